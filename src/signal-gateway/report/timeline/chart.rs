//! The timeline as a chart.

use super::{Curve, Group, MOTION, Span, Timeline, Tone};
use crate::report::chart::{self, Bar, Chart, CommandKind, CurvePoint, IndicatorState, Look, Note};
use gateway_base::diagnostics::Level;

impl Timeline {
    pub fn chart(&self) -> Chart {
        let curves: Vec<_> = self.curves.iter().map(curve_row).collect();
        let motion = chart::Lane { label: MOTION.to_owned(), rows: curves };
        let mut lanes: Vec<_> = (!motion.rows.is_empty()).then_some(motion).into_iter().collect();
        for lane in &self.lanes {
            let row = chart::Row {
                label: lane.label.clone(),
                bars: lane.spans.iter().filter_map(|span| bar(span, lane.group)).collect(),
            };
            let heading = lane.group.heading();
            match lanes.last_mut().filter(|last| last.label == heading) {
                Some(last) => last.rows.push(row),
                None => lanes.push(chart::Lane { label: heading.to_owned(), rows: vec![row] }),
            }
        }
        let (title, subtitle, to) = (self.title.clone(), self.subtitle.clone(), self.length_s);
        let note = Note { heading: "Left out".to_owned(), lines: self.remarks.clone() };
        let notes = (!note.lines.is_empty()).then_some(note).into_iter().collect();
        Chart { title, subtitle, to, lanes, notes, ..Chart::default() }
    }
}

impl Group {
    /// Returns the heading of its lanes.
    pub(super) const fn heading(self) -> &'static str {
        match self {
            Self::Raw => "raw values",
            Self::Reports => "reports",
            Self::Commands => "commands",
            Self::Diagnostics => "diagnostics",
            Self::TrafficLights => "traffic lights",
            Self::Links => "buses",
        }
    }
}

/// Returns the row of a curve, with a bar for each of its parts.
fn curve_row(curve: &Curve) -> chart::Row {
    let (low, high) = curve.range();
    let size = if high > low { high - low } else { 1.0 };
    let share = |value: f64| (value - low) / size;
    let unit = curve.unit;
    let bars = curve.parts().map(|part| {
        let (from, to) = (part[0].from_s, part[part.len() - 1].to_s);
        let along = |at_s: f64| if to > from { (at_s - from) / (to - from) } else { 0.0 };
        let point = |at_s, value| CurvePoint { along: along(at_s), share: share(value) };
        let points = part
            .iter()
            .flat_map(|column| [point(column.from_s, column.low), point(column.to_s, column.high)]);
        let lowest = part.iter().map(|column| column.low).fold(f64::INFINITY, f64::min);
        let highest = part.iter().map(|column| column.high).fold(f64::NEG_INFINITY, f64::max);
        let text = format!("{lowest:.2}{unit} to {highest:.2}{unit}");
        Bar { from, to, look: Look::Curve { points: points.collect(), zero: share(0.0), text } }
    });
    chart::Row { label: format!("{}, {low:.1} to {high:.1}{unit}", curve.label), bars: bars.collect() }
}

/// Returns the bar of a span; `None` if nothing is published.
fn bar(span: &Span, group: Group) -> Option<Bar> {
    let is_signal = matches!(group, Group::Reports | Group::Commands);
    let text = || span.text.clone();
    let lights = |state| {
        if is_signal { Look::Command(CommandKind::Signal, state) } else { Look::Value(state, text()) }
    };
    let look = match span.tone {
        Tone::Nothing if is_signal => return None,
        Tone::Left => lights(IndicatorState::Left),
        Tone::Right => lights(IndicatorState::Right),
        Tone::Hazard => lights(IndicatorState::Hazard),
        Tone::Off if is_signal => lights(IndicatorState::Off),
        Tone::Ok => Look::Status(Level::Ok, text()),
        Tone::Warn => Look::Status(Level::Warn, text()),
        Tone::Error => Look::Status(Level::Error, text()),
        Tone::Off | Tone::Nothing | Tone::Plain | Tone::Folded => Look::Named(text()),
    };
    Some(Bar { from: span.from_s, to: span.to_s, look })
}
