//! `check` as a gate: it ends with 0 for each healthy recording of the test data, and with 4 for each spoilt
//! one, whose finding has its kind and its remedy.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use boon::{Compiler, Schemas};
use serde_json::Value;

use crate::support::prerequisite::{require, shared_data};
use crate::support::program::{Ran, run};

/// A public recording that is healthy with this configuration.
struct Healthy {
    file: &'static str,
    configuration: &'static str,
}

const KONA: Healthy = Healthy {
    file: "eld-kona-turnonlog.log",
    configuration: "profile = \"hyundai_kia\"\n[can.powertrain]\ninterface = \"can0\"\n\
                    [vehicle_geometry]\nwheel_base_m = 2.6\nsteering_ratio = 13.73\n",
};
const VOLVO: Healthy = Healthy {
    file: "volvo-s60-2002-key-steering.csv",
    configuration: "profile = \"volvo_s60_2002\"\n[can.body]\ninterface = \"can0\"\n\
                    [reports]\nhazard_not_visible = \"acknowledged\"\n",
};
/// The wheel base and steering ratio of opendbc's list.
const RAV4: Healthy = Healthy {
    file: "comma2k19-rav4-b0c9d232-seg40.candump.log.gz",
    configuration: "profile = \"toyota_nodsu\"\n[can.body]\ninterface = \"can0\"\n\
                    [vehicle_geometry]\nwheel_base_m = 2.65\nsteering_ratio = 16.88\n",
};

/// A public recording that is not healthy, with its profile, the kind of a finding, and the reason.
struct Unhealthy {
    file: &'static str,
    profile: &'static str,
    kind: &'static str,
    reason: &'static str,
}

#[rustfmt::skip]
const UNHEALTHY: [Unhealthy; 15] = [
    unhealthy("icsim-sample-can.log", "acura_ilx_2016", "message_not_received", "the bus carries neither the steering angle nor the gear"),
    unhealthy("eld-civic-type-r-2019-turnonanddrive.log", "honda_civic_hatchback_2017", "message_missing", "the recorder lost frames for seconds"),
    unhealthy("hyundai-kona-ev-2019-pcan-ccan-power-cycle.csv.gz", "hyundai_kia", "recording_fault", "its two buses are not in the order of time"),
    unhealthy("eld-camaro-engineon.log", "gm_global_a", "report_withheld", "the gear selector sends a value that no source names"),
    unhealthy("eld-durango-keyon.log", "chrysler_pacifica_2017", "report_withheld", "after the key is turned, values arrive that no source names"),
    unhealthy("eld-gt350-2reverselog.trc", "ford_lincoln", "message_not_received", "the bus carries neither yaw rate nor steering angle"),
    unhealthy("eld-gt350-engineoffthenonthenoff.log", "ford_lincoln", "message_not_received", "the bus carries neither yaw rate nor steering angle"),
    unhealthy("ford-mustang-s550.txt.gz", "ford_lincoln", "message_missing", "the recorder lost frames, and the bus carries no yaw rate"),
    unhealthy("eld-subaru-va-cruise.log", "subaru_outback_2015", "message_not_received", "the bus carries neither the steering angle nor the gear"),
    unhealthy("hyundai-i30-serial.txt.gz", "hyundai_i30_2014", "recording_fault", "lines are cut or joined"),
    unhealthy("ford-falcon-fg-candump-2021-01-20_205722.log.gz", "ford_falcon_fg", "undefined_value", "a value that is in no value table, for 2.5 s"),
    unhealthy("savvycan-candump.log", "tesla_model_s_powertrain", "bus_silent", "the recorder lost everything eight times"),
    unhealthy("savvycan-GVRET_Log.csv", "tesla_model_s_powertrain", "integrity_rejected", "the same drive by another recorder, with counters that repeat and jump"),
    unhealthy("savvycan-BusMasterLog.log", "tesla_model_s_powertrain", "integrity_rejected", "the same drive by another recorder, with counters that repeat and jump"),
    unhealthy("css-truck-j1939-00000001.candump.log.gz", "j1939_truck", "message_not_received", "the truck sends no VDC2, and hazard lights as not available"),
];

const fn unhealthy(
    file: &'static str,
    profile: &'static str,
    kind: &'static str,
    reason: &'static str,
) -> Unhealthy {
    Unhealthy { file, profile, kind, reason }
}

