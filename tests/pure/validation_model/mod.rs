//! Only what a frame has proven is published, and it is published again as soon as it is proven.
//!
//! A sender's frames are lost, late, repeated, cut and corrupted, its bus falls silent and asleep
//! and its link is lost, at random. What the gateway publishes is compared, after every frame and
//! at every deadline, with a model that has nothing in common with it but
//! docs/spec/vehicle-interface.md.

mod model;
mod sender;

use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{TestCaseError, TestRunner};
use signal_gateway::core::can::frame::{CanId, Frame};
use signal_gateway::core::can::input::CanInput;
use signal_gateway::core::can::link::{BusIndex, LinkState};
use signal_gateway::core::time::MonoTime;

use crate::support::clock::MS;
use crate::support::property::for_all;
use crate::support::virtual_gateway::VirtualGateway;

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

/// A day as it happened to a sender, to its end.
fn lived(guarded: Guarded, day: Vec<(u64, Act)>) -> Result<Trial, TestCaseError> {
    let mut trial = Trial::new(guarded);
    for (pause, act) in day {
        trial.pass(pause)?;
        trial.happen(act)?;
    }
    Ok(trial)
}

fn what_is_published_is_trusted_over(days: u32) {
    for_all(days, (any_guarded(), any_day()), |(guarded, day)| {
        let mut trial = lived(guarded, day)?;
        trial.pass(3 * ALIVE_MS)?;
        prop_assert_eq!(trial.published, None, "nothing came for long");
        Ok(())
    });
}

fn enough_good_frames_are_believed_after(days: u32) {
    for_all(days, (any_guarded(), any_day(), 0..3_u8), |(guarded, day, value)| {
        let mut trial = lived(guarded, day)?;
        // Of the fields three: one that breaks with what was, one that is in sequence with it, and
        // one that counts. The window needs four good ones behind those.
        let enough = if guarded == Guarded::E2e { 6 } else { 3 };
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
    enough_good_frames_are_believed_after(150);
}

mod slow {
    #[test]
    fn a_published_value_was_carried_by_a_trusted_frame_no_older_than_its_limit() {
        super::what_is_published_is_trusted_over(500);
    }

    #[test]
    fn after_enough_good_frames_in_sequence_the_value_is_published_again() {
        super::enough_good_frames_are_believed_after(500);
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
    gateway: VirtualGateway,
    sender: Sender,
    model: Model,
    published: Option<&'static str>,
}

impl Trial {
    fn new(guarded: Guarded) -> Self {
        Self {
            gateway: VirtualGateway::new(settings(guarded)),
            sender: Sender::new(guarded),
            model: Model::new(guarded),
            published: None,
        }
    }

    /// Time goes by; whenever the gateway wants to be called, it is.
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

    /// What is published is what the model believes.
    fn check(&mut self) -> Result<(), TestCaseError> {
        // The model counts in milliseconds: what is too old by a nanosecond is too old by one.
        let ms = self.gateway.now.mono.as_nanos().div_ceil(MS);
        if let Some((_, state)) = self.gateway.turn_reports().last() {
            self.published = Some(*state).filter(|state| *state != "stops");
        }
        assert_eq!(self.gateway.hazard_reports(), [], "not bound");
        self.gateway.outputs.clear();
        let believed = self.model.believed(ms).filter(|value| *value < 3).map(name);
        prop_assert_eq!(self.published, believed, "{:?} at {} ms", self.sender.guarded, ms);
        Ok(())
    }
}

fn name(value: u8) -> &'static str {
    ["DISABLE", "ENABLE_LEFT", "ENABLE_RIGHT"][usize::from(value)]
}
