//! A measured value over time, as columns with its lowest and highest value, so that no peak is lost.

use crate::report::gateway_view::report_place;

/// Maximum number of columns of a curve; beyond it, neighbours are joined.
const MAX_COLUMNS: usize = 4_000;
/// Initial width of a column, seconds.
const FIRST_WIDTH_S: f64 = 0.01;

/// A measured value over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Key of the report with the value.
    pub report: &'static str,
    pub label: &'static str,
    /// Unit, including the space before it, if any.
    pub unit: &'static str,
    /// Columns in ascending order of time.
    pub columns: Vec<Column>,
    width_s: f64,
    is_interrupted: bool,
}

/// The values within a short time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Column {
    /// Time of the first value, seconds after the first frame.
    pub from_s: f64,
    /// Time of the last value, seconds after the first frame.
    pub to_s: f64,
    pub low: f64,
    pub high: f64,
    /// True if nothing was published before it.
    pub is_begin: bool,
}

impl Curve {
    pub fn new(report: &'static str, label: &'static str, unit: &'static str) -> Self {
        let (columns, width_s) = (Vec::new(), FIRST_WIDTH_S);
        Self { report, label, unit, columns, width_s, is_interrupted: true }
    }

    pub fn add(&mut self, at_s: f64, value: f64) {
        let is_begin = std::mem::replace(&mut self.is_interrupted, false);
        let column = Column { from_s: at_s, to_s: at_s, low: value, high: value, is_begin };
        let width_s = self.width_s;
        match self.columns.last_mut().filter(|last| same_column(last, &column, width_s)) {
            Some(last) => last.join(&column),
            None => self.columns.push(column),
        }
        while self.columns.len() > MAX_COLUMNS {
            self.width_s *= 2.0;
            let width_s = self.width_s;
            self.columns.dedup_by(|next, kept| {
                let is_same = same_column(kept, next, width_s);
                if is_same {
                    kept.join(next);
                }
                is_same
            });
        }
    }

    /// Records that nothing is published until the next value.
    pub fn interrupt(&mut self) {
        self.is_interrupted = true;
    }

    /// Returns the parts between interruptions, each with at least one column.
    pub fn parts(&self) -> impl Iterator<Item = &[Column]> {
        self.columns.chunk_by(|_, next| !next.is_begin)
    }

    /// Returns the lowest and highest value; both are infinite without a value.
    pub fn range(&self) -> (f64, f64) {
        let low = self.columns.iter().map(|column| column.low).fold(f64::INFINITY, f64::min);
        let high = self.columns.iter().map(|column| column.high).fold(f64::NEG_INFINITY, f64::max);
        (low, high)
    }

    /// Returns the heading of its section.
    pub fn section(&self) -> &'static str {
        report_place(self.report).map_or(self.report, |(_, title)| title)
    }

    /// Returns its name with the lowest and highest value.
    pub fn heading(&self) -> String {
        let (low, high) = self.range();
        format!("{}, {low:.2} to {high:.2}{}", self.label, self.unit)
    }
}

impl Column {
    fn join(&mut self, next: &Self) {
        self.to_s = next.to_s;
        (self.low, self.high) = (self.low.min(next.low), self.high.max(next.high));
    }
}

/// Returns true if two columns merge at this width. A shorter interruption is not visible.
fn same_column(one: &Column, next: &Column, width_s: f64) -> bool {
    (one.from_s / width_s).floor().total_cmp(&(next.from_s / width_s).floor()).is_eq()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peaks_and_interruptions_survive_a_long_drive() {
        let mut curve = Curve::new("velocity", "speed", " m/s");
        for step in 0_u32..200_000 {
            let value = if step == 77_777 { 50.0 } else { f64::from(step % 7) };
            curve.add(f64::from(step) * 0.02, value);
            if step == 100_000 {
                curve.interrupt();
            }
            if step == 100_001 {
                curve.add(3_000.0, -4.0);
            }
        }
        assert!(curve.columns.len() <= MAX_COLUMNS, "{}", curve.columns.len());
        assert!(curve.columns.len() > MAX_COLUMNS / 3, "{}", curve.columns.len());
        assert_eq!(curve.range(), (-4.0, 50.0));
    }

    #[test]
    fn an_interruption_begins_another_part() {
        let mut curve = Curve::new("velocity", "speed", " m/s");
        curve.add(0.0, 1.0);
        curve.add(1.0, 2.0);
        curve.interrupt();
        curve.add(3.0, 5.0);
        let lengths: Vec<_> = curve.parts().map(<[Column]>::len).collect();
        assert_eq!(lengths, [2, 1]);
        assert_eq!(curve.range(), (1.0, 5.0));
    }
}
