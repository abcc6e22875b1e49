//! Comments cite the specifications by file and section title, on one line, so that whoever reads them
//! can open what they cite: `docs/spec/<file>.md, "<title>" and "<title>"`. Numbers of sections mean nothing
//! and go stale.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::sources::{files_below, project};

const FOLDERS: [&str; 9] =
    ["src", "tests", "benches", "fuzz/fuzz_targets", "examples", "config", "dbc", "docs", "systemd"];
const SINGLE_FILES: [&str; 4] = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md", "Cargo.toml"];
/// Where comments begin, by extension; a page is all comment.
const COMMENTS: [(&str, &str); 7] =
    [("rs", "//"), ("cpp", "//"), ("toml", "#"), ("yaml", "#"), ("py", "#"), ("service", "#"), ("md", "")];
const SPECIFICATIONS: &str = "docs/spec/";
/// What the pages for maintainers call `dds`.
const DDS: &str = "src/ros-transport/dds";

/// What is written down in each specification, by the path of its file.
type Titles = BTreeMap<String, Vec<String>>;

#[test]
fn what_comments_cite_is_there() {
    let titles = titles();
    let files = files();
    let breaches: Vec<String> = files
        .iter()
        .filter(|path| !path.ends_with(file!().rsplit('/').next().unwrap_or_default()))
        .flat_map(|path| breaches_of(path, &titles))
        .collect();
    assert!(files.len() > 500 && titles.len() > 3, "the files were not found");
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

/// A page that speaks of all weaknesses names the last one, as the specification lists them.
#[test]
fn the_last_weakness_is_named_everywhere_alike() {
    let listed = |text: &str| {
        let labels = text.lines().filter_map(|line| line.strip_prefix("| W")?.split(' ').next());
        labels.filter_map(|number| number.parse::<u32>().ok()).max()
    };
    let last = listed(&read(Path::new("docs/spec/turn-signal-decider.md"))).expect("a list of weaknesses");
    let mut counted = 0;
    for page in pages() {
        for rest in read(&page).split("W1 to W").skip(1) {
            let number: String = rest.chars().take_while(char::is_ascii_digit).collect();
            assert_eq!(number, last.to_string(), "{}: W1 to W{number}", page.display());
            counted += 1;
        }
    }
    assert!(counted > 0, "nothing speaks of all weaknesses");
}

/// What a feature of Cargo.toml builds in, no page denies.
#[test]
fn no_page_denies_what_can_be_built_in() {
    let manifest = read(Path::new("Cargo.toml"));
    let (_, features) = manifest.split_once("[features]").unwrap();
    let features = features.lines().take_while(|line| !line.starts_with("[dep")).filter_map(|line| {
        let name = line.split_once(" = ")?.0;
        name.chars().all(char::is_alphabetic).then_some(name)
    });
    for feature in features.filter(|name| *name != "default") {
        for page in pages() {
            let text = read(&page).to_lowercase().split_whitespace().collect::<Vec<_>>().join(" ");
            for denial in [
                format!("has no {feature}"),
                format!("no {feature} engine"),
                format!("without a {feature} engine"),
            ] {
                assert!(!text.contains(&denial), "{}: {denial}", page.display());
            }
        }
    }
}

fn pages() -> Vec<PathBuf> {
    files().into_iter().filter(|path| path.extension().is_some_and(|end| end == "md")).collect()
}

#[test]
fn links_of_pages_lead_somewhere() {
    let pages = pages();
    let mut breaches = Vec::new();
    for page in &pages {
        let text = read(page);
        for link in text.split("](").skip(1).filter_map(|rest| rest.split(')').next()) {
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = if file.is_empty() { page.clone() } else { page.with_file_name(file) };
            let is_page = target.extension().is_some_and(|end| end == "md");
            let leads_somewhere = if link.starts_with("https://") {
                true
            } else if is_page && project().join(&target).exists() {
                anchor.is_empty() || headings(&read(&target)).map(anchor_of).any(|known| known == anchor)
            } else {
                project().join(&target).exists() && anchor.is_empty()
            };
            if !leads_somewhere {
                breaches.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(pages.len() > 10, "the pages were not found: {pages:?}");
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

/// The walks and the table of ARCHITECTURE.md name functions, types, modules and files.
#[test]
fn what_the_map_of_the_code_names_exists() {
    let is_word = |letter: char| letter.is_alphanumeric() || letter == '_';
    let is_source =
        |path: &&PathBuf| path.starts_with("src") && path.extension().is_some_and(|end| end == "rs");
    let sources: String = files().iter().filter(is_source).map(|path| read(path)).collect();
    let words: BTreeSet<&str> = sources.split(|letter| !is_word(letter)).collect();
    let page = read(Path::new("ARCHITECTURE.md"));
    let (_, rest) = page.split_once("## Three walks").unwrap();
    let (map, _) = rest.split_once("## What a change costs").unwrap();
    let names: Vec<&str> = map.split('`').skip(1).step_by(2).filter(|name| !name.contains('…')).collect();
    let exists = |name: &&str| {
        if name.contains(['/', '.']) {
            return project().join(name).exists();
        }
        name.split(|letter| !is_word(letter)).all(|word| word.is_empty() || words.contains(word))
    };
    let absent: Vec<_> = names.iter().filter(|name| !exists(name)).collect();
    assert!(names.len() > 80, "the names were not found: {names:?}");
    assert!(absent.is_empty(), "ARCHITECTURE.md names what does not exist: {absent:?}");
}

/// The pages for maintainers name modules by their paths, and files by their paths or, sources alone, by
/// their names.
#[test]
fn what_the_pages_for_maintainers_name_exists() {
    let files = files();
    let file_names: BTreeSet<_> = files.iter().filter_map(|path| path.file_name()?.to_str()).collect();
    let exists = |name: &str| {
        if FOLDERS.iter().any(|folder| name.starts_with(&format!("{folder}/"))) {
            project().join(name).exists()
        } else if Path::new(name).extension().is_some_and(|end| end == "rs") && !name.contains('/') {
            file_names.contains(name)
        } else {
            is_module_or_no_path(name)
        }
    };
    let (mut counted, mut absent) = (0, Vec::new());
    for page in pages().into_iter().filter(|page| page.starts_with("docs/development")) {
        let text = read(&page);
        // Blocks of code have commands, and programs that are built first.
        let prose = text.split("```").step_by(2);
        for name in prose.flat_map(|part| part.split('`').skip(1).step_by(2)) {
            counted += 1;
            // Behind it: options, or a level of the log.
            let name = name.split([' ', '=']).next().unwrap_or_default();
            if !exists(name) {
                absent.push(format!("{}: {name}", page.display()));
            }
        }
    }
    assert!(counted > 300, "only {counted} names were found");
    assert!(absent.is_empty(), "what does not exist is named:\n{}", absent.join("\n"));
}

/// True for the path of a module that is there, and for anything that is not a path into a crate of ours.
fn is_module_or_no_path(name: &str) -> bool {
    let mut parts = name.split("::");
    let package = parts.next().unwrap_or_default();
    let crate_folder = Path::new("src").join(package.replace('_', "-"));
    let mut place = project().join(if package == "dds" { PathBuf::from(DDS) } else { crate_folder });
    if !name.contains("::") || name.contains('…') || !place.is_dir() {
        return true;
    }
    parts.all(|part| {
        place.push(part);
        place.is_dir() || place.with_extension("rs").is_file()
    })
}

fn breaches_of(path: &Path, titles: &Titles) -> Vec<String> {
    let extension = path.extension().and_then(|extension| extension.to_str());
    let Some((_, mark)) = COMMENTS.iter().find(|(known, _)| Some(*known) == extension) else {
        return Vec::new();
    };
    let text = read(path);
    let lines = (1..).zip(text.lines());
    let comments = lines.filter_map(|(line, text)| Some((line, text.get(text.find(mark)?..)?)));
    comments
        .flat_map(|(line, comment)| {
            let wrong = wrong_citations(comment, titles).into_iter().chain(numbered_section(comment));
            wrong.map(|why| format!("{}:{line}: {why}", path.display())).collect::<Vec<_>>()
        })
        .collect()
}

/// Files and titles that a comment cites and that do not exist.
fn wrong_citations(comment: &str, titles: &Titles) -> Vec<String> {
    let mut wrong = Vec::new();
    for cited in comment.split(SPECIFICATIONS).skip(1) {
        let name = cited.split(|letter: char| !is_of_path(letter)).next().unwrap_or_default();
        // The folder itself, and `<file>` in explanations.
        let Some(name) = name.strip_suffix('.').or(Some(name)).filter(|name| !name.is_empty()) else {
            continue;
        };
        let Some(known) = titles.get(&format!("{SPECIFICATIONS}{name}")) else {
            wrong.push(format!("there is no {SPECIFICATIONS}{name}"));
            continue;
        };
        let mut rest = cited.get(name.len()..).unwrap_or_default();
        while let Some(quoted) = [", \"", " and \""].iter().find_map(|before| rest.strip_prefix(before)) {
            let Some((title, after)) = quoted.split_once('"') else {
                wrong.push(format!("the title \"{quoted} does not end on its line"));
                break;
            };
            if !known.iter().any(|heading| heading == title) {
                wrong.push(format!("{SPECIFICATIONS}{name} has no section \"{title}\""));
            }
            rest = after;
        }
    }
    wrong
}

/// A section by its number, in a comment that names no page of this repository: `section 3.2`, `(3.2)`. What
/// follows `§` is a paragraph of law.
fn numbered_section(comment: &str) -> Option<String> {
    let names_page = comment.contains("docs/") && comment.contains(".md");
    let begins_with_digit = |text: &str| text.starts_with(|letter: char| letter.is_ascii_digit());
    let lower = comment.to_lowercase();
    let words: Vec<&str> = lower.split(|letter: char| !letter.is_alphanumeric() && letter != '.').collect();
    let by_word = words
        .windows(2)
        .any(|pair| matches!(pair, ["section" | "sections", number] if begins_with_digit(number)));
    let by_number = comment.split('(').skip(1).any(|rest| {
        let number =
            rest.split(|letter: char| !letter.is_ascii_digit() && letter != '.').next().unwrap_or_default();
        let parts: Vec<&str> = number.split('.').collect();
        let ends: &[char] = if parts.len() == 2 { &[')'] } else { &[')', ',', ' '] };
        !number.starts_with('0')
            && (2..4).contains(&parts.len())
            && parts.iter().all(|part| begins_with_digit(part) && part.len() < 3)
            && rest.get(number.len()..).is_some_and(|after| after.starts_with(ends))
    });
    (!names_page && (by_word || by_number))
        .then(|| format!("cite a page and a title, not a number: {comment}"))
}

fn is_of_path(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || ['-', '_', '.'].contains(&letter)
}

fn titles() -> Titles {
    let pages = files().into_iter().filter(|path| path.starts_with(SPECIFICATIONS));
    let titles_of = |path: PathBuf| {
        let titles = headings(&read(&path)).map(str::to_owned).collect();
        (path.display().to_string(), titles)
    };
    pages.map(titles_of).collect()
}

/// The texts of the headings of a page.
fn headings(page: &str) -> impl Iterator<Item = &str> {
    let is_heading = |line: &&str| line.starts_with('#') && line.trim_start_matches('#').starts_with(' ');
    page.lines().filter(is_heading).map(|line| line.trim_start_matches('#').trim())
}

/// What code forges make of a heading.
fn anchor_of(heading: &str) -> String {
    let kept = |letter: &char| letter.is_alphanumeric() || ['-', '_', ' '].contains(letter);
    heading
        .to_lowercase()
        .chars()
        .filter(kept)
        .map(|letter| if letter == ' ' { '-' } else { letter })
        .collect()
}

/// Every file that may cite, relative to the project.
fn files() -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = SINGLE_FILES.iter().map(PathBuf::from).collect();
    files.extend(FOLDERS.iter().flat_map(|folder| files_below(folder)));
    files.sort();
    files
}

fn read(path: &Path) -> String {
    let bytes = fs::read(project().join(path)).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

mod the_check_itself {
    use super::*;

    #[test]
    fn finds_what_is_not_there() {
        let known = Titles::from([("docs/spec/a.md".to_owned(), vec!["One".to_owned(), "Two".to_owned()])]);
        let wrong = |comment| {
            wrong_citations(comment, &known).len() + usize::from(numbered_section(comment).is_some())
        };
        for comment in [
            "as docs/spec/a.md, \"One\" and \"Two\", says",
            "see docs/spec/a.md.",
            "`docs/spec/<file>.md`",
            "docs/guide.md, section 3",
            "the section of turns, intersection 111; (1.5 m), (0.25), (StVO § 9)",
        ] {
            assert_eq!(wrong(comment), 0, "{comment}");
        }
        for comment in [
            "docs/spec/b.md",
            "docs/spec/a.md, \"Three\"",
            "docs/spec/a.md, \"One\" and \"Four\"",
            "docs/spec/a.md, \"One",
            "(lights section 3.2)",
            "Sections 3 and 4",
            "its end (3.0.5)",
            "its end (4.2).",
        ] {
            assert_eq!(wrong(comment), 1, "{comment}");
        }
        assert_eq!(
            anchor_of("Improved and upstream-compatible mode"),
            "improved-and-upstream-compatible-mode"
        );
    }
}
