//! The house rules that neither Cargo nor the compiler checks: within a crate imports run downhill and in no
//! circle, what computes stays pure, files stay short and their names are specific. What a crate may use is
//! in its manifest.
//!
//! Sources are read as tokens, so comments and strings do not count, and paths count wherever they
//! stand: in `use`, in expressions, inside macros. What is `#[cfg(test)]` may do as it likes.

mod circles;
mod config_rooms;
mod parameters;
mod renderers;
mod the_check_itself;

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use crate::support::sources::{files_of_kind, project};
use signal_gateway::io::process_log::LOGGING_CRATES;

/// The rooms of crates, top to bottom; a module imports from floors below its own. `lib.rs` and `main.rs`
/// join them.
#[rustfmt::skip]
const FLOORS: &[(&str, &[&[&str]])] = &[
    ("signal_gateway", &[&["cli"], &["daemon", "check"], &["replay", "desk"], &["report"], &["config"], &["io"], &["process_status"]]),
    // Each flow stands alone, and only what is above them imports two of them.
    ("gateway_core", &[
        &["gateway"], &["vehicle_lights", "vehicle_status", "command", "v2i_reception"], &["vehicle_report"], &["control_mode", "provenance"],
    ]),
    ("vehicle_bringup", &[&["plausibility", "simulated_vehicle", "discovery"], &["car_model"]]),
    ("can_signal", &[&["validation"], &["dbc"], &["can"]]),
    ("gateway_base", &[&["diagnostics"], &["time", "near_miss"], &["names"]]),
];
/// Parts of the standard library that reach outside the process, wait or share.
const IMPURE_STD: &[&str] = &["env", "fs", "io", "net", "os", "process", "thread", "sync"];
/// Names that mean a clock, a random order or a terminal, however they were imported.
#[rustfmt::skip]
const IMPURE_NAMES: &[&str] = &[
    "Instant", "SystemTime", "UNIX_EPOCH", "HashMap", "HashSet", "RandomState", "DefaultHasher", "print",
    "println", "eprint", "eprintln", "dbg",
];
const VAGUE_NAMES: &[&str] = &["util", "utils", "common", "manager", "managers", "helper", "helpers", "misc"];
const MAX_FILE: usize = 500;
/// Columns of a line that is a comment; code is laid out by rustfmt.
const MAX_COMMENT: usize = 110;

