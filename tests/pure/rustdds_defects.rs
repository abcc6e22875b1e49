//! The tables of `docs/development/rustdds.md` are made of `tests/rustdds_defects.toml` and
//! `ros_transport::rebuild_cause` by `UPDATE_DOCS=1 cargo test --test pure rustdds_defects`.

use std::fmt::Write as _;
use std::path::Path;

use ros_transport::rebuild_cause::{CAUSES, CauseRow};
use serde::Deserialize;

use crate::support::docs_table;

const DOCUMENT: &str = "docs/development/rustdds.md";
const THREADS: &str = "https://github.com/Atostek/RustDDS/issues/";
const CODE: &str = "src/ros-transport/dds/";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Rows {
    defect: Vec<Defect>,
    cause: Vec<Cause>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Defect {
    title: String,
    cause: String,
    workaround: String,
    code: Option<String>,
    seen_in: String,
    #[serde(default)]
    upstream: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cause {
    name: String,
    condition: String,
    interval: String,
}

fn rows() -> Rows {
    toml::from_str(include_str!("../rustdds_defects.toml")).unwrap()
}

fn text(path: &str) -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).unwrap()
}

/// The version of RustDDS that we use.
fn version() -> String {
    let lock = text("Cargo.lock");
    let (_, package) = lock.split_once("name = \"rustdds\"\nversion = \"").unwrap();
    package.split('"').next().unwrap().to_owned()
}

/// Links a title to its section of the document, if there is one.
fn linked(title: &str, document: &str) -> String {
    if !document.contains(&format!("\n### {title}\n")) {
        return title.to_owned();
    }
    let kept = |character: &char| character.is_alphanumeric() || [' ', '-', '_'].contains(character);
    let anchor: String = title.to_lowercase().chars().filter(kept).collect();
    format!("[{title}](#{})", anchor.replace(' ', "-"))
}

fn upstream(threads: &[String]) -> String {
    let linked = threads.iter().map(|thread| {
        let (number, state) = thread.strip_prefix('#').unwrap().split_once(' ').unwrap();
        format!("[#{number}]({THREADS}{number}) {state}")
    });
    if threads.is_empty() { "–".to_owned() } else { linked.collect::<Vec<_>>().join(", ") }
}

#[test]
fn the_document_has_each_cause_and_each_defect() {
    let causes = causes(&text(DOCUMENT));
    let edges =
        ["<!-- Causes: made of tests/rustdds_defects.toml. -->\n", "<!-- The end of the causes. -->\n"];
    docs_table::check(DOCUMENT, edges, &causes, "rustdds_defects");
    let defects = defects(&text(DOCUMENT));
    let edges =
        ["<!-- Defects: made of tests/rustdds_defects.toml. -->\n", "<!-- The end of the defects. -->\n"];
    docs_table::check(DOCUMENT, edges, &defects, "rustdds_defects");
}

fn causes(document: &str) -> String {
    let mut table =
        "| cause of a new participant | name in the log | shortest time between two | defect |\n|---|---|---|---|\n"
            .to_owned();
    for (Cause { name, condition, interval }, CauseRow { cause, defect, log, .. }) in
        rows().cause.iter().zip(CAUSES)
    {
        assert_eq!(*name, format!("{cause:?}"), "the causes are those of the code, in its order");
        let line = log.map_or_else(|| format!("`{name}` in `causes`"), |_| "a line of its own".to_owned());
        writeln!(table, "| {condition} | {line} | {interval} | {} |", linked(defect, document)).unwrap();
    }
    assert_eq!(rows().cause.len(), CAUSES.len());
    table
}

fn defects(document: &str) -> String {
    let mut table = "| defect | file | upstream |\n|---|---|---|\n".to_owned();
    for Defect { title, cause, workaround, code, upstream: threads, .. } in rows().defect {
        let code = code.map_or_else(String::new, |file| format!("`{file}`"));
        let linked = linked(&title, document);
        // A section has cause and workaround.
        let details = if linked == title { format!(": {cause} {workaround}") } else { String::new() };
        writeln!(table, "| {linked}{details} | {code} | {} |", upstream(&threads)).unwrap();
    }
    table
}

#[test]
fn defects_are_named_by_causes_and_sections_and_were_seen_in_the_version_that_we_use() {
    let (document, rows) = (text(DOCUMENT), rows());
    let is_listed = |title: &str| rows.defect.iter().any(|defect| defect.title == title);
    for CauseRow { defect, .. } in CAUSES {
        assert!(is_listed(defect), "{defect}");
    }
    for title in document.lines().filter_map(|line| line.strip_prefix("### ")) {
        assert!(is_listed(title), "the section {title:?} has no row");
    }
    for Defect { title, code, seen_in, .. } in &rows.defect {
        assert_eq!(*seen_in, version(), "{title}: is it still in this version?");
        let Some(code) = code else { continue };
        let folder =
            if Path::new(code).components().count() == 1 && code != "Cargo.toml" { CODE } else { "" };
        assert!(!text(&format!("{folder}{code}")).is_empty());
    }
}
