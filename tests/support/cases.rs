//! Cases in text files: files or a command line, and the whole answer to them.
//!
//! ```text
//! # A comment.
//! with car.toml                                    another file than the sound one, here in all groups
//! - off = [0]                                      by a change: lines that go,
//! + off = [1]                                      that come,
//!   left = [2]                                     that stay
//!
//! === a missing profile is refused at its key      a group of cases: a sentence that is true of each
//! in gateway.toml                                  the file that its cases change
//! | profile = "car.toml"                           and what it is here as a whole
//! | # here
//!
//! + profil = "car.toml"                            a case: what comes alone does so at the line `# here`
//! > gateway.toml:2:1: profil: unknown key; …       the answer, in which `…` leaves out any text
//!
//! - profile = "car.toml"                           another case,
//! + profile = @@"cart.toml"                        with a mark
//! > @@: profile: cart.toml: there is no such file  whose place the answer has
//!
//! $ check --profile nosuch                         a command line
//! > error: nosuch: there is no such file
//! ```
//!
//! A group of cases starts from the sound files and what stands above the first group. With `UPDATE_DOCS`
//! set, answers that differ are written into the file; a new case needs no more than `>` then.

use std::fmt::Write as _;
use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::support::files::MemoryFiles;

/// A case: the files as it changes them, and the command that is run on them.
pub(crate) struct Case<'a> {
    pub(crate) files: MemoryFiles,
    /// The file that the case changes; empty when it changes none.
    pub(crate) file: &'a str,
    /// Empty when files alone are asked about.
    pub(crate) command: &'a str,
    /// The place of the mark, as a problem there begins: `file:line:column:`.
    mark: Option<String>,
    group: &'a str,
    /// Lines of the file that ask, by index.
    question: Range<usize>,
    /// Lines of the expected answer.
    answer: Range<usize>,
}

/// Returns the folder with the cases of a kind.
pub(crate) fn folder(kind: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(kind)
}

/// Compares the answers to all cases of a kind with the expected ones, and panics with those that differ.
pub(crate) fn check(kind: &str, sound: &MemoryFiles, answer: impl Fn(&Case) -> String) {
    let entries = std::fs::read_dir(folder(kind)).unwrap().map(|entry| entry.unwrap().path());
    let mut paths: Vec<_> = entries.filter(|path| path.is_file()).collect();
    paths.sort();
    assert!(!paths.is_empty(), "no cases of {kind}");
    let wrong = paths.iter().map(|path| {
        let text = std::fs::read_to_string(path).unwrap();
        wrong_in(path, &text, &text, "> ", sound, &answer)
    });
    refuse(&wrong.collect::<String>());
}

/// Does the same with a document whose answers have no marks. `translate` makes a line of cases of each of
/// its lines.
pub(crate) fn check_document(
    path: &Path,
    translate: impl Fn(&str) -> String,
    sound: &MemoryFiles,
    answer: impl Fn(&Case) -> String,
) {
    let text = std::fs::read_to_string(path).unwrap();
    refuse(&wrong_in(path, &text, &translate(&text), "", sound, &answer));
}

fn refuse(wrong: &str) {
    assert!(wrong.is_empty(), "other answers, which UPDATE_DOCS=1 writes down:\n\n{wrong}");
}

/// Returns the cases of a file whose answers differ. With `UPDATE_DOCS` set, writes these answers into the
/// file instead.
fn wrong_in(
    path: &Path,
    text: &str,
    cases_of_text: &str,
    mark: &str,
    sound: &MemoryFiles,
    answer: impl Fn(&Case) -> String,
) -> String {
    let is_update = std::env::var_os("UPDATE_DOCS").is_some();
    let [text, lines] = [text, cases_of_text].map(|text| text.lines().collect::<Vec<_>>());
    let cases = cases(&lines, sound).unwrap_or_else(|problem| panic!("{}:{problem}", path.display()));
    let (mut wrong, mut renewed, mut copied) = (String::new(), String::new(), 0);
    for case in cases {
        let found = answer(&case);
        let found = case.mark.as_ref().map_or(found.clone(), |place| found.replace(place, "@@:"));
        let is_at_mark = case.mark.is_none() || found.contains("@@:");
        if is_at_mark && is_like(found.trim_end(), &contents(&lines[case.answer.clone()], ">")) {
            continue;
        }
        let found: Vec<_> = found.lines().map(|line| format!("{mark}{line}").trim_end().to_owned()).collect();
        if is_update && is_at_mark {
            renewed += &whole(&text[copied..case.answer.start]);
            renewed += &whole(&found);
            copied = case.answer.end;
        } else {
            let place = format!("{}:{}", path.display(), case.question.start + 1);
            let [asked, expected] = [case.question, case.answer].map(|range| whole(&text[range]));
            let found = whole(&found);
            writeln!(wrong, "{place}: {}\n{asked}{expected}instead:\n{found}", case.group).unwrap();
        }
    }
    if copied > 0 {
        std::fs::write(path, renewed + &whole(&text[copied..])).unwrap();
    }
    wrong
}

