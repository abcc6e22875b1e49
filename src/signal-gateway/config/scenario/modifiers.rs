//! Scenario modifiers, which TIER IV adds to OpenSCENARIO in YAML: names that stand for values, each
//! combination of which is a run.

use std::collections::BTreeMap;

use super::naming::listed;
use crate::config::reading::{Checker, Element, Entry, Kind, MAX_BYTES, Refusal, Value, items};

pub(super) const ROOT: &str = "ScenarioModifiers";
/// Maximum number of modifiers, since each is searched for in every text.
const MAX_MODIFIERS: usize = 100;
const MAX_VALUES: usize = 10_000;
/// Differences below which the end of a range counts as reached, relative and absolute, as in upstream.
const TOLERANCES: (f64, f64) = (1e-9, 1e-10);

#[derive(Debug)]
struct Modifier {
    name: String,
    /// All values, as text; at least one.
    values: Vec<String>,
    /// Value of this run: the only value, or the chosen one.
    value: Option<String>,
}

/// The modifiers of a file, longest name first, so that no name is mistaken for a part of another one.
#[derive(Debug, Default)]
pub(super) struct Modifiers(Vec<Modifier>);

impl Modifiers {
    /// Reads the modifiers below their key; `chosen` are the values of this run by name. Refuses modifiers
    /// without values, and chosen values that a modifier does not have.
    pub(super) fn read(checker: &Checker, root: &Value, chosen: &BTreeMap<String, String>) -> Self {
        let Kind::Map(entries) = &root.kind else { return Self::default() };
        let all = entries.iter().flat_map(|entry| items(&entry.value));
        if let Some(value) = all.clone().nth(MAX_MODIFIERS) {
            let reason = format!("more than {MAX_MODIFIERS} scenario modifiers");
            checker.refuse(&value.location, reason, "give fewer");
            return Self::default();
        }
        let mut modifiers: Vec<_> = all.filter_map(|value| modifier(checker, value, chosen)).collect();
        modifiers.sort_by_key(|modifier| std::cmp::Reverse(modifier.name.len()));
        Self(modifiers)
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.0.iter().any(|modifier| modifier.name == name)
    }

    pub(super) fn listed(&self) -> String {
        listed(self.0.iter().map(|modifier| modifier.name.as_str()))
    }

    /// Replaces names by their values in the attributes of an element and its descendants. A text with a
    /// modifier whose value is not chosen remains unchanged. Values longer than the limit for files are
    /// refused.
    pub(super) fn replace_in(&self, checker: &Checker, element: &mut Element) {
        let mut left_bytes = MAX_BYTES;
        self.replace_below(checker, element, &mut left_bytes);
    }

    /// `left_bytes` is the remaining total length for further values.
    fn replace_below(&self, checker: &Checker, element: &mut Element, left_bytes: &mut usize) {
        for attribute in &mut element.attributes {
            match self.replaced(&attribute.value, left_bytes) {
                Some(text) => attribute.value = text,
                None => {
                    let reason = "the values of the scenario modifiers are longer than a file may be";
                    checker.refuse(&attribute.location, reason, "give shorter values");
                    return;
                }
            }
        }
        element.children.iter_mut().for_each(|child| self.replace_below(checker, child, left_bytes));
    }

    /// Returns the text with the names replaced; `None` if the values are too long.
    fn replaced(&self, text: &str, left_bytes: &mut usize) -> Option<String> {
        let mut text = text.to_owned();
        if self.first_not_chosen_in(&text).is_some() {
            return Some(text);
        }
        for Modifier { name, value, .. } in &self.0 {
            let (Some(value), count @ 1..) = (value, text.matches(name).count()) else { continue };
            *left_bytes = left_bytes.checked_sub(count.saturating_mul(value.len()))?;
            text = text.replace(name, value);
        }
        Some(text)
    }

    /// Returns the reason why the value of a text is unknown: a modifier with several values.
    pub(super) fn not_chosen_in(&self, text: &str) -> Option<Refusal> {
        self.first_not_chosen_in(text).map(|modifier| {
            let reason = format!("{} is a scenario modifier, which stands for several values", modifier.name);
            Refusal::new(reason, modifier.remedy())
        })
    }

