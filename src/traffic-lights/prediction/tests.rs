//! Predictions at almost the same time.

use super::*;
use crate::bulb::{BulbShape, BulbStatus, Color};

fn bulb(color: Color) -> Bulb {
    Bulb { color, status: BulbStatus::SolidOn, shape: BulbShape::Circle }
}

#[test]
fn predictions_within_ten_milliseconds_are_one() {
    let at = |millis: i64| WallStamp::from_nanos(millis * 1_000_000);
    let mut list = Vec::new();
    for (millis, color) in [(100, Color::Red), (110, Color::Green), (120, Color::Yellow), (95, Color::Red)] {
        add(&mut list, at(millis), [bulb(color)]);
    }
    let times: Vec<_> = list.iter().map(|predicted| (predicted.at, predicted.bulbs.len())).collect();
    assert_eq!(times, [(at(100), 3), (at(120), 1)], "at the time of the first one");
}
