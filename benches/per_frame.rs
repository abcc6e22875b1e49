//! The cost of one frame: filter, decode, state, decision, and taking the outputs away.
//!
//! `cargo bench --bench per_frame`. Time stands still, so that neither the period of reports nor the refresh
//! of diagnostics hides in the mean; the refresh has a line of its own. Afterwards cantools decodes the same
//! frames with the same DBC, if `SIGNAL_GATEWAY_PEER_PYTHON` has it, and so does the code that dbc-codegen
//! makes. The limits are ratios to them, which hold on any machine.

#![allow(clippy::unwrap_used, clippy::cast_precision_loss)] // a program for developers, times far below 2^52

#[path = "comparison.rs"]
mod comparison;
#[path = "demo_frames.rs"]
mod demo_frames;

use std::hint::black_box;
use std::path::Path;
use std::process::{Command, ExitCode};
use std::time::Duration;

use can_signal::can::frame::{CanId, Frame};
use can_signal::can::input::CanInput;
use can_signal::can::link::{BusIndex, LinkState};
use can_signal::dbc::codec::{Layout, SignalCodec};
use can_signal::validation::integrity::checksum::{Checksum, ChecksumRule, CrcRule, Sum};
use can_signal::validation::integrity::counter::{Counter, CounterRule};
use can_signal::validation::integrity::e2e::{DataIdMode, E2e, E2eProfile};
use can_signal::validation::integrity::{IntegrityChecker, MessageIntegrity, Protection};
use can_signal::validation::table::MessageIndex;
use comparison::{Row, figure, peers, processor_time};
use criterion::Criterion;
use demo_frames::{
    CHANGED, FramePair, IRRELEVANT, LEFT, NOW, RIGHT, SIGN_OF_LIFE, UNCHANGED, gateway, input, take,
};
use gateway_base::time::Now;
use gateway_core::gateway::Gateway;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;

fn main() -> ExitCode {
    let mut criterion = Criterion::default()
        .without_plots()
        .warm_up_time(Duration::from_millis(500))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    let frames =
        [UNCHANGED, CHANGED, SIGN_OF_LIFE, IRRELEVANT].map(|frames| time_of_frames(&mut criterion, &frames));
    time_of_a_check(&mut criterion);
    for (name, checked) in [("gateway with all checks", true), ("gateway without checks", false)] {
        time_with_checks(&mut criterion, name, checked);
    }
    criterion.bench_function("next deadline", |bencher| {
        let gateway = gateway();
        bencher.iter(|| black_box(&gateway).next_deadline());
    });
    criterion.bench_function("frame, with reports and diagnostics due", |bencher| {
        let (mut gateway, mut now) = (gateway(), NOW);
        bencher.iter(|| {
            let time = Duration::from_millis(250);
            now = Now { mono: now.mono.after(time), wall: now.wall.after(time) };
            take(&mut gateway, input(LEFT), now);
        });
    });
    criterion.final_summary();
    match frames {
        [Some(unchanged), Some(changed), Some(sign_of_life), Some(irrelevant)] => {
            compare(unchanged, changed, sign_of_life, irrelevant)
        }
        _ => ExitCode::SUCCESS,
    }
}

/// Feeds the two frames in turn. Returns what a tenth of the samples stay below, ns: the machine's other work
/// adds to the rest; `None` when there are next to none, as in `--test` or when another benchmark was
/// requested.
fn time_of_frames(criterion: &mut Criterion, frames: &FramePair) -> Option<f64> {
    let (mut gateway, inputs) = frames.prepared();
    let mut samples = Vec::new();
    criterion.bench_function(frames.name, |bencher| {
        bencher.iter_custom(|count| {
            let start = processor_time();
            for (input, _) in inputs.iter().cycle().zip(0..count) {
                take(&mut gateway, *input, NOW);
            }
            let spent = processor_time().saturating_sub(start);
            samples.push(spent.as_secs_f64() * 1e9 / count as f64);
            spent
        });
    });
    samples.sort_by(f64::total_cmp);
    (samples.len() >= 10).then(|| samples[samples.len() / 10])
}

/// The whole handling of the Civic's frames, which have a checksum and a counter, checked or taken as
/// they are.
fn time_with_checks(criterion: &mut Criterion, name: &str, checked: bool) {
    let profile =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("config/vehicles/honda_civic_hatchback_2017.toml");
    let mut settings = load_profile(&Disk, &profile).unwrap().gateway;
    let message = &mut settings.lights.table.messages[0];
    let Some(Protection::Fields { checksum: Some(checksum), .. }) =
        message.integrity.clone().map(|integrity| integrity.protection)
    else {
        unreachable!("the profile has a checksum");
    };
    if !checked {
        message.integrity = None;
    }
    let frames = [0, 1, 2, 3].map(|counter| {
        let mut data = [0, 0, 0, 0b100, 0, 0, 0, counter << 4];
        assert!(checksum.protect(message.ids.described(), &mut data));
        let frame = Frame::classic(message.ids.described(), &data).unwrap();
        CanInput::Frame { bus: BusIndex(0), frame, stamp: NOW.wall }
    });
    let mut gateway = Gateway::new(settings, LinkState::Up, NOW);
    let mut round = frames.iter().cycle();
    for _ in 0..frames.len() {
        take(&mut gateway, *round.next().unwrap(), NOW);
    }
    criterion.bench_function(name, |bencher| {
        bencher.iter(|| take(&mut gateway, *round.next().unwrap(), NOW));
    });
    let observations = gateway.lights().observations();
    let rejected = observations.integrity_counts(MessageIndex(0)).map(|counts| counts.rejected());
    assert_eq!(rejected, checked.then_some(1), "all frames but the first are good");
}

