//! The parser against an exhaustive parser, and against printed texts.

use proptest::prelude::*;

use super::*;

/// Tries every choice of parts, preferring a spelling over none for an optional part; the first choice that
/// uses up the text counts.
fn reference_bulb(text: &str) -> Option<Bulb> {
    let optional = |spellings: usize| (0..spellings).map(Some).chain([None]);
    let after = |text: &str, spelling: Option<&str>| -> Option<String> {
        text.strip_prefix(spelling.unwrap_or("")).map(|rest| rest.trim_start_matches(is_blank).to_owned())
    };
    for color in optional(COLORS.len()) {
        for status in optional(STATUSES.len()) {
            for shape in optional(SHAPES.len()) {
                let color = color.map(|at| COLORS[at]);
                let status = status.map(|at| STATUSES[at]);
                let shape = shape.map(|at| SHAPES[at]);
                let rest = after(text, color.map(|color| color.0))
                    .and_then(|rest| after(&rest, status.map(|status| status.0)))
                    .and_then(|rest| after(&rest, shape.map(|shape| shape.0)));
                if rest.is_some_and(|rest| rest.is_empty()) {
                    return Some(Bulb {
                        color: color.map_or(Color::Green, |color| color.1),
                        status: status.map_or(BulbStatus::SolidOn, |status| status.1),
                        shape: shape.map_or(BulbShape::Circle, |shape| shape.1),
                    });
                }
            }
        }
    }
    None
}

/// Splits a list at commas, with an optional comma at the end.
fn reference_bulbs(text: &str) -> Option<BulbSet> {
    if text.is_empty() {
        return Some(BulbSet::EMPTY);
    }
    let trimmed = text.trim_end_matches(is_blank);
    let list = trimmed.strip_suffix(',').unwrap_or(text);
    let mut items = list.split(',');
    let first = items.next()?; // may not begin with a blank, the others may
    let items = [first].into_iter().chain(items.map(|item| item.trim_start_matches(is_blank)));
    let bulb = |item: &str| {
        let begins_well = item.starts_with(|char: char| char.is_ascii_alphanumeric() || char == '_');
        reference_bulb(item).filter(|_| begins_well && item.len() > 1)
    };
    items.map(bulb).collect()
}

fn any_bulb() -> impl Strategy<Value = Bulb> {
    use proptest::sample::select;
    (select(&Color::ALL[..]), select(&BulbStatus::ALL[..]), select(&BulbShape::ALL[..]))
        .prop_map(|(color, status, shape)| Bulb { color, status, shape })
}

/// Generates texts from spellings of the grammar, blanks and disturbances.
fn near_misses() -> impl Strategy<Value = String> {
    let spellings = COLORS.iter().map(|part| part.0).chain(STATUSES.iter().map(|part| part.0));
    let spellings: Vec<&str> = spellings.chain(SHAPES.iter().map(|part| part.0)).collect();
    let piece = prop_oneof![
        6 => proptest::sample::select(spellings),
        6 => proptest::sample::select(vec![" ", "", "\t", "\n ", ", ", ",", " ,"]),
        1 => proptest::sample::select(vec!["r", ";", "blue", "ü", "\u{b}", "\u{a0}", "_"]),
    ];
    proptest::collection::vec(piece, 0..9).prop_map(|pieces| pieces.concat())
}

proptest! {
    #[test]
    fn printed_bulbs_are_read_back(bulbs in proptest::collection::vec(any_bulb(), 0..12)) {
        for bulb in &bulbs {
            prop_assert_eq!(parse_bulb(&bulb.to_string()), Ok(*bulb));
        }
        let set: BulbSet = bulbs.into_iter().collect();
        prop_assert_eq!(parse_bulbs(&set.to_string()), Ok(set));
    }

    #[test]
    fn any_text_is_read_or_refused_at_a_column_in_it(text in any::<String>()) {
        for error in [parse_bulb(&text).err(), parse_bulbs(&text).err()].into_iter().flatten() {
            let at_column: String = text.chars().skip(error.column - 1).collect();
            prop_assert!(at_column.starts_with(error.found.trim_end_matches('…')), "{error}");
        }
    }

    #[test]
    fn texts_mean_the_same_to_the_reference(text in near_misses()) {
        prop_assert_eq!(parse_bulb(&text).ok(), reference_bulb(&text), "{:?}", &text);
        prop_assert_eq!(parse_bulbs(&text).ok(), reference_bulbs(&text), "{:?}", &text);
        let state = StateText::new(&text);
        prop_assert_eq!(state.mistake.is_none(), parse_bulbs(&text) == Ok(state.bulbs));
    }
}
