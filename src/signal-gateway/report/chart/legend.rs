//! The legend of a chart: a sample of each look that occurs in it.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

use super::command::{CommandKind, IndicatorState};
use super::look::{self, BASE_LINE, CurvePoint, LEFT_OUT, Look};
use super::svg::{Area, Element, text_at};
use super::text;
use crate::report::palette;
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

const SIZE_PX: f64 = 11.0;
/// A sample, pixels.
const SAMPLE: Area = Area { x: 0.0, y: 0.0, width: 26.0, height: 16.0 };
const LINE_PX: f64 = 22.0;

enum Sample {
    Look(Look),
    /// States too short to be distinguished.
    Dense,
    /// The corner that marks an omitted label.
    LeftOut,
}

/// Marks in the drawing that the legend explains if they occur.
pub(super) struct Marks {
    pub(super) is_dense: bool,
    pub(super) is_left_out: bool,
}

impl Sample {
    fn draw(&self, area: Area) -> Vec<Element> {
        match self {
            Self::Look(look) => look.draw(area),
            Self::Dense => look::dense(area, palette::PLAIN),
            Self::LeftOut => {
                let field = area.rect().fill(palette::PLAIN);
                [field].into_iter().chain(look::corner(area, palette::TEXT)).collect()
            }
        }
    }
}

/// Returns samples with their meanings for the looks that occur.
fn entries<'a>(looks: impl Iterator<Item = &'a Look>, marks: &Marks) -> Vec<(Sample, String)> {
    let mut bulbs = BulbSet::EMPTY;
    let (mut dark, mut several) = (false, false);
    let (mut commands, mut levels) = (BTreeSet::new(), BTreeSet::new());
    let mut others = BTreeMap::new();
    let side = |indicator, meaning| Some((Look::Lanelet(Some(indicator), String::new()), meaning));
    for look in looks {
        let other = match look {
            Look::Bulbs(set) => {
                dark |= set.is_empty();
                several |= set.len() > 1;
                bulbs = bulbs.union(*set);
                None
            }
            Look::Command(kind, indicator) => {
                commands.insert((*kind, *indicator));
                None
            }
            Look::Status(level, _) => {
                levels.insert(*level);
                None
            }
            Look::Value(indicator, _) => {
                commands.insert((CommandKind::Signal, *indicator));
                None
            }
            Look::Named(_) => Some((Look::Named(String::new()), "other state, by its name")),
            Look::Lanelet(Some(IndicatorState::Left), _) => {
                side(IndicatorState::Left, "lanelet that turns left")
            }
            Look::Lanelet(Some(IndicatorState::Right), _) => {
                side(IndicatorState::Right, "lanelet that turns right")
            }
            Look::Lanelet(..) => Some((Look::Lanelet(None, String::new()), "lanelet, by its id")),
            Look::Share(..) => Some((Look::Share(0.6, String::new()), "share of the highest value")),
            Look::Curve { .. } => {
                let points = [(0.0, 0.2), (0.4, 0.5), (0.6, 0.4), (1.0, 0.8)];
                let points = points.map(|(along, share)| CurvePoint { along, share }).to_vec();
                Some((Look::Curve { points, ticks: Vec::new(), text: String::new() }, "measured value"))
            }
        };
        others.extend(other.map(|(look, meaning)| (meaning, look)));
    }
    let sample = |bulb: Bulb| Look::Bulbs([bulb].into_iter().collect());
    let plain = |color, status| sample(Bulb { color, status, shape: BulbShape::Circle });
    let mut entries = Vec::new();
    for color in Color::ALL.into_iter().filter(|color| bulbs.iter().any(|bulb| bulb.color == *color)) {
        entries.push((plain(color, BulbStatus::SolidOn), color.name().to_owned()));
    }
    for status in [BulbStatus::Flashing, BulbStatus::SolidOff, BulbStatus::Unknown] {
        if let Some(bulb) = bulbs.iter().find(|bulb| bulb.status == status) {
            let meaning = if status == BulbStatus::Unknown { "status unknown" } else { status.name() };
            entries.push((plain(bulb.color, status), meaning.to_owned()));
        }
    }
    if several {
        let both = [Color::Green, Color::Red];
        let both = both.map(|color| Bulb { color, status: BulbStatus::SolidOn, shape: BulbShape::Circle });
        entries.push((Look::Bulbs(both.into_iter().collect()), "several bulbs".to_owned()));
    }
    if dark {
        entries.push((Look::Bulbs(BulbSet::EMPTY), "dark".to_owned()));
    }
    let levels = levels.into_iter().map(|level| (Look::Status(level, String::new()), level.to_string()));
    entries.extend(levels);
    let commands = commands.into_iter().map(|(kind, indicator)| Look::Command(kind, indicator));
    entries.extend(commands.map(|look| (look.clone(), look.description())));
    entries.extend(others.into_iter().map(|(meaning, look)| (look, meaning.to_owned())));
    let looks = entries.into_iter().map(|(look, meaning)| (Sample::Look(look), meaning));
    let dense = (marks.is_dense, Sample::Dense, "several states, too short to be told apart");
    let left_out =
        (marks.is_left_out, Sample::LeftOut, "corner: text left out, shown where it is pointed at");
    let marks = [dense, left_out].into_iter().filter(|(occurs, ..)| *occurs);
    looks.chain(marks.map(|(_, sample, meaning)| (sample, meaning.to_owned()))).collect()
}

/// Draws the entries from left to right, in as many lines as needed, and returns the height.
pub(super) fn draw<'a>(
    looks: impl Iterator<Item = &'a Look>,
    marks: &Marks,
    across: Range<f64>,
    top: f64,
) -> (Vec<Element>, f64) {
    let (mut x, mut y) = (across.start, top);
    let mut drawn = Vec::new();
    let entries = entries(looks, marks);
    for (sample, meaning) in &entries {
        let width = SAMPLE.width + 6.0 + text::width(meaning, SIZE_PX) + 16.0;
        if x + width > across.end && x > across.start {
            (x, y) = (across.start, y + LINE_PX);
        }
        // A label that does not fit into a sample is placed beside it.
        let shapes = sample.draw(Area { x, y, ..SAMPLE });
        let is_sample_of_corner = matches!(sample, Sample::LeftOut);
        drawn.extend(shapes.into_iter().filter(|shape| is_sample_of_corner || !shape.has_class(LEFT_OUT)));
        let base_line = y + SAMPLE.height / 2.0 + SIZE_PX * BASE_LINE;
        drawn.push(text_at(x + SAMPLE.width + 6.0, base_line, SIZE_PX, meaning).fill(palette::SOFT));
        x += width;
    }
    let height = if entries.is_empty() { 0.0 } else { y + LINE_PX - top };
    let legend = Element::new("g").with("class", "legend").children(drawn);
    (vec![legend], height)
}
