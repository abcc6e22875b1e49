//! Injected faults, on virtual time.

use std::process::Command;

use serde_json::Value;

use crate::dds::daemon_on_ros::{add_crossing, light_text};
use crate::support::process::Folder;

/// The output of `replay --json` in 30 s of the crossing, with these faults.
fn replayed(faults: &str) -> String {
    let lights = format!("[ros]\nenabled = false\n[traffic_lights]\nscenario = \"crossing.xosc\"\n{faults}");
    let folder = Folder::with_demo_vehicle("can0", &lights);
    add_crossing(&folder);
    folder.write("quiet.log", "(1000.000000) can0 100#00\n(1030.000000) can0 100#00\n");
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.current_dir(folder.path()).args(["replay", "quiet.log", "--config", "gateway.toml", "--json"]);
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn of_topic(text: &str, part: &str) -> Vec<Value> {
    text.lines().filter(|line| line.contains(part)).map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// From the stamp to the arrival, ms; the recording begins at 1000 s.
#[allow(clippy::cast_precision_loss)] // far below 2^52
fn delay_ms(line: &Value) -> f64 {
    line["t"].as_f64().unwrap() * 1e3 - (light_text::nanos(&line["data"]) - 1_000_000_000_000) as f64 / 1e6
}

fn states(lines: &[Value]) -> Vec<String> {
    lines.iter().map(|line| light_text::of(&line["data"])).collect()
}

const CAMERA: &str = "seed = 7\nlatency_ms = 80\njitter_ms = 40\nloss = 0.1\nmiss = 0.1\nmiss_messages = 3\n\
    unknown = 0.1\nconfidence = 0.8\nconfidence_spread = 0.1\n";
const V2I: &str = "seed = 7\nfreeze = 0.05\nfreeze_messages = 5\nstamp_offset_ms = -250\n\
    confusion = [{ from = \"red\", to = \"green\", probability = 0.2 }]\n";

#[test]
fn the_same_seed_gives_the_same_faults_byte_for_byte_and_another_seed_others() {
    let faults = format!("[traffic_lights.faults.camera]\n{CAMERA}[traffic_lights.faults.v2i]\n{V2I}");
    let first = replayed(&faults);
    assert_eq!(first, replayed(&faults));
    let other = replayed(&faults.replace("seed = 7", "seed = 8"));
    let plain = replayed("");
    for topic in ["/internal/", "/external/", "/v2x/"] {
        let [first, other, plain] = [&first, &other, &plain].map(|text| of_topic(text, topic));
        assert_ne!(first, other, "{topic}");
        assert_ne!(first, plain, "{topic}");
    }
    let truth = [&first, &other, &plain].map(|text| of_topic(text, "/simulation/"));
    assert!(truth[0].len() > 800 && truth.iter().all(|lines| *lines == truth[0]), "no faults there");
}

#[test]
fn each_fault_of_the_configuration_shows_on_its_topic() {
    let plain = replayed("");
    let [plain_camera, plain_v2i] = ["/internal/", "/external/"].map(|topic| of_topic(&plain, topic));
    assert!(plain_camera.iter().chain(&plain_v2i).all(|line| delay_ms(line).abs() < 0.001));

    let faulty =
        replayed(&format!("[traffic_lights.faults.camera]\n{CAMERA}[traffic_lights.faults.v2i]\n{V2I}"));
    let camera = of_topic(&faulty, "/internal/");
    let delays: Vec<_> = camera.iter().map(delay_ms).collect();
    let (shortest, longest) =
        (delays.iter().copied().fold(f64::MAX, f64::min), delays.iter().copied().fold(0.0, f64::max));
    assert!(
        (40.0..45.0).contains(&shortest) && (115.0..=120.0).contains(&longest),
        "{shortest} to {longest} ms"
    );
    let share = |part: usize, all: usize| {
        f64::from(u32::try_from(part).unwrap()) / f64::from(u32::try_from(all).unwrap())
    };
    let lost = 1.0 - share(camera.len(), plain_camera.len());
    assert!((0.05..0.15).contains(&lost), "{lost}");
    let states_published = states(&camera);
    let missing =
        share(states_published.iter().filter(|state| !state.contains("34806")).count(), camera.len());
    // A spell of 3 messages begins with every tenth message that is in none.
    assert!((0.12..0.35).contains(&missing), "{missing}");
    let unknown = share(
        states_published.iter().filter(|state| state.contains("120666: unknown unknown circle")).count(),
        camera.len(),
    );
    assert!((0.03..0.13).contains(&unknown), "{unknown}");
    let sure: Vec<_> = camera
        .iter()
        .flat_map(|line| line["data"]["traffic_light_groups"].as_array().unwrap())
        .flat_map(|group| group["elements"].as_array().unwrap())
        .map(|element| element["confidence"].as_f64().unwrap())
        .collect();
    let mean = sure.iter().sum::<f64>() / f64::from(u32::try_from(sure.len()).unwrap());
    assert!((mean - 0.8).abs() < 0.02 && sure.iter().any(|one| (one - mean).abs() > 0.15), "{mean}");

    let v2i = of_topic(&faulty, "/external/");
    assert_eq!(v2i.len(), plain_v2i.len(), "a frozen sender goes on sending");
    let stamps: Vec<_> = v2i.iter().map(|line| light_text::nanos(&line["data"])).collect();
    let repeated = share(stamps.windows(2).filter(|pair| pair[0] == pair[1]).count(), stamps.len());
    assert!((0.08..0.35).contains(&repeated), "{repeated}");
    assert!(v2i.iter().map(delay_ms).any(|delay| (delay - 250.0).abs() < 0.001), "the stamp is off");
    let confused =
        states(&v2i).iter().filter(|state| state.contains("red") && state.contains("green")).count();
    assert!(confused > 5, "one group is taken for green, the other is not: {confused}");
}
