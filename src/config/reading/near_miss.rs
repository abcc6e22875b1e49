//! The word that was probably meant by one that is not known.

/// The smallest similarity of a word to the one that was probably meant, from 0 to 1.
const MIN_SIMILARITY: f64 = 0.65;

/// The known word that `given` is most like; `None` when none is like it.
pub fn nearest<'a>(given: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |word: &str| word.to_lowercase().replace('-', "_");
    let given = plain(given);
    let similarity = |word: &str| {
        let word = plain(word);
        // One that was cut off, or goes on.
        let begins = |word: &str, other: &str| other.len() >= 4 && word.starts_with(other);
        let is_part = begins(&given, &word) || begins(&word, &given);
        let similarity = strsim::normalized_damerau_levenshtein(&given, &word);
        if is_part { similarity.max(MIN_SIMILARITY) } else { similarity }
    };
    let similarities = known.into_iter().map(|word| (similarity(word), word));
    let near = similarities.filter(|(similarity, _)| *similarity >= MIN_SIMILARITY);
    near.max_by(|(one, _), (other, _)| one.total_cmp(other)).map(|(_, word)| word)
}

/// The question for the known word that was probably meant; else `otherwise`.
pub(crate) fn did_you_mean<'a>(
    given: &str,
    known: impl IntoIterator<Item = &'a str>,
    otherwise: impl Into<String>,
) -> String {
    nearest(given, known).map_or_else(|| otherwise.into(), |word| format!("did you mean {word}?"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_the_fingers_is_understood_and_another_word_is_not() {
        let known = ["left", "right", "interface", "timeout_ms", "dbc", "node"];
        for (given, expected) in [
            ("lefft", Some("left")),
            ("rigth", Some("right")),
            ("Interface", Some("interface")),
            ("interface_name", Some("interface")),
            ("timeout-ms", Some("timeout_ms")),
            ("timeout", Some("timeout_ms")),
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
    }
}