#[test]
fn imports_run_downhill_and_what_computes_is_pure() {
    let (sources, test_files) = (sources_below("src"), test_files());
    let mut breaches = Vec::new();
    // A build script runs on the machine that builds.
    let is_built_in =
        |source: &&&Source| !test_files.contains(&source.path) && !source.path.ends_with("build.rs");
    for source in sources.iter().filter(is_built_in) {
        let breach = |breach| format!("{}: {breach}", source.path.display());
        breaches.extend(source.breaches().map(breach));
    }
    assert!(sources.len() > 10, "the sources were not found");
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

#[test]
fn files_are_short_and_named_after_what_they_do() {
    let mut breaches = Vec::new();
    for Source { path, lines, wide_comments, declared, .. } in &*SOURCES {
        if *lines > MAX_FILE {
            breaches.push(format!("{}: {lines} lines, at most {MAX_FILE}", path.display()));
        }
        breaches.extend(
            wide_comments.iter().map(|line| {
                format!("{}:{line}: a comment of more than {MAX_COMMENT} columns", path.display())
            }),
        );
        let names = path.iter().filter_map(|part| part.to_str()?.split('.').next());
        for name in names.chain(declared.iter().map(String::as_str)).filter(|name| VAGUE_NAMES.contains(name))
        {
            breaches.push(format!("{}: `{name}` is too vague", path.display()));
        }
    }
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

/// All source files, read once for all tests.
static SOURCES: LazyLock<Vec<Source>> = LazyLock::new(|| {
    let folders = ["src", "tests", "benches", "fuzz/fuzz_targets", "examples"];
    folders.iter().flat_map(|folder| files_of_kind(folder, "rs")).map(|path| Source::read(&path)).collect()
});

fn sources_below(folder: &str) -> Vec<&'static Source> {
    SOURCES.iter().filter(|source| source.path.starts_with(folder)).collect()
}

/// The files in `src` that are modules of tests.
pub(super) fn test_files() -> Vec<PathBuf> {
    let sources = sources_below("src");
    let test_modules: Vec<_> = sources.iter().flat_map(|source| &source.test_modules).collect();
    let is_test = |source: &&&Source| test_modules.iter().any(|module| source.module.starts_with(module));
    sources.iter().filter(is_test).map(|source| source.path.clone()).collect()
}

/// One file, read for what it mentions.
#[derive(Default)]
struct Source {
    path: PathBuf,
    lines: usize,
    /// Numbers of the lines that are wider comments than [`MAX_COMMENT`].
    wide_comments: Vec<usize>,
    /// `["can_signal", "can", "bus"]` for `src/can-signal/can/bus.rs`.
    module: Vec<String>,
    mentions: Vec<Mention>,
    /// Every `mod name`, inline or not.
    declared: Vec<String>,
    /// Absolute names of `#[cfg(test)] mod name;`: their files are tests as well.
    test_modules: Vec<Vec<String>>,
    /// Parameters of functions that are tuples of equal types.
    swappable: Vec<String>,
}

/// A path as it is written, with the module it stands in.
struct Mention {
    inside: Vec<String>,
    path: Vec<String>,
}

impl Source {
    fn read(path: &Path) -> Self {
        Self::parse(path, &fs::read_to_string(project().join(path)).unwrap())
    }

    fn parse(path: &Path, text: &str) -> Self {
        let tokens: TokenStream = text.parse().unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let mut module: Vec<String> =
            path.with_extension("").iter().skip(1).map(|part| part.to_string_lossy().into_owned()).collect();
        module.pop_if(|last| ["mod", "lib", "main"].contains(&last.as_str()));
        if let Some(package) = module.first_mut() {
            *package = package.replace('-', "_");
        }
        let lines = text.lines().count();
        let is_wide = |line: &str| line.trim_start().starts_with("//") && line.chars().count() > MAX_COMMENT;
        let wide_comments =
            (1..).zip(text.lines()).filter(|(_, line)| is_wide(line)).map(|(number, _)| number);
        let mut source = Self {
            path: path.to_owned(),
            lines,
            wide_comments: wide_comments.collect(),
            module: module.clone(),
            ..Self::default()
        };
        source.walk(tokens, &module, &[]);
        source
    }

    /// Notes every path in `tokens`; `prefix` is what stands before the braces they came out of.
    fn walk(&mut self, tokens: TokenStream, inside: &[String], prefix: &[String]) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let mut at = 0;
        while let Some(token) = tokens.get(at) {
            let rest = &tokens[at..];
            at += match token {
                TokenTree::Punct(_) if is_cfg_test(rest) => self.skip_test_item(rest, inside),
                TokenTree::Ident(segment) if segment == "mod" => self.enter_module(rest, inside),
                TokenTree::Ident(segment) if segment == "pub" => {
                    if is_restriction(rest.get(1)) {
                        2
                    } else {
                        1
                    }
                }
                TokenTree::Ident(segment) if segment == "fn" => {
                    self.swappable.extend(parameters::swappable(rest));
                    1
                }
                TokenTree::Ident(segment) if segment == "as" && !prefix.is_empty() => 2, // a new name is not a path
                TokenTree::Ident(_) => self.note_path(rest, inside, prefix),
                TokenTree::Group(group) => {
                    self.walk(group.stream(), inside, &[]);
                    1
                }
                // A variable of a macro, or its crate: what a macro names is the affair of those who use it.
                TokenTree::Punct(dollar) if dollar.as_char() == '$' => 2,
                TokenTree::Punct(_) | TokenTree::Literal(_) => 1,
            };
        }
    }

    /// `a::b::{c, d}` from its first segment on; returns how many tokens it took.
    fn note_path(&mut self, tokens: &[TokenTree], inside: &[String], prefix: &[String]) -> usize {
        let mut path = prefix.to_vec();
        let mut at = 0;
        loop {
            match tokens.get(at) {
                Some(TokenTree::Ident(segment)) => {
                    path.push(segment.to_string().trim_start_matches("r#").to_owned());
                }
                Some(TokenTree::Punct(star)) if star.as_char() == '*' && at > 0 => path.push("*".to_owned()),
                Some(TokenTree::Group(group)) if group.delimiter() == Delimiter::Brace && at > 0 => {
                    self.walk(group.stream(), inside, &path);
                    return at + 1;
                }
                _ => break,
            }
            at += 1;
            if !is_path_separator(&tokens[at..]) {
                break;
            }
            at += 2;
        }
        self.mentions.push(Mention { inside: inside.to_vec(), path });
        at
    }

    fn enter_module(&mut self, tokens: &[TokenTree], inside: &[String]) -> usize {
        let Some(TokenTree::Ident(name)) = tokens.get(1) else { return 1 };
        self.declared.push(name.to_string());
        match tokens.get(2) {
            Some(TokenTree::Group(body)) => {
                self.walk(body.stream(), &joined(inside, name.to_string()), &[]);
                3
            }
            _ => 2,
        }
    }

    /// From `#[cfg(test)]` through the item it stands on: to its braces or its semicolon.
    fn skip_test_item(&mut self, tokens: &[TokenTree], inside: &[String]) -> usize {
        let end = tokens.iter().position(|token| match token {
            TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
            TokenTree::Punct(punct) => punct.as_char() == ';',
            TokenTree::Ident(_) | TokenTree::Literal(_) => false,
        });
        let end = end.unwrap_or(tokens.len() - 1);
        let module = tokens[..end].iter().position(|token| token.to_string() == "mod");
        if let Some(TokenTree::Ident(name)) = module.and_then(|at| tokens.get(at + 1)) {
            self.declared.push(name.to_string());
            self.test_modules.push(joined(inside, name.to_string()));
        }
        end + 1
    }

    fn breaches(&self) -> impl Iterator<Item = String> {
        self.mentions.iter().filter_map(|mention| {
            let why = mention.breach()?;
            Some(format!("`{}`: {why}", mention.path.join("::")))
        })
    }
}