    /// Returns a line for each modifier whose value is not chosen.
    pub(super) fn lines(&self) -> impl Iterator<Item = String> {
        self.not_chosen().map(|modifier| {
            format!(
                "the scenario modifier {}, of which each value is a run; {}",
                modifier.name,
                modifier.remedy()
            )
        })
    }

    fn first_not_chosen_in(&self, text: &str) -> Option<&Modifier> {
        self.not_chosen().find(|modifier| text.contains(&modifier.name))
    }

    fn not_chosen(&self) -> impl Iterator<Item = &Modifier> {
        self.0.iter().filter(|modifier| modifier.value.is_none())
    }
}

impl Modifier {
    fn remedy(&self) -> String {
        let first = self.values.first().map_or("", String::as_str);
        let known = listed(self.values.iter().map(String::as_str));
        let name = &self.name;
        format!("choose one with --modifier {name}={first}, or modifiers in [traffic_lights]; {known}")
    }
}

fn modifier(checker: &Checker, value: &Value, chosen: &BTreeMap<String, String>) -> Option<Modifier> {
    let entries = checker.entries(value, "give a name, and a list or start, step and stop");
    let entry = |key: &str| entries.iter().find(|entry| entry.key == key);
    let Some(name) = entry("name") else {
        if matches!(value.kind, Kind::Map(_)) {
            checker.refuse(&value.location, "a scenario modifier without a name", "give it a name");
        }
        return None;
    };
    let name = checker.text(&name.value)?;
    if name.text.is_empty() {
        return checker.refused(&name.location, "the name of a scenario modifier is empty", "give it a name");
    }
    let values = match entry("list") {
        Some(list) => {
            let values = items(&list.value).iter().map(|item| Some(checker.text(item)?.text));
            values.collect::<Option<Vec<_>>>()?
        }
        None => range(checker, value, ["start", "step", "stop"].map(entry))?,
    };
    let value = match (chosen.get(&name.text), values.as_slice()) {
        (_, []) => {
            let reason = format!("the scenario modifier {} has no value", name.text);
            return checker.refused(&name.location, reason, "give it a list, or a range from start to stop");
        }
        (Some(value), known) if !known.contains(value) => {
            let reason = format!("the scenario modifier {} has no value {value:?}", name.text);
            return checker.refused(&name.location, reason, &listed(known.iter().map(String::as_str)));
        }
        (Some(value), _) | (None, [value]) => Some(value.clone()),
        (None, _) => None,
    };
    Some(Modifier { name: name.text, values, value })
}

