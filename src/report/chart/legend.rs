//! What the looks of a picture mean: those that occur in it, each with a sample.

use super::bar::{Look, Place};
use super::ink;
use super::svg::{Element, words};
use super::text;
use crate::core::traffic_light::bulb::{Bulb, BulbSet, Color, Shape, Status};

const SIZE_PX: f64 = 11.0;
const SAMPLE_PX: f64 = 26.0;
const LINE_PX: f64 = 22.0;

/// Samples with their meaning, for what occurs among these looks.
pub(super) fn entries<'a>(looks: impl Iterator<Item = &'a Look>) -> Vec<(Look, String)> {
    let mut bulbs = BulbSet::EMPTY;
    let (mut dark, mut several) = (false, false);
    for look in looks {
        match look {
            Look::Bulbs(set) => {
                dark |= set.is_empty();
                several |= set.len() > 1;
                bulbs = bulbs.union(*set);
            }
            Look::Named(_) => {}
        }
    }
    let sample = |bulb: Bulb| Look::Bulbs([bulb].into_iter().collect());
    let plain = |color, status| sample(Bulb { color, status, shape: Shape::Circle });
    let mut entries = Vec::new();
    for color in Color::ALL.into_iter().filter(|color| bulbs.iter().any(|bulb| bulb.color == *color)) {
        entries.push((plain(color, Status::SolidOn), color.name().to_owned()));
    }
    for status in [Status::Flashing, Status::SolidOff, Status::Unknown] {
        if let Some(bulb) = bulbs.iter().find(|bulb| bulb.status == status) {
            let meaning = if status == Status::Unknown { "status unknown" } else { status.name() };
            entries.push((plain(bulb.color, status), meaning.to_owned()));
        }
    }
    if several {
        let both = [Color::Green, Color::Red];
        let both = both.map(|color| Bulb { color, status: Status::SolidOn, shape: Shape::Circle });
        entries.push((Look::Bulbs(both.into_iter().collect()), "several bulbs".to_owned()));
    }
    if dark {
        entries.push((Look::Bulbs(BulbSet::EMPTY), "dark".to_owned()));
    }
    entries
}

/// Draws the entries from left to right, in as many lines as needed; returns the height as well.
pub(super) fn draw(entries: &[(Look, String)], left: f64, right: f64, top: f64) -> (Vec<Element>, f64) {
    let (mut x, mut y) = (left, top);
    let mut drawn = Vec::new();
    for (look, meaning) in entries {
        let width = SAMPLE_PX + 6.0 + text::width(meaning, SIZE_PX) + 16.0;
        if x + width > right && x > left {
            (x, y) = (left, y + LINE_PX);
        }
        drawn.extend(look.draw(Place { x, y, width: SAMPLE_PX, height: 16.0 }));
        let label = words(x + SAMPLE_PX + 6.0, y + 8.0 + SIZE_PX * 0.36, SIZE_PX, meaning);
        drawn.push(label.with("fill", ink::SOFT));
        x += width;
    }
    let height = if entries.is_empty() { 0.0 } else { y + LINE_PX - top };
    (drawn, height)
}
