//! Writes `LICENSE-NOTE.md`: the owners of the labels and of the geometry.

/// The text of the note, with the license of the labels if the releaser has named one.
#[must_use]
pub fn license_note(license: Option<&str>) -> String {
    let license = match license {
        Some(license) => format!("License of the labels: {license}"),
        None => {
            "The releaser has not named a license of the labels; ask before you use them".to_owned()
        }
    };
    format!(
        "\
# License note

- The labels in this package belong to those who release it. {license}.
- The geometry is not inside. This package contains no STEP file, no mesh, no coordinate and no area.
- Each STEP file keeps the license of its own source. This package gives no right to any of them. Get the files from their
  source, under its terms.
- The labels join with a file by the SHA-256 of its text. The hash and the `#` numbers identify a file and its faces, and do not
  replace them.
"
    )
}
