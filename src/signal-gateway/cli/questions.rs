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
    mut take: impl FnMut(&str) -> Result<T, Failure>,
) -> Result<T, Failure> {
    let mut refused = 0;
    loop {
        let Some(answer) = answer(question, default)? else {
            return Err(Failure::Usage(format!("there is no answer on standard input: give {option}")));
        };
        match take(&answer) {
            Ok(value) => return Ok(value),
            Err(error) if refused + 1 == MAX_ANSWERS => return Err(error),
            Err(error) => failure_message::show(&error),
        }
        refused += 1;
        messages::flush();
    }
}

/// Asks a question that is answered with yes or no. No answer on standard input means no.
pub(super) fn confirm(question: &str) -> Result<bool, Failure> {
    for _ in 0..MAX_ANSWERS {
        match answer(question, "no")?.as_deref().map_or(Ok(false), yes_or_no) {
            Ok(is_confirmed) => return Ok(is_confirmed),
            Err(error) => failure_message::show(&error),
        }
        messages::flush();
    }
    Ok(false)
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
