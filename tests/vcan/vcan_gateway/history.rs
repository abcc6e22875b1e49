//! From an ERROR in the history to its frames.

use std::process::Command;

use serde_json::Value;

use super::{Folder, HAZARD, HAZARD_OFF, OFF, PATIENT, Process, Sender, TURN, UNDEFINED, Vcan};
use crate::support::http::{body, free_address, get};
use crate::support::prerequisite::require;
use crate::support::waiting::{described, wait_for};

/// The data of the report's script.
fn data(page: &str) -> Value {
    let (_, rest) = page.split_once("id=\"data\">").expect(page);
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

#[test]
fn every_error_of_a_fault_leads_to_the_frame_in_the_black_box_that_caused_it() {
    let vcan = require!(Vcan::new("vcan21"));
    let address = free_address();
    let keys = format!(
        "[black_box]\nfolder = \"box\"\nafter_s = 1\n[http]\naddress = \"{address}\"\n[status]\nsocket = \"s\"\n\
         [ros]\nenabled = false\n"
    );
    let folder = Folder::with_demo_vehicle("vcan21", &keys);
    folder.append("demo_vehicle.toml", PATIENT);
    let sender = Sender::start(&vcan, &[(TURN, OFF), (HAZARD, HAZARD_OFF)]);
    let mut gateway = Process::run(&folder);
    gateway.wait_for_log("hazard_lights: publishing");
    gateway.wait_for_log("turn_indicators: publishing");
    sender.set(TURN, UNDEFINED);
    gateway.wait_for_log("turn_indicators: invalid");
    sender.set(TURN, OFF);
    gateway.wait_for_log("black box written");
    let error = wait_for(described(|| format!("an ERROR with frames: {:?}", gateway.log())), || {
        let page: Value = serde_json::from_str(body(&get(address, "/history?level=ERROR")?)).ok()?;
        // A slow start may be an ERROR as well, before there is a frame.
        let is_invalid =
            |entry: &&Value| entry["text"].as_str().is_some_and(|text| text.starts_with("invalid"));
        let mut entries = page["entries"].as_array()?.iter().filter(is_invalid);
        entries.find(|entry| entry["black_box"].is_object()).cloned()
    });
    assert_eq!(error["subject"], "turn_indicators", "{error}");
    assert!(error["remedy"].as_str().is_some_and(|remedy| !remedy.is_empty()), "{error}");
    let page = get(address, &format!("/frames/{}", error["number"])).unwrap();
    assert!(page.starts_with("HTTP/1.1 200 "), "{page}");
    let data = data(&page);
    let at_s = data["opened_at"]["at_s"].as_f64().unwrap();
    assert_eq!(data["opened_at"]["label"], "turn_indicators");
    let lane = data["lanes"]
        .as_array()
        .unwrap()
        .iter()
        .find(|lane| lane["group"] == "diagnostics" && lane["label"] == "turn_indicators");
    let lane = lane
        .unwrap_or_else(|| panic!("no lane of the fault: {}\n{error}\n{:?}", data["lanes"], gateway.log()));
    let spans = lane["spans"].as_array().unwrap();
    let is_it = |span: &&Value| span[2] == "error" && (span[0].as_f64().unwrap() - at_s).abs() < 1e-3;
    let span = spans.iter().find(is_it).unwrap_or_else(|| panic!("{at_s}: {spans:?}"));
    let frame = span[4].as_u64().unwrap_or_else(|| panic!("no frame: {error}, {spans:?}"));
    let frame = &data["frames"][usize::try_from(frame).unwrap()];
    assert_eq!(
        (&frame["id"], &frame["bytes"]),
        (&"2A5".into(), &"00 00 06 00 00 00 00 00".into()),
        "{frame}"
    );
    // The same on the command line, with the file's name.
    let mut command = Command::new(env!("CARGO_BIN_EXE_signal-gateway"));
    command.args(["status", "--history=ERROR", "--socket"]).arg(folder.path().join("s"));
    let output = command.output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let recording = error["black_box"]["recording"].as_str().unwrap();
    assert!(text.contains(&format!("frames: black box fault-*-{recording}.log, at ")), "{text}");
    assert!(text.contains("turn_indicators") && !text.contains(" OK "), "{text}");
    // Once it is deleted, the answer says so.
    for file in std::fs::read_dir(folder.path().join("box")).unwrap() {
        std::fs::remove_file(file.unwrap().path()).unwrap();
    }
    let gone = get(address, &format!("/frames/{}", error["number"])).unwrap();
    assert!(gone.starts_with("HTTP/1.1 404 ") && gone.contains("is no longer there"), "{gone}");
}
