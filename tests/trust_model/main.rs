//! Only what a frame has proven is published, and it is published again as soon as it is proven.
//!
//! A sender's frames are lost, late, repeated, cut and corrupted, its bus falls silent and asleep
//! and its link is lost, at random. What the gateway publishes is compared, after every frame and
//! at every deadline, with a model that has nothing in common with it but the specification.

#![allow(clippy::unwrap_used, clippy::panic)] // helpers of tests fail like tests

mod model;
mod sender;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{Config, TestCaseError, TestRunner};
use signal_gateway::core::event::{BusIndex, Input, LinkState, Output};
use signal_gateway::core::frame::{CanId, Frame};
use signal_gateway::core::gateway::Gateway;
use signal_gateway::core::time::{MonoTime, Now, WallStamp};

use model::Model;
use sender::{ALIVE, ALIVE_MS, Act, Guarded, Sender, TIMEOUT_MS, TURN, any_act, settings};

/// The three kinds, an equal share each.
fn any_guarded() -> impl Strategy<Value = Guarded> {
    prop::sample::select(vec![Guarded::Fields, Guarded::EventFields, Guarded::E2e])
}

/// Pauses before the acts; most are as long as a cycle, some longer than the limit.
fn any_day() -> impl Strategy<Value = Vec<(u64, Act)>> {
    let pause = prop_oneof![12 => 20..140_u64, 1 => 140..TIMEOUT_MS + 100];
    prop::collection::vec((pause, any_act()), 1..100)
}

proptest! {
    #![proptest_config(Config { cases: 500, failure_persistence: None, ..Config::default() })]

    #[test]
    fn a_published_value_was_carried_by_a_trusted_frame_no_older_than_its_limit(
        guarded in any_guarded(),
        day in any_day(),
    ) {
        let mut trial = Trial::new(guarded);
        for (pause, act) in day {
            trial.pass(pause)?;
            trial.happen(act)?;
        }
        trial.pass(3 * ALIVE_MS)?;
        prop_assert_eq!(trial.published, None, "nothing came for long");
    }

    #[test]
    fn after_enough_good_frames_in_sequence_the_value_is_published_again(
        guarded in any_guarded(),
        day in any_day(),
        value in 0..3_u8,
    ) {
        let mut trial = Trial::new(guarded);
        for (pause, act) in day {
            trial.pass(pause)?;
            trial.happen(act)?;
        }
        // Of the fields three: one that breaks with what was, one that is in sequence with it, and
        // one that counts. The window needs four good ones behind those.
        let enough = if guarded == Guarded::E2e { 6 } else { 3 };
        for _ in 0..enough {
            trial.pass(100)?;
            trial.happen(Act::Send(value))?;
        }
        prop_assert_eq!(trial.published, Some(name(value)));
    }
}

#[test]
fn the_days_are_neither_all_good_nor_all_bad() {
    let mut runner = TestRunner::deterministic();
    let (mut believed, mut all) = (0, 0);
    for _ in 0..200 {
        let (guarded, day) = (any_guarded(), any_day()).new_tree(&mut runner).unwrap().current();
        let mut trial = Trial::new(guarded);
        for (pause, act) in day {
            trial.pass(pause).unwrap();
            trial.happen(act).unwrap();
            believed += u32::from(trial.published.is_some());
            all += 1;
        }
    }
    assert!((0.2..0.8).contains(&(f64::from(believed) / f64::from(all))), "{believed} of {all}");
}

struct Trial {
    gateway: Gateway,
    sender: Sender,
    model: Model,
    ms: u64,
    published: Option<&'static str>,
}

impl Trial {
    fn new(guarded: Guarded) -> Self {
        Self {
            gateway: Gateway::new(settings(guarded), LinkState::Up, now(0)),
            sender: Sender::new(guarded),
            model: Model::new(guarded),
            ms: 0,
            published: None,
        }
    }

    /// Time goes by; whenever the gateway wants to be called, it is.
    fn pass(&mut self, pause: u64) -> Result<(), TestCaseError> {
        let until = self.ms + pause;
        let mut at = now(self.ms);
        // Each deadline moves time on; a millisecond has a few at most.
        for _ in 0..pause * 8 + 8 {
            let wanted = self.gateway.next_deadline(at.mono).as_nanos();
            prop_assert!(wanted > at.mono.as_nanos(), "a deadline that does not move");
            if wanted > until * 1_000_000 {
                self.ms = until;
                return self.check(until);
            }
            let wall = WallStamp::from_nanos(i64::try_from(wanted).unwrap());
            at = Now { mono: MonoTime::from_nanos(wanted), wall };
            self.gateway.handle(Input::Deadline, at);
            // The model counts in milliseconds: what is too old by a nanosecond is too old by one.
            self.check(wanted.div_ceil(1_000_000))?;
        }
        Err(TestCaseError::fail("too many deadlines"))
    }

    fn happen(&mut self, act: Act) -> Result<(), TestCaseError> {
        match act {
            Act::Silence => {
                for _ in 0..8 {
                    self.pass(90)?;
                    self.gateway.handle(frame(ALIVE, &[0]), now(self.ms));
                    self.model.sign_of_life(self.ms);
                    self.check(self.ms)?;
                }
            }
            Act::Sleep => self.pass(2 * ALIVE_MS)?,
            Act::LinkLost => {
                for state in [LinkState::Down, LinkState::Up] {
                    self.gateway.handle(Input::Link { bus: BusIndex(0), state }, now(self.ms));
                    self.model.link_was_lost();
                    self.check(self.ms)?;
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
            self.gateway.handle(frame(TURN, &data), now(self.ms));
            self.model.frame(self.ms, &data);
            self.check(self.ms)?;
        }
        Ok(())
    }

    /// What is published is what the model believes.
    fn check(&mut self, ms: u64) -> Result<(), TestCaseError> {
        while let Some(output) = self.gateway.poll_output() {
            match output {
                Output::TurnIndicators { report, .. } => self.published = Some(report.name()),
                Output::WithdrawTurnIndicators => self.published = None,
                Output::HazardLights { .. }
                | Output::WithdrawHazardLights
                | Output::TrafficLights(_)
                | Output::TurnCommand { .. }
                | Output::HazardCommand { .. } => {
                    panic!("not bound")
                }
                Output::Diagnostics { .. } => {}
            }
        }
        let believed = self.model.believed(ms).filter(|value| *value < 3).map(name);
        prop_assert_eq!(self.published, believed, "{:?} at {} ms", self.sender.guarded, ms);
        Ok(())
    }
}

fn name(value: u8) -> &'static str {
    ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"][usize::from(value)]
}

fn now(ms: u64) -> Now {
    let wall = WallStamp::from_nanos(i64::try_from(ms * 1_000_000).unwrap());
    Now { mono: MonoTime::from_millis(ms), wall }
}

fn frame(id: u16, data: &[u8]) -> Input {
    let frame = Frame::fd(CanId::Standard(id), data).unwrap();
    Input::Frame { bus: BusIndex(0), frame, stamp: WallStamp::default() }
}
