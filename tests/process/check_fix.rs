//! `check --fix`: the profile with the printed lines in their places passes the check.

use std::fmt::Write as _;
use std::fs;

use crate::support::program::run;

const DBC: &str = "VERSION \"\"\nBO_ 193 LIGHTS: 4 X\n SG_ TURN : 0|2@1+ (1,0) [0|3] \"\" X\n SG_ COUNTER : 8|4@1+ (1,0) [0|15] \"\" X\n \
                   SG_ CHECKSUM : 24|8@1+ (1,0) [0|255] \"\" X\nBO_ 194 HAZARD: 1 X\n SG_ ON : 0|1@1+ (1,0) [0|1] \"\" X\n";
const PROFILE: &str = "name = \"Car\"\n[bus.body]\ndbc = \"car.dbc\"\n[turn]\nsignal = \"LIGHTS.TURN\"\noff = [0]\nleft = [1]\nright = [2]\n\
                       [hazard]\nfrom = \"signal\"\nsignal = \"HAZARD.ON\"\noff = [0]\non = [1]\n";

/// Left, right and hazard, with a counter and a checksum beside the turn signal.
fn drive() -> String {
    let mut text = String::new();
    for step in 0_u32..240 {
        let at = format!("{}.{}00000", 1 + step / 10, step % 10);
        let (turn, counter) = ([0, 1, 0, 2, 0, 0][(step / 40) as usize], step % 16);
        let sum = (turn + counter) & 0xFF;
        let hazard = u8::from(step >= 210);
        writeln!(text, "({at}) can0 0C1#{turn:02X}{counter:02X}00{sum:02X}\n({at}) can0 0C2#{hazard:02X}")
            .unwrap();
    }
    text
}

/// Puts each line of a patch where its comment says.
fn apply(patch: &str, profile: &str) -> String {
    let (mut lines, mut end): (Vec<_>, String) =
        (profile.lines().map(|line| vec![line.to_owned()]).collect(), String::new());
    for block in patch.split("# car.toml, ").filter(|block| !block.is_empty()) {
        let (place, text) = block.split_once(":\n").unwrap();
        if place == "at the end" {
            end += text;
            continue;
        }
        let number = place.split("line ").nth(1).unwrap().split(',').next().unwrap();
        let line = &mut lines[number.parse::<usize>().unwrap() - 1];
        if place.starts_with("below") {
            line.push(text.trim().to_owned());
        } else {
            *line = vec![text.trim().to_owned()];
        }
    }
    lines.concat().join("\n") + "\n" + &end
}

#[test]
fn the_lines_of_fix_mend_the_profile_whether_it_is_refused_or_not() {
    // Without any section, and with one that lacks the timeout.
    for sections in ["", "[message.LIGHTS]\ntiming = \"cyclic\"\n"] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let profile = PROFILE.to_owned() + sections;
        for (name, text) in [("car.dbc", DBC), ("drive.log", &drive()), ("car.toml", &profile)] {
            fs::write(folder.join(name), text).unwrap();
        }
        let mut codes = Vec::new();
        for _ in 0..3 {
            let fixed = run(folder, &["check", "drive.log", "--profile", "car.toml", "--fix"]);
            codes.push(fixed.code);
            let has_none = fixed.error.contains("shows no line that it lacks");
            assert_eq!(has_none, fixed.out.is_empty(), "{}", fixed.error);
            let before = fs::read_to_string(folder.join("car.toml")).unwrap();
            let after = apply(&fixed.out, &before);
            assert_eq!(after.matches("[message.LIGHTS]").count(), 1, "{after}");
            fs::write(folder.join("car.toml"), after).unwrap();
        }
        // Timeouts for a profile that is refused without them, then counter and checksum, then nothing.
        assert_eq!(codes, [3, 4, 0], "{sections}");
        let mended = fs::read_to_string(folder.join("car.toml")).unwrap();
        for line in ["timeout_ms = 500", "counter = { ", "checksum = { kind = \"sum8\""] {
            assert!(mended.contains(line), "{mended}");
        }
        run(folder, &["check", "drive.log", "--profile", "car.toml"]).succeeded();
    }
}
