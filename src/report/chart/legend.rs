//! The legend of a chart: the looks that occur in it, each with a sample.

use std::collections::BTreeSet;

use super::look::{BASE_LINE, Look};
use super::svg::{Area, Element, text_at};
use super::{ink, text};
use crate::core::traffic_light::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

const SIZE_PX: f64 = 11.0;
/// Width and height of a sample.
const SAMPLE_PX: (f64, f64) = (26.0, 16.0);
const LINE_PX: f64 = 22.0;

/// Samples with their meaning, for what occurs among these looks.
fn entries<'a>(looks: impl Iterator<Item = &'a Look>) -> Vec<(Look, String)> {
    let mut bulbs = BulbSet::EMPTY;
    let (mut dark, mut several) = (false, false);
    let (mut commands, mut levels) = (BTreeSet::new(), BTreeSet::new());
    for look in looks {
        match look {
            Look::Bulbs(set) => {
                dark |= set.is_empty();
                several |= set.len() > 1;
                bulbs = bulbs.union(*set);
            }
            Look::Command(kind, indicator) => drop(commands.insert((*kind, *indicator))),
            Look::Named(_) | Look::Lanelet(..) | Look::Share(..) | Look::Curve { .. } => {}
            Look::Status(level, _) => drop(levels.insert(*level)),
        }
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
    entries
}

/// Draws the entries from left to right, in as many lines as needed; returns the height as well.
pub(super) fn draw<'a>(
    looks: impl Iterator<Item = &'a Look>,
    (left, right): (f64, f64),
    top: f64,
) -> (Vec<Element>, f64) {
    let (sample_px, height) = SAMPLE_PX;
    let (mut x, mut y) = (left, top);
    let mut drawn = Vec::new();
    let entries = entries(looks);
    for (look, meaning) in &entries {
        let width = sample_px + 6.0 + text::width(meaning, SIZE_PX) + 16.0;
        if x + width > right && x > left {
            (x, y) = (left, y + LINE_PX);
        }
        drawn.extend(look.draw(Area { x, y, width: sample_px, height }));
        let base_line = y + height / 2.0 + SIZE_PX * BASE_LINE;
        drawn.push(text_at(x + sample_px + 6.0, base_line, SIZE_PX, meaning).with("fill", ink::SOFT));
        x += width;
    }
    let height = if entries.is_empty() { 0.0 } else { y + LINE_PX - top };
    (drawn, height)
}
