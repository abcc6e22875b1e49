//! What brings a CAN interface up is listen-only in every document, example and message: with a wrong bit
//! rate a controller that may send puts error frames onto a car. Sections about sending are the exception,
//! and have to say why.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use crate::support::sources::{files_below, project};

/// A section that may bring an interface up for sending: its file and heading, and the text that says why.
const SENDING: [(&str, &str, &str); 1] = [(
    "docs/commands.md",
    "### Bringing the interface up to send",
    "A controller that is listen-only can send nothing",
)];

/// Files in which people look for commands, and texts of the program.
fn searched() -> impl Iterator<Item = String> {
    let folders = ["config", "docs", "examples", "packaging", "ros", "src", "systemd"];
    let files = folders.into_iter().flat_map(files_below).map(|file| file.display().to_string());
    let top = ["README.md", "CHANGELOG.md", "CONTRIBUTING.md", "ARCHITECTURE.md"].map(str::to_owned);
    files.chain(top).filter(|file| {
        let kinds = ["", "md", "rs", "toml", "txt", "network", "sh", "py", "xml"];
        kinds.contains(&kind_of(file))
    })
}

/// The extension of a file's name, or nothing.
fn kind_of(file: &str) -> &str {
    Path::new(file).extension().and_then(|kind| kind.to_str()).unwrap_or_default()
}

/// True if a line gives a hardware interface a bit rate, and so brings it up or prepares that.
fn sets_bit_rate(line: &str) -> bool {
    let words: Vec<_> = line.split(|sign: char| sign.is_whitespace() || "`\"'".contains(sign)).collect();
    let follows = |first: &str, second: &str| words.windows(2).any(|pair| pair == [first, second]);
    follows("type", "can") && words.contains(&"bitrate") || line.trim_start().starts_with("BitRate=")
}

/// The lines of a text that set a bit rate, and may send. Lines that a backslash joins are one.
fn sending_lines(file: &str, text: &str) -> Vec<String> {
    let (mut found, mut heading) = (Vec::new(), "");
    let text = text.replace("\\\n", "");
    let network_file_listens = text.lines().any(|line| line.trim() == "ListenOnly=yes");
    for line in text.lines() {
        if line.starts_with('#') && kind_of(file) == "md" {
            heading = line;
        }
        let listens = line.contains("listen-only on") || kind_of(file) == "network" && network_file_listens;
        let may_send = SENDING.iter().any(|(place, section, _)| *place == file && *section == heading);
        if sets_bit_rate(line) && !listens && !may_send {
            found.push(line.to_owned());
        }
    }
    found
}

#[test]
fn interfaces_are_brought_up_listen_only_but_where_a_section_says_why_not() {
    let mut wrong = String::new();
    let mut listening = 0;
    for file in searched() {
        let Ok(text) = fs::read_to_string(project().join(&file)) else { continue };
        listening += text.lines().filter(|line| sets_bit_rate(line)).count();
        for line in sending_lines(&file, &text) {
            let _ = writeln!(wrong, "{file}: {line}");
        }
    }
    assert!(wrong.is_empty(), "without listen-only:\n{wrong}");
    assert!(listening >= 5, "only {listening} lines were found");
    for (file, heading, why) in SENDING {
        let text = fs::read_to_string(project().join(file)).unwrap();
        let section = text.split_once(heading).unwrap().1.split("\n#").next().unwrap();
        assert!(section.contains(why), "{heading} of {file} does not say why");
        assert!(section.lines().any(sets_bit_rate), "{heading} of {file} needs no exception");
    }
}

#[test]
fn lines_that_may_send_are_found_in_every_form() {
    for line in [
        "ip link set can0 up type can bitrate 500000",
        "run `sudo ip link set can1 type can bitrate 250000 dbitrate 2000000 fd on` first",
        "BitRate=500K",
    ] {
        assert_eq!(sending_lines("docs/a.md", line), [line]);
    }
    for (file, text) in [
        ("docs/a.md", "ip link set can0 up type can bitrate 500000 listen-only on"),
        ("docs/a.md", "ip link set can0 type can restart"),
        ("systemd/a.network", "[CAN]\nBitRate=500K\nListenOnly=yes\n"),
    ] {
        assert!(sending_lines(file, text).is_empty(), "{text}");
    }
}
