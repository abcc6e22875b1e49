//! `MovementPhaseState` of SAE J2735 and ETSI TS 103 301 as bulbs
//! (docs/spec/traffic-lights.md, "V2X unit on CAN").

use can_signal::validation::meaning::Meaning;
use traffic_lights::bulb::{Bulb, BulbSet, BulbShape, BulbStatus, Color};

/// Returns the numbers 0 to 9 of the standard, with their bulbs. `protected` is the shape of green, arrow or
/// circle, for a movement without conflicting traffic: the number itself has no direction. Only green is ever
/// an arrow, since Autoware before April 2026 treats an arrow of any colour as permission to pass.
pub fn movement_phase_states(protected: BulbShape) -> [(i128, Meaning<BulbSet>); 10] {
    let one = |color, status, shape| {
        let bulb = Bulb { color, status, shape };
        Meaning::Defined([bulb].into_iter().collect())
    };
    let lit = |color, shape| one(color, BulbStatus::SolidOn, shape);
    let circle = BulbShape::Circle;
    [
        (0, Meaning::NotAvailable),
        // Dark: the colour of an unlit lamp is not sent.
        (1, one(Color::Unknown, BulbStatus::SolidOff, circle)),
        (2, one(Color::Red, BulbStatus::Flashing, circle)),
        (3, lit(Color::Red, circle)),
        // The arbiter would reduce red and yellow together to one of them.
        (4, lit(Color::Red, circle)),
        (5, lit(Color::Green, circle)),
        (6, lit(Color::Green, protected)),
        (7, lit(Color::Yellow, circle)),
        (8, lit(Color::Yellow, circle)),
        (9, one(Color::Yellow, BulbStatus::Flashing, circle)),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_the_standard_has_its_state() {
        let text = |meaning| match meaning {
            Meaning::Defined(bulbs) => BulbSet::to_string(&bulbs),
            Meaning::NotAvailable => "not available".to_owned(),
            Meaning::Fault | Meaning::Undefined => panic!("the standard names it"),
        };
        #[rustfmt::skip]
        let expected = [
            "not available", "unknown solidOff circle", "red flashing circle", "red solidOn circle",
            "red solidOn circle", "green solidOn circle", "green solidOn left", "yellow solidOn circle",
            "yellow solidOn circle", "yellow flashing circle",
        ];
        for ((number, meaning), expected) in movement_phase_states(BulbShape::Left).into_iter().zip(expected)
        {
            assert_eq!(text(meaning), expected, "{number}");
        }
        let [.., (six, green), _, _, _] = movement_phase_states(BulbShape::Circle);
        assert_eq!((six, text(green)), (6, "green solidOn circle".to_owned()));
    }
}