/// Files of the test data that no profile can be checked with, with the reason.
const NOT_CHECKED: [(&str, &str); 9] = [
    ("NOTES.md", "not a recording"),
    ("candrive-5de-labelled-frames.csv", "single frames without times"),
    ("candrive-opel-labelled-frames.csv", "single frames without times"),
    ("comma2k19-rav4-b0c9d232-seg40.truth.csv.gz", "measured speeds and angles, not frames"),
    ("crysys-48.csv.gz", "a car for which there is no profile"),
    ("css-truck-j1939-00000001.MF4", "the recording of the candump log of this name, in another format"),
    ("e2e-known-good-frames.csv", "single frames without times"),
    ("eld-evox-5000rev-asc.trc.gz", "a Mitsubishi, for which there is no profile"),
    ("remora-truck-engine-on.log", "a truck without the lighting message of the profile"),
];

fn checked(folder: &Path, log: &Path, configuration: &str) -> Ran {
    fs::write(folder.join("gateway.toml"), configuration).unwrap();
    run(folder, &["check", log.to_str().unwrap(), "--config", "gateway.toml", "--json"])
}

fn assert_healthy(shared: &Path, healthy: &Healthy) {
    let folder = tempfile::tempdir().unwrap();
    let log = shared.join("can-logs").join(healthy.file);
    let checked = checked(folder.path(), &log, healthy.configuration);
    assert_eq!(checked.code, 0, "{}: {:#?}", healthy.file, concerns(&checked));
    let notes = &checked.json()[0]["notes"];
    assert!(notes.as_u64() > Some(0), "what is expected is a note: {notes}");
}

/// The warnings and errors of a check, each with its remedy.
fn concerns(checked: &Ran) -> Vec<Value> {
    let report = checked.json().into_iter().next().unwrap_or_default();
    let findings = report["findings"].as_array().cloned().unwrap_or_default();
    findings.into_iter().filter(|finding| finding["severity"] != "note").collect()
}

/// The kinds of the warnings and errors of a check that ends with 4.
fn kinds(checked: &Ran) -> BTreeSet<String> {
    assert_eq!(checked.code, 4, "{}", checked.text());
    let concerns = concerns(checked);
    assert!(concerns.iter().all(|finding| finding["remedy"].is_string()), "{concerns:#?}");
    concerns.iter().map(|finding| finding["kind"].as_str().unwrap().to_owned()).collect()
}

#[test]
fn each_recording_of_the_test_data_is_healthy_or_has_a_reason() {
    let folder = require!(shared_data()).join("can-logs");
    let files = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
    let files: BTreeSet<_> = files.map(|name| name.to_string_lossy().into_owned()).collect();
    let healthy = [&KONA, &VOLVO, &RAV4].map(|healthy| healthy.file);
    let unhealthy = UNHEALTHY.iter().map(|row| (row.file, row.reason));
    let others = NOT_CHECKED.into_iter().chain(unhealthy).inspect(|(file, reason)| {
        assert!(!reason.is_empty(), "{file}");
    });
    let listed: BTreeSet<_> =
        healthy.into_iter().chain(others.map(|(file, _)| file)).map(str::to_owned).collect();
    assert_eq!(files, listed);
}

#[test]
fn healthy_recordings_end_with_0() {
    let shared = require!(shared_data());
    assert_healthy(&shared, &KONA);
    assert_healthy(&shared, &VOLVO);
}

#[test]
fn without_its_dimensions_a_healthy_recording_ends_with_4_and_the_row_of_the_car() {
    let shared = require!(shared_data());
    let folder = tempfile::tempdir().unwrap();
    let (configuration, _) = KONA.configuration.split_once("[vehicle_geometry]").unwrap();
    let checked = checked(folder.path(), &shared.join("can-logs").join(KONA.file), configuration);
    assert_eq!(kinds(&checked), ["missing_dimension".to_owned()].into());
    let remedy = concerns(&checked)[0]["remedy"].as_str().unwrap().to_owned();
    assert!(remedy.contains("config/cars/models.toml") && remedy.contains("steering_ratio = "), "{remedy}");
}

