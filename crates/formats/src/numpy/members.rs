//! Takes the members of an archive by name, type and shape.

use crate::numpy::array::{Array, Element};
use std::collections::BTreeMap;

/// Named arrays.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    arrays: BTreeMap<String, Array>,
}

/// A member is not what its reader needs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MemberError {
    /// No member has this name.
    #[error("member `{0}` is missing")]
    Missing(String),
    /// The values have another type.
    #[error("member `{name}` holds {found}, {expected} is needed")]
    Type {
        /// The member.
        name: String,
        /// The type that it has.
        found: &'static str,
        /// The type that is needed.
        expected: &'static str,
    },
    /// The array has another shape.
    #[error("member `{name}` has shape {found:?}, {expected} is needed")]
    Shape {
        /// The member.
        name: String,
        /// The shape that it has.
        found: Vec<usize>,
        /// The shape that is needed, in words.
        expected: String,
    },
}

impl Members {
    /// Adds an array. Returns `false` and changes nothing if the name already exists.
    pub(crate) fn insert(&mut self, name: String, array: Array) -> bool {
        let is_new = !self.arrays.contains_key(&name);
        if is_new {
            self.arrays.insert(name, array);
        }
        is_new
    }

    /// The names, sorted.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.arrays.keys().map(String::as_str)
    }

    /// The array of this name, of any type.
    #[must_use]
    pub fn array(&self, name: &str) -> Option<&Array> {
        self.arrays.get(name)
    }

    /// Takes the values of a member with one dimension.
    ///
    /// # Errors
    /// If it is missing (or taken before), or has another type or shape.
    pub fn vector<T: Element>(&mut self, name: &str) -> Result<Vec<T>, MemberError> {
        self.take(name, "one dimension".to_owned(), |shape| shape.len() == 1)
    }

    /// Takes the rows of a member with two dimensions, the second of length `N`.
    ///
    /// # Errors
    /// If it is missing (or taken before), or has another type or shape.
    pub fn rows<T: Element + Copy, const N: usize>(
        &mut self,
        name: &str,
    ) -> Result<Vec<[T; N]>, MemberError> {
        let values: Vec<T> = self.take(name, format!("(rows, {N})"), |shape| {
            shape.len() == 2 && shape[1] == N
        })?;
        Ok(values.as_chunks::<N>().0.to_vec())
    }

    /// Takes the blocks of a member with three dimensions, the last two of lengths `M` and `N`.
    ///
    /// # Errors
    /// If it is missing (or taken before), or has another type or shape.
    pub fn blocks<T: Element + Copy, const M: usize, const N: usize>(
        &mut self,
        name: &str,
    ) -> Result<Vec<[[T; N]; M]>, MemberError> {
        let values: Vec<T> = self.take(name, format!("(rows, {M}, {N})"), |shape| {
            shape.len() == 3 && shape[1..] == [M, N]
        })?;
        Ok(values.as_chunks::<N>().0.as_chunks::<M>().0.to_vec())
    }

    fn take<T: Element>(
        &mut self,
        name: &str,
        expected: String,
        fits: impl Fn(&[usize]) -> bool,
    ) -> Result<Vec<T>, MemberError> {
        let array = self
            .arrays
            .remove(name)
            .ok_or_else(|| MemberError::Missing(name.to_owned()))?;
        if !fits(array.shape()) {
            return Err(MemberError::Shape {
                name: name.to_owned(),
                found: array.shape().to_vec(),
                expected,
            });
        }
        let found = array.values().type_name();
        let wrong_type = || MemberError::Type {
            name: name.to_owned(),
            found,
            expected: T::NAME,
        };
        T::unwrap_from(array.into_values()).ok_or_else(wrong_type)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_refused_by_name() {
        let fresh = || {
            let mut members = Members::default();
            assert!(members.insert("a".to_owned(), Array::rows(&[[1u8, 2]])));
            assert!(!members.insert("a".to_owned(), Array::scalar(0u8)));
            members
        };
        assert_eq!(fresh().rows::<u8, 2>("a"), Ok(vec![[1, 2]]));
        assert_eq!(
            fresh().vector::<u8>("b"),
            Err(MemberError::Missing("b".to_owned()))
        );
        let shape = |expected: &str| MemberError::Shape {
            name: "a".to_owned(),
            found: vec![1, 2],
            expected: expected.to_owned(),
        };
        assert_eq!(fresh().vector::<u8>("a"), Err(shape("one dimension")));
        assert_eq!(fresh().rows::<u8, 3>("a"), Err(shape("(rows, 3)")));
        let wrong = MemberError::Type {
            name: "a".to_owned(),
            found: "uint8",
            expected: "int32",
        };
        assert_eq!(fresh().rows::<i32, 2>("a"), Err(wrong));
    }
}
