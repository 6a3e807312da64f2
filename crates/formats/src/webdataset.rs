//! Writes the tar files of WebDataset: samples, each with a key and one member per ending.

use partprobe_carrier::sha256_hex;
use std::collections::BTreeMap;
use std::io::{self, Write};
use tar::{Builder, EntryType, Header};

/// The number of hexadecimal digits that distinguish keys whose ids differ only in a dot.
const HASH_DIGITS: usize = 12;

/// The key of each id, in its order: the id with `_` instead of each dot, because WebDataset cuts names at the first dot.
///
/// If two ids would have the same key, the keys of both end in a hash of the id. Keys do not depend on the order of the ids.
#[must_use]
pub fn webdataset_keys(ids: &[&str]) -> Vec<String> {
    let plain = |id: &str| id.replace('.', "_");
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for id in ids {
        *counts.entry(plain(id)).or_default() += 1;
    }
    let key = |id: &&str| {
        let key = plain(id);
        if counts[&key] == 1 {
            return key;
        }
        format!("{key}-{}", &sha256_hex(id.as_bytes())[..HASH_DIGITS])
    };
    ids.iter().map(key).collect()
}

/// Writes samples into a tar file. Owners and times are 0, so the bytes depend only on the samples.
pub struct WebdatasetWriter<W: Write> {
    tar: Builder<W>,
}

impl<W: Write> WebdatasetWriter<W> {
    /// A file without samples.
    pub fn new(out: W) -> Self {
        Self {
            tar: Builder::new(out),
        }
    }

    /// Adds a sample: the bytes of `<key>.<ending>` for each pair of an ending and bytes.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn add(&mut self, key: &str, members: &[(&str, &[u8])]) -> io::Result<()> {
        for (ending, bytes) in members {
            let mut header = Header::new_gnu();
            header.set_entry_type(EntryType::Regular);
            header.set_mode(0o644);
            header.set_uid(0);
            header.set_gid(0);
            header.set_mtime(0);
            header.set_size(bytes.len() as u64);
            self.tar
                .append_data(&mut header, format!("{key}.{ending}"), *bytes)?;
        }
        Ok(())
    }

    /// Writes the end of the file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn finish(mut self) -> io::Result<()> {
        self.tar.finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[track_caller]
    fn check(ids: &[&str], expected: &[&str]) {
        assert_eq!(webdataset_keys(ids), expected);
    }

    #[test]
    fn keys_have_no_dots_and_differ() {
        check(&["a", "b__s1"], &["a", "b__s1"]);
        check(&["a.b.c", "d"], &["a_b_c", "d"]);
        let keys = webdataset_keys(&["a.b", "a_b", "c"]);
        assert!(keys[0] != keys[1] && keys.iter().all(|key| !key.contains('.')));
        assert_eq!(
            webdataset_keys(&["a_b", "a.b"]),
            [keys[1].clone(), keys[0].clone()]
        );
        assert_eq!(keys[2], "c");
    }

    #[test]
    fn samples_are_found_by_their_names() {
        let long = "n".repeat(150);
        let mut bytes = Vec::new();
        let mut tar = WebdatasetWriter::new(&mut bytes);
        tar.add("a", &[("npz", b"12"), ("json", b"{}")]).unwrap();
        tar.add(&long, &[("npz", b"3")]).unwrap();
        tar.finish().unwrap();

        let mut archive = tar::Archive::new(bytes.as_slice());
        let members: Vec<(String, String)> = archive
            .entries()
            .unwrap()
            .map(|entry| {
                let mut entry = entry.unwrap();
                assert_eq!(entry.header().mtime().unwrap(), 0);
                let name = entry.path().unwrap().display().to_string();
                let mut text = String::new();
                entry.read_to_string(&mut text).unwrap();
                (name, text)
            })
            .collect();
        let expected = [
            ("a.npz", "12"),
            ("a.json", "{}"),
            (&*format!("{long}.npz"), "3"),
        ];
        assert_eq!(
            members,
            expected.map(|(name, text)| (name.to_owned(), text.to_owned()))
        );
    }
}
