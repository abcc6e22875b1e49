//! The result of each recording as a row of text or JSON.

use std::io::{self, Write};
use std::path::PathBuf;

use serde_json::json;

use super::found::Found;
use super::worker::Ended;
use crate::report::text::{counted, escaped};

/// Exit codes from the best to the worst; any other is worse.
const FROM_BEST: [u8; 6] = [0, 4, 5, 3, 2, 1];

/// Width of the column for the vehicle.
const CAR_WIDTH: usize = 26;

/// Result of a recording.
pub(super) struct Row {
    recording: PathBuf,
    car: Option<String>,
    /// What was found, or why nothing was found.
    found: String,
    ended: Ended,
}

impl Row {
    pub(super) fn new(recording: PathBuf, car: Option<String>, found: Option<Found>, ended: Ended) -> Self {
        let (found_car, text) = found.map(|found| (found.car, found.text)).unwrap_or_default();
        let error = ended.error.as_ref().map(|error| error.text.clone());
        let texts = [Some(text).filter(|text| !text.is_empty()), error];
        let found = texts.into_iter().flatten().collect::<Vec<_>>().join("; ");
        Self { recording, car: car.or(found_car), found, ended }
    }

    fn text(&self) -> String {
        let Self { recording, car, found, ended } = self;
        let car = escaped(car.as_deref().unwrap_or("–")).into_owned();
        let recording = recording.to_string_lossy();
        let line =
            format!("{:>4}  {car:<CAR_WIDTH$}  {}: {}", ended.exit_code, escaped(&recording), escaped(found));
        line.trim_end().to_owned()
    }

    fn json(&self) -> String {
        json!({
            "recording": self.recording.to_string_lossy(),
            "car": self.car,
            "found": self.found,
            "exit_code": self.ended.exit_code,
            "error": self.ended.error,
            "result": self.ended.result,
        })
        .to_string()
    }
}

/// Writes the rows, and counts them by exit code.
pub(super) struct ResultTable<W> {
    out: W,
    as_json: bool,
    /// True if rows without a finding are left out of the text.
    only_findings: bool,
    counts: Vec<(u8, u64)>,
}

impl<W: Write> ResultTable<W> {
    pub(super) fn new(out: W, as_json: bool, only_findings: bool) -> Self {
        Self { out, as_json, only_findings, counts: Vec::new() }
    }

    pub(super) fn rows(&self) -> u64 {
        self.counts.iter().map(|(_, count)| count).sum()
    }

    pub(super) fn add(&mut self, row: &Row) -> io::Result<()> {
        let code = row.ended.exit_code;
        if self.as_json {
            writeln!(self.out, "{}", row.json())?;
        } else {
            if self.counts.is_empty() {
                writeln!(self.out, "exit  {:<CAR_WIDTH$}  recording: what was found", "car")?;
            }
            if !self.only_findings || code != 0 {
                writeln!(self.out, "{}", row.text())?;
            }
        }
        match self.counts.iter_mut().find(|(known, _)| *known == code) {
            Some((_, count)) => *count += 1,
            None => self.counts.push((code, 1)),
        }
        self.out.flush()
    }

    /// Writes the numbers of recordings by exit code as text, and returns the worst exit code.
    pub(super) fn finish(mut self) -> io::Result<u8> {
        let rank = |code: u8| FROM_BEST.iter().position(|known| *known == code).unwrap_or(FROM_BEST.len());
        self.counts.sort_by_key(|(code, _)| rank(*code));
        let worst = self.counts.last().map_or(0, |(code, _)| *code);
        if !self.as_json {
            let counts = self.counts.iter().map(|(code, count)| format!("{count} with exit code {code}"));
            let counts = counts.collect::<Vec<_>>().join(", ");
            writeln!(self.out, "\n{}: {counts}", counted(self.rows(), "recording"))?;
        }
        Ok(worst)
    }
}

#[cfg(test)]
mod tests {
    use super::super::worker::ErrorMessage;
    use super::*;

    fn row(name: &str, exit_code: u8, error: Option<&str>) -> Row {
        let found = Found { car: Some("demo_vehicle".to_owned()), text: "fits".to_owned() };
        let error = error.map(|text| ErrorMessage { text: text.to_owned(), remedy: String::new() });
        let ended = Ended { exit_code, error, ..Ended::default() };
        Row::new(name.into(), None, Some(found).filter(|_| exit_code == 0), ended)
    }

    #[test]
    fn rows_are_aligned_and_the_worst_code_is_that_of_all() {
        let mut out = Vec::new();
        let mut table = ResultTable::new(&mut out, false, false);
        table.add(&row("a.log", 0, None)).unwrap();
        table.add(&row("b\n.log", 1, Some("permission denied"))).unwrap();
        table.add(&row("c.log", 4, None)).unwrap();
        assert_eq!(table.finish().unwrap(), 1);
        let expected = "\
exit  car                         recording: what was found
   0  demo_vehicle                a.log: fits
   1  –                           b\\n.log: permission denied
   4  –                           c.log:

3 recordings: 1 with exit code 0, 1 with exit code 4, 1 with exit code 1
";
        assert_eq!(String::from_utf8(out).unwrap(), expected);
    }

    #[test]
    fn each_line_of_json_is_a_row() {
        let mut out = Vec::new();
        let mut table = ResultTable::new(&mut out, true, false);
        table.add(&row("a.log", 0, None)).unwrap();
        assert_eq!(table.finish().unwrap(), 0);
        let expected = r#"{"recording":"a.log","car":"demo_vehicle","found":"fits","exit_code":0,"error":null,"result":null}"#;
        assert_eq!(String::from_utf8(out).unwrap(), format!("{expected}\n"));
    }

    #[test]
    fn a_failure_is_worse_than_a_warning() {
        for (codes, worst) in [(vec![0, 4], 4), (vec![4, 5, 3, 0], 3), (vec![1, 2, 4], 1), (vec![0], 0)] {
            let mut table = ResultTable::new(io::sink(), true, false);
            for code in &codes {
                table.add(&row("a", *code, None)).unwrap();
            }
            assert_eq!(table.finish().unwrap(), worst, "{codes:?}");
        }
    }
}
