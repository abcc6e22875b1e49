//! States over time as CSV: a row for each change, or rows at a rate.
//!
//! The first row is the beginning, the last one the end. A cell is empty while nothing is known.

use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, Write};
use std::time::Duration;

use serde::Serialize;

use super::output_budget::OutputBudget;
use super::text::counted;
use gateway_base::time::{MonoTime, Now, WallStamp};

/// Names of the columns before the states: virtual time, and the recording's clock.
const TIME_COLUMNS: [&str; 2] = ["time_s", "unix_time_s"];

/// Value of a column at one time.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Cell {
    /// Nothing is known, or it is withheld.
    #[default]
    Unknown,
    /// A number in the unit of the column.
    Number(f64),
    /// A state in words.
    Word(String),
}

impl Cell {
    /// Returns a state whose name is that of a constant, such as `AUTONOMOUS_STEER_ONLY`.
    pub fn word(name: &str) -> Self {
        Self::Word(name.to_lowercase().replace('_', " "))
    }
}

/// Numbers have at most 9 decimals and no exponent.
impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => Ok(()),
            Self::Number(number) => {
                let text = format!("{number:.9}");
                let text = text.trim_end_matches('0').trim_end_matches('.');
                f.write_str(if text == "-0" { "0" } else { text })
            }
            Self::Word(word) => f.write_str(word),
        }
    }
}

/// Returns a name for a column, with its unit in brackets if there is one. Spreadsheets, data frames and
/// plotters take it as it is: it has no comma, quote or slash, and is ASCII.
pub fn column_name(name: &str, unit: &str) -> String {
    let unit = unit.trim().replace('/', " per ").replace(['°', 'º'], "deg").replace(['µ', 'μ'], "u");
    let unit = unit.replace('²', "^2").replace('³', "^3").replace('Ω', "ohm");
    let plain = |text: &str| -> String {
        let is_plain = |char: char| char.is_ascii_alphanumeric() || " ._-:%^*()".contains(char);
        text.chars().map(|char| if is_plain(char) { char } else { '_' }).collect()
    };
    if unit.is_empty() { plain(name) } else { format!("{} [{}]", plain(name), plain(&unit)) }
}

/// When a row is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rows {
    /// At every change.
    Changes,
    /// So many times a second, from the beginning on.
    Rate(f64),
}

/// Writes a table while its states change.
pub struct Table<W: Write> {
    writer: csv::Writer<W>,
    rows: Rows,
    columns: Vec<Column>,
    /// Virtual time with the recording's clock at that time.
    clock: Now,
    /// Time of the first row and time of the present states; `None` before the first.
    span: Option<Span>,
    /// True if a state has changed since the last row.
    is_changed: bool,
    written: u64,
    budget: OutputBudget,
}

#[derive(Debug, Clone, Copy)]
struct Span {
    start: MonoTime,
    now: MonoTime,
    last_row: Option<MonoTime>,
}

#[derive(Debug, Default)]
struct Column {
    name: String,
    cell: Cell,
    text: String,
    since: MonoTime,
    known: Duration,
}

/// Size of a table, and for how long each of its states was known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TableSummary {
    /// Number of rows without the header.
    pub rows: u64,
    /// Time from the first to the last row.
    pub seconds: f64,
    /// Time for which each column was not empty, seconds.
    pub known_s: BTreeMap<String, f64>,
}

impl<W: Write> Table<W> {
    /// Creates a table and writes its header. Fails if `out` does.
    pub fn new(out: W, columns: Vec<String>, rows: Rows) -> io::Result<Self> {
        let mut writer = csv::Writer::from_writer(out);
        let header = TIME_COLUMNS.into_iter().chain(columns.iter().map(String::as_str));
        writer.write_record(header)?;
        let column = |name| Column { name, ..Column::default() };
        Ok(Self {
            writer,
            rows,
            columns: columns.into_iter().map(column).collect(),
            clock: Now { mono: MonoTime::ZERO, wall: WallStamp::default() },
            span: None,
            is_changed: false,
            written: 0,
            budget: OutputBudget::default(),
        })
    }

    /// Counts an entry of the recording, in proportion to which the table may grow.
    pub fn entry(&mut self) {
        self.budget.entry();
    }

