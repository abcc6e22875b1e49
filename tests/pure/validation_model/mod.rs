//! Only values of valid frames are published, and again as soon as frames are valid.
//!
//! A sender's frames are lost, late, repeated, cut and corrupted, its bus falls silent and asleep
//! and its link is lost, at random. What the gateway publishes is compared, after every frame and
//! at every deadline, with a model that has nothing in common with it but
//! docs/spec/vehicle-interface.md.

mod model;
mod sender;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use gateway_base::time::MonoTime;
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{TestCaseError, TestRunner};

use crate::support::clock::MS;
use crate::support::property::for_all;
use crate::support::virtual_gateway::VirtualGateway;

use model::Model;
use sender::{ALIVE, ALIVE_MS, Act, Protection, Sender, TIMEOUT_MS, TURN, any_act, settings};

/// The three kinds, an equal share each.
fn any_protection() -> impl Strategy<Value = Protection> {
    prop::sample::select(vec![Protection::Fields, Protection::EventFields, Protection::E2e])
}

/// Pauses before the acts; most are as long as a cycle, some longer than the limit.
fn any_day() -> impl Strategy<Value = Vec<(u64, Act)>> {
    let pause = prop_oneof![12 => 20..140_u64, 1 => 140..TIMEOUT_MS + 100];
    prop::collection::vec((pause, any_act()), 1..100)
}

/// Runs the events of a sender to their end.
fn run(protection: Protection, day: Vec<(u64, Act)>) -> Result<Trial, TestCaseError> {
    let mut trial = Trial::new(protection);
    for (pause, act) in day {
        trial.pass(pause)?;
        trial.happen(act)?;
    }
    Ok(trial)
}

fn what_is_published_is_trusted_over(days: u32) {
    for_all(days, (any_protection(), any_day()), |(protection, day)| {
        let mut trial = run(protection, day)?;
        trial.pass(3 * ALIVE_MS)?;
        prop_assert_eq!(trial.published, None, "nothing came for long");
        Ok(())
    });
}

fn enough_good_frames_are_used_after(days: u32) {
    for_all(days, (any_protection(), any_day(), 0..3_u8), |(protection, day, value)| {
        let mut trial = run(protection, day)?;
        // Of the fields three: one that breaks with what was, one that is in sequence with it, and
        // one that counts. The window needs four good ones behind those.
        let enough = if protection == Protection::E2e { 6 } else { 3 };
        for _ in 0..enough {
            trial.pass(100)?;
            trial.happen(Act::Send(value))?;
        }
        prop_assert_eq!(trial.published, Some(name(value)));
        Ok(())
    });
}

#[test]
fn a_published_value_was_carried_by_a_trusted_frame_no_older_than_its_limit() {
    what_is_published_is_trusted_over(150);
}

#[test]
fn after_enough_good_frames_in_sequence_the_value_is_published_again() {
    enough_good_frames_are_used_after(150);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_published_value_was_carried_by_a_trusted_frame_no_older_than_its_limit() {
        super::what_is_published_is_trusted_over(500);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn after_enough_good_frames_in_sequence_the_value_is_published_again() {
        super::enough_good_frames_are_used_after(500);
    }
}

#[test]
fn the_days_are_neither_all_good_nor_all_bad() {
    let mut runner = TestRunner::deterministic();
    let (mut valid, mut all) = (0, 0);
    for _ in 0..200 {
        let (protection, day) = (any_protection(), any_day()).new_tree(&mut runner).unwrap().current();
        let mut trial = Trial::new(protection);
        for (pause, act) in day {
            trial.pass(pause).unwrap();
            trial.happen(act).unwrap();
            valid += u32::from(trial.published.is_some());
            all += 1;
        }
    }
    assert!((0.2..0.8).contains(&(f64::from(valid) / f64::from(all))), "{valid} of {all}");
}

struct Trial {
    gateway: VirtualGateway,
    sender: Sender,
    model: Model,
    published: Option<&'static str>,
}

impl Trial {
    fn new(protection: Protection) -> Self {
        Self {
            gateway: VirtualGateway::new(settings(protection)),
            sender: Sender::new(protection),
            model: Model::new(protection),
            published: None,
        }
    }

    /// Time goes by, and the gateway is called at each deadline.
    fn pass(&mut self, pause: u64) -> Result<(), TestCaseError> {
        let until = self.gateway.ms() + pause;
        // Each deadline moves time on; a millisecond has a few at most.
        for _ in 0..pause * 8 + 8 {
            let is_deadline = self.gateway.step(MonoTime::from_millis(until));
            self.check()?;
            if !is_deadline {
                return Ok(());
            }
        }
        Err(TestCaseError::fail("too many deadlines"))
    }

    fn happen(&mut self, act: Act) -> Result<(), TestCaseError> {
        match act {
            Act::Silence => {
                for _ in 0..8 {
                    self.pass(90)?;
                    self.receive(ALIVE, &[0]);
                    self.model.sign_of_life(self.gateway.ms());
                    self.check()?;
                }
            }
            Act::Sleep => self.pass(2 * ALIVE_MS)?,
            Act::LinkLost => {
                for state in [LinkState::Down, LinkState::Up] {
                    self.gateway.handle(CanInput::Link { bus: BusIndex(0), state });
                    self.model.link_was_lost();
                    self.check()?;
                }
            }
            Act::Send(_)
            | Act::Lose(_)
            | Act::Delay(_)
            | Act::Late
            | Act::Again(_)
            | Act::Corrupt(..)
            | Act::Cut(..)
            | Act::Stretch(_)
            | Act::Jump(..) => {}
        }
        if let Some(data) = self.sender.act(act) {
            self.receive(TURN, &data);
            self.model.frame(self.gateway.ms(), &data);
            self.check()?;
        }
        Ok(())
    }

    fn receive(&mut self, id: u16, data: &[u8]) {
        let frame = Frame::fd(CanId::Standard(id), data).unwrap();
        self.gateway.handle(CanInput::Frame { bus: BusIndex(0), frame, stamp: self.gateway.now.wall });
    }

    /// Compares the published value with that of the model.
    fn check(&mut self) -> Result<(), TestCaseError> {
        // The model counts in milliseconds: what is too old by a nanosecond is too old by one.
        let ms = self.gateway.now.mono.as_nanos().div_ceil(MS);
        if let Some((_, state)) = self.gateway.turn_reports().last() {
            self.published = Some(*state).filter(|state| *state != "stops");
        }
        assert_eq!(self.gateway.hazard_reports(), [], "not bound");
        self.gateway.outputs.clear();
        let expected = self.model.valid_value(ms).filter(|value| *value < 3).map(name);
        prop_assert_eq!(self.published, expected, "{:?} at {} ms", self.sender.protection, ms);
        Ok(())
    }
}

fn name(value: u8) -> &'static str {
    ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"][usize::from(value)]
}
