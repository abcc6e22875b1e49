//! The process for one recording.

use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::os::unix::process::ExitStatusExt as _;
use std::process::{Child, Command, ExitStatus, Stdio};

use serde::Deserialize;
use serde_json::Value;

/// Maximum length of a line of JSON, bytes; `identify` needs 40,000.
const MAX_LINE: u64 = 16 << 20;

/// Result of a process.
#[derive(Debug, Default)]
pub(super) struct Ended {
    pub(super) exit_code: u8,
    /// The last object on standard output: the result, or the summary after the results.
    pub(super) result: Option<Value>,
    /// The first error.
    pub(super) error: Option<ErrorMessage>,
}

/// An error of the process, as `--message-format json` writes it.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, serde::Serialize)]
pub(super) struct ErrorMessage {
    pub(super) text: String,
    #[serde(default)]
    pub(super) remedy: String,
}

#[derive(Deserialize)]
struct Message {
    level: String,
    #[serde(flatten)]
    message: ErrorMessage,
}

/// Runs a process to its end. A process that cannot be started, or is ended by a signal, has exit code 1.
pub(super) fn run(mut command: Command) -> Ended {
    let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    match command.spawn().and_then(read) {
        Ok(ended) => ended,
        Err(error) => failed(format!("the process for this recording could not be started: {error}")),
    }
}

fn failed(text: String) -> Ended {
    let error = ErrorMessage { text, remedy: String::new() };
    Ended { exit_code: 1, error: Some(error), ..Ended::default() }
}

fn read(mut child: Child) -> io::Result<Ended> {
    // If memory runs short, the kernel ends this process and not another one. Not all systems permit it.
    drop(fs::write(format!("/proc/{}/oom_score_adj", child.id()), "1000"));
    let (stdout, stderr) = (child.stdout.take(), child.stderr.take());
    let (result, error) = std::thread::scope(|scope| {
        let errors = scope.spawn(|| stderr.and_then(|stderr| first_error(BufReader::new(stderr))));
        let result = stdout.and_then(|stdout| last_object(BufReader::new(stdout)));
        (result, errors.join().unwrap_or_default())
    });
    Ok(ended(child.wait()?, result, error))
}

fn ended(status: ExitStatus, result: Option<Value>, error: Option<ErrorMessage>) -> Ended {
    match (status.code().map(u8::try_from), status.signal()) {
        (Some(Ok(exit_code)), _) => Ended { exit_code, result, error },
        (_, Some(signal)) => failed(format!("the process for this recording was ended by signal {signal}")),
        _ => failed(format!("the process for this recording ended: {status}")),
    }
}

/// Reads all lines; passes those that are not too long.
fn each_line(mut source: impl BufRead, mut take: impl FnMut(&[u8])) {
    let mut line = Vec::new();
    while source.by_ref().take(MAX_LINE).read_until(b'\n', &mut line).is_ok_and(|length| length > 0) {
        take(&line);
        line.clear();
    }
}

fn last_object(source: impl BufRead) -> Option<Value> {
    let mut last = Vec::new();
    each_line(source, |line| line.clone_into(&mut last));
    serde_json::from_slice(&last).ok()
}

/// Lines of others, such as the log, are passed over.
fn first_error(source: impl BufRead) -> Option<ErrorMessage> {
    let mut first = None;
    each_line(source, |line| {
        let message = || serde_json::from_slice::<Message>(line).ok();
        first = first
            .take()
            .or_else(|| message().filter(|found| found.level == "error").map(|found| found.message));
    });
    first
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Ended {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        run(command)
    }

    #[test]
    fn the_result_is_the_last_object_and_the_error_the_first_one() {
        let ended = shell(
            r#"echo '{"a": 1}'; echo '{"b": 2}'; echo noise >&2
               echo '{"level": "warning", "text": "w", "remedy": ""}' >&2
               echo '{"level": "error", "text": "e", "remedy": "r"}' >&2
               echo '{"level": "error", "text": "f", "remedy": ""}' >&2; exit 4"#,
        );
        assert_eq!((ended.exit_code, ended.result), (4, Some(serde_json::json!({ "b": 2 }))));
        assert_eq!(ended.error, Some(ErrorMessage { text: "e".to_owned(), remedy: "r".to_owned() }));
    }

    #[test]
    fn a_process_that_a_signal_ends_is_a_result_like_others() {
        let ended = shell("kill -KILL $$");
        assert_eq!((ended.exit_code, ended.result), (1, None));
        assert_eq!(ended.error.unwrap().text, "the process for this recording was ended by signal 9");
        let missing = run(Command::new("/nonexistent"));
        assert_eq!(missing.exit_code, 1);
    }

    #[test]
    fn no_amount_of_output_fills_the_memory() {
        let ended = shell("head -c 100000000 /dev/zero; echo; echo '{}'");
        assert_eq!(ended.result, Some(serde_json::json!({})));
    }
}
