//! The DBC reader on the public files of vehicles as real people wrote them, malformed ones among them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use can_signal::can::frame::{CanId, MAX_DATA};
use can_signal::dbc::model::{Database, DbcSeverity, Message, Number};
use can_signal::dbc::parse;

use crate::support::prerequisite::{peer_python, require, shared_data};
use crate::support::random::Random;
use crate::support::vehicle_facts::{DbcOrigin, Twin, VEHICLES, VehicleFacts};

/// Every DBC file, by name without its ending; each is read once.
fn databases(folder: &Path) -> &'static BTreeMap<String, Database> {
    static READ: OnceLock<BTreeMap<String, Database>> = OnceLock::new();
    READ.get_or_init(|| {
        let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let files = paths.filter(|path| path.extension().is_some_and(|extension| extension == "dbc"));
        let name = |path: &Path| path.file_stem().unwrap().to_string_lossy().into_owned();
        files.map(|path| (name(&path), parse(&std::fs::read(&path).unwrap()))).collect()
    })
}

/// The public file of each vehicle that has one, by file.
fn twins() -> BTreeMap<&'static str, &'static Twin> {
    let twin = |vehicle: &'static VehicleFacts| match &vehicle.dbc {
        DbcOrigin::Twin(twin) => Some((twin.file.as_str(), twin)),
        DbcOrigin::Opendbc | DbcOrigin::Own => None,
    };
    VEHICLES.values().filter_map(twin).collect()
}

/// Every message with turn signals: its file, and their layouts.
fn turn_signals(folder: &Path) -> Vec<(&'static str, &'static Message, &'static str)> {
    let messages = twins().into_iter().flat_map(|(file, twin)| {
        twin.turn_signals.iter().map(move |[number, signals]| {
            let is_it = |message: &&Message| number_of(message).to_string() == *number;
            let message = databases(folder)[file].messages.iter().find(is_it);
            (file, message.unwrap_or_else(|| panic!("{file} {number}")), signals.as_str())
        })
    });
    messages.collect()
}

/// The id as a DBC writes it.
fn number_of(message: &Message) -> u32 {
    match message.id {
        CanId::Standard(id) => u32::from(id),
        CanId::Extended(id) => id | 0x8000_0000,
    }
}

#[test]
fn every_real_file_loads_with_the_known_losses() {
    let folder = require!(shared_data()).join("dbc");
    let databases = databases(&folder);
    assert!(databases.keys().eq(twins().keys()), "{:?}", databases.keys());
    for (file, Twin { size, .. }) in twins() {
        let (found, signals) = (&databases[file], databases[file].signal_count());
        let expected = (size.messages, size.signals, size.rejected);
        assert_eq!((found.messages.len(), signals, found.rejected()), expected, "{file}");
    }
}

#[test]
fn turn_signals_are_read_from_their_bits() {
    let folder = require!(shared_data()).join("dbc");
    for (file, message, signals) in turn_signals(&folder) {
        for signal in signals.split(", ") {
            let (name, layout) = signal.split_once(' ').unwrap();
            let codec = &message.signal(name).unwrap_or_else(|| panic!("{file} {name}")).codec;
            for (weight, bit) in bits(layout).into_iter().enumerate() {
                let mut data = [0; MAX_DATA];
                data[bit / 8] = 1 << (bit % 8);
                assert_eq!(codec.value(&data), 1 << weight, "{file} {signal}");
                assert!(
                    codec.is_present(&data) && codec.needed_length() <= message.length,
                    "{file} {signal}"
                );
            }
            let mut others = [0xFF; MAX_DATA];
            for bit in bits(layout) {
                others[bit / 8] &= !(1 << (bit % 8));
            }
            assert_eq!(codec.value(&others), 0, "{file} {signal}");
        }
    }
}

/// Bit numbers of `start|length@order`, the least significant first; no signal here leaves its byte.
fn bits(layout: &str) -> Vec<usize> {
    let mut numbers = layout.split(['|', '@']).map(|number| number.parse::<usize>().unwrap());
    let (start, length, order) = (numbers.next().unwrap(), numbers.next().unwrap(), numbers.next().unwrap());
    let first = if order == 1 { start } else { start + 1 - length };
    (first..first + length).collect()
}