impl Mention {
    /// Why this must not stand here.
    fn breach(&self) -> Option<String> {
        let home = self.inside.first()?;
        match self.target().as_deref() {
            Some([package, path @ ..]) if package == home => self.breach_of_floors(path),
            None if PURE.contains(home) => self.impurity(),
            Some(_) | None => None, // whether it may use another crate is in its manifest
        }
    }

    fn breach_of_floors(&self, target: &[String]) -> Option<String> {
        let [home, room, ..] = &*self.inside else { return None }; // the roots may import everything
        let (_, floors) = FLOORS.iter().find(|(package, _)| package == home)?;
        let Some(floor) = floor_of(floors, room) else {
            return Some(format!("`{room}` has no floor: give it one in tests/pure/layering.rs"));
        };
        match target {
            [] => Some("names the whole crate".to_owned()),
            [met, ..] if met != room && floor_of(floors, met).is_none_or(|other| other <= floor) => {
                Some(format!("`{room}` must not import `{met}`: imports run downhill"))
            }
            [_, ..] => None,
        }
    }

    fn impurity(&self) -> Option<String> {
        let segments: Vec<&str> = self.path.iter().map(String::as_str).collect();
        if let Some(name) = segments.iter().find(|segment| IMPURE_NAMES.contains(segment)) {
            return Some(format!("`{name}` is no business of what computes"));
        }
        match segments.as_slice() {
            ["std" | "alloc"] | ["std", "*"] => Some("names the whole standard library".to_owned()),
            ["std", "sync", "Arc", ..] => None,
            ["std", part, ..] if IMPURE_STD.contains(part) => Some(format!("`std::{part}` is not pure")),
            _ => None,
        }
    }

    /// The path from a crate of ours on, when it leads into one by its name, or by `crate`, `self` or
    /// `super`.
    fn target(&self) -> Option<Vec<String>> {
        let mut target = match self.path[0].as_str() {
            "crate" => self.inside[..1].to_vec(),
            "self" if self.path.len() > 1 => self.inside.clone(),
            "super" => self.inside[..self.inside.len() - 1].to_vec(),
            name if OURS.contains_key(name) => vec![name.to_owned()],
            _ => return None,
        };
        for segment in &self.path[1..] {
            match segment.as_str() {
                "super" => drop(target.pop()),
                "self" | "*" => {}
                name => target.push(name.to_owned()),
            }
        }
        Some(target)
    }
}

fn floor_of(floors: &[&[&str]], room: &str) -> Option<usize> {
    floors.iter().position(|rooms| rooms.contains(&room))
}