    /// Sets the recording's clock at a virtual time.
    pub fn set_clock(&mut self, clock: Now) {
        self.clock = clock;
    }

    /// Writes the rows that are due before `now`. Later states hold from `now` on. Fails if the output does.
    pub fn advance(&mut self, now: MonoTime) -> io::Result<()> {
        let Some(span) = self.span else {
            self.span = Some(Span { start: now, now, last_row: None });
            self.is_changed = true;
            return Ok(());
        };
        if now <= span.now {
            return Ok(());
        }
        self.write_until(now, false)?;
        self.span = self.span.map(|span| Span { now, ..span });
        Ok(())
    }

    /// Sets the state of a column, by its position, from the present time on.
    pub fn set(&mut self, column: usize, cell: Cell) {
        let now = self.span.map_or(MonoTime::ZERO, |span| span.now);
        let Some(column) = self.columns.get_mut(column).filter(|column| column.cell != cell) else { return };
        column.pass(now);
        column.text = cell.to_string();
        column.cell = cell;
        self.is_changed = true;
    }

    /// Writes the last rows, and returns the size of the table. Fails if the output does, or if the table was
    /// out of proportion to the recording.
    pub fn finish(mut self, end: MonoTime) -> io::Result<TableSummary> {
        self.advance(end)?;
        let end = self.span.map_or(end, |span| span.now);
        self.is_changed |= self.span.is_some_and(|span| span.last_row != Some(end));
        self.write_until(end, true)?;
        self.writer.flush()?;
        self.budget.outcome()?;
        let known = |mut column: Column| {
            column.pass(end);
            (column.name, column.known.as_secs_f64())
        };
        let start = self.span.map_or(end, |span| span.start);
        Ok(TableSummary {
            rows: self.written,
            seconds: end.since(start).as_secs_f64(),
            known_s: self.columns.into_iter().map(known).collect(),
        })
    }

    /// Writes the rows of the present states that are due before `limit`, or until then.
    fn write_until(&mut self, limit: MonoTime, is_included: bool) -> io::Result<()> {
        let Some(span) = self.span else { return Ok(()) };
        let Rows::Rate(hz) = self.rows else {
            if std::mem::take(&mut self.is_changed) {
                self.write(span.now)?;
            }
            return Ok(());
        };
        loop {
            #[allow(clippy::cast_precision_loss)] // exact for more rows than a disk holds
            let at =
                span.start.after(Duration::try_from_secs_f64(self.written as f64 / hz).unwrap_or_default());
            if at > limit || at == limit && !is_included || !self.write(at)? {
                return Ok(());
            }
        }
    }

    /// Writes a row unless the table is too large; returns false then.
    fn write(&mut self, at: MonoTime) -> io::Result<bool> {
        let since_start = |at: MonoTime| i128::from(at.as_nanos());
        let offset = since_start(at) - since_start(self.clock.mono);
        let times = [since_start(at), i128::from(self.clock.wall.as_nanos()) + offset].map(seconds_text);
        let length: usize = self.columns.iter().map(|column| column.text.len() + 1).sum();
        let length = length + times.iter().map(|time| time.len() + 1).sum::<usize>();
        if !self.budget.take(length, at) {
            return Ok(false);
        }
        let cells = times.iter().chain(self.columns.iter().map(|column| &column.text));
        self.writer.write_record(cells)?;
        self.written += 1;
        self.span = self.span.map(|span| Span { last_row: Some(at), ..span });
        Ok(true)
    }
}

impl Column {
    /// Adds the time since the last change to the time for which the state was known.
    fn pass(&mut self, now: MonoTime) {
        if self.cell != Cell::Unknown {
            self.known += now.since(self.since);
        }
        self.since = now;
    }
}

/// Formats nanoseconds as seconds, exactly.
fn seconds_text(nanos: i128) -> String {
    let (sign, size) = (if nanos < 0 { "-" } else { "" }, nanos.unsigned_abs());
    format!("{sign}{}.{:09}", size / 1_000_000_000, size % 1_000_000_000)
}

impl TableSummary {
    /// Returns the size in words, then for each column the time for which it was known.
    pub fn text(&self) -> String {
        let mut text = format!("{} in {:.3} s", counted(self.rows, "row"), self.seconds);
        for (name, known_s) in &self.known_s {
            text += &format!("\n  {name}: known for {known_s:.3} s{}", self.share_text(*known_s));
        }
        text
    }

