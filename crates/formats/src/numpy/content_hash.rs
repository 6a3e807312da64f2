//! Hashes the content of an archive of arrays: the names and bytes of its members go in, and one number comes out.
//!
//! The hash does not depend on the order, the dates and the compression of the members. It detects accidents and mix-ups, but it
//! does not protect against intentional forgery.

use partprobe_carrier::Mesh;
use std::collections::BTreeMap;
use std::fmt;
use xxhash_rust::xxh3::{Xxh3, xxh3_128};

/// The member that holds the hash of all others.
pub(crate) const HASH_MEMBER: &str = "content_hash";

/// A hash of 128 bits (XXH3), shown as 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ContentHash(u128);

impl ContentHash {
    /// The bytes, the highest first. Their hexadecimal digits are the shown ones.
    pub(crate) fn to_bytes(self) -> [u8; 16] {
        self.0.to_be_bytes()
    }

    /// The hash in the bytes of its member. Returns `None` if there are not 16 bytes.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Option<Self> {
        Some(Self(u128::from_be_bytes(bytes.try_into().ok()?)))
    }
}

impl fmt::Display for ContentHash {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

/// Hashes an archive member by member.
#[derive(Clone, Debug, Default)]
pub(crate) struct ContentHasher {
    members: BTreeMap<String, u128>,
}

impl ContentHasher {
    /// Adds a member with the bytes of its NPY file. The member of the hash itself does not count.
    pub(crate) fn add(&mut self, name: &str, bytes: &[u8]) {
        if name != HASH_MEMBER {
            self.members.insert(name.to_owned(), xxh3_128(bytes));
        }
    }

    /// The hash of all members that were added.
    pub(crate) fn hash(&self) -> ContentHash {
        let mut all = Xxh3::new();
        for (name, hash) in &self.members {
            all.update(&(name.len() as u64).to_le_bytes());
            all.update(name.as_bytes());
            all.update(&hash.to_le_bytes());
        }
        ContentHash(all.digest128())
    }
}

/// A hash of only the mesh: shapes with equal hashes have the same vertices and triangles, even if their names differ.
#[must_use]
pub fn mesh_hash(mesh: &Mesh) -> ContentHash {
    let mut all = Xxh3::new();
    let coordinates = mesh.vertices.iter().flatten();
    coordinates.for_each(|coordinate| all.update(&coordinate.to_le_bytes()));
    let corners = mesh.triangles.iter().flatten();
    corners.for_each(|corner| all.update(&corner.to_le_bytes()));
    ContentHash(all.digest128())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(members: &[(&str, &[u8])]) -> ContentHash {
        let mut hasher = ContentHasher::default();
        members
            .iter()
            .for_each(|(name, bytes)| hasher.add(name, bytes));
        hasher.hash()
    }

    #[test]
    fn names_and_bytes_count_and_order_does_not() {
        let base = hash(&[("a", b"12"), ("b", b"3")]);
        assert_eq!(base, hash(&[("b", b"3"), ("a", b"12")]));
        assert_eq!(
            base,
            hash(&[("a", b"12"), (HASH_MEMBER, b"x"), ("b", b"3")])
        );
        for other in [
            &[("a", &b"1"[..]), ("b", b"23")][..],
            &[("a", b"12")],
            &[("a", b"12"), ("c", b"3")],
            &[],
        ] {
            assert_ne!(base, hash(other));
        }
    }

    #[test]
    fn a_hash_round_trips_and_is_shown_in_full() {
        let small = ContentHash(255);
        assert_eq!(small.to_string(), format!("{}ff", "0".repeat(30)));
        assert_eq!(ContentHash::from_bytes(&small.to_bytes()), Some(small));
        assert_eq!(ContentHash::from_bytes(&[0; 15]), None);
    }

    #[test]
    fn a_mesh_is_its_vertices_and_triangles() {
        let mesh = Mesh {
            vertices: vec![[0.0, 1.0, 2.0]; 3],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        };
        let turned = Mesh {
            triangles: vec![[1, 2, 0]],
            ..mesh.clone()
        };
        let moved = Mesh {
            vertices: vec![[0.0, 1.0, 2.5]; 3],
            ..mesh.clone()
        };
        let of_another_face = Mesh {
            tri_face: vec![7],
            ..mesh.clone()
        };
        assert_eq!(mesh_hash(&mesh), mesh_hash(&of_another_face));
        assert_ne!(mesh_hash(&mesh), mesh_hash(&turned));
        assert_ne!(mesh_hash(&mesh), mesh_hash(&moved));
    }
}
