//! The DBC reader on 31 files as real people wrote them, malformed ones among them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use signal_gateway::core::can::frame::{CanId, MAX_DATA};
use signal_gateway::core::dbc::model::{Database, Message, Number, Severity};
use signal_gateway::core::dbc::parse;

use crate::support::prerequisite::{peer_python, require, shared_data};

/// File, messages, signals, rejected statements.
const FILES: [(&str, usize, usize, usize); 31] = [
    ("New_Eagle_DBW_3.4", 36, 269, 0),
    ("acura_ilx_2016_can_generated", 36, 280, 0),
    ("bmw_e9x_e8x", 326, 165, 0),
    ("chrysler_pacifica_2017_hybrid_generated", 50, 210, 1),
    ("ford_falcon_fg", 37, 109, 434),
    ("ford_fusion_2018_pt", 14, 67, 0),
    ("ford_lincoln_base_pt", 331, 2_150, 0),
    ("gm_global_a_powertrain_generated", 49, 122, 1),
    ("honda_civic_hatchback_ex_2017_can_generated", 48, 369, 2),
    ("honda_civic_touring_2016_can_generated", 38, 288, 0),
    ("hyundai_can_generated", 146, 1_325, 0),
    ("hyundai_i30_2014", 32, 415, 0),
    ("leaf_CAR-can_AZE0", 52, 349, 0),
    ("luxgen_s5_2015", 21, 59, 0),
    ("mazda_2017", 102, 514, 1),
    ("mercedes_benz_e350_2010", 16, 97, 0),
    ("mg", 18, 167, 0),
    ("nissan_leaf_2018_generated", 20, 134, 0),
    ("psa_aee2010_r3", 107, 430, 0),
    ("psa_can_confort", 55, 40, 14),
    ("subaru_global_2017_generated", 32, 231, 0),
    ("subaru_outback_2015_generated", 28, 153, 0),
    ("tesla_can", 44, 572, 1),
    ("tesla_model3_party", 21, 240, 0),
    ("tesla_model3_vehicle", 11, 209, 0),
    ("toyota_nodsu_pt_generated", 60, 380, 0),
    ("volvo_s60_2002", 3, 7, 0),
    ("volvo_v40_2017_pt", 51, 165, 0),
    ("vw_meb_generated", 108, 1_784, 24),
    ("vw_mqb", 113, 1_348, 0),
    ("vw_pq", 86, 1_312, 19),
];

