//! Faults in the middle of drives: what is wrong is not published for longer than the window of its check,
//! what is healthy stays, and a healthy drive raises no alarm.

use gateway_base::diagnostics::Level;
use gateway_core::vehicle_report::Step;
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::output::VehicleStatusOutput;

use super::car::{Car, Listener, RawFrame, settings};
use super::{DRIVE, PARK, REVERSE};
use crate::support::clock::millis;

/// Time from a fault to its last wrong report: the longest check takes 2 s, a frozen value 3 s, and the next
/// frames follow.
const WINDOW_MS: u64 = 3_200;
const DRIVE_MS: u64 = 40_000;

/// A small generator, so that a drive is the same on every machine.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 31)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}

/// A driver: goals of speed and steering that change every few seconds; stops, reverses, drives off again.
pub(super) struct Driver {
    random: Random,
    goal_mps: f64,
    goal_rad: f64,
    until_ms: u64,
    /// From when the gear is engaged.
    engaged_ms: u64,
}

impl Driver {
    pub(super) fn new(seed: u64) -> Self {
        Self { random: Random(seed * 977 + 13), goal_mps: 0.0, goal_rad: 0.0, until_ms: 2_000, engaged_ms: 0 }
    }

    pub(super) fn step(&mut self, car: &mut Car, now_ms: u64) {
        if now_ms >= self.until_ms {
            self.until_ms = now_ms + self.random.between(1_500.0, 5_000.0) as u64;
            let kind = self.random.next();
            self.goal_mps = match kind {
                _ if kind < 0.12 => 0.0,
                _ if kind < 0.22 => self.random.between(-3.0, -1.0),
                _ => self.random.between(2.0, 25.0),
            };
            self.goal_rad = self.random.between(-0.4, 0.4);
        }
        // No gear without a standstill.
        let is_other_way = self.goal_mps * car.speed_mps < 0.0;
        let gear = if self.goal_mps < 0.0 {
            REVERSE
        } else if self.goal_mps > 0.0 {
            DRIVE
        } else {
            PARK
        };
        if car.speed_mps == 0.0 && car.gear != gear {
            (car.gear, self.engaged_ms) = (gear, now_ms + 300);
        }
        let goal = if is_other_way || now_ms < self.engaged_ms { 0.0 } else { self.goal_mps };
        let change: f64 = (goal - car.speed_mps).clamp(-0.08, 0.03);
        car.speed_mps += change;
        if car.speed_mps.abs() < 0.05 && goal == 0.0 {
            car.speed_mps = 0.0;
        }
        // At most 4 m/s² across.
        let most = (4.0 * super::car::WHEEL_BASE_M / car.speed_mps.powi(2).max(0.1)).atan().min(0.5);
        let goal = self.goal_rad.clamp(-most, most);
        car.tire_rad += (goal - car.tire_rad).clamp(-0.004, 0.004);
        car.tire_rad = car.tire_rad.clamp(-most, most);
    }
}

/// What is wrong with the signals of one message.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    Stuck,
    Offset(f64),
    Scale(f64),
    AllOnes,
    Lost,
    Late,
}

const FAULTS: [Fault; 8] = [
    Fault::Stuck,
    Fault::Offset(0.3),
    Fault::Scale(-1.0),
    Fault::Scale(3.6),
    Fault::Scale(1.0 / 57.3),
    Fault::AllOnes,
    Fault::Lost,
    Fault::Late,
];

/// The words of a message that are concerned.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Part {
    id: u16,
    words: &'static [usize],
    report: StatusReport,
}

const PARTS: [Part; 6] = [
    Part { id: 256, words: &[2], report: StatusReport::Velocity },
    Part { id: 256, words: &[0], report: StatusReport::Velocity },
    Part { id: 256, words: &[0, 1, 2, 3], report: StatusReport::Velocity },
    Part { id: 257, words: &[0], report: StatusReport::Velocity },
    Part { id: 258, words: &[0], report: StatusReport::Velocity },
    Part { id: 259, words: &[0], report: StatusReport::Steering },
];