    fn share_text(&self, known_s: f64) -> String {
        let percent = known_s / self.seconds * 100.0;
        if percent.is_finite() { format!(" ({percent:.0} %)") } else { String::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: &str = "left";

    fn at(millis: u64) -> MonoTime {
        MonoTime::from_millis(millis)
    }

    /// A state that is known from 10 ms on, changes twice at 20 ms, and is withheld at 50 ms.
    fn written(rows: Rows) -> (String, TableSummary) {
        let mut out = Vec::new();
        let columns = vec![column_name("speed", "km/h"), "turn".to_owned()];
        let mut table = Table::new(&mut out, columns, rows).unwrap();
        table.set_clock(Now { mono: at(0), wall: WallStamp::from_nanos(1_700_000_000_000_000_000) });
        table.advance(at(0)).unwrap();
        table.advance(at(10)).unwrap();
        table.set(0, Cell::Number(2.5));
        table.advance(at(20)).unwrap();
        table.set(0, Cell::Number(0.1 + 0.2));
        table.set(1, Cell::Word(LEFT.to_owned()));
        table.advance(at(30)).unwrap();
        table.set(1, Cell::Word(LEFT.to_owned()));
        table.advance(at(50)).unwrap();
        table.set(0, Cell::Unknown);
        let summary = table.finish(at(60)).unwrap();
        (String::from_utf8(out).unwrap(), summary)
    }

    #[test]
    fn a_change_is_one_row_and_what_is_withheld_is_empty() {
        let (text, summary) = written(Rows::Changes);
        let expected = "\
time_s,unix_time_s,speed [km per h],turn
0.000000000,1700000000.000000000,,
0.010000000,1700000000.010000000,2.5,
0.020000000,1700000000.020000000,0.3,left
0.050000000,1700000000.050000000,,left
0.060000000,1700000000.060000000,,left
";
        assert_eq!(text, expected);
        assert_eq!((summary.rows, summary.seconds), (5, 0.06));
        assert!((summary.known_s["speed [km per h]"] - 0.04).abs() < 1e-9);
        let expected = "5 rows in 0.060 s\n  speed [km per h]: known for 0.040 s (67 %)\n  turn: known for 0.040 s (67 %)";
        assert_eq!(summary.text(), expected);
    }

    #[test]
    fn rows_at_a_rate_have_the_state_of_their_time() {
        let (text, summary) = written(Rows::Rate(50.0));
        let rows: Vec<_> = text.lines().skip(1).map(|row| row.replace(",170000000", ",")).collect();
        assert_eq!(
            rows,
            [
                "0.000000000,0.000000000,,",
                "0.020000000,0.020000000,0.3,left",
                "0.040000000,0.040000000,0.3,left",
                "0.060000000,0.060000000,,left"
            ]
        );
        assert_eq!(summary.rows, 4);
    }

    #[test]
    fn names_and_numbers_load_in_other_tools() {
        for (name, unit, expected) in [
            ("SPEED.ENCODER", "km/h", "SPEED.ENCODER [km per h]"),
            ("A.B", "°/s²", "A.B [deg per s^2]"),
            ("a:A.B", "", "a:A.B"),
            ("=A,\"B\"", "°C", "_A__B_ [degC]"),
        ] {
            assert_eq!(column_name(name, unit), expected);
        }
        for (number, expected) in
            [(-0.0, "0"), (-1e-12, "0"), (1e-7, "0.0000001"), (100.0, "100"), (-2.5, "-2.5")]
        {
            assert_eq!(Cell::Number(number).to_string(), expected);
        }
        assert_eq!(Cell::word("AUTONOMOUS_STEER_ONLY").to_string(), "autonomous steer only");
    }

    #[test]
    fn a_table_ends_where_it_is_out_of_proportion_to_the_recording() {
        let mut table = Table::new(io::sink(), vec!["turn".to_owned()], Rows::Rate(1000.0)).unwrap();
        table.advance(at(0)).unwrap();
        let ended = table.finish(at(1_000_000_000)).unwrap_err().to_string();
        assert!(ended.starts_with("it ends at "), "{ended}");
    }
}
