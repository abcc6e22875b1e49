//! The cost of many traffic lights: from 10 to 100,000 of them, with all kinds of messages.
//!
//! `cargo bench --bench traffic_lights`. Each crossing has ten lights, each light has a group of its
//! own, with V2I and predictions. Times are processor times of this thread. The limits compare
//! figures of the same run: a change of a few lights must not cost more because there are many others.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // a program for developers, numbers far below 2^52

#[path = "comparison.rs"]
mod comparison;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;

use can_signal::can::link::LinkState;
use comparison::{Row, point, processor_time};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use lanelet2_map::light_map::{GroupEntry, LampColor, LightMap, MapLamp};
use ros_messages::cdr::CdrBytes;
use signal_gateway::config::files::{DEMO_CONFIG, Embedded};
use signal_gateway::config::{Overrides, load};
use signal_gateway::io::ros::messages::{LightsEncoder, LightsMessage, LightsType};
use traffic_lights::arbiter::ArbiterSettings;
use traffic_lights::compat::Compat;
use traffic_lights::emission::{Emission, LightsTopic};
use traffic_lights::engine::{LightsSettings, TrafficLights};
use traffic_lights::flow::LightsFlowSettings;
use traffic_lights::output::TrafficLightOutput;
use traffic_lights::scenario::{
    Act, Action, Condition, ControllerIndex, Edge, Event, Phase, PhaseEntry, Reference, Rule, Scenario,
    StateText, Test, TrafficSignalController, Trigger,
};
use traffic_lights::target::{LightChannel, SignalTarget, StoreId, StoreLayer};

/// The largest ratio of the times for a few lights among 100,000 lights and among 10.
const MAX_GROWTH: f64 = 20.0;

const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];
const LIGHTS_PER_CROSSING: usize = 10;
/// The number of samples of which each figure is the median.
const SAMPLES: usize = 9;
/// The first relation id.
const GROUPS: usize = 1_000_000;
/// Green, yellow, red; the cycle of each crossing begins a little after that of the one before.
const PHASES: [(&str, u64); 3] = [("green", 17), ("yellow", 3), ("red", 10)];
/// The duration of all phases together: each light changes three times.
const CYCLE: Duration = Duration::from_secs(30);
const TRUTH: StoreId = StoreId { channel: LightChannel::Conventional, layer: StoreLayer::GroundTruth };

/// One figure for each of the sizes, nanoseconds.
struct Growth {
    name: &'static str,
    ns: Vec<f64>,
    /// The largest ratio of 100,000 lights to 10; `None` for work on all lights.
    max_ratio: Option<f64>,
}

