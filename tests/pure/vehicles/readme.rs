//! The table of vehicles in `README.md`, made of the head of each profile and of its bindings.

use std::fs;

use signal_gateway::core::validation::integrity::Protection;
use signal_gateway::core::vehicle_lights::binding::{HazardBinding, TurnBinding};

use crate::pure::vehicles::{profile, profile_names, project};

const BEGIN: &str = "<!-- vehicles -->\n";
const END: &str = "<!-- end of vehicles -->";

/// A paragraph `# Topic: …` of a profile's head, in one line; empty when there is none.
fn paragraph(text: &str, topic: &str) -> String {
    let mut lines = text.lines().skip_while(|line| !line.starts_with(&format!("# {topic}:")));
    let first = lines.next().and_then(|line| line.split_once(": ")).map_or("", |(_, rest)| rest.trim());
    let rest = lines.map_while(|line| line.strip_prefix("#           ")).map(str::trim);
    std::iter::once(first).chain(rest).collect::<Vec<_>>().join(" ")
}

/// The part of a profile's "Verified" that was received on a bus: its first sentence without brackets.
fn verified(text: &str) -> String {
    let verified = paragraph(text, "Verified");
    let sentence = verified.split(". ").next().unwrap_or_default().trim_end_matches('.');
    let mut plain = String::new();
    let mut depth = 0;
    for char in sentence.chars() {
        depth += i32::from(char == '(');
        if depth == 0 {
            plain.push(char);
        }
        depth -= i32::from(char == ')');
    }
    let plain = plain.replace(" ,", ",").split_whitespace().collect::<Vec<_>>().join(" ");
    if plain.is_empty() || plain.starts_with("nothing here") { "–".to_owned() } else { plain }
}

fn source(text: &str) -> &'static str {
    let head = text.split("\nname = ").next().unwrap_or_default().replace("\n#           ", " ");
    let is_source = |name: &str| head.contains(name) && !head.contains(&format!("no {name}"));
    [
        ("public DBC", "public DBC"),
        ("the maker's published DBC", "the maker's DBC"),
        ("come from the standard", "the standard"),
        ("are public facts", "public facts"),
        ("labelled", "labelled frames"),
        ("invented", "invented"),
    ]
    .iter()
    .find(|(name, _)| is_source(name))
    .map_or("the recording", |(_, source)| source)
}

fn row(name: &str) -> Option<String> {
    let path = format!("config/vehicles/{name}.toml");
    let text = fs::read_to_string(project().join(&path)).unwrap();
    let settings = profile(name);
    let lights = &settings.gateway.lights;
    if matches!(lights.turn, TurnBinding::LeftOut) {
        return None;
    }
    let hazard = match lights.hazard {
        HazardBinding::From(_) => "yes",
        HazardBinding::NotFitted => "not fitted",
        HazardBinding::Unbound | HazardBinding::LeftOut => "–",
    };
    let checks = lights.table.messages.iter().filter_map(|message| message.integrity.as_ref());
    let (mut checksum, mut counter) = (false, false);
    for check in checks {
        let (has_checksum, has_counter) = match &check.protection {
            Protection::Fields { checksum, counter } => (checksum.is_some(), counter.is_some()),
            Protection::E2e { .. } => (true, true),
        };
        checksum |= has_checksum;
        counter |= has_counter;
    }
    let protection = match (checksum, counter) {
        (true, true) => "checksum, counter",
        (true, false) => "checksum",
        (false, true) => "counter",
        (false, false) => "–",
    };
    let commands = if text.contains("\n[[command.message]]") { "yes" } else { "–" };
    let title = text.lines().find_map(|line| line.strip_prefix("name = \"")?.strip_suffix('"')).unwrap();
    Some(format!(
        "| [{title}]({path}) | {} | {} | {hazard} | {protection} | {commands} |\n",
        verified(&text),
        source(&text)
    ))
}

#[test]
fn the_readme_lists_the_shipped_vehicles_as_their_profiles_are() {
    let header = "| profile | verified on a recording | the rest from | hazard visible | protection | commands |\n\
                  |---|---|---|---|---|---|\n";
    let table = profile_names()
        .iter()
        .filter_map(|name| row(name))
        .fold(header.to_owned(), |table, row| table + &row);
    let path = project().join("README.md");
    let readme = fs::read_to_string(&path).unwrap();
    let (before, rest) = readme.split_once(BEGIN).unwrap();
    let (written, after) = rest.split_once(END).unwrap();
    if std::env::var_os("UPDATE_DOCS").is_some() {
        fs::write(&path, format!("{before}{BEGIN}{table}{END}{after}")).unwrap();
    } else {
        let again = "run `UPDATE_DOCS=1 cargo test --test pure vehicles::readme`";
        assert!(
            written == table,
            "the table in README.md is not what config/vehicles gives: {again}\n{table}"
        );
    }
}