/// Returns the values of a range, including `stop` if a step reaches it: whole numbers as such, others with a
/// decimal point. A step of 0 gives `start` alone.
fn range(checker: &Checker, value: &Value, entries: [Option<&Entry>; 3]) -> Option<Vec<String>> {
    let [Some(start), Some(step), Some(stop)] = entries else {
        let remedy = "give a list, or start, step and stop";
        return checker.refused(&value.location, "a scenario modifier without values", remedy);
    };
    let number = |entry: &Entry| {
        let given = checker.text(&entry.value)?;
        let number = given.text.trim().parse().ok().filter(|number: &f64| number.is_finite());
        if number.is_none() {
            let remedy = "give a finite number";
            checker.refuse(&given.location, format!("{:?} is not a number", given.text), remedy);
        }
        Some((number?, given.text.trim().parse::<i64>().is_ok()))
    };
    let (start, step, stop) = (number(start), number(step), number(stop));
    let ((start, is_start_whole), (step, is_step_whole), (stop, _)) = (start?, step?, stop?);
    let (relative, absolute) = TOLERANCES;
    let is_at =
        |value: f64, end: f64| (value - end).abs() <= (relative * value.abs().max(end.abs())).max(absolute);
    let text = |value: f64, is_whole| if is_whole { format!("{value}") } else { format!("{value:?}") };
    if is_at(step, 0.0) {
        return Some(vec![text(start, is_start_whole)]);
    }
    let is_within =
        |value: &f64| (if step > 0.0 { *value < stop } else { *value > stop }) || is_at(*value, stop);
    // Summed up like upstream, so that the digits are the same.
    let values = std::iter::successors(Some(start), |value| Some(value + step)).take_while(is_within);
    let values: Vec<_> = values.take(MAX_VALUES + 1).collect();
    if values.len() > MAX_VALUES {
        let reason = format!("a scenario modifier with more than {MAX_VALUES} values");
        return checker.refused(&value.location, reason, "give a larger step");
    }
    let is_whole = |index| is_start_whole && (index == 0 || is_step_whole);
    Some(values.iter().enumerate().map(|(index, value)| text(*value, is_whole(index))).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::reading::{Text, from_yaml};
    use std::path::Path;

    /// Returns the modifiers of a YAML list, or the refusal.
    fn read(list: &str, chosen: &[(&str, &str)]) -> Result<Modifiers, String> {
        let text = Text::new(Path::new("a"), format!("ScenarioModifier: {list}\n").into()).unwrap();
        let checker = Checker::new(&text.file, "");
        let chosen = chosen.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let modifiers = Modifiers::read(&checker, &from_yaml(&text).unwrap(), &chosen);
        checker.finish(Some(modifiers)).map_err(|problems| problems[0].to_string())
    }

    #[test]
    fn a_range_has_the_values_that_upstream_computes() {
        for (range, expected) in [
            ("start: 18, step: 1, stop: 22", "18 19 20 21 22"),
            ("start: -20, step: 4, stop: -10", "-20 -16 -12"),
            ("start: 0, step: 0.1, stop: 0.3", "0 0.1 0.2 0.30000000000000004"),
            ("start: 1.0, step: 1, stop: 2", "1.0 2.0"),
            ("start: 3, step: -2, stop: 0", "3 1"),
            ("start: 5, step: 0, stop: 9", "5"),
            ("start: 5, step: 1, stop: 5", "5"),
            ("list: [red, 'green left', 10.0, true]", "red green left 10.0 true"),
            ("list: red", "red"),
        ] {
            let modifiers = read(&format!("[{{ name: M, {range} }}]"), &[]).unwrap();
            assert_eq!(modifiers.0[0].values.join(" "), expected, "{range}");
        }
    }

    #[test]
    fn a_modifier_without_values_or_with_wrong_ones_is_refused() {
        for (list, reason) in [
            ("[{ list: [1] }]", "a:1:20: ScenarioModifier[1]: a scenario modifier without a name"),
            ("[{ name: '', list: [1] }]", "the name of a scenario modifier is empty"),
            ("[{ name: M }]", "a scenario modifier without values; give a list, or start, step and stop"),
            ("[{ name: M, start: 1, step: 1 }]", "a scenario modifier without values"),
            ("[{ name: M, list: [] }]", "the scenario modifier M has no value"),
            ("[{ name: M, start: 2, step: 1, stop: 1 }]", "the scenario modifier M has no value"),
            ("[{ name: M, start: a, step: 1, stop: 1 }]", "\"a\" is not a number"),
            ("[{ name: M, start: 1, step: 1, stop: .inf }]", "\".inf\" is not a number"),
            ("[{ name: M, start: 0, step: 1e-5, stop: 1 }]", "more than 10000 values"),
            ("[{ name: M, start: 1e17, step: 1, stop: 2e17 }]", "more than 10000 values"),
            ("[{ name: M, list: [[1]] }]", "expected a single value, found a list"),
            ("[M]", "expected a table, found M"),
        ] {
            let refused = read(list, &[]).unwrap_err();
            assert!(refused.contains(reason), "{list}: {refused}");
        }
    }

    #[test]
    fn the_longest_name_is_replaced_first() {
        let list =
            "[{ name: M, list: [1] }, { name: M-2, list: [a, b] }, { name: N, start: 0, step: 1, stop: 3 }]";
        let modifiers = read(list, &[("M-2", "b")]).unwrap();
        let replaced = |text, mut left_bytes| modifiers.replaced(text, &mut left_bytes);
        assert_eq!(replaced("M M-2 xMx", 3).as_deref(), Some("1 b x1x"));
        assert_eq!(replaced("M M-2 xMx", 2), None);
        assert_eq!(replaced("M N", 0).as_deref(), Some("M N"));
        let reason = "N is a scenario modifier, which stands for several values";
        let remedy = "choose one with --modifier N=0, or modifiers in [traffic_lights]; there are 0, 1, 2, 3";
        assert_eq!(modifiers.not_chosen_in("M N"), Some(Refusal::new(reason, remedy)));
        let refused = read(list, &[("M", "2")]).unwrap_err();
        assert!(refused.contains("the scenario modifier M has no value \"2\"; there are 1"), "{refused}");
    }
}