fn is_path_separator(tokens: &[TokenTree]) -> bool {
    let colon = |at| matches!(tokens.get(at), Some(TokenTree::Punct(punct)) if punct.as_char() == ':');
    colon(0) && colon(1)
}

/// The parentheses of `pub(crate)`, `pub(super)`, `pub`: they import nothing.
fn is_restriction(token: Option<&TokenTree>) -> bool {
    let Some(TokenTree::Group(group)) = token else { return false };
    let first = group.stream().into_iter().next().map(|token| token.to_string());
    group.delimiter() == Delimiter::Parenthesis
        && first.is_some_and(|segment| ["crate", "self", "super", "in"].contains(&segment.as_str()))
}

pub(super) fn is_cfg_test(tokens: &[TokenTree]) -> bool {
    matches!(tokens, [TokenTree::Punct(hash), TokenTree::Group(attribute), ..]
        if hash.as_char() == '#' && attribute.stream().to_string().replace(' ', "") == "cfg(test)")
}

fn joined(path: &[String], name: String) -> Vec<String> {
    path.iter().cloned().chain([name]).collect()
}

/// Our crates by their names in Rust, with what each depends on, by names in manifests.
static OURS: LazyLock<BTreeMap<String, BTreeSet<String>>> = LazyLock::new(|| {
    let root = PathBuf::from("Cargo.toml");
    let below_src = files_of_kind("src", "toml").into_iter().filter(|path| path.ends_with("Cargo.toml"));
    let packages = below_src.chain([root]).map(|path| {
        let manifest: toml::Table = fs::read_to_string(project().join(path)).unwrap().parse().unwrap();
        let dependencies = manifest["dependencies"].as_table().unwrap().keys().cloned().collect();
        (manifest["package"]["name"].as_str().unwrap().replace('-', "_"), dependencies)
    });
    packages.collect()
});

/// The crate that reads files, and has nothing else of the outside world.
const READS_FILES: &str = "can_log";
/// Those that compute and touch nothing.
static PURE: LazyLock<BTreeSet<String>> = LazyLock::new(|| {
    let pure = OURS
        .iter()
        .filter(|(package, dependencies)| !dependencies.contains("tokio") && package.as_str() != READS_FILES);
    pure.map(|(package, _)| package.clone()).collect()
});

/// What a build has is the affair of one crate, and a level of `signal_gateway` is one of all crates that
/// log.
#[test]
fn one_crate_has_features_and_the_log_knows_who_logs() {
    let other_rust =
        files_of_kind("src", "rs").into_iter().filter(|path| !path.starts_with("src/ros-transport"));
    let with_features: Vec<_> = other_rust
        .filter(|path| fs::read_to_string(project().join(path)).unwrap().contains("cfg(feature"))
        .collect();
    assert_eq!(with_features, Vec::<PathBuf>::new());
    let logging = OURS.iter().filter(|(_, dependencies)| dependencies.contains("tracing"));
    let logging: BTreeSet<_> = logging.map(|(package, _)| package.as_str()).collect();
    let known = LOGGING_CRATES.into_iter().chain(["signal_gateway"]).collect();
    assert_eq!(logging, known);
}

/// The table of crates in ARCHITECTURE.md has the arrows of the manifests.
#[test]
fn the_architecture_shows_which_crate_uses_which() {
    let text = fs::read_to_string(project().join("ARCHITECTURE.md")).unwrap();
    let cells = |line: &str| line.split('|').map(|cell| cell.trim().replace('`', "")).collect::<Vec<_>>();
    let rows = text.lines().map(cells).filter_map(|cells| match &*cells {
        [_, package, _, uses, _] => Some((package.replace('-', "_"), uses.clone())),
        _ => None,
    });
    let drawn: BTreeMap<_, _> = rows.filter(|(package, _)| OURS.contains_key(package)).collect();
    for (package, dependencies) in &*OURS {
        let ours: Vec<_> =
            dependencies.iter().filter(|name| OURS.contains_key(&name.replace('-', "_"))).cloned().collect();
        let expected = if ours.is_empty() { "none".to_owned() } else { ours.join(", ") };
        assert_eq!(drawn.get(package), Some(&expected), "{package} in ARCHITECTURE.md");
    }
}
