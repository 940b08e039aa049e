//! What a word was meant to be.

/// Insertions, deletions and substitutions that turn one into the other (Levenshtein 1966).
pub fn edit_distance(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, x) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, y) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(x != *y);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

/// The name that a word was meant to be, if one is much like it.
#[cfg(feature = "foreign")]
pub fn meant<'a>(word: &str, names: &[&'a str]) -> Option<&'a str> {
    let near =
        names.iter().map(|name| (edit_distance(word, name), *name)).min_by_key(|(distance, _)| *distance);
    near.filter(|(distance, name)| 2 * distance < name.len().max(word.len())).map(|(_, name)| name)
}
