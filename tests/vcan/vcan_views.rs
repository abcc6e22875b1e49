//! Views on a terminal, which tmux plays, of what is on a bus.

use crate::support::prerequisite::require;
use crate::support::process::Folder;
use crate::support::tmux::Tmux;
use crate::support::vcan::Vcan;

const GATEWAY: &str = env!("CARGO_BIN_EXE_signal-gateway");

#[test]
fn table_of_messages_follows_the_bus_and_finds_one_by_its_name() {
    let vcan = require!(Vcan::new("vcan40"));
    let folder = Folder::with_demo_vehicle("vcan40", "");
    let config = folder.path().join("gateway.toml");
    let tmux = require!(Tmux::run(&format!("{GATEWAY} decode --live -c {}", config.display())));
    tmux.wait_for(|screen| screen.contains("link up"));
    vcan.send(0x2A5, [0; 8]);
    vcan.send(0x5EE, [0xAB; 8]);
    let both = tmux.wait_for(|screen| screen.contains("2A5 ") && screen.contains("AB AB AB"));
    assert!(both.contains("TurnIndicatorState = 0 turn") && both.contains("5EE "), "{both}");
    vcan.send(0x2A5, [0, 0, 2, 0, 0, 0, 0, 0]);
    tmux.wait_for(|screen| screen.contains("TurnIndicatorState = 1 turn"));
    for key in ["/", "t", "u", "r", "n", "Enter"] {
        tmux.press(key);
    }
    let one = tmux.wait_for(|screen| screen.contains("1 of 2 ids"));
    assert!(one.contains("2A5 ") && !one.contains("AB AB"), "{one}");
    vcan.bring_down();
    tmux.wait_for(|screen| screen.contains("link down") && screen.contains("vcan40 is down"));
    tmux.press("q");
    assert!(tmux.wait_for_end().contains("code 0"));
}

#[test]
fn keys_move_the_stalk_and_the_button_of_a_simulated_vehicle() {
    let vcan = require!(Vcan::new("vcan41"));
    let vehicle = format!("{GATEWAY} vehicle --profile demo_vehicle --interface vcan41");
    let tmux = require!(Tmux::run(&vehicle));
    tmux.wait_for(|screen| screen.contains("simulated") && screen.contains("← → stalk"));
    for (key, shown, absent) in [
        ("Right", "right (driver)", "hazard lights on"),
        ("o", "off", "right (driver)"),
        ("Left", "left (driver)", "turning right"),
        ("h", "hazard lights on", "turning left"),
        ("h", "left (driver)", "hazard lights on"),
    ] {
        tmux.press(key);
        // The log below the picture keeps what was.
        let is_shown = |picture: &str| picture.contains(shown) && !picture.contains(absent);
        tmux.wait_for(|screen| screen.split(" log ").next().is_some_and(is_shown));
    }
    tmux.press("?");
    tmux.wait_for(|screen| screen.contains("left bulb broken"));
    tmux.press("?");
    vcan.bring_down();
    tmux.wait_for(|screen| screen.contains("0/s") && screen.contains("cannot send"));
    tmux.press("q");
    assert!(tmux.wait_for_end().contains("code 0"));
}
