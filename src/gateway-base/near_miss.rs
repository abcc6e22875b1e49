//! Finds the known words that an unknown word probably means.

/// Smallest similarity to the intended word, from 0 to 1.
const MIN_SIMILARITY: f64 = 0.65;
/// Largest number of mistyped letters in a long word.
const MAX_TYPOS: usize = 3;
/// Length in bytes of the longest word compared, since comparing takes quadratic time.
const MAX_LENGTH: usize = 100;

/// Returns the known words most similar to `given`, all with the same similarity; empty if none is similar. A
/// prefix of a word and a longer word also count as similar.
pub fn near_misses<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    most_similar(given, known, |given, word| {
        let begins = |word: &str, other: &str| other.len() >= 5 && word.starts_with(other);
        let is_part = begins(given, word) || begins(word, given);
        likeness(given, word).max(if is_part { MIN_SIMILARITY } else { 0.0 })
    })
}

/// Returns the known word that equals `given` except for a few typos.
pub fn mistyped<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    most_similar(given, known, likeness).first().copied()
}

fn most_similar<'a>(
    given: &str,
    known: impl IntoIterator<Item = &'a str>,
    similarity: impl Fn(&str, &str) -> f64,
) -> Vec<&'a str> {
    let given = plain(given);
    if given.len() > MAX_LENGTH {
        return Vec::new();
    }
    let mut best = (MIN_SIMILARITY, Vec::new());
    for word in known {
        match similarity(&given, &plain(word)) {
            similarity if similarity > best.0 => best = (similarity, vec![word]),
            similarity if similarity >= best.0 => best.1.push(word),
            _ => {}
        }
    }
    best.1
}

/// Returns the known word most similar to `given`, the first of several.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    near_misses(given, known).first().copied()
}

/// Returns a question with the known word that was probably meant, otherwise `otherwise`.
pub fn did_you_mean<'a>(
    given: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: impl Into<String>,
) -> String {
    nearest(given, known).map_or_else(|| otherwise.into(), |word| format!("did you mean {word}?"))
}

/// Returns a word in lower case, without hyphens and without a version after `@`.
fn plain(word: &str) -> String {
    word.split('@').next().unwrap_or_default().to_lowercase().replace('-', "_")
}

/// Returns the similarity of two words in plain letters, from 0 to 1; 0 if there are too many typos.
pub fn likeness(given: &str, word: &str) -> f64 {
    let is_mistyped = strsim::damerau_levenshtein(given, word) <= MAX_TYPOS;
    if is_mistyped { strsim::normalized_damerau_levenshtein(given, word) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_fingers_is_understood_and_another_word_is_not() {
        let known = ["left", "right", "interface", "timeout_ms", "dbc", "node", "EnableAction@v1"];
        for (given, expected) in [
            ("lefft", Some("left")),
            ("rigth", Some("right")),
            ("Interface", Some("interface")),
            ("interface_name", Some("interface")),
            ("timeout-ms", Some("timeout_ms")),
            ("timeout", Some("timeout_ms")),
            ("enableActoin@v2", Some("EnableAction@v1")),
            ("EnableSomeAction", None),
            ("enab", None),
            ("face", None),
            ("dbs", Some("dbc")),
            ("nod", Some("node")),
            ("hazard", None),
            ("off", None),
            ("", None),
        ] {
            assert_eq!(nearest(given, known), expected, "{given}");
        }
        assert_eq!(did_you_mean("nod", known, "see the list"), "did you mean node?");
        assert_eq!(did_you_mean("x", known, "see the list"), "see the list");
        assert_eq!(nearest(&"left".repeat(100), known), None);
        assert_eq!(
            [mistyped("interface_name", known), mistyped("timout_ms", known)],
            [None, Some("timeout_ms")]
        );
    }

    #[test]
    fn words_that_are_equally_near_are_all_given() {
        let known = ["honda_touring", "honda_civic", "toyota"];
        assert_eq!(near_misses("honda", known), ["honda_touring", "honda_civic"]);
        assert_eq!(near_misses("honda_civc", known), ["honda_civic"]);
    }
}
