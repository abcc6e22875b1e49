//! Asks questions on standard output; the answers come from a person or a pipe.

use std::io::{self, BufRead as _, Write as _};

use super::failure::Failure;
use super::{failure_message, messages};

const MAX_ANSWERS: usize = 3;

/// Asks until `take` accepts the answer; an empty answer means `default`. Fails with the last refusal after
/// [`MAX_ANSWERS`], or at the end of standard input with a hint to use `option`.
pub(super) fn ask<T>(
    question: &str,
    default: &str,
    option: &str,
    take: impl FnMut(&str) -> Result<T, Failure>,
) -> Result<T, Failure> {
    ask_until(question, default, Some(option), take)
}

/// Like [`ask`], but takes the default at the end of standard input.
pub(super) fn ask_or_default<T>(
    question: &str,
    default: &str,
    take: impl FnMut(&str) -> Result<T, Failure>,
) -> Result<T, Failure> {
    ask_until(question, default, None, take)
}

fn ask_until<T>(
    question: &str,
    default: &str,
    option: Option<&str>,
    mut take: impl FnMut(&str) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut refused = 0;
    loop {
        let given = answer(question, default)?;
        let is_ended = given.is_none();
        if let Some(option) = option.filter(|_| is_ended) {
            return Err(Failure::Usage(format!("there is no answer on standard input: give {option}")));
        }
        match take(given.as_deref().unwrap_or(default)) {
            Ok(value) => return Ok(value),
            Err(error) if is_ended || refused + 1 == MAX_ANSWERS => return Err(error),
            Err(error) => failure_message::show(&error),
        }
        refused += 1;
        messages::flush();
    }
}

/// Parses an answer of yes or no.
pub(super) fn yes_or_no(answer: &str) -> Result<bool, Failure> {
    match answer {
        "yes" | "y" => Ok(true),
        "no" | "n" => Ok(false),
        _ => Err(Failure::Usage(format!("expected yes or no, found {answer:?}"))),
    }
}

/// Returns the next line, or `default` for an empty line; `None` at the end of standard input.
fn answer(question: &str, default: &str) -> io::Result<Option<String>> {
    let mut out = io::stdout().lock();
    write!(out, "{question} [{default}]: ")?;
    out.flush()?;
    let mut line = String::new();
    if io::stdin().lock().read_line(&mut line)? == 0 {
        writeln!(out)?;
        return Ok(None);
    }
    let line = line.trim();
    Ok(Some(if line.is_empty() { default } else { line }.to_owned()))
}
