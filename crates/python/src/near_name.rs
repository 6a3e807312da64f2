//! Finds the name that the caller may have meant.

/// The smallest similarity of two names that are near each other.
const MIN_SIMILARITY: f64 = 0.7;

/// `; did you mean …?` with the nearest of the names, or an empty text if no name is near.
pub(crate) fn did_you_mean<'a>(name: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let rated = names.into_iter().map(|other| {
        let starts = !name.is_empty()
            && other
                .strip_prefix(name)
                .is_some_and(|rest| rest.starts_with('_'));
        let similarity = strsim::normalized_damerau_levenshtein(name, other);
        (if starts { 1.0 } else { similarity }, other)
    });
    rated
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .filter(|&(similarity, _)| similarity >= MIN_SIMILARITY)
        .map_or_else(String::new, |(_, near)| format!("; did you mean `{near}`?"))
}
