//! Problems of a configuration as text, each with its line of the file, a caret and the remedy.

use std::ops::Range;
use std::path::{Path, PathBuf};

use annotate_snippets::{AnnotationKind, Element, Group, Level, Renderer, Snippet};

use super::text::{Layout, escaped, wrapped};
use crate::config::built_in::display;
use crate::config::files::Files;
use crate::config::{Position, Problem};

/// Maximum length of a line that is shown as an excerpt, bytes.
const MAX_LINE: usize = 1 << 14;
/// Width of the excerpt without a limit, characters.
const WIDTH: usize = 140;

/// Formats at most `most` problems, one below the other, with the lines of their `files`.
pub(crate) fn refusals(files: &dyn Files, problems: &[Problem], most: usize, layout: Layout) -> String {
    let mut source = Source::default();
    let mut blocks = Vec::new();
    let mut before = "";
    for problem in problems.iter().take(most) {
        // Avoids repeating e.g. a list of all keys.
        let remedy = if problem.remedy == before { "" } else { &problem.remedy };
        before = &problem.remedy;
        let excerpt = problem.position.and_then(|place| source.line(files, &problem.file, place));
        let is_element = problem.key.contains('/');
        let key = match &*problem.key {
            "" => String::new(),
            // The path of an element is long, and its line is more informative.
            _ if is_element && excerpt.is_some() => String::new(),
            key => format!("{key}: "),
        };
        let place = match (&excerpt, problem.position) {
            (Some(_), _) => String::new(),
            (None, Some(position)) => format!("{}:{position}: ", display(&problem.file)),
            (None, None) => format!("{}: ", display(&problem.file)),
        };
        let title = format!("{place}{key}{}", problem.reason);
        blocks.push(message(Level::ERROR, &title, excerpt, remedy, layout));
    }
    let more = problems.len().saturating_sub(most);
    if more > 0 {
        let title = format!("and {more} more");
        blocks.push(message(Level::ERROR, &title, None, "--verbose shows all of them", layout));
    }
    blocks.join("\n\n")
}

/// Formats a message without a position in a file; its remedy may be empty.
pub(crate) fn plain(level: Level<'_>, text: &str, remedy: &str, layout: Layout) -> String {
    message(level, text, None, remedy, layout)
}

struct Excerpt<'a> {
    path: String,
    text: &'a str,
    number: usize,
    span: Range<usize>,
}

fn message(
    level: Level<'_>,
    title: &str,
    excerpt: Option<Excerpt<'_>>,
    remedy: &str,
    layout: Layout,
) -> String {
    // `error: ` and `= help: ` precede the first lines, blanks the others.
    let in_column = |text: &str, indent: usize| {
        let width = layout.width.map(|width| width.saturating_sub(indent));
        wrapped(&escaped(text), width, 0).join("\n")
    };
    let margin = excerpt.as_ref().map_or(1, |excerpt| excerpt.number.to_string().len() + 1);
    let (title, remedy) = (in_column(title, "warning: ".len()), in_column(remedy, margin + "= help: ".len()));
    let help = (!remedy.is_empty()).then(|| Element::from(Level::HELP.message(remedy)));
    let picture = excerpt.map(|excerpt| {
        let primary = AnnotationKind::Primary.span(excerpt.span);
        let snippet = Snippet::source(excerpt.text).line_start(excerpt.number).path(excerpt.path);
        Element::from(snippet.annotation(primary))
    });
    let group = Group::with_title(level.primary_title(title)).elements(picture).elements(help);
    let renderer = if layout.has_color { Renderer::styled() } else { Renderer::plain() };
    renderer.term_width(layout.width.unwrap_or(WIDTH)).render(&[group])
}

/// The last file read, since problems are ordered by file.
#[derive(Default)]
struct Source {
    file: PathBuf,
    text: Option<String>,
}

impl Source {
    /// Returns the line of a position; `None` if the file cannot be read now, or has no such line.
    fn line(
        &mut self,
        files: &dyn Files,
        file: &Path,
        Position { line, column }: Position,
    ) -> Option<Excerpt<'_>> {
        if self.file != file || self.text.is_none() {
            file.clone_into(&mut self.file);
            self.text = files.read(file).ok().map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        }
        let text = self.text.as_deref()?;
        let text = text.strip_prefix('\u{FEFF}').unwrap_or(text);
        let text = text.split('\n').nth(line.checked_sub(1)?)?;
        let text = text.strip_suffix('\r').unwrap_or(text);
        if text.len() > MAX_LINE {
            return None;
        }
        let start = text.char_indices().nth(column.checked_sub(1)?).map_or(text.len(), |(at, _)| at);
        let span = start..start + word(&text[start..]);
        Some(Excerpt { path: escaped(&display(file)).into_owned(), text, number: line, span })
    }
}

