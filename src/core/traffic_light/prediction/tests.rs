//! Which states are announced, and when they are one.

use super::*;
use crate::core::traffic_light::bulb::{Color, Shape, Status};

fn bulb(color: Color) -> Bulb {
    Bulb { color, status: Status::SolidOn, shape: Shape::Circle }
}

#[test]
fn what_begins_within_ten_milliseconds_begins_at_once() {
    let at = |millis: i64| WallStamp::from_nanos(millis * 1_000_000);
    let mut list = Vec::new();
    for (millis, color) in [(100, Color::Red), (110, Color::Green), (120, Color::Yellow), (95, Color::Red)] {
        add(&mut list, at(millis), [bulb(color)]);
    }
    let times: Vec<_> = list.iter().map(|predicted| (predicted.at, predicted.bulbs.len())).collect();
    assert_eq!(times, [(at(100), 3), (at(120), 1)], "of the first one near it");
}