/// File and message id (in its DBC's number), with the signals of the turn and hazard state.
static TURN_SIGNALS: [(&str, u32, &str); 45] = [
    ("New_Eagle_DBW_3.4", 2_147_491_599, "DBW_DrvInptTurnSignal 34|2@1"),
    ("New_Eagle_DBW_3.4", 2_147_491_604, "DBW_TurnSignalState 4|3@1, DBW_TurnSignalSyncBit 7|1@1"),
    ("New_Eagle_DBW_3.4", 2_147_495_686, "AKit_TurnSignalReq 4|2@1, AKit_BlockTurnSigStalkInpts 15|1@1"),
    ("acura_ilx_2016_can_generated", 660, "LEFT_BLINKER 5|1@0, RIGHT_BLINKER 6|1@0"),
    ("bmw_e9x_e8x", 502, "LeftTurn 4|1@1, RightTurn 5|1@0, TurnSignalActive 8|1@0, TurnSignalIdle 9|1@0"),
    ("chrysler_pacifica_2017_hybrid_generated", 792, "TURN_SIGNALS 0|2@1"),
    ("chrysler_pacifica_2017_hybrid_generated", 820, "TURN_LIGHT_LEFT 31|1@0, TURN_LIGHT_RIGHT 30|1@0"),
    ("ford_falcon_fg", 296, "TurnStalkSwitchSatus 16|8@1"),
    ("ford_fusion_2018_pt", 131, "Left_Turn_Light 4|1@0, Right_Turn_Light 5|1@0"),
    ("ford_lincoln_base_pt", 131, "TurnLghtSwtch_D_Stat 5|2@0"),
    ("ford_lincoln_base_pt", 947, "TurnLghtLeftOn_B_Stat 54|1@0, TurnLghtRightOn_B_Stat 35|1@0"),
    ("ford_lincoln_base_pt", 947, "TurnLghtLeft_D_Rq 9|2@0, TurnLghtRight_D_Rq 63|2@0"),
    ("gm_global_a_powertrain_generated", 320, "TurnSignals 19|2@0"),
    ("honda_civic_hatchback_ex_2017_can_generated", 806, "LEFT_BLINKER 26|1@0, RIGHT_BLINKER 27|1@0"),
    ("honda_civic_touring_2016_can_generated", 806, "LEFT_BLINKER 26|1@0, RIGHT_BLINKER 27|1@0"),
    (
        "hyundai_can_generated",
        1345,
        "CF_Gway_TurnSigLh 19|2@1, CF_Gway_TurnSigRh 62|2@1, CF_Gway_HazardSw 33|2@1",
    ),
    ("hyundai_i30_2014", 1680, "CF_Clu_TurnSigLh 24|1@1, CF_Clu_TurnSigRh 25|1@1, CF_Clu_HazardSW 49|1@1"),
    ("leaf_CAR-can_AZE0", 856, "TurnSignalStatus 16|8@1"),
    ("luxgen_s5_2015", 1040, "LEFT_SIGNAL_SWITCH 1|1@0, RIGHT_SIGNAL_SWITCH 2|1@0"),
    ("luxgen_s5_2015", 1056, "LEFT_SIGNAL_STATUS 10|1@0, RIGHT_SIGNAL_STATUS 9|1@0"),
    ("mazda_2017", 145, "HAZARD 10|1@0, TURN_RIGHT_SWITCH 12|1@0, TURN_LEFT_SWITCH 13|1@0"),
    ("mazda_2017", 154, "LEFT_BLINK 18|1@1, RIGHT_BLINK 19|1@0"),
    ("mercedes_benz_e350_2010", 69, "LEFT_BLINKER 16|1@0, RIGHT_BLINKER 17|1@0"),
    ("mg", 1130, "DircnIndLampSwStsHSC2 3|2@0, LDircnIndLghtFHSC2 10|1@0, RDircnIndLghtFHSC2 48|1@0"),
    ("nissan_leaf_2018_generated", 856, "LEFT_BLINKER 17|1@0, RIGHT_BLINKER 18|1@0"),
    ("psa_aee2010_r3", 1106, "TURN_SIGNAL_STATUS 5|2@0"),
    ("psa_can_confort", 246, "ETAT_CLIGNOTANTS 56|2@1"),
    ("subaru_global_2017_generated", 912, "LEFT_BLINKER 50|1@1, RIGHT_BLINKER 51|1@1"),
    ("subaru_outback_2015_generated", 642, "LEFT_BLINKER 44|1@1, RIGHT_BLINKER 45|1@1"),
    ("tesla_can", 69, "TurnIndLvr_Stat 16|2@1"),
    ("tesla_model3_party", 785, "leftBlinkerOn 22|1@0, rightBlinkerOn 23|1@0"),
    ("tesla_model3_party", 785, "leftBlinkerBlinking 25|2@0, rightBlinkerBlinking 26|2@1"),
    ("tesla_model3_vehicle", 585, "SCCM_turnIndicatorStalkStatus 16|3@1"),
    ("tesla_model3_vehicle", 1001, "DAS_turnIndicatorRequest 8|2@1, DAS_hazardLightRequest 2|2@1"),
    ("tesla_model3_vehicle", 1013, "VCFRONT_indicatorLeftRequest 0|2@1, VCFRONT_indicatorRightRequest 2|2@1"),
    ("tesla_model3_vehicle", 1013, "VCFRONT_hazardLightRequest 4|4@1, VCFRONT_simLatchingStalk 59|2@1"),
    (
        "tesla_model3_vehicle",
        1013,
        "VCFRONT_turnSignalLeftStatus 50|2@1, VCFRONT_turnSignalRightStatus 52|2@1",
    ),
    (
        "toyota_nodsu_pt_generated",
        1556,
        "TURN_SIGNALS 29|2@0, HAZARD_LIGHT 27|1@0, BLINKER_BUTTON_PRESSED 15|1@0",
    ),
    ("volvo_s60_2002", 0x8261_300A, "Indicators 34|2@1"),
    ("volvo_v40_2017_pt", 681, "TurnSignal 1|2@0"),
    (
        "vw_meb_generated",
        870,
        "BM_Warnblinken 20|1@1, Blinken_li_Fzg_Takt 25|1@1, Blinken_re_Fzg_Takt 26|1@1",
    ),
    ("vw_meb_generated", 980, "BH_Blinker_li 12|1@1, BH_Blinker_re 13|1@1, BH_Blinker_Fehler 46|1@1"),
    ("vw_mqb", 870, "Hazard_Switch 20|1@1, Comfort_Signal_Left 23|1@1, Comfort_Signal_Right 24|1@1"),
    ("vw_mqb", 987, "BH_Blinker_li 50|1@1, BH_Blinker_re 51|1@1"),
    ("vw_pq", 912, "GK1_Blinker_li 34|1@1, GK1_Blinker_re 35|1@1, GK1_Warnblk_Status 55|1@1"),
];

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