/// The cost of the integrity check of a message, by kind of check.
fn time_of_a_check(criterion: &mut Criterion) {
    let id = CanId::Standard(0x318);
    let field = |start, length| SignalCodec::new(Layout::unsigned(start, length), 8).unwrap();
    let fields = |rule, checksum, counter| {
        let checksum = Checksum::new(rule, checksum).unwrap();
        let protect = checksum.clone();
        let counter = Counter::new(CounterRule::new(0, 3).unwrap(), counter).unwrap();
        let protection = Protection::Fields { checksum: Some(checksum), counter: Some(counter) };
        (
            protection,
            Box::new(move |_, data: &mut [u8]| protect.protect(id, data))
                as Box<dyn Fn(u32, &mut [u8]) -> bool>,
        )
    };
    let e2e = |profile| {
        let profile = E2e::new(profile, 0, 8).unwrap();
        let protect = profile.clone();
        let protection = Protection::e2e(profile, 1).unwrap();
        (
            protection,
            Box::new(move |counter, data: &mut [u8]| protect.protect(counter, data))
                as Box<dyn Fn(u32, &mut [u8]) -> bool>,
        )
    };
    let p01 = E2eProfile::P01 { data_id: 0x123, mode: DataIdMode::Both };
    for (name, (protection, protect)) in [
        ("check, Honda's nibble and counter", fields(ChecksumRule::Honda, field(56, 4), field(60, 2))),
        (
            "check, Toyota's sum and a counter",
            fields(ChecksumRule::Sum(Sum::TOYOTA), field(56, 8), field(48, 2)),
        ),
        (
            "check, J1850 and a counter",
            fields(ChecksumRule::Crc(CrcRule::j1850()), field(56, 8), field(48, 2)),
        ),
        ("check, E2E profile 1", e2e(p01)),
        ("check, E2E profile 5", e2e(E2eProfile::P05 { data_id: 0x1234 })),
    ] {
        // As many frames as all their counters divide, so that they can go round.
        let frames: Vec<_> = (0..256 * 15)
            .map(|counter: u32| {
                let mut data = [0x5A; 8];
                data[6] = (counter % 4) as u8;
                data[7] = data[6] << 4;
                assert!(protect(if name.ends_with('1') { counter % 15 } else { counter }, &mut data));
                Frame::classic(id, &data).unwrap()
            })
            .collect();
        let mut checker = IntegrityChecker::new(MessageIntegrity {
            length: Some(8),
            protection,
            window: None,
            forget_after: None,
        });
        let mut round = frames.iter().cycle();
        criterion.bench_function(name, |bencher| {
            bencher.iter(|| checker.check(black_box(round.next().unwrap()), NOW.mono));
        });
        assert_eq!(checker.counts().rejected(), 1, "{name}: all but the first are good");
    }
}

/// Prints the figures beside those of peers.
fn compare(unchanged: f64, changed: f64, sign_of_life: f64, irrelevant: f64) -> ExitCode {
    let row = |what, ours, peer, theirs, aim, limit| {
        Row { what, ours, peer, theirs, unit: "ns", aim, limit }.print()
    };
    let what = "frame, sign of life only";
    let mut good = row(what, sign_of_life, "frame that is not relevant", irrelevant, Some(2.0), 4.0);
    let names = ["frame, value unchanged", "frame, value changed"];
    if let Some(peers) = peers(&["frames"]) {
        for (peer, aims, limits) in [
            ("decode by hand", [None, None], [60.0, 250.0]),
            ("decode with dbc-codegen", [Some(4.0), Some(8.0)], [12.0, 60.0]),
        ] {
            for index in [0, 1] {
                let (ours, theirs) = ([unchanged, changed][index], figure(&peers, peer));
                good &= row(names[index], ours, peer, theirs, aims[index], limits[index]);
            }
        }
    }
    match cantools() {
        Ok(Some(theirs)) => good &= row(names[1], changed, "decode with cantools", theirs, None, 0.5),
        Ok(None) => println!(
            "skipped: comparison with cantools: SIGNAL_GATEWAY_PEER_PYTHON is not set (a Python with \
             cantools==45.1.0)"
        ),
        Err(error) => {
            println!("cantools failed: {error}");
            good = false;
        }
    }
    if good { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Nanoseconds for decoding one of the frames with cantools; `None` without it.
fn cantools() -> Result<Option<f64>, String> {
    let Some(python) = std::env::var_os("SIGNAL_GATEWAY_PEER_PYTHON") else { return Ok(None) };
    let project = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut command = Command::new(python);
    command.arg(project.join("tests/peer/cantools_bench.py")).arg("3");
    command.arg(project.join("dbc/demo_vehicle.dbc"));
    for (id, data) in [LEFT, RIGHT] {
        command.arg(Frame::classic(CanId::Standard(id), &data).unwrap().to_string());
    }
    let output = command.output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    printed.trim().parse().map(Some).map_err(|_| String::from_utf8_lossy(&output.stderr).into_owned())
}
