//! Questions on standard output and the answers on standard input, of a person or of a pipe.

use std::io::{self, BufRead as _, Write as _};

use super::failure::Failure;
use super::{failure_message, messages};

/// The number of answers to one question after which it is not asked again.
const MAX_ANSWERS: usize = 3;

/// Asks until `take` accepts the answer; an empty answer stands for `default`.
///
/// # Errors
/// The reason why the last of [`MAX_ANSWERS`] was refused, or the end of standard input: `option` says what to give on the
/// command line then.
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
        // The next question comes below.
        messages::flush();
    }
}

/// The next line, or the default for an empty one; `None` at the end of standard input.
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