fn by_number(database: &Database, number: u32) -> Option<&Message> {
    database.messages.iter().find(|message| number_of(message) == number)
}

/// [`TURN_SIGNALS`], each with its file.
fn turn_signals(
    folder: &Path,
) -> impl Iterator<Item = (&'static Database, (&'static str, u32, &'static str))> {
    let databases = databases(folder);
    TURN_SIGNALS.iter().map(|row| (&databases[row.0], *row))
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
    let outcome = databases(&folder).iter().map(|(name, database)| {
        (name.clone(), database.messages.len(), database.signal_count(), database.rejected())
    });
    let outcome: Vec<_> = outcome.collect();
    let expected =
        FILES.map(|(name, messages, signals, rejected)| (name.to_owned(), messages, signals, rejected));
    assert_eq!(outcome, expected, "{outcome:#?}");
}

#[test]
fn turn_signals_are_read_from_their_bits() {
    let folder = require!(shared_data()).join("dbc");
    for (database, (file, number, signals)) in turn_signals(&folder) {
        let message = by_number(database, number).unwrap_or_else(|| panic!("{file} {number}"));
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
    for (database, (file, number, _)) in turn_signals(&folder) {
        let message = by_number(database, number).unwrap();
        let lines = message.line..=message.signals.last().unwrap().line;
        let rejected = database.findings.iter().filter(|finding| finding.severity == Severity::Rejected);
        for finding in rejected {
            let names_it = finding.excerpt.split(' ').any(|word| word == number.to_string());
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
    for (file, ..) in FILES {
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
    let request_file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(request_file.path(), requests).unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peer/cantools_decode.py");
    let output = Command::new(python).arg(script).arg(request_file.path()).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));

    let answers = String::from_utf8(output.stdout).unwrap();
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

/// Frames for one message: noise, all bits set, and noise for each alternative of a multiplexor.
fn payloads(message: &Message, random: &mut Random) -> Vec<(Message, [u8; MAX_DATA])> {
    let mut payloads = vec![[0xFF; MAX_DATA]];
    payloads.extend((0..6).map(|_| random.bytes()));
    for signal in message.signals.iter().filter(|signal| signal.codec.is_multiplexed()) {
        let mut data = random.bytes();
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

/// Sebastiano Vigna's splitmix64: the same noise in every run.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    fn bytes(&mut self) -> [u8; MAX_DATA] {
        let mut bytes = [0; MAX_DATA];
        bytes.chunks_exact_mut(8).for_each(|chunk| chunk.copy_from_slice(&self.next().to_le_bytes()));
        bytes
    }
}