/// A car whose turn message has a counter and a checksum, with hazard lights and a steering wheel.
const DBC: &str = "VERSION \"\"\nBO_ 193 LIGHTS: 4 X\n SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X\n SG_ COUNTER : 8|4@1+ (1,0) [0|15] \"\" X\n \
                   SG_ CHECKSUM : 24|8@1+ (1,0) [0|255] \"\" X\nBO_ 194 HAZARD: 1 X\n SG_ ON : 0|1@1+ (1,0) [0|1] \"\" X\n\
                   BO_ 195 WHEEL: 2 X\n SG_ ANGLE : 0|16@1- (0.1,0) [0|0] \"\" X\n\
                   VAL_ 193 TURN 0 \"Off\" 1 \"Left\" 2 \"Right\" ;\n";
const PROFILE: &str = "name = \"Car\"\n[bus.body]\ndbc = \"car.dbc\"\n\
                       [message.LIGHTS]\ntimeout_ms = 500\ncounter = { signal = \"COUNTER\", max_step = 4 }\n\
                       checksum = { kind = \"sum8\", signal = \"CHECKSUM\" }\n\
                       [message.WHEEL]\ntimeout_ms = 500\n\
                       [turn]\nsignal = \"LIGHTS.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
                       [hazard]\nfrom = \"signal\"\nsignal = \"HAZARD.ON\"\noff = [0]\non = [1]\n\
                       [message.HAZARD]\ntimeout_ms = 500\n\
                       [steering]\nwheel = { signal = \"WHEEL.ANGLE\", unit = \"deg\", positive = \"left\", valid = [\"-7000..=7000\"] }\n";
const CONFIGURATION: &str = "profile = \"car.toml\"\n[can.body]\ninterface = \"can0\"\n\
                             [vehicle_geometry]\nwheel_base_m = 2.7\nsteering_ratio = 16.0\n";

/// A frame of the drive: step of 100 ms, identifier and data.
#[derive(Clone)]
struct Line {
    step: u32,
    interface: &'static str,
    id: u32,
    data: Vec<u8>,
}

fn lights(step: u32, turn: u8) -> Line {
    let counter = u8::try_from(step % 16).unwrap();
    Line { step, interface: "can0", id: 0x0C1, data: vec![turn, counter, 0, turn + counter] }
}

/// 24 s of left, right and hazard.
fn drive() -> Vec<Line> {
    let line = |step: u32, id, data: &[u8]| Line { step, interface: "can0", id, data: data.to_vec() };
    (0..240)
        .flat_map(|step| {
            let turn = [0, 1, 0, 2, 0, 0][(step / 40) as usize];
            [
                lights(step, turn),
                line(step, 0x0C2, &[u8::from(step >= 210)]),
                line(step, 0x0C3, &[u8::try_from(step).unwrap(), 0]),
            ]
        })
        .collect()
}

fn candump(lines: &[Line]) -> String {
    let mut text = String::new();
    for Line { step, interface, id, data } in lines {
        let at = format!("{}.{}00000", 1 + step / 10, step % 10);
        let data: String = data.iter().map(|byte| format!("{byte:02X}")).collect();
        writeln!(text, "({at}) {interface} {id:03X}#{data}").unwrap();
    }
    text
}

/// Checks a drive with the car's files, of which one text is replaced.
fn check_drive(log: &str, [from, to]: [&str; 2]) -> Ran {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("car.dbc", DBC), ("car.toml", PROFILE)] {
        fs::write(folder.path().join(name), text.replace(from, to)).unwrap();
    }
    fs::write(folder.path().join("drive.log"), log).unwrap();
    checked(folder.path(), Path::new("drive.log"), &CONFIGURATION.replace(from, to))
}

const UNCHANGED: [&str; 2] = ["\0", "\0"];

