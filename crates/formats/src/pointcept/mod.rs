//! Pointcept's folders of NPY files: they are written and checked.

pub(crate) mod check;
pub(crate) mod folder;