/// A fault of a part from a time on.
struct Mutation {
    part: Part,
    fault: Fault,
    from_ms: u64,
    before: Vec<(u64, RawFrame)>,
}

impl Mutation {
    fn apply(&mut self, frame: RawFrame, millis: u64) -> Option<RawFrame> {
        if frame.id != self.part.id {
            return Some(frame);
        }
        self.before.push((millis, frame));
        if millis < self.from_ms {
            return Some(frame);
        }
        let mut mutated = frame;
        let stuck =
            self.before.iter().find(|(at, _)| *at + 50 >= self.from_ms).map_or(frame, |(_, frame)| *frame);
        for word in self.part.words {
            let is_signed = self.part.id >= 258;
            let raw =
                if is_signed { f64::from(frame.word(*word) as i16) } else { f64::from(frame.word(*word)) };
            let full = if self.part.id == 259 { 4_000.0 } else { 6_000.0 };
            let value = match self.fault {
                Fault::Stuck => {
                    mutated.set_word(*word, stuck.word(*word));
                    continue;
                }
                Fault::AllOnes => {
                    mutated.set_word(*word, u16::MAX);
                    continue;
                }
                Fault::Offset(share) => raw + share * full,
                Fault::Scale(factor) => raw * factor,
                Fault::Lost => return None,
                Fault::Late => {
                    let late = self.before.iter().rev().find(|(at, _)| at + 500 <= millis);
                    return late.map(|(_, frame)| *frame).or(Some(frame));
                }
            };
            mutated.set_word(*word, if is_signed { value as i16 as u16 } else { value as u16 });
        }
        Some(mutated)
    }
}

/// True if a report is so far from the truth that its check has to find it.
fn is_wrong(found: f64, truth: f64, share: f64, more: f64) -> bool {
    (found - truth).abs() > share * found.abs().max(truth.abs()) + more
}