/// Returns the length of the word, quoted text or bracket at the beginning of a text, bytes.
fn word(text: &str) -> usize {
    let Some(first) = text.chars().next() else { return 0 };
    match first {
        '"' | '\'' => {
            let rest = &text[1..];
            rest.find(first).map_or(text.trim_end().len(), |end| end + 2)
        }
        '[' | '{' => 1,
        _ => {
            let is_end =
                |(at, char): &(usize, char)| *at > 0 && (char.is_whitespace() || "\"',]}=>#".contains(*char));
            let end = text.char_indices().find(is_end);
            end.map_or(text.len(), |(at, _)| at)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::files::TestFiles;

    /// Returns the only file, with this text.
    fn car(text: &str) -> [(&str, &str); 1] {
        [("car.toml", text)]
    }

    fn problem(file: &str, position: Option<[usize; 2]>, reason: &str, remedy: &str) -> Problem {
        Problem {
            file: file.into(),
            position: position.map(|[line, column]| Position { line, column }),
            key: "turn.lefft".into(),
            reason: reason.to_owned(),
            remedy: remedy.to_owned(),
            missing_timeout: None,
        }
    }

    fn shown(text: &'static str, problems: &[Problem], most: usize) -> String {
        refusals(&TestFiles(&car(text)), problems, most, Layout::default())
    }

    #[test]
    fn a_problem_is_shown_with_its_line_and_a_caret_below_its_word() {
        let text = "\u{FEFF}[turn]\r\nä = 1, lefft = \"a\\u0041\" # \u{1b}[31m\r\n";
        let unknown = problem("car.toml", Some([2, 8]), "unknown key \"lefft\"", "did you mean left?");
        let expected = "\
error: turn.lefft: unknown key \"lefft\"
 --> car.toml:2:8
  |
2 | ä = 1, lefft = \"a\\u0041\" # ␛[31m
  |        ^^^^^
  |
  = help: did you mean left?";
        assert_eq!(shown(text, &[unknown], 10), expected);
        let value = problem("car.toml", Some([2, 16]), "wrong", "");
        assert!(shown(text, &[value], 10).ends_with("\n  |                ^^^^^^^^^"));
        let end = problem("car.toml", Some([3, 1]), "it ends", "");
        assert!(
            shown(text, &[end], 10).contains("3 |\n  | ^"),
            "{}",
            shown(text, &[problem("car.toml", Some([3, 1]), "it ends", "")], 10)
        );
    }

    #[test]
    fn without_its_line_a_problem_has_its_place_in_front() {
        let far = problem("car.toml", Some([9, 1]), "wrong", "mend it");
        let gone = problem("gone\u{1b}.toml", Some([1, 2]), "wrong", "mend it");
        let whole = Problem::whole_file(Path::new("gone.toml"), "there is no such file", "");
        let expected = "\
error: car.toml:9:1: turn.lefft: wrong
 |
 = help: mend it

error: gone\\u{1b}.toml:1:2: turn.lefft: wrong

error: gone.toml: there is no such file";
        assert_eq!(shown("", &[far, gone, whole], 10), expected);
    }

    #[test]
    fn many_problems_are_cut_and_counted() {
        let many: Vec<_> = (0..23).map(|_| problem("gone", None, "wrong", "")).collect();
        let text = shown("", &many, 10);
        assert_eq!(text.matches("error: gone: turn.lefft: wrong").count(), 10);
        assert!(text.ends_with("error: and 13 more\n |\n = help: --verbose shows all of them"), "{text}");
    }

    #[test]
    fn long_texts_are_wrapped_and_colours_are_wanted() {
        let reason = "a reason of many words, each of them short, that does not fit on one line";
        let layout = Layout { has_color: false, width: Some(40) };
        let problems = [problem("car.toml", Some([1, 1]), reason, reason)];
        let text = refusals(
            &TestFiles(&car("lefft = 1 # a comment that is longer than the terminal is wide")),
            &problems,
            1,
            layout,
        );
        assert!(text.lines().all(|line| line.chars().count() <= 40), "{text}");
        let colored = refusals(&TestFiles(&car("")), &problems, 1, Layout { has_color: true, width: None });
        assert!(colored.contains("\u{1b}[1m"), "{colored:?}");
    }
}
