//! Hand-made solids for tests.
