//! The timeline as a chart.

use super::{Curve, Group, Span, Timeline, Tone};
use crate::report::chart::{self, Bar, Chart, CommandKind, CurvePoint, IndicatorState, Look, Note};
use gateway_base::diagnostics::Level;

impl Timeline {
    pub fn chart(&self) -> Chart {
        let mut lanes: Vec<chart::Lane> = Vec::new();
        let mut add = |heading: &str, row| match lanes.iter_mut().find(|lane| lane.label == heading) {
            Some(lane) => lane.rows.push(row),
            None => lanes.push(chart::Lane { label: heading.to_owned(), rows: vec![row] }),
        };
        for curve in &self.curves {
            add(curve.section(), curve_row(curve));
        }
        for lane in self.lanes.iter().filter(|lane| !lane.is_constant()) {
            let bars = lane.spans.iter().filter_map(|span| bar(span, lane.group)).collect();
            add(lane.section().2, chart::Row { label: lane.name().to_owned(), bars });
        }
        let (title, subtitle, to) = (self.title.clone(), self.subtitle.clone(), self.length_s);
        let note = Note {
            heading: "Left out".to_owned(),
            lines: self.remarks.iter().cloned().chain(self.constants()).collect(),
        };
        let notes = (!note.lines.is_empty()).then_some(note).into_iter().collect();
        Chart { title, subtitle, to, lanes, notes, ..Chart::default() }
    }
}

/// Returns the row of a curve, with a bar for each of its parts. The first has the numbers of the axis.
fn curve_row(curve: &Curve) -> chart::Row {
    let (low, high) = curve.range();
    let ticks = chart::value_ticks(low, high, curve.unit);
    let ends = |end: Option<&(f64, String)>| end.map_or(0.0, |(value, _)| *value);
    let (bottom, top) = (ends(ticks.first()), ends(ticks.last()));
    let share = |value: f64| (value - bottom) / (top - bottom);
    let unit = curve.unit;
    let bars = curve.parts().enumerate().map(|(index, part)| {
        let (from, to) = (part[0].from_s, part[part.len() - 1].to_s);
        let along = |at_s: f64| if to > from { (at_s - from) / (to - from) } else { 0.0 };
        let point = |at_s, value| CurvePoint { along: along(at_s), share: share(value) };
        let points = part
            .iter()
            .flat_map(|column| [point(column.from_s, column.low), point(column.to_s, column.high)]);
        let lowest = part.iter().map(|column| column.low).fold(f64::INFINITY, f64::min);
        let highest = part.iter().map(|column| column.high).fold(f64::NEG_INFINITY, f64::max);
        let text = format!("{lowest:.2}{unit} to {highest:.2}{unit}");
        let tick = |(value, text): &(f64, String)| {
            (share(*value), if index == 0 { text.clone() } else { String::new() })
        };
        let ticks = ticks.iter().map(tick).collect();
        Bar { from, to, look: Look::Curve { points: points.collect(), ticks, text } }
    });
    chart::Row { label: curve.heading(), bars: bars.collect() }
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
