//! Words that are misspelt.

/// The candidate that `text` is most likely a misspelling of: at most one edit in three letters of the shorter one; `None` when none is near.
pub fn closest<'a>(text: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let length = text.chars().count();
    candidates
        .map(|candidate| (strsim::damerau_levenshtein(text, candidate), candidate))
        .filter(|(distance, candidate)| 3 * distance <= candidate.len().min(length))
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate)
}
