//! Matching, scores, statistics and tables.