fn main() -> ExitCode {
    let mut rows = [
        ("emission, nothing changed", Some(MAX_GROWTH)),
        ("phase change of ten lights", Some(MAX_GROWTH)),
        ("emissions of a frame after it", None),
        ("diagnostics", Some(MAX_GROWTH)),
    ]
    .map(|(name, max_ratio)| Growth { name, ns: Vec::new(), max_ratio });
    for lights in SIZES {
        for (row, ns) in rows.iter_mut().zip(times(lights)) {
            row.ns.push(ns);
        }
    }
    let mut good = true;
    println!("{:<32}{}", "traffic lights, ns for", SIZES.map(|size| format!("{size:>11}")).concat());
    for row in &rows {
        good &= row.print();
    }
    let usual = Load { slower: 1, arbiter: false, encoding: None };
    let with_cdr = |slower, encoding| Load { slower, encoding: Some(encoding), ..usual };
    for (lights, with, load) in [
        (1_000, "", usual),
        (10_000, "", usual),
        (10_000, ", with arbiter", Load { arbiter: true, ..usual }),
        (10_000, ", with CDR from nothing", with_cdr(1, Encoding::Anew)),
        (10_000, ", with CDR, ten kept", with_cdr(1, Encoding::Kept(10))),
        (100_000, "", usual),
    ] {
        let Work { share, .. } = share_of_a_core(lights, load);
        println!("traffic lights, {lights} at 30 Hz{with}: {share:.2} % of a core");
    }
    for (changes, slower, aim) in [
        ("1,000 changes a second", 1, None),
        ("100 changes a second", 10, Some(3.75)),
        ("no change", 10_000, Some(1.5)),
    ] {
        let Work { share, bytes_per_s } = share_of_a_core(10_000, with_cdr(slower, Encoding::Kept(1)));
        good &= Row {
            what: &format!("10,000 lights at 30 Hz with CDR, {changes}"),
            ours: share,
            peer: "copy of the same bytes, with a stamp",
            theirs: bytes_per_s * copy_ns_per_byte() / 1e9 * 100.0,
            unit: "% of a core",
            aim,
            limit: 4.0,
        }
        .print();
    }
    encoding(10_000);
    events(10_000);
    println!("traffic lights, all of this: {:.1} s", processor_time().as_secs_f64());
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

impl Growth {
    /// Prints the row. Returns false when its ratio exceeds the limit.
    fn print(&self) -> bool {
        let figures: String = self.ns.iter().map(|ns| format!("{ns:>11.0}")).collect();
        let grown = self.ns.last().unwrap() / self.ns.first().unwrap();
        for (size, ns) in SIZES.iter().zip(&self.ns) {
            point(&format!("traffic lights: {}", self.name), "ns", *size as f64, *ns);
        }
        println!("{:<32}{figures} ns, {:.1} times for ten times the lights", self.name, growth(&self.ns));
        match self.max_ratio {
            Some(max) if grown > max => {
                println!("{}: {grown:.0} times as long among 100,000 lights; the limit is {max}", self.name);
                false
            }
            Some(_) | None => true,
        }
    }
}

/// The factor from one size to the next that fits all of them best (least squares of the logarithms).
fn growth(ns: &[f64]) -> f64 {
    let logs: Vec<_> = ns.iter().map(|ns| ns.log10()).collect();
    let middle = (logs.len() - 1) as f64 / 2.0;
    let offsets = || (0..logs.len()).map(|index| index as f64 - middle);
    let slope = offsets().zip(&logs).map(|(offset, log)| offset * log).sum::<f64>()
        / offsets().map(|offset| offset * offset).sum::<f64>();
    10_f64.powf(slope)
}

/// The times of a second, a change, the messages after it, and a status, nanoseconds, for the rows.
fn times(lights: usize) -> [f64; 4] {
    let hour = Duration::from_secs(3_600);
    let mut drive = Drive::new(settings(lights, [hour; 3], Duration::ZERO));
    drive.passes(Duration::from_secs(1));
    let unchanged = median(|| timed(|| drive.passes(Duration::from_secs(1))));
    let mut changes = (0..).flat_map(|round| {
        let phase = PHASES[(round + 1) % PHASES.len()].0.to_owned();
        (0..lights / LIGHTS_PER_CROSSING).map(move |crossing| Action::EnterPhase {
            controller: ControllerIndex(crossing),
            phase: phase.clone(),
        })
    });
    let change = median(|| {
        let actions: Vec<_> = changes.by_ref().take(100).collect();
        timed(|| {
            for action in &actions {
                drive.engine.apply(action, drive.now).unwrap();
            }
            actions.len()
        })
    });
    drive.passes(Duration::from_secs(1));
    let after = median(|| {
        drive.engine.apply(&changes.next().unwrap(), drive.now).unwrap();
        // Three frames, in which each topic has its turn at least once.
        timed(|| drive.passes(Duration::from_millis(100)).min(1))
    });
    let diagnostics = median(|| {
        timed(|| {
            for _ in 0..10 {
                black_box(drive.engine.statuses(None, drive.now.mono));
            }
            10
        })
    });
    [unchanged, change, after, diagnostics]
}

/// Traffic lights and their time.
struct Drive {
    engine: TrafficLights,
    now: Now,
}

impl Drive {
    fn new(settings: LightsSettings) -> Self {
        let now = Now { mono: MonoTime::ZERO, wall: WallStamp::default() };
        Self { engine: TrafficLights::new(settings, now), now }
    }

    /// Advances by a time and takes all messages. Returns their number.
    fn passes(&mut self, time: Duration) -> usize {
        let end = self.now.mono.after(time);
        let mut count = 0;
        while self.engine.next_deadline() <= end {
            self.now = at(self.engine.next_deadline());
            self.engine.advance(self.now);
            while let Some(emission) = self.engine.poll_output() {
                black_box(&emission);
                count += 1;
            }
            while self.engine.poll_event().is_some() {}
        }
        self.now = at(end);
        count
    }
}

/// The work of the gateway beside messages and diagnostics.
#[derive(Debug, Clone, Copy)]
struct Load {
    /// The factor by which phases are longer than usual, when a tenth of the lights changes each second.
    slower: u32,
    arbiter: bool,
    encoding: Option<Encoding>,
}

#[derive(Debug, Clone, Copy)]
enum Encoding {
    /// Each message is made and encoded anew.
    Anew,
    /// A [`LightsEncoder`] encodes; writers keep this number of the last messages of each topic.
    Kept(usize),
}

/// What the gateway takes and gives.
struct Work {
    /// Share of a core, per cent.
    share: f64,
    /// Encoded messages, bytes a second.
    bytes_per_s: f64,
}

/// The work of the whole gateway.
fn share_of_a_core(lights: usize, load_of: Load) -> Work {
    let phases = PHASES.map(|(_, seconds)| Duration::from_secs(seconds) * load_of.slower);
    let cycle = CYCLE * load_of.slower.min(10);
    let mut settings = load(&Embedded, Path::new(DEMO_CONFIG), &Overrides::default()).unwrap().gateway;
    let apart = cycle / u32::try_from(lights / LIGHTS_PER_CROSSING).unwrap();
    settings.traffic_lights = Some(LightsFlowSettings {
        arbiter: load_of.arbiter.then(ArbiterSettings::default),
        ..LightsFlowSettings::new(self::settings(lights, phases, apart))
    });
    let mut gateway = Gateway::new(settings, LinkState::Up, at(MonoTime::ZERO));
    let mut due = MonoTime::ZERO;
    let mut encoders = Encoders::default();
    let mut encoded = 0;
    let mut work = |until: MonoTime, encoding: Option<Encoding>| {
        let start = processor_time();
        while gateway.next_deadline() <= until {
            due = gateway.next_deadline();
            gateway.handle(Input::Tick, at(due));
            while let Some(output) = gateway.poll_output() {
                if let Output::TrafficLights(TrafficLightOutput::Publish(emission)) = &output {
                    match encoding {
                        None => {}
                        Some(Encoding::Anew) => drop(black_box(bytes(emission))),
                        Some(Encoding::Kept(kept)) => encoded += encoders.encode(emission, kept),
                    }
                }
                black_box(output);
            }
        }
        (processor_time().saturating_sub(start), std::mem::take(&mut encoded))
    };
    // Within a cycle all crossings have begun.
    let begun = MonoTime::ZERO.after(cycle + Duration::from_secs(1));
    work(begun, None);
    let (first, span) = (begun.after(Duration::from_secs(1)), Duration::from_secs(2));
    work(first, load_of.encoding);
    let (time, bytes) = work(first.after(span), load_of.encoding);
    let seconds = span.as_secs_f64();
    Work { share: time.as_secs_f64() / seconds * 100.0, bytes_per_s: bytes as f64 / seconds }
}

/// Copying a large message to where the last one is, and putting a stamp into it.
fn copy_ns_per_byte() -> f64 {
    const SIZE: usize = 7_000_000;
    let (message, mut copy, mut stamp) = (vec![7_u8; SIZE], vec![0_u8; SIZE], 0_u64);
    let mut once = || {
        stamp += 1;
        copy.copy_from_slice(black_box(&message));
        copy[4..12].copy_from_slice(&stamp.to_le_bytes());
        black_box(copy.len())
    };
    median(|| timed(&mut once))
}

/// An encoder for each topic, and the messages that its writer keeps.
#[derive(Default)]
struct Encoders(BTreeMap<LightsTopic, (Option<LightsEncoder>, VecDeque<Vec<CdrBytes>>)>);

impl Encoders {
    /// Encodes the messages of an emission; gives their bytes.
    fn encode(&mut self, emission: &Emission, kept: usize) -> usize {
        let (encoder, messages) = self.0.entry(emission.topic).or_default();
        let new = || LightsEncoder::new(lights_type(emission.topic), Compat::Improved);
        messages.push_back(encoder.get_or_insert_with(new).encode(emission).unwrap());
        if messages.len() > kept {
            messages.pop_front();
        }
        messages.back().iter().flat_map(|last| last.iter()).map(|bytes| bytes.as_ref().len()).sum()
    }
}

/// Measures the encoding of messages beside the gateway.
fn encoding(lights: usize) {
    let phases = [Duration::from_secs(3_600); 3];
    let mut drive = Drive::new(settings(lights, phases, Duration::ZERO));
    drive.passes(Duration::from_secs(1));
    let mut last = BTreeMap::new();
    drive.now = at(drive.engine.next_deadline().after(Duration::from_millis(100)));
    drive.engine.advance(drive.now);
    while let Some(emission) = drive.engine.poll_output() {
        last.insert(emission.topic, emission);
    }
    for (topic, emission) in last {
        let messages = LightsMessage::of(&emission, lights_type(topic), Compat::Improved);
        let size: usize = messages.iter().map(|message| cdr(message).as_ref().len()).sum();
        let converted = median(|| timed(|| black_box(bytes(&emission)).len().min(1)));
        let mut encoders = Encoders::default();
        encoders.encode(&emission, 1);
        encoders.encode(&emission, 1);
        let patched = median(|| {
            timed(|| {
                encoders.encode(&emission, 1);
                1
            })
        });
        println!(
            "traffic lights, {lights} as CDR, {topic:?}: {:.2} ms for {size} bytes, {:.3} ms when nothing changed",
            converted / 1e6,
            patched / 1e6
        );
    }
}

/// Measures a scenario with a number of events, one after the other, for a hundred seconds.
fn events(count: usize) {
    let span = Duration::from_secs(100);
    let event = |number: usize| {
        let value = span * u32::try_from(number).unwrap() / u32::try_from(count).unwrap();
        let test = Test::SimulationTime { rule: Rule::GreaterOrEqual, value };
        let condition = Condition { name: String::new(), test, edge: Edge::None, delay: Duration::ZERO };
        let state = StateText::new(PHASES[number % PHASES.len()].0);
        Event {
            name: format!("event {number}"),
            start: Some(Trigger { groups: vec![vec![condition]] }),
            max_executions: 1,
            action_names: vec![String::new()],
            actions: vec![Action::SetState { target: target(number % LIGHTS_PER_CROSSING), state }],
        }
    };
    let mut settings = settings(LIGHTS_PER_CROSSING, [Duration::from_secs(3_600); 3], Duration::ZERO);
    let events = (0..count).map(event).collect();
    settings.scenario.acts = vec![Act { events, ..Act::default() }];
    let mut drive = Drive::new(settings);
    let time = timed(|| drive.passes(span).min(1));
    println!("traffic lights, {count} events in {} s: {:.0} ms", span.as_secs(), time / 1e6);
}

/// The bytes of a message that is made and encoded anew.
fn bytes(emission: &Emission) -> Vec<CdrBytes> {
    let messages = LightsMessage::of(emission, lights_type(emission.topic), Compat::Improved);
    messages.iter().map(cdr).collect()
}

fn cdr(message: &LightsMessage) -> CdrBytes {
    CdrBytes::encode(message).unwrap()
}

fn lights_type(topic: LightsTopic) -> LightsType {
    match topic {
        LightsTopic::GroundTruth => LightsType::ArrayV1,
        LightsTopic::Camera | LightsTopic::V2i | LightsTopic::Arbiter => LightsType::GroupArray,
        LightsTopic::Markers => LightsType::MarkerArray,
        LightsTopic::Clock => LightsType::Clock,
    }
}

/// Crossings whose lights all go through the phases, each crossing `apart` after the one before.
fn settings(lights: usize, phases: [Duration; 3], apart: Duration) -> LightsSettings {
    let way_ids =
        |crossing: usize| (0..LIGHTS_PER_CROSSING).map(move |light| crossing * LIGHTS_PER_CROSSING + light);
    let lamps = (0..lights).map(|way_id| {
        let lamp = |color| MapLamp { color, position_m: [1.0, 2.0, 3.0] };
        (id(way_id), LampColor::ALL.map(lamp).to_vec())
    });
    let groups: Vec<_> =
        (0..lights).map(|way_id| GroupEntry::new(id(GROUPS + way_id), [id(way_id)])).collect();
    let phase = |crossing: usize, (state, _): (&str, u64), duration| Phase {
        name: state.to_owned(),
        duration: Some(duration),
        entries: way_ids(crossing)
            .map(|way_id| PhaseEntry { target: target(way_id), state: StateText::new(state) })
            .collect(),
    };
    let controllers = (0..lights / LIGHTS_PER_CROSSING).map(|crossing| TrafficSignalController {
        name: format!("crossing {crossing}"),
        reference: (crossing > 0).then(|| Reference {
            controller: ControllerIndex(0),
            delay: apart * u32::try_from(crossing).unwrap(),
        }),
        phases: PHASES
            .into_iter()
            .zip(phases)
            .map(|(state, duration)| phase(crossing, state, duration))
            .collect(),
    });
    let scenario = Scenario {
        controllers: controllers.collect(),
        init: vec![Action::EnableV2i((0..lights).map(id).collect())],
        ..Scenario::default()
    };
    let topics = [LightsTopic::GroundTruth, LightsTopic::Camera, LightsTopic::V2i, LightsTopic::Markers];
    LightsSettings {
        topics: BTreeSet::from(topics),
        ..LightsSettings::new(Arc::new(LightMap::new(lamps, &groups)), scenario, Compat::Improved)
    }
}

fn target(way_id: usize) -> SignalTarget {
    SignalTarget { id: id(way_id), store: TRUTH }
}

fn id(number: usize) -> i64 {
    i64::try_from(number).unwrap()
}

fn at(mono: MonoTime) -> Now {
    Now { mono, wall: WallStamp::from_nanos(i64::try_from(mono.as_nanos()).unwrap()) }
}

/// Processor time of an action, nanoseconds for each of the items that it returns the number of.
fn timed(action: impl FnOnce() -> usize) -> f64 {
    let start = processor_time();
    let count = action();
    processor_time().saturating_sub(start).as_secs_f64() * 1e9 / count as f64
}

fn median(mut sample: impl FnMut() -> f64) -> f64 {
    let mut samples: Vec<_> = (0..SAMPLES).map(|_| sample()).collect();
    samples.sort_by(f64::total_cmp);
    samples[SAMPLES / 2]
}