#[test]
fn a_healthy_drive_ends_with_0_and_each_spoilt_one_with_4_and_its_kind() {
    let healthy = check_drive(&candump(&drive()), UNCHANGED);
    assert_eq!(healthy.code, 0, "{}", healthy.text());
    let middle = 60..80;
    let spoilt = |spoil: &dyn Fn(Line) -> Option<Line>| {
        candump(&drive().into_iter().filter_map(spoil).collect::<Vec<_>>())
    };
    let is_at = |line: &Line| middle.contains(&line.step);
    let is_turn = |line: &Line| line.id == 0x0C1;
    let text = candump(&drive());
    #[rustfmt::skip]
    let drives: [(&str, String); 13] = [
        ("message_not_received", spoilt(&|line| (line.id != 0x0C2).then_some(line))),
        ("message_missing", spoilt(&|line| (!(is_turn(&line) && is_at(&line))).then_some(line))),
        ("bus_silent", spoilt(&|line| (!is_at(&line)).then_some(line))),
        ("recording_fault", text.replacen("#0100", "#01X0", 3)),
        ("error_frames", format!("{text}(30.000000) can0 20000088#0000000000000000\n")),
        ("undefined_value", spoilt(&|line| Some(if is_turn(&line) && is_at(&line) { lights(line.step, 3) } else { line }))),
        ("integrity_rejected", spoilt(&|mut line| {
            if is_turn(&line) && is_at(&line) { line.data[3] ^= 0x55; }
            Some(line)
        })),
        ("wrong_length", spoilt(&|mut line| {
            if line.id == 0x0C2 && is_at(&line) { line.data.push(0); }
            Some(line)
        })),
        ("wrong_period", spoilt(&|line| (line.id != 0x0C2 || line.step % 10 == 0).then_some(line))),
        ("implausible_states", spoilt(&|line| {
            let flash = u8::from(line.step / 3 % 2 == 0);
            Some(if is_turn(&line) { lights(line.step, flash) } else { line })
        })),
        ("foreign_interface", spoilt(&|mut line| {
            line.interface = if is_turn(&line) { "can7" } else { "can8" };
            Some(line)
        })),
        ("wrong_profile", spoilt(&|mut line| {
            line.id += 0x100;
            Some(line)
        })),
        ("report_withheld", spoilt(&|mut line| {
            if line.id == 0x0C3 && is_at(&line) { line.data = vec![0xFF, 0x7F]; }
            Some(line)
        })),
    ];
    for (kind, log) in &drives {
        let kinds = kinds(&check_drive(log, UNCHANGED));
        assert!(kinds.contains(*kind), "{kind} is not in {kinds:?}");
    }
    for (kind, change) in [
        ("missing_dimension", ["steering_ratio = 16.0\n", ""]),
        ("unused_integrity", ["checksum = { kind = \"sum8\", signal = \"CHECKSUM\" }\n", ""]),
        ("opposite_side", ["1 \"Left\" 2 \"Right\"", "1 \"Right\" 2 \"Left\""]),
        (
            "hazard_not_visible",
            [
                "from = \"signal\"\nsignal = \"HAZARD.ON\"\noff = [0]\non = [1]\n[message.HAZARD]\ntimeout_ms = 500\n",
                "from = \"not_visible\"\n",
            ],
        ),
    ] {
        let kinds = kinds(&check_drive(&text, change));
        assert_eq!(kinds, [kind.to_owned()].into(), "{kind}");
    }
}

#[test]
fn the_json_is_valid_by_the_shipped_schema_which_check_prints() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/schema/check.schema.json");
    let printed = run(".", &["check", "--schema"]).succeeded();
    assert_eq!(printed, fs::read_to_string(&path).unwrap());
    let mut schemas = Schemas::new();
    let index = Compiler::new().compile(path.to_str().unwrap(), &mut schemas).unwrap();
    let text = candump(&drive());
    for log in [text.clone(), text.replace("0C2#", "1C2#")] {
        let report = check_drive(&log, UNCHANGED).json().remove(0);
        if let Err(error) = schemas.validate(&report, index) {
            panic!("{error:#}: {report}");
        }
    }
    let wrong = serde_json::json!({ "findings": [{ "kind": "other" }] });
    assert!(schemas.validate(&wrong, index).is_err());
}

mod slow {
    use super::*;

    #[test]
    #[ignore = "slow: tests/run --full"]
    fn a_healthy_drive_of_a_minute_ends_with_0_and_each_other_recording_with_its_kind() {
        let shared = require!(shared_data());
        assert_healthy(&shared, &RAV4);
        for Unhealthy { file, profile, kind, reason } in &UNHEALTHY {
            let folder = shared.join("can-logs");
            let mut arguments = vec!["check", file, "--profile", profile, "--json"];
            if *profile == "hyundai_kia" {
                arguments.extend(["--map", "can0=powertrain"]);
            }
            let kinds = kinds(&run(folder, &arguments));
            assert!(kinds.contains(*kind), "{file}: {reason}: {kinds:?}");
        }
    }
}
