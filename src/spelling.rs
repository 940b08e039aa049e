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
    let letters = |word: &str| {
        let mut letters: Vec<char> = word.chars().collect();
        letters.sort_unstable();
        letters
    };
    // Letters that changed places are one mistake.
    let distance = |name: &str| if letters(name) == letters(word) { 1 } else { edit_distance(word, name) };
    let nearest = names.iter().map(|name| (distance(name), *name)).min_by_key(|(distance, _)| *distance);
    nearest.filter(|(distance, name)| 2 * distance < name.len().max(word.len())).map(|(_, name)| name)
}