#[test]
fn no_rejected_statement_touches_a_turn_message() {
    let folder = require!(shared_data()).join("dbc");
    let mut all_rejected = 0;
    for (file, message, _) in turn_signals(&folder) {
        let (database, number) = (&databases(&folder)[file], number_of(message).to_string());
        let lines = message.line..=message.signals.last().unwrap().line;
        let rejected = database.findings.iter().filter(|finding| finding.severity == DbcSeverity::Rejected);
        for finding in rejected {
            let names_it = finding.excerpt.split(' ').any(|word| word == number);
            assert!(!names_it && !lines.contains(&finding.line), "{file} {}: {finding:?}", message.name);
            all_rejected += 1;
        }
    }
    assert!(all_rejected > 400, "{all_rejected} rejected statements");
}

#[test]
fn raw_values_agree_with_cantools() {
    let folder = require!(shared_data()).join("dbc");
    let python = require!(peer_python());
    let mut random = Random(0x5EED);
    let (mut requests, mut requested) = (String::new(), Vec::new());
    for file in twins().into_keys() {
        let path = folder.join(format!("{file}.dbc"));
        writeln!(requests, "file {}", path.display()).unwrap();
        let database = &databases(&folder)[file];
        let frames = database.messages.iter().flat_map(|message| payloads(message, &mut random));
        requested.push((file, frames.collect::<Vec<_>>()));
        for (message, data) in &requested.last().unwrap().1 {
            write!(requests, "frame {} ", number_of(message)).unwrap();
            data[..message.length].iter().for_each(|byte| write!(requests, "{byte:02x}").unwrap());
            requests.push('\n');
        }
    }
    let answers = cantools_decode(&python, &requests);
    let mut answers = answers.lines();
    let (mut whole, mut total) = (0, Tally::default());
    for (file, requested) in &requested {
        let verdict = answers.next().unwrap();
        if verdict == "file whole" {
            whole += 1;
        } else {
            println!("cantools refuses {file}, so only what is well-formed: {verdict}");
            assert!(verdict.starts_with("file bones"), "{verdict}");
        }
        for (message, data) in requested {
            total.compare(file, message, data, answers.next().unwrap());
        }
    }
    assert_eq!(answers.next(), None);
    let Tally { frames, agreed, absent, unknown } = total;
    println!("cantools agrees on {agreed} raw values and {absent} absent signals in {frames} frames");
    println!("of {} files, {whole} of them whole; {unknown} more it does not know", requested.len());
    assert!(whole >= 19 && agreed > 50_000 && unknown < agreed / 50);
}

