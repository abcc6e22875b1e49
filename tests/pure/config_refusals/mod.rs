//! Configurations that must be refused, and with which words: place, key, reason and remedy.

mod commands;
mod garbled;
mod gateway_file;
mod integrity_keys;
mod reference;
mod sources;
mod traffic_lights;
mod turn_signal;
mod v2i;
mod vehicle_profile;

use std::path::Path;

use signal_gateway::config::Problem;
use signal_gateway::config::{Overrides, Settings, load};

use crate::support::files::MemoryFiles;

/// A configuration that is accepted; each test spoils a bit of it.
fn sound() -> MemoryFiles {
    MemoryFiles::new([
        ("gateway.toml", GATEWAY),
        ("car.toml", PROFILE),
        ("car.dbc", DBC),
        ("map.osm", MAP),
        ("empty.osm", "<osm></osm>"),
        ("torn.osm", "<osm><node id='1'"),
    ])
}

const GATEWAY: &str = r#"profile = "car.toml"
[can.body]
interface = "can0"
[reports]
publish = "periodic"
[diagnostics]
period_ms = 250
[ros]
node = "signal_gateway"
"#;

const PROFILE: &str = r#"name = "Car"
[bus.body]
dbc = "car.dbc"
[message.BLINK]
timeout_ms = 500
[turn]
signal = "BLINK.TURN"
off = [0]
left = [1]
right = [2]
[hazard]
from = "signal"
signal = "BLINK.HAZARD"
on = [1]
off = [0]
"#;

/// One lanelet.
const MAP: &str = "\
<osm>
<node id='1' lat='0' lon='0'><tag k='local_x' v='0'/><tag k='local_y' v='0'/></node>
<node id='2' lat='0' lon='0'><tag k='local_x' v='9'/><tag k='local_y' v='0'/></node>
<node id='3' lat='0' lon='0'><tag k='local_x' v='0'/><tag k='local_y' v='3'/></node>
<node id='4' lat='0' lon='0'><tag k='local_x' v='9'/><tag k='local_y' v='3'/></node>
<way id='12'><nd ref='1'/><nd ref='2'/></way><way id='13'><nd ref='3'/><nd ref='4'/></way>
<relation id='21'><member type='way' ref='13' role='left'/><member type='way' ref='12' role='right'/>
<tag k='type' v='lanelet'/><tag k='subtype' v='road'/></relation></osm>";

/// `BLINK` has no cycle time; line 6 goes beyond its message and line 15 is not a statement.
const DBC: &str = r#"BO_ 256 BLINK: 4 X
 SG_ TURN : 0|4@1+ (1,0) [0|15] "" X
 SG_ HAZARD : 4|2@1+ (1,0) [0|3] "" X
 SG_ LEFT : 8|1@1+ (1,0) [0|1] "" X
 SG_ RIGHT : 9|1@1+ (1,0) [0|1] "" X
 SG_ TORN : 28|8@1+ (1,0) [0|255] "" X
 SG_ TILT : 12|4@1- (1,0) [-8|7] "" X
 SG_ COUNT : 10|2@1+ (1,0) [0|3] "" X
 SG_ CRC : 16|8@1+ (1,0) [0|255] "" X
 SG_ NIBBLE : 24|4@1+ (1,0) [0|15] "" X
 SG_ PAGE M : 28|1@1+ (1,0) [0|1] "" X
 SG_ PAGED m1 : 0|4@1+ (1,0) [0|15] "" X
BO_ 257 CLIMATE: 8 X
 SG_ HEAT : 0|32@1+ (1,0) [0|0] "" X
BO_ 258 LAMPS 8 X
SIG_VALTYPE_ 257 HEAT : 1;
BO_ 259 OTHER: 1 X
 SG_ LAMP : 0|1@1+ (1,0) [0|1] "" X
BO_ 260 SPAT: 4 X
 SG_ PLACE : 0|8@1+ (1,0) [0|255] "" X
 SG_ GROUP : 8|4@1+ (1,0) [0|15] "" X
 SG_ STATE : 12|4@1+ (1,0) [0|15] "" X
 SG_ SURE : 16|7@1+ (1,0) [0|127] "" X
 SG_ SHORT : 23|3@1+ (1,0) [0|7] "" X
 SG_ KIND M : 26|1@1+ (1,0) [0|1] "" X
 SG_ NEXT m1 : 27|4@1+ (1,0) [0|15] "" X
BO_ 261 LAMP_CMD: 4 X
 SG_ ENABLE : 0|1@1+ (1,0) [0|1] "" X
 SG_ DOOR : 1|1@1+ (1,0) [0|1] "" X
 SG_ TURN_REQ : 2|3@1+ (1,0) [0|7] "" X
 SG_ CMD_COUNT : 8|4@1+ (1,0) [0|15] "" X
 SG_ CMD_SUM : 16|8@1+ (1,0) [0|255] "" X
"#;

fn load_texts(texts: &MemoryFiles) -> Result<Settings, Vec<Problem>> {
    load(texts, Path::new("gateway.toml"), &Overrides::default()).map_err(|refused| refused.0)
}

/// One way to spoil a file.
struct Spoilt {
    /// What stands in the sound file.
    old: &'static str,
    /// What stands there instead; `@@` marks the place that must be named, else it is the file's start.
    new: &'static str,
    /// The key that must be named.
    key: &'static str,
    /// Parts of reason and remedy.
    says: [&'static str; 2],
}

/// A row of a table, short.
const fn row(
    old: &'static str,
    new: &'static str,
    key: &'static str,
    reason: &'static str,
    remedy: &'static str,
) -> Spoilt {
    Spoilt { old, new, key, says: [reason, remedy] }
}

/// Replaces `old` in a file; gives the text and the line and column of the mark, both from 1.
fn spoil(text: &str, old: &str, new: &str) -> (String, (usize, usize)) {
    assert_eq!(text.matches(old).count(), 1, "{old:?} must stand there once");
    let marked = text.replace(old, new);
    let before = marked.split_once("@@").map_or("", |(before, _)| before);
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
    (marked.replace("@@", ""), (line, column))
}

/// Every row must be refused with exactly one problem, in that file, at that place, in those words.
fn assert_refused(file: &str, rows: &[Spoilt]) {
    let mut wrong = Vec::new();
    for Spoilt { old, new, key, says: [reason, remedy] } in rows {
        let mut texts = sound();
        let (text, position) = spoil(texts.text(file), old, new);
        texts.insert(file, text);
        match load_texts(&texts) {
            Ok(_) => wrong.push(format!("{new:?} is accepted")),
            Err(problems) => {
                let [problem] = problems.as_slice() else {
                    let all: Vec<_> = problems.iter().map(ToString::to_string).collect();
                    wrong.push(format!("{new:?} has several problems:\n  {}", all.join("\n  ")));
                    continue;
                };
                let placed = problem.file == Path::new(file)
                    && problem.position == Some(position)
                    && problem.key == *key;
                if !placed || !problem.reason.contains(reason) || !problem.remedy.contains(remedy) {
                    let wanted = format!("{file}:{}:{}: {key}: {reason}; {remedy}", position.0, position.1);
                    wrong.push(format!("{new:?}:\n  {problem}\n  {wanted}"));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_sound_configuration_is_accepted() {
    let settings = load_texts(&sound()).unwrap_or_else(|problems| panic!("{problems:?}"));
    assert_eq!(settings.vehicle, "Car");
    assert_eq!(settings.dbcs[0].database.rejected(), 2);
}
