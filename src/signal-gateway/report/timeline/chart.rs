//! The timeline as a chart.

use super::{Curve, Group, MOTION, Span, Timeline, Tone};
use crate::report::chart::{self, Along, Bar, Chart, CommandKind, IndicatorState, Look, Note};
use gateway_base::diagnostics::Level;

impl Timeline {
    /// Returns the timeline as a chart.
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
        let note = Note { heading: "Left out".to_owned(), lines: self.remarks.clone() };
        Chart {
            title: self.title.clone(),
            subtitle: self.subtitle.clone(),
            along: Along::Time,
            from: 0.0,
            to: self.length_s,
            lanes,
            marks: Vec::new(),
            plan: None,
            notes: (!self.remarks.is_empty()).then_some(note).into_iter().collect(),
        }
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
        let points = part.iter().flat_map(|column| {
            [(along(column.from_s), share(column.low)), (along(column.to_s), share(column.high))]
        });
        let lowest = part.iter().map(|column| column.low).fold(f64::INFINITY, f64::min);
        let highest = part.iter().map(|column| column.high).fold(f64::NEG_INFINITY, f64::max);
        let text = format!("{lowest:.2}{unit} to {highest:.2}{unit}");
        Bar { from, to, look: Look::Curve { points: points.collect(), zero: share(0.0), text } }
    });
    chart::Row { label: format!("{}, {low:.1} to {high:.1}{unit}", curve.label), bars: bars.collect() }
}

/// Returns the bar of a span; `None` if nothing is published.
fn bar(span: &Span, group: Group) -> Option<Bar> {
    let signal = |indicator| Look::Command(CommandKind::Signal, indicator);
    let look = match (span.tone, group) {
        (Tone::Nothing, Group::Reports | Group::Commands) => return None,
        (Tone::Left, Group::Reports | Group::Commands) => signal(IndicatorState::Left),
        (Tone::Right, Group::Reports | Group::Commands) => signal(IndicatorState::Right),
        (Tone::Hazard, Group::Reports | Group::Commands) => signal(IndicatorState::Hazard),
        (Tone::Off, Group::Reports | Group::Commands) => signal(IndicatorState::Off),
        (Tone::Ok, _) => Look::Status(Level::Ok, span.text.clone()),
        (Tone::Warn, _) => Look::Status(Level::Warn, span.text.clone()),
        (Tone::Error, _) => Look::Status(Level::Error, span.text.clone()),
        (Tone::Left, _) => Look::Value(IndicatorState::Left, span.text.clone()),
        (Tone::Right, _) => Look::Value(IndicatorState::Right, span.text.clone()),
        (Tone::Hazard, _) => Look::Value(IndicatorState::Hazard, span.text.clone()),
        (Tone::Off | Tone::Nothing | Tone::Plain | Tone::Folded, _) => Look::Named(span.text.clone()),
    };
    Some(Bar { from: span.from_s, to: span.to_s, look })
}