/// Runs cantools on these requests; see the script for the form of both.
fn cantools_decode(python: &Path, requests: &str) -> String {
    let request_file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(request_file.path(), requests).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_decode.py");
    let output = Command::new(python).arg(script).arg(request_file.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Two trees of multiplexors: the first three levels deep and with ranges, the second with one level.
const NESTED: &str = r#"VERSION ""

BU_: X

BO_ 257 NESTED: 8 X
 SG_ Page M : 0|4@1+ (1,0) [0|0] "" X
 SG_ Row m1M : 4|4@1+ (1,0) [0|0] "" X
 SG_ Column m2M : 8|4@1+ (1,0) [0|0] "" X
 SG_ Deep m3 : 12|12@1- (1,0) [0|0] "" X
 SG_ Flat m7 : 15|8@0+ (1,0) [0|0] "" X
 SG_ Other M : 32|2@1+ (1,0) [0|0] "" X
 SG_ Own m2 : 40|8@1- (1,0) [0|0] "" X
 SG_ Always : 56|8@1+ (1,0) [0|0] "" X

SG_MUL_VAL_ 257 Row Page 1-1, 3-5;
SG_MUL_VAL_ 257 Column Row 2-2;
SG_MUL_VAL_ 257 Deep Column 3-3, 8-15;
SG_MUL_VAL_ 257 Flat Page 7-7;
SG_MUL_VAL_ 257 Own Other 2-3;
"#;

#[test]
fn nested_multiplexing_as_cantools_writes_it_is_read_like_cantools_reads_it() {
    let python = require!(peer_python());
    let folder = tempfile::tempdir().unwrap();
    let [given, written] = ["given.dbc", "written.dbc"].map(|name| folder.path().join(name));
    std::fs::write(&given, NESTED).unwrap();
    let mut convert = Command::new(&python);
    convert.args(["-m", "cantools", "convert"]).args([&given, &written]);
    assert!(convert.output().unwrap().status.success());
    let text = std::fs::read_to_string(&written).unwrap();
    assert!(text.contains("SG_ Row M :") && text.contains("SG_ Other M :"), "{text}");

    let [ours, theirs] = [NESTED.as_bytes(), text.as_bytes()].map(parse);
    assert_eq!((ours.findings, theirs.findings), (vec![], vec![]));
    let mut random = Random(0x5EED);
    let frames: Vec<_> = (0..40).flat_map(|_| payloads(&theirs.messages[0], &mut random)).collect();
    let mut requests = format!("file {}\n", written.display());
    for (_, data) in &frames {
        let data: String = data[..8].iter().map(|byte| format!("{byte:02x}")).collect();
        writeln!(requests, "frame 257 {data}").unwrap();
    }
    let answers = cantools_decode(&python, &requests);
    let (verdict, answers) = answers.split_once('\n').unwrap();
    assert_eq!(verdict, "file whole");
    let mut total = Tally::default();
    for ((message, data), answer) in frames.iter().zip(answers.lines()) {
        total.compare("written", message, data, answer);
        total.compare("given", &ours.messages[0], data, answer);
    }
    assert_eq!((total.frames, total.unknown), (2 * frames.len(), 0));
    assert!(total.agreed > 1000 && total.absent > 500, "{} {}", total.agreed, total.absent);
}

/// Frames for one message: noise, all bits set, and noise for each alternative of a multiplexor.
fn payloads(message: &Message, random: &mut Random) -> Vec<(Message, [u8; MAX_DATA])> {
    let mut payloads = vec![[0xFF; MAX_DATA]];
    payloads.extend((0..6).map(|_| bytes(random)));
    for signal in message.signals.iter().filter(|signal| signal.codec.is_multiplexed()) {
        let mut data = bytes(random);
        signal.codec.select(&mut data).unwrap();
        payloads.push(data);
    }
    payloads.into_iter().map(|data| (message.clone(), data)).collect()
}

/// What was compared with cantools.
#[derive(Default)]
struct Tally {
    frames: usize,
    agreed: usize,
    absent: usize,
    unknown: usize,
}

impl Tally {
    /// Compares the values, and which signals are in the frame at all.
    fn compare(&mut self, file: &str, message: &Message, data: &[u8; MAX_DATA], answer: &str) {
        self.frames += 1;
        let pairs = answer.split(' ').filter_map(|pair| pair.split_once('='));
        let theirs: BTreeMap<&str, &str> = pairs.collect();
        for signal in &message.signals {
            let value = signal.codec.value(data).to_string();
            let ours = if signal.codec.is_present(data) { value.as_str() } else { "absent" };
            match theirs.get(signal.name.as_str()).copied() {
                None | Some("?") => self.unknown += 1,
                Some("absent") if ours == "absent" => self.absent += 1,
                Some(theirs) => {
                    assert_eq!(ours, theirs, "{file} {} {}", message.name, signal.name);
                    self.agreed += 1;
                }
            }
            assert_eq!(signal.number, Number::Integer, "floats would be compared by value, not by bits");
        }
    }
}

fn bytes(random: &mut Random) -> [u8; MAX_DATA] {
    let mut bytes = [0; MAX_DATA];
    bytes.chunks_exact_mut(8).for_each(|chunk| chunk.copy_from_slice(&random.next().to_le_bytes()));
    bytes
}
