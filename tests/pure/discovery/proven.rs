//! Cars that are easily mistaken: what is written reports the truth, in its own session and in another one.

use std::ops::Range;
use std::sync::Mutex;

use signal_gateway::config::Settings;
use signal_gateway::desk::proven_draft::{Refutation, reported};
use signal_gateway::report::discovery::result;
use vehicle_bringup::discovery::capture::Capture;
use vehicle_bringup::discovery::proof::ReportedState;
use vehicle_bringup::discovery::timeline::DriverAction;

use super::car::Car;
use super::driver::Driver;
use super::lights::State;
use super::synthetic::{Drive, drive_with};
use super::{for_each_seed, proven, settings};
use crate::support::clock::millis;

/// The first state that lasted and whose end the reports contradict.
fn contradiction(
    settings: &Settings,
    capture: &Capture,
    driver: &Driver,
    shows_hazard: bool,
) -> Option<String> {
    let reports = reported(settings, &["can0".to_owned()], capture);
    let (_, end) = capture.span().unwrap();
    let has_hazard = shows_hazard && !settings.gateway.lights.hazard.sources().is_empty();
    driver.states.windows(2).find_map(|pair| {
        let ((since, state), (until, _)) = (pair[0], pair[1]);
        let at = until - 50;
        if until - since < 2500 || at > millis(end) {
            return None;
        }
        let reported = reports.iter().rev().find(|(since, _)| millis(*since) <= at);
        let reported = reported.map_or(ReportedState::Unknown, |(_, state)| *state);
        // A report that is withheld, as while the bus may be silent, is not wrong.
        let expected = match state {
            State::Left => ReportedState::Action(DriverAction::Left),
            State::Right => ReportedState::Action(DriverAction::Right),
            State::Hazard if has_hazard => ReportedState::Action(DriverAction::Hazard),
            State::Off | State::Hazard => ReportedState::Off,
        };
        let is_true = reported == expected || reported == ReportedState::Unknown;
        (!is_true).then(|| format!("{reported} at {at} ms, not {state:?}: {reports:?}"))
    })
}

/// The numbers of cars by outcome.
#[derive(Debug, Default, PartialEq, Eq)]
struct Outcomes {
    found: usize,
    not_sure: usize,
    refuted: Vec<String>,
    wrong: Vec<String>,
}

fn outcome(seed: u64, outcomes: &Mutex<Outcomes>) {
    let drive = drive_with(Car::mistakable(seed), Driver::new(seed, false), false);
    let proven = proven(&drive.discovery, &drive.findings, &["can0"]);
    let wrong = proven.as_ref().ok().and_then(|files| {
        let settings = settings(files);
        let check = |drive: &Drive| {
            contradiction(&settings, drive.discovery.capture(), &drive.driver, drive.car.shows_hazard)
        };
        let other =
            || drive_with(Car::mistakable(seed).again(seed), Driver::new(seed + 1_000_000, false), false);
        let why = check(&drive).or_else(|| check(&other()))?;
        let files: Vec<_> = files.iter().map(|(name, text)| format!("--- {name}\n{text}")).collect();
        Some(format!("{seed}: {}\n{why}\n{}", drive.car.indicators(), files.join("\n")))
    });
    let mut outcomes = outcomes.lock().unwrap();
    match (proven, wrong) {
        (_, Some(why)) => outcomes.wrong.push(why),
        (Ok(_), None) => outcomes.found += 1,
        (Err(Refutation::NotSure), None) => outcomes.not_sure += 1,
        (Err(why), None) => {
            let turn = drive.findings.turn.first().map(|turn| turn.form.to_string());
            outcomes.refuted.push(format!("{seed}: {why}\n  {turn:?}\n  {}", drive.car.indicators()));
        }
    }
}

fn discover(seeds: Range<u64>) -> Outcomes {
    let outcomes = Mutex::new(Outcomes::default());
    for_each_seed(seeds, |seed| outcome(seed, &outcomes));
    let outcomes = outcomes.into_inner().unwrap();
    let Outcomes { found, not_sure, refuted, wrong } = &outcomes;
    println!(
        "{found} found, {not_sure} not sure, {} refuted by their session, {} wrong",
        refuted.len(),
        wrong.len()
    );
    println!("{}", refuted.join("\n"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    outcomes
}

#[test]
fn no_profile_is_written_that_its_session_contradicts() {
    let outcomes = discover(0..24);
    assert!(outcomes.found >= 19, "{outcomes:?}");
}

/// A checksum of few changes, some of whose bits count; a message that proves the bus alive but pauses for
/// ten seconds.
#[test]
fn cars_whose_second_session_shows_more_are_not_mistaken() {
    for seed in [10_680, 10_954] {
        discover(seed..seed + 1);
    }
}

#[test]
fn a_lever_that_is_moved_during_hands_off_is_named() {
    let is_named = |seed: u64| {
        let drive = drive_with(Car::mistakable(seed), Driver::restless(seed), false);
        let why = proven(&drive.discovery, &drive.findings, &["can0"]).expect_err("the session is spoilt");
        let text = result(&drive.findings) + &why.to_string();
        text.contains("HANDS OFF")
    };
    let named = (0..4).filter(|seed| is_named(*seed)).count();
    assert_eq!(named, 4);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_hundred_mistakable_cars_are_found_or_not_sure() {
        let outcomes = super::discover(10_600..10_700);
        assert!(outcomes.found >= 80, "{outcomes:?}");
    }
}

mod exhaustive {
    #[test]
    #[ignore = "exhaustive: tests/run --release"]
    fn a_thousand_mistakable_cars_are_found_or_not_sure() {
        let outcomes = super::discover(10_000..11_000);
        assert!(outcomes.found >= 800, "{outcomes:?}");
    }
}
