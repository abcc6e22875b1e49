//! The examples of checksums in `docs/vehicle-lights.md`, each on frames with the checksum that opendbc
//! computes.

use std::fmt::Write as _;

use can_signal::can::frame::{CanId, Frame};
use can_signal::validation::integrity::Protection;
use can_signal::validation::integrity::checksum::Checksum;
use serde_json::json;
use signal_gateway::config::files::Disk;
use signal_gateway::config::load_profile;

use super::ask;
use crate::pure::vehicles::project;
use crate::support::prerequisite::{opendbc_python, require};

const FRAMES: usize = 600;

/// A row of the table: the value of the key `checksum`, and file and message of opendbc.
#[derive(Debug)]
struct Example {
    toml: String,
    counterpart: Option<(String, String)>,
}

fn examples() -> Vec<Example> {
    let text = std::fs::read_to_string(project().join("docs/vehicle-lights.md")).unwrap();
    let (_, rest) = text.split_once("<!-- checksums -->\n").unwrap();
    let (table, _) = rest.split_once("<!-- end of checksums -->").unwrap();
    let rows = table.lines().skip(2).map(|row| {
        let cells: Vec<_> = row.split('|').map(str::trim).collect();
        let [_, _, _, toml, counterpart, _] = cells[..] else { panic!("{row}") };
        let toml = toml.trim_matches('`').to_owned();
        let counterpart =
            counterpart.split_once(' ').map(|(file, message)| (file.to_owned(), message.to_owned()));
        Example { toml, counterpart }
    });
    rows.collect()
}

/// The checksum of an example, bound to a message of this layout by a profile and a DBC.
fn bound(example: &Example, id: u64, length: u64, field: &str) -> Checksum {
    let folder = tempfile::tempdir().unwrap();
    let mut dbc = format!("BO_ {id} M: {length} X\n SG_ TURN : 8|2@1+ (1,0) [0|3] \"\" X\n");
    writeln!(dbc, " SG_ CHECKSUM : {field}+ (1,0) [0|0] \"\" X").unwrap();
    std::fs::write(folder.path().join("m.dbc"), dbc).unwrap();
    let profile = format!(
        "name = \"M\"\n[bus.b]\ndbc = \"m.dbc\"\n[message.M]\ntimeout_ms = 500\nchecksum = {}\n\
         [turn]\nsignal = \"M.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n[hazard]\nfrom = \"not_visible\"\n",
        example.toml
    );
    let path = folder.path().join("m.toml");
    std::fs::write(&path, profile).unwrap();
    let settings = load_profile(&Disk, &path).unwrap_or_else(|refused| panic!("{}: {refused}", example.toml));
    let integrity = settings.gateway.lights.table.messages[0].integrity.clone();
    let Protection::Fields { checksum: Some(checksum), .. } = integrity.unwrap().protection else {
        panic!("{}", example.toml)
    };
    checksum
}

#[test]
fn every_example_of_a_checksum_is_accepted() {
    let examples = examples();
    assert!(examples.len() >= 15);
    for example in examples {
        let is_nibble = ["\"honda\"", "\"psa\""].iter().any(|kind| example.toml.contains(kind));
        let is_wide = ["\"hyundai_fd\"", "\"crc16\""].iter().any(|kind| example.toml.contains(kind));
        let field = if is_nibble {
            "56|4@1"
        } else if is_wide {
            "0|16@1"
        } else {
            "56|8@1"
        };
        bound(&example, 256, 8, field);
    }
}

#[test]
fn checksums_are_those_of_opendbc() {
    let python = require!(opendbc_python());
    let examples: Vec<_> = examples().into_iter().filter(|example| example.counterpart.is_some()).collect();
    let requests: Vec<_> = examples
        .iter()
        .map(|example| {
            let (dbc, message) = example.counterpart.as_ref().unwrap();
            json!({ "dbc": dbc, "message": message, "checksums": FRAMES })
        })
        .collect();
    let answers = ask(&python, &requests);
    assert_eq!(answers.len(), examples.len());
    for (example, answer) in examples.iter().zip(answers) {
        let (id, length) = (answer["id"].as_u64().unwrap(), answer["length"].as_u64().unwrap());
        let checksum = bound(example, id, length, answer["field"].as_str().unwrap());
        let frames = answer["frames"].as_array().unwrap();
        assert_eq!(frames.len(), FRAMES);
        for text in frames {
            let digits = text.as_str().unwrap();
            let bytes =
                (0..digits.len() / 2).map(|at| u8::from_str_radix(&digits[at * 2..][..2], 16).unwrap());
            let id = CanId::standard(u32::try_from(id).unwrap()).unwrap();
            let frame = Frame::fd(id, &bytes.collect::<Vec<_>>()).unwrap();
            let (stored, expected) = checksum.compare(&frame).unwrap();
            assert_eq!(stored, expected, "{example:?} {frame}");
        }
    }
}
