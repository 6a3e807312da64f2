//! Hashes labels, so that two sets of labels can be compared without comparing each face.

use partprobe_carrier::sha256_hex;
use partprobe_tables::ShapeLabels;

/// The value in the hash for an undefined angle.
const NO_ANGLE: u64 = u64::MAX;

/// The SHA-256 of everything in the labels of a shape, in hexadecimal.
#[must_use]
pub fn labels_sha256(labels: &ShapeLabels) -> String {
    let mut bytes = Vec::new();
    let n_faces = labels.step_id.len() as u64;
    push(&mut bytes, [n_faces, labels.edge_faces.len() as u64]);
    push(&mut bytes, labels.step_id.iter().copied());
    push(&mut bytes, unsigned(&labels.instance));
    for types in [&labels.face_type, &labels.canonical_type] {
        push(&mut bytes, types.iter().map(|kind| u64::from(kind.code())));
    }
    push(&mut bytes, unsigned(&labels.part));
    push(&mut bytes, unsigned(&labels.label));
    for (name, layer) in &labels.layers {
        push(&mut bytes, [name.len() as u64]);
        bytes.extend_from_slice(name.as_bytes());
        push(&mut bytes, unsigned(layer));
    }
    push(&mut bytes, unsigned(labels.edge_faces.as_flattened()));
    let angles = labels.phi_deg.iter();
    push(
        &mut bytes,
        angles.map(|phi| phi.map_or(NO_ANGLE, f64::to_bits)),
    );
    sha256_hex(&bytes)
}

/// The SHA-256 of only the faces and their parts, in hexadecimal. Labels with other settings may have the same hash.
#[must_use]
pub fn parts_sha256(labels: &ShapeLabels) -> String {
    let mut bytes = Vec::new();
    push(&mut bytes, labels.step_id.iter().copied());
    push(&mut bytes, unsigned(&labels.instance));
    push(&mut bytes, unsigned(&labels.label));
    sha256_hex(&bytes)
}

fn unsigned(values: &[i32]) -> impl Iterator<Item = u64> + '_ {
    values.iter().map(|&value| u64::from(value.cast_unsigned()))
}

fn push(bytes: &mut Vec<u8>, values: impl IntoIterator<Item = u64>) {
    bytes.extend(values.into_iter().flat_map(u64::to_le_bytes));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::two_faces;
    use partprobe_carrier::FaceType;

    /// Whether a change of the labels changes the two hashes.
    #[track_caller]
    fn check(change: impl Fn(&mut ShapeLabels), all: bool, parts: bool) {
        let mut changed = two_faces();
        change(&mut changed);
        let found = (
            labels_sha256(&changed) != labels_sha256(&two_faces()),
            parts_sha256(&changed) != parts_sha256(&two_faces()),
        );
        assert_eq!(found, (all, parts), "{changed:?}");
    }

    #[test]
    fn every_label_counts() {
        check(|_| {}, false, false);
        check(|labels| labels.step_id[1] = 21, true, true);
        check(|labels| labels.instance[1] = 1, true, true);
        check(|labels| labels.label[1] = 0, true, true);
        check(|labels| labels.part[1] = 0, true, false);
        check(|labels| labels.face_type[0] = FaceType::Cone, true, false);
        check(
            |labels| labels.canonical_type[0] = FaceType::Cone,
            true,
            false,
        );
        check(|labels| labels.layers.clear(), true, false);
        check(|labels| labels.edge_faces[0] = [1, 0], true, false);
        check(
            |labels| labels.phi_deg[0] = Some(90.000_000_001),
            true,
            false,
        );
        check(|labels| labels.phi_deg[0] = None, true, false);
    }
}
