//! Configurations that must be refused, each with the whole text: position, key, reason and remedy.

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

/// A configuration that is accepted; each test changes something.
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

/// The sound configuration with another text in a file.
fn with(file: &str, old: &str, new: &str) -> MemoryFiles {
    let files = sound();
    let text = files.text(file);
    assert_eq!(text.matches(old).count(), 1, "{old:?} must occur once");
    let text = text.replace(old, new);
    files.with(file, text)
}

/// The line in front of which lines are added that need no particular line.
const HERE: &str = "# here\n";

const GATEWAY: &str = r#"profile = "car.toml"
[can.body]
interface = "can0"
[reports]
publish = "periodic"
[diagnostics]
period_ms = 250
# here
[ros]
node = "signal_gateway"
"#;

const PROFILE: &str = r#"name = "Car"
[bus.body]
dbc = "car.dbc"
[message.BLINK]
timeout_ms = 500
# here
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

/// The keys of `[turn]` in the profile.
const TURN: &str = "signal = \"BLINK.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n";
/// The keys of `[hazard]` in the profile.
const HAZARD: &str = "from = \"signal\"\nsignal = \"BLINK.HAZARD\"\non = [1]\noff = [0]\n";

/// One lanelet and one traffic light.
const MAP: &str = "\
<osm>
<node id='1' lat='0' lon='0'><tag k='local_x' v='0'/><tag k='local_y' v='0'/></node>
<node id='2' lat='0' lon='0'><tag k='local_x' v='9'/><tag k='local_y' v='0'/></node>
<node id='3' lat='0' lon='0'><tag k='local_x' v='0'/><tag k='local_y' v='3'/></node>
<node id='4' lat='0' lon='0'><tag k='local_x' v='9'/><tag k='local_y' v='3'/></node>
<way id='11'><nd ref='1'/><nd ref='2'/><tag k='type' v='traffic_light'/></way>
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

/// Refuses changes to a file of `base`, which `cases` holds one after the other, each like a patch: lines that
/// stay ("  "), go ("- ") and come ("+ "), then each problem that is found ("> "), of which "…" leaves out a
/// part. Lines that come alone do so at [`HERE`].
fn assert_refused(base: &MemoryFiles, file: &str, cases: &str) {
    let lines: Vec<_> = cases.lines().filter(|line| !line.is_empty()).collect();
    let mut wrong = Vec::new();
    for case in lines.chunk_by(|line, next| !line.starts_with('>') || next.starts_with('>')) {
        let those = |marks: &str| -> Vec<_> {
            let marked = case.iter().filter(|line| line.starts_with(|mark| marks.contains(mark)));
            marked.map(|line| &line[2..]).collect()
        };
        let [old, new] = [" -", " +"].map(|marks| those(marks).join("\n") + "\n");
        let (old, new) = if old == "\n" { (HERE.to_owned(), new + HERE) } else { (old, new) };
        let text = format!("\n{}", base.text(file));
        assert_eq!(text.matches(&format!("\n{old}")).count(), 1, "{old:?} must occur once");
        let text = text.replacen(&format!("\n{old}"), &format!("\n{new}"), 1);
        let problems = load_texts(&base.clone().with(file, &text[1..])).err().unwrap_or_default();
        let problems: Vec<_> = problems.iter().map(ToString::to_string).collect();
        let expected = those(">");
        let agree = problems.iter().zip(&expected).all(|(problem, expected)| is_like(problem, expected));
        if problems.is_empty() || problems.len() != expected.len() || !agree {
            let case = case.iter().filter(|line| !line.starts_with('>')).map(|line| format!("{line}\n"));
            wrong.push(case.collect::<String>() + "> " + &problems.join("\n> "));
        }
    }
    assert!(wrong.is_empty(), "other problems are found:\n{}\n", wrong.join("\n"));
}

/// Compares a text with a pattern in which "…" stands for any text.
fn is_like(text: &str, pattern: &str) -> bool {
    let Some((start, rest)) = pattern.split_once('…') else { return text == pattern };
    let Some(text) = text.strip_prefix(start) else { return false };
    text.char_indices().map(|(at, _)| at).chain([text.len()]).any(|at| is_like(&text[at..], rest))
}

#[test]
fn the_sound_configuration_is_accepted() {
    let settings = load_texts(&sound()).unwrap_or_else(|problems| panic!("{problems:?}"));
    assert_eq!(settings.vehicle, "Car");
    assert_eq!(settings.dbcs[0].database.rejected(), 2);
}
