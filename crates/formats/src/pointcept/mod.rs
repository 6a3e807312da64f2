//! Writes and checks Pointcept's folders of NPY files.

pub(crate) mod check;
pub(crate) mod folder;