/// One drive: times of wrong reports after the fault, and the share of time that the healthy reports were
/// published.
struct Outcome {
    wrong_ms: Vec<(u64, &'static str, f64, f64)>,
    published: [f64; 3],
    alarms: Vec<String>,
}

fn drive(seed: u64, mut mutation: Option<Mutation>) -> Outcome {
    let mut listener = Listener::new(settings(&[], &[]));
    let (mut car, mut driver) = (Car::default(), Driver::new(seed));
    let mut outcome = Outcome { wrong_ms: Vec::new(), published: [0.0; 3], alarms: Vec::new() };
    let mut seen = 0;
    let mut known = 0.0;
    for now_ms in (0..DRIVE_MS).step_by(10) {
        driver.step(&mut car, now_ms);
        let step = |_: &mut Car, _| {};
        listener.drive(&mut car, 10, step, |frame, at| match &mut mutation {
            Some(mutation) => mutation.apply(frame, at),
            None => Some(frame),
        });
        let (speed, rate) = (car.speed_mps, car.heading_rate_radps());
        for (at, output) in &listener.outputs[seen..] {
            let at = millis(*at);
            let mut wrong = |what, found, truth| outcome.wrong_ms.push((at, what, found, truth));
            match output {
                VehicleStatusOutput::Velocity(Step::Publish(velocity, _)) => {
                    if is_wrong(velocity.longitudinal_mps, speed, 0.35, 1.2) {
                        wrong("speed", velocity.longitudinal_mps, speed);
                    }
                    if speed.abs() > 2.2 && is_wrong(velocity.heading_rate_radps, rate, 0.65, 0.15) {
                        wrong("heading rate", velocity.heading_rate_radps, rate);
                    }
                }
                VehicleStatusOutput::Steering(Step::Publish(tire, _)) => {
                    let reported = speed * tire.0.tan() / super::car::WHEEL_BASE_M;
                    if speed.abs() > 2.2 && is_wrong(reported, rate, 0.65, 0.15) {
                        wrong("steering", reported, rate);
                    }
                }
                _ => {}
            }
        }
        seen = listener.outputs.len();
        if now_ms > 1_000 && now_ms % 100 == 0 {
            known += 1.0;
            let status = listener.snapshot().vehicle_status;
            let published = [
                status.velocity.as_ref().unwrap().published.is_some(),
                status.steering.as_ref().unwrap().published.is_some(),
                status.gear.as_ref().unwrap().published.is_some(),
            ];
            for (share, is_published) in outcome.published.iter_mut().zip(published) {
                *share += f64::from(u8::from(is_published));
            }
            let (velocity, steering) = (status.velocity.unwrap(), status.steering.unwrap());
            let messages = [(velocity.level, velocity.message), (steering.level, steering.message)];
            for (_, message) in messages.into_iter().filter(|(level, _)| *level != Level::Ok) {
                if !outcome.alarms.contains(&message) {
                    outcome.alarms.push(message);
                }
            }
        }
    }
    outcome.published = outcome.published.map(|share| share / known);
    outcome
}

/// Judges drives with faults; gives the number of wrong reports that lasted too long.
fn assert_faults_are_found(seeds: std::ops::Range<u64>) {
    let mut missed = Vec::new();
    let mut healthy = Vec::new();
    for seed in seeds.clone() {
        let part = PARTS[seed as usize % PARTS.len()];
        let fault = FAULTS[(seed as usize / PARTS.len()) % FAULTS.len()];
        // A magnitude has no sign to flip.
        let fault = if fault == Fault::Scale(-1.0) && part.id < 258 { Fault::Stuck } else { fault };
        let from_ms = 12_000 + seed % 7 * 1_000;
        let outcome = drive(seed, Some(Mutation { part, fault, from_ms, before: Vec::new() }));
        // Of reports that are wrong one after the other, how long that lasts.
        let mut begin: Option<(u64, u64)> = None;
        for (at, what, found, truth) in &outcome.wrong_ms {
            begin = match begin {
                Some((since, last)) if at - last < 500 => Some((since, *at)),
                _ => Some((*at, *at)),
            };
            let since = begin.unwrap().0;
            if at - since > WINDOW_MS {
                missed.push(format!("{seed}: {fault:?} of {part:?} since {from_ms}: {what} {found:.2}, truth {truth:.2}, at {at}"));
                break;
            }
        }
        if outcome.published[2] < 0.99 {
            healthy.push(format!("{seed}: gear {:?}", outcome.published));
        }
        if part.report == StatusReport::Velocity && outcome.published[1] < 0.99 {
            healthy.push(format!(
                "{seed}: {fault:?} of {part:?}: steering {:?} {:?}",
                outcome.published, outcome.alarms
            ));
        }
        if part.report == StatusReport::Steering && outcome.published[0] < 0.99 {
            healthy.push(format!(
                "{seed}: {fault:?} of {part:?}: velocity {:?} {:?}",
                outcome.published, outcome.alarms
            ));
        }
    }
    println!(
        "{} drives, {} missed, {} healthy parts lost",
        seeds.end - seeds.start,
        missed.len(),
        healthy.len()
    );
    assert!(missed.is_empty(), "\n{}", missed.join("\n"));
    assert!(healthy.is_empty(), "\n{}", healthy.join("\n"));
}

fn assert_healthy_drives_raise_no_alarm(seeds: std::ops::Range<u64>) {
    for seed in seeds {
        let outcome = drive(seed, None);
        assert_eq!(outcome.alarms, Vec::<String>::new(), "seed {seed}");
        assert!(
            outcome.wrong_ms.is_empty() && outcome.published.iter().all(|share| *share > 0.999),
            "seed {seed}"
        );
    }
}

#[test]
fn healthy_drives_raise_no_alarm() {
    assert_healthy_drives_raise_no_alarm(0..3);
}

#[test]
fn faults_are_found_within_their_window() {
    assert_faults_are_found(0..48);
}

mod slow {
    #[test]
    #[ignore = "slow: tests/run --full"]
    fn two_thousand_drives_with_faults() {
        super::assert_faults_are_found(1_000..3_000);
    }

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn two_hundred_healthy_drives() {
        super::assert_healthy_drives_raise_no_alarm(1_000..1_200);
    }
}
