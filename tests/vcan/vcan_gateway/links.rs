//! What becomes of the interface, and what the daemon makes of it: the same process all the time.

use super::{
    Bench, ENABLE_LEFT, ENABLE_RIGHT, HAZARD, HAZARD_OFF, LEFT, Process, RIGHT, Reader, Sender, TURN,
};
use crate::support::json_process::Mark;
use crate::support::prerequisite::require;

/// Something done to an interface.
type Change<'a> = &'a dyn Fn();

/// Reports stop, and everything names the interface.
fn expect_unknown(reader: &Reader, mark: Mark, text: &str) {
    for task in ["turn_indicators", "hazard_lights"] {
        reader.status(mark, task, 2, &format!("unknown: {text}"));
    }
    let interface = text.split(' ').next().unwrap();
    reader.status(mark, interface, 2, text);
    reader.expect_silence(&["turn", "hazard"]);
}

/// Reports come again, and nothing is wrong any more.
fn expect_normal(reader: &Reader, mark: Mark, interface: &str, report: u8) {
    reader.report(mark, "turn", report);
    for task in ["turn_indicators", "hazard_lights"] {
        reader.status(mark, task, 0, "publishing");
    }
    reader.status(mark, interface, 0, "receiving");
}

#[test]
fn an_interface_that_goes_down_or_away_is_named_and_taken_up_again_when_it_is_back() {
    let bench = require!(Bench::new("vcan5", ""));
    let vcan = &bench.vcan;
    let sender = Sender::start(vcan, &[(TURN, LEFT), (HAZARD, HAZARD_OFF)]);
    let (reader, mut gateway) = bench.start();
    expect_normal(&reader, Mark::START, "vcan5", ENABLE_LEFT);
    let losses: [(Change, Change, &str); 2] = [
        (&|| vcan.bring_down(), &|| vcan.bring_up(), "vcan5 is down"),
        (&|| vcan.delete(), &|| vcan.create(), "vcan5 is missing"),
    ];
    for (lose, restore, text) in losses {
        for (data, report) in [(RIGHT, ENABLE_RIGHT), (LEFT, ENABLE_LEFT)] {
            let mark = reader.mark();
            lose();
            expect_unknown(&reader, mark, text);
            sender.set(TURN, data);
            let mark = reader.mark();
            restore();
            expect_normal(&reader, mark, "vcan5", report);
        }
    }
    assert!(gateway.is_running(), "the process of the start");
    vcan.delete();
    let mark = reader.mark();
    reader.status(mark, "vcan5", 2, "vcan5 is missing");
    println!("SIGINT with a reader and without the interface: {:?}", gateway.stop("INT"));
}

#[test]
fn an_interface_that_is_not_there_at_the_start_is_waited_for() {
    let bench = require!(Bench::new("vcan7", ""));
    bench.vcan.delete();
    let (reader, mut gateway) = bench.start();
    expect_unknown(&reader, Mark::START, "vcan7 is missing");
    let mark = reader.mark();
    bench.vcan.create();
    let _sender = Sender::start(&bench.vcan, &[(TURN, RIGHT), (HAZARD, HAZARD_OFF)]);
    expect_normal(&reader, mark, "vcan7", ENABLE_RIGHT);
    println!("SIGTERM with a reader, while publishing: {:?}", gateway.stop("TERM"));
}

#[test]
fn an_interface_that_is_there_is_never_called_missing() {
    let bench = require!(Bench::new("vcan-there", ""));
    let mut gateway = Process::run(&bench.folder);
    gateway.wait_for_log("vcan-there: up, but no frame of the vehicle profile yet");
    gateway.stop("TERM");
    assert!(!gateway.log().iter().any(|line| line.contains("missing")), "{:?}", gateway.log());
}
