//! The tables of countries in `docs/turn-signal-decider.md`, made of the table of rules and of the shipped
//! files.

use std::path::Path;

use signal_gateway::config::country::{built_in, country};
use signal_gateway::config::files::Embedded;
use turn_signal::country::{Country, CountryRule, RULES, RuleValue};
use turn_signal::side::Side;

const BEGIN: &str = "<!-- begin countries, made by `UPDATE_DOCS=1 cargo test --test pure countries` -->\n";
const END: &str = "<!-- end countries -->";

/// The key of a rule as a reader writes it: `roundabout.on_entry`.
fn key(rule: &CountryRule) -> String {
    [rule.table, rule.name].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(".")
}

fn value(rule: &CountryRule, country: &mut Country) -> String {
    let side = |side: Option<Side>| side.map_or("–", Side::name).to_owned();
    match rule.value {
        RuleValue::Number { unit, field, .. } => {
            field(country).map_or("in good time".to_owned(), |number| format!("{number} {unit}"))
        }
        RuleValue::Side(field) => side(Some(*field(country))),
        RuleValue::SideOrNone(field) => side(*field(country)),
        RuleValue::Flag(field) => if *field(country) { "yes" } else { "no" }.to_owned(),
    }
}

fn tables() -> String {
    let mut text = "| rule | value | what it does |\n|---|---|---|\n".to_owned();
    for rule in RULES {
        let values = match rule.value {
            RuleValue::Number { unit, max, .. } => format!("0 to {max} {unit}; without it: in good time"),
            RuleValue::Side(_) => "left or right".to_owned(),
            RuleValue::SideOrNone(_) => "left, right or none".to_owned(),
            RuleValue::Flag(_) => "true or false; default: false".to_owned(),
        };
        let anchor = rule.section.to_lowercase().replace(' ', "-");
        let effect = format!("{} ([{}](spec/turn-signal-decider.md#{anchor}))", rule.effect, rule.section);
        text += &format!("| `{}` | {values} | {effect} |\n", key(rule));
    }
    let keys: Vec<_> = RULES.iter().map(|rule| format!("`{}`", key(rule))).collect();
    let line = "---|".repeat(RULES.len() + 2);
    text += &format!("\n| code | source | {} |\n|{line}\n", keys.join(" | "));
    for code in built_in() {
        let mut country = country(&Embedded, Path::new(""), code).unwrap();
        let values: Vec<_> = RULES.iter().map(|rule| value(rule, &mut country)).collect();
        text += &format!("| `{code}` | {} | {} |\n", country.source, values.join(" | "));
    }
    text
}

#[test]
fn the_guide_lists_every_rule_and_country() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/turn-signal-decider.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once(BEGIN).unwrap();
    let (found, after) = rest.split_once(END).unwrap();
    let tables = tables();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, format!("{before}{BEGIN}{tables}{END}{after}")).unwrap();
    } else {
        assert_eq!(found, tables, "run `UPDATE_DOCS=1 cargo test --test pure countries`");
    }
}

/// Japan's file is the example to copy, and a section of the specification explains each rule.
#[test]
fn every_rule_has_an_example_and_a_specification() {
    let example = include_str!("../../../config/countries/JP.toml");
    let specification = include_str!("../../../docs/spec/turn-signal-decider.md");
    for rule in RULES {
        let name = format!("{} = ", rule.name);
        let is_set = |line: &str| line.trim_start_matches("# ").starts_with(&name);
        assert!(example.lines().any(is_set), "JP.toml lacks {}", rule.name);
        let title = format!("# {}", rule.section);
        assert!(specification.lines().any(|line| line.ends_with(&title)), "no section {:?}", rule.section);
    }
}
