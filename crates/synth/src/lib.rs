//! Parametric mechanical parts, written as STEP text.