/// Reads the cases of a file. The error is a mistake in it, with its line.
pub(crate) fn cases<'a>(lines: &[&'a str], sound: &MemoryFiles) -> Result<Vec<Case<'a>>, String> {
    let (mut common, mut files) = (None, sound.clone());
    let (mut group, mut changed, mut given) = ("", "", None);
    let mut cases: Vec<Case> = Vec::new();
    let has_case = |group: &str, cases: &[Case]| cases.last().is_some_and(|case| case.group == group);
    let mut end = 0;
    for block in lines.chunk_by(|line, next| is_of_case(line) && is_of_case(next) && !ends(line, next)) {
        let start = end;
        end += block.len();
        if block[0].starts_with('#') {
            continue;
        }
        let wrong = |what: &str| format!("{}: {what}", start + 1);
        let answered = block.iter().position(|line| line.starts_with('>'));
        if let Some(sentence) = block[0].strip_prefix("=== ") {
            if !group.is_empty() && !has_case(group, &cases) {
                return Err(wrong("the group before has no case"));
            }
            (group, changed, given) = (sentence, "", None);
            files = common.get_or_insert(files).clone();
        } else if let Some(file) = block[0].strip_prefix("in ") {
            (changed, given) = (file, Some(file));
        } else if let Some(file) = block[0].strip_prefix("with ") {
            given = Some(file);
        } else if block[0].is_empty() {
            given = None;
        } else if !is_of_case(block[0]) {
            return Err(wrong(
                "a line of a case begins with one of \"|\", \" \", \"-\", \"+\", \"$\", \">\"",
            ));
        } else if let Some(answered) = answered {
            if group.is_empty() {
                return Err(wrong("a case in front of all groups"));
            }
            let command = block.iter().find_map(|line| line.strip_prefix("$ ")).unwrap_or_default();
            let mut case = Case {
                files: files.clone(),
                file: changed,
                command,
                mark: None,
                group,
                question: start..start + answered,
                answer: start + answered..end,
            };
            let lines: Vec<_> = block.iter().filter(|line| !line.starts_with(['$', '>'])).copied().collect();
            if !lines.is_empty() {
                let text = change(&files, changed, &lines).map_err(|what| wrong(&what))?;
                case.mark = place(&text).map(|(line, column)| format!("{changed}:{line}:{column}:"));
                case.files.insert(changed, text.replacen("@@", "", 1));
            }
            cases.push(case);
            given = None;
        } else {
            let Some(file) = given.take() else { return Err(wrong("a case without an answer")) };
            let text = change(&files, file, block).map_err(|what| wrong(&what))?;
            files.insert(file, text);
        }
    }
    if has_case(group, &cases) { Ok(cases) } else { Err(format!("{end}: no case at the end")) }
}

fn is_of_case(line: &str) -> bool {
    line.starts_with(['|', ' ', '-', '+', '$', '>'])
}

/// Returns true if a case ends between the lines.
fn ends(line: &str, next: &str) -> bool {
    line.starts_with('>') && !next.starts_with('>')
}

fn whole(lines: &[impl AsRef<str>]) -> String {
    lines.iter().map(|line| format!("{}\n", line.as_ref())).collect()
}

/// Joins the lines with one of these marks, without it.
fn contents(lines: &[&str], marks: &str) -> String {
    let marked = lines.iter().filter(|line| line.starts_with(|mark| marks.contains(mark)));
    marked.map(|line| line.get(2..).unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// Returns the text of a file after a change of it.
fn change(files: &MemoryFiles, file: &str, lines: &[&str]) -> Result<String, String> {
    if lines[0].starts_with('|') {
        return Ok(contents(lines, "|") + "\n");
    }
    let text = format!("\n{}", files.get(file).ok_or(format!("no file {file:?}"))?);
    let [old, new] = [" -", " +"].map(|marks| format!("\n{}\n", contents(lines, marks)));
    let (old, new) = if lines.iter().all(|line| line.starts_with('+')) {
        let here = ["\n# here\n", "\n<!-- here -->\n"].into_iter().find(|here| text.contains(here));
        let here = here.ok_or(format!("{file} has no line `# here`"))?;
        (here.to_owned(), new.trim_end_matches('\n').to_owned() + here)
    } else {
        (old, if new == "\n\n" { "\n".to_owned() } else { new })
    };
    match text.match_indices('\n').filter(|(at, _)| text[*at..].starts_with(&old)).count() {
        1 => Ok(text.replacen(&old, &new, 1)[1..].to_owned()),
        count => Err(format!("these lines are {count} times in {file}: {old}")),
    }
}

/// Returns line and column of the mark.
fn place(text: &str) -> Option<(usize, usize)> {
    let (before, _) = text.split_once("@@")?;
    let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
    Some((before.matches('\n').count() + 1, column))
}

/// Compares a text with a pattern in which "…" stands for any text.
fn is_like(text: &str, pattern: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('…') else { return text == pattern };
    let Some(text) = text.strip_prefix(start) else { return false };
    text.char_indices().map(|(at, _)| at).chain([text.len()]).any(|at| is_like(&text[at..], rest))
}
