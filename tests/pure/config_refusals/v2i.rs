//! Traffic-light states over CAN that are accepted.

use crate::pure::config_refusals::{load_texts, sound, with};

/// One group with a signal of its own.
const ONE: &str = r#"[message.SPAT]
timeout_ms = 500
[[v2i]]
id = -7
signal = "SPAT.STATE"
states = { "red, green right" = [1] }
"#;

/// A message of many groups.
const MANY: &str = r#"[message.SPAT]
timeout_ms = 500
[[v2i]]
signal = "SPAT.STATE"
states = "movement_phase_state"
intersection = "SPAT.PLACE"
group = "SPAT.GROUP"
group_timeout_ms = 900
groups = [{ intersection = 1, group = 2, id = 7, arrow = "left" }]
"#;

#[test]
fn both_forms_are_accepted() {
    for form in [ONE, MANY] {
        let settings = with("car.toml", form).settings();
        assert_eq!(settings.gateway.v2i.sources.len(), 1);
    }
}

#[test]
fn a_profile_may_leave_the_lights_out_beside_v2i() {
    let profile = format!("name = \"Car\"\nbus.body.dbc = \"car.dbc\"\n{ONE}");
    let settings = load_texts(&sound().with("car.toml", profile)).unwrap();
    assert!(settings.gateway.lights.table.messages.is_empty());
    assert_eq!(settings.gateway.v2i.table.messages.len(), 1);
}
