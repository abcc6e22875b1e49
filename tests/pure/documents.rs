//! The documents lead on: each is in the index and says whom it is for, and each link and anchor between them
//! exists.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use crate::support::sources::{files_of_kind, project};

const INDEX: &str = "docs/README.md";

/// Documents outside of docs.
const OTHERS: [&str; 6] =
    ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "CONTRIBUTING.md", "ros/README.md", "systemd/README.md"];

fn documents() -> Vec<PathBuf> {
    let mut documents = files_of_kind("docs", "md");
    documents.extend(OTHERS.map(PathBuf::from));
    documents
}

fn text(document: &Path) -> String {
    fs::read_to_string(project().join(document)).unwrap()
}

/// The targets of all links in a document, without those in blocks of code.
fn links(text: &str) -> Vec<&str> {
    let mut is_code = false;
    let mut links = Vec::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            links.extend(line.split("](").skip(1).filter_map(|rest| rest.split(')').next()));
        }
    }
    links
}

/// The path from the project of a link in a document, and its anchor.
fn target(document: &Path, link: &str) -> (PathBuf, Option<String>) {
    let (path, anchor) = link.split_once('#').map_or((link, None), |(path, anchor)| (path, Some(anchor)));
    let anchor = anchor.map(str::to_owned);
    if path.is_empty() {
        return (document.to_owned(), anchor);
    }
    let mut target = PathBuf::new();
    for component in document.parent().unwrap().join(path).components() {
        match component {
            Component::ParentDir => {
                assert!(target.pop(), "{}: {link} leaves the project", document.display());
            }
            Component::CurDir => {}
            Component::Prefix(_) | Component::RootDir | Component::Normal(_) => target.push(component),
        }
    }
    (target, anchor)
}

/// The anchor of a heading, as on GitHub.
fn anchor(heading: &str) -> String {
    let heading = heading.trim_start_matches('#').trim().to_lowercase();
    let letters = heading.chars().filter(|char| char.is_alphanumeric() || [' ', '-', '_'].contains(char));
    letters.map(|char| if char == ' ' { '-' } else { char }).collect()
}

fn anchors(text: &str) -> BTreeSet<String> {
    let mut is_code = false;
    let mut anchors = BTreeSet::new();
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code && line.starts_with('#') {
            anchors.insert(anchor(line));
        }
    }
    anchors
}

#[test]
fn each_link_between_documents_leads_to_a_file_and_a_heading() {
    let (mut wrong, mut count) = (Vec::new(), 0);
    for document in documents() {
        for link in links(&text(&document)) {
            if link.contains("://") || link.starts_with("mailto:") {
                continue;
            }
            count += 1;
            let (target, anchor) = target(&document, link);
            let is_there = project().join(&target).exists();
            let is_heading = anchor.is_none_or(|anchor| {
                target.extension().is_none_or(|kind| kind != "md")
                    || anchors(&text(&target)).contains(&anchor)
            });
            if !is_there || !is_heading {
                wrong.push(format!("{}: {link}", document.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    assert!(count > 200, "only {count} links were found");
}

#[test]
fn each_document_is_in_the_index_and_says_whom_it_is_for() {
    let index = text(Path::new(INDEX));
    let listed: BTreeSet<_> =
        links(&index).into_iter().map(|link| target(Path::new(INDEX), link).0).collect();
    let mut wrong = Vec::new();
    for document in files_of_kind("docs", "md") {
        // The specifications have an index of their own.
        if !document.starts_with("docs/spec") && document != Path::new(INDEX) && !listed.contains(&document) {
            wrong.push(format!("{} is not in {INDEX}", document.display()));
        }
        let text = text(&document);
        let is_text = |line: &&str| !line.is_empty() && !line.starts_with("<!--") && !line.starts_with('#');
        let first = text.lines().find(is_text).unwrap_or_default();
        if !document.starts_with("docs/spec") && !first.starts_with("For ") {
            wrong.push(format!("{} does not begin with whom it is for", document.display()));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_landing_page_is_short() {
    let lines = text(Path::new("README.md")).lines().count();
    assert!(lines <= 150, "README.md has {lines} lines");
}

#[test]
fn links_and_anchors_are_read_as_github_does() {
    assert_eq!(anchor("## Recordings, and their JSON"), "recordings-and-their-json");
    assert_eq!(anchor("## `turn_indicators`, `hazard_lights`"), "turn_indicators-hazard_lights");
    let text = "[a](b.md#c), ![d](e.svg)\n```\n[no](x)\n```\n[f](#g)";
    assert_eq!(links(text), ["b.md#c", "e.svg", "#g"]);
    let found = target(Path::new("docs/a.md"), "../README.md#in-60-seconds");
    assert_eq!(found, (PathBuf::from("README.md"), Some("in-60-seconds".to_owned())));
}
