//! DBC files: parsing and compiled signal codecs.
//!
//! Real files contain many errors, and a strict parser would refuse half of them. Here each statement is
//! parsed by itself: a statement that is malformed or contradicts another is rejected with a
//! [finding](model::DbcFinding), and the rest stays usable. An error is repaired only if a single
//! interpretation is left.
//!
//! [`parse`] uses `statement` (split), `grammar` (parse, with `repair`), `outline` (messages and properties)
//! and `join` (compile, with `multiplex`, and check).

pub mod codec;
mod finding;
mod grammar;
mod join;
pub mod model;
mod multiplex;
mod outline;
mod repair;
mod statement;

use std::borrow::Cow;

use encoding_rs::{UTF_8, WINDOWS_1252};

use model::Database;

/// Parses a DBC file; unusable statements are reported as findings.
///
/// The text is UTF-8, with or without a byte order mark, or else Windows-1252, which is usual for the format.
/// Lines end with LF, CRLF or CR.
///
/// ```
/// use can_signal::can::frame::{CanId, Frame};
///
/// let text = b"BO_ 296 LIGHTS: 8 BCM\n SG_ Turn : 8|2@1+ (1,0) [0|3] \"\" GW\n";
/// let database = can_signal::dbc::parse(text);
/// let turn = database.message("LIGHTS").unwrap().signal("Turn").unwrap();
/// let frame = Frame::classic(CanId::Standard(296), &[0, 2, 0, 0, 0, 0, 0, 0]).unwrap();
/// assert_eq!((turn.codec.value(frame.padded()), database.findings.len()), (2, 0));
/// ```
pub fn parse(bytes: &[u8]) -> Database {
    let text = decoded(bytes);
    let text = if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n").into() } else { text };
    join::database(outline::read(&text))
}

fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let (unmarked, _) = UTF_8.decode_with_bom_removal(bytes);
    match UTF_8.decode_without_bom_handling_and_without_replacement(bytes) {
        Some(_) => unmarked,
        None => WINDOWS_1252.decode_without_bom_handling(bytes).0,
    }
}

#[cfg(test)]
mod tests {
    use super::model::{DbcFinding, DbcSeverity, Number};
    use super::*;
    use crate::can::CanId;
    use proptest::prelude::*;

    const GOOD: &str = r#"SG_ Good : 56|8@1+ (1,0) [0|0] "" X"#;

    /// Returns a database of one message of 8 bytes with these signals, followed by `after`.
    fn message(signals: &str, after: &str) -> Database {
        parse(format!("BO_ 1 M: 8 X\n{signals}\n {GOOD}\n\n{after}\n").as_bytes())
    }

    fn signal(database: &Database, name: &str) -> model::Signal {
        database.messages[0].signal(name).unwrap_or_else(|| panic!("{name}: {:?}", database.findings)).clone()
    }

    fn value(database: &Database, name: &str, data: &[u8]) -> Option<i128> {
        let mut padded = [0; 64];
        padded[..data.len()].copy_from_slice(data);
        let codec = signal(database, name).codec;
        codec.is_present(&padded).then(|| codec.value(&padded))
    }

    #[track_caller]
    fn assert_finding(database: &Database, line: usize, severity: DbcSeverity, reason: &str) {
        let fits = |finding: &DbcFinding| {
            finding.line == line && finding.severity == severity && finding.reason.contains(reason)
        };
        assert!(database.findings.iter().any(fits), "{line} {reason}: {:#?}", database.findings);
        let usable = database.messages.iter().any(|message| message.signal("Good").is_some());
        assert!(usable, "the rest stays usable");
    }

    #[track_caller]
    fn assert_one_signal_and_one_rejection(database: &Database) {
        let counts = (database.signal_count(), database.rejected());
        assert_eq!(counts, (1, 1), "{:?}", database.findings);
    }

    #[test]
    fn regular_file_has_no_findings() {
        let text = include_bytes!("../../../fuzz/corpus/dbc_text/plain.dbc");
        let database = parse(text);
        assert_eq!(database.findings, []);
        let lights = database.message("Lights").unwrap();
        assert_eq!((lights.id, lights.length, lights.cycle_ms), (CanId::Standard(0x100), 8, Some(50)));
        assert_eq!(lights.line, 13);
        let turn = lights.signal("Turn").unwrap();
        assert_eq!(turn.values[2], (2, "right".to_owned()));
        assert_eq!(lights.signal("Hazard").unwrap().values[0], (1, "on".to_owned()), "by VAL_TABLE_");
        let level = lights.signal("Level").unwrap();
        assert_eq!((level.factor, level.offset, level.unit.as_str(), level.line), (0.5, -10.0, "%", 16));
    }

    #[test]
    fn line_ends_and_encodings_are_equivalent() {
        let text = "BO_ 1 M: 8 X\n SG_ T : 0|8@1+ (1,0) [0|0] \"°\" X\n\nVAL_ 1 T 1 \"gauche é\" ;\nfoo\n";
        let crlf = text.replace('\n', "\r\n");
        let marked = format!("\u{feff}{text}");
        let (cp1252, _, _) = WINDOWS_1252.encode(text);
        for bytes in [text.as_bytes(), crlf.as_bytes(), marked.as_bytes(), &cp1252] {
            let database = parse(bytes);
            let signal = signal(&database, "T");
            assert_eq!((signal.unit.as_str(), signal.line), ("°", 2));
            assert_eq!(*signal.values, [(1, "gauche é".to_owned())]);
            assert_eq!(database.findings.iter().map(|finding| finding.line).collect::<Vec<_>>(), [5]);
        }
    }

    #[test]
    fn unambiguous_errors_are_repaired_and_noted() {
        for (statement, reason) in [
            (r#"SG_ S : 8|4@1+ (.25,0) [0|0] "" X"#, "decimal point"),
            (r#"SG_ S : 8|4@1+ (1.,0.) [0|0] "" X"#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) [0||1] "" X"#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) [|] "" X"#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] """#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] "" A,B,"#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] "" A B;"#, "repaired"),
            (r#"SG_ S : 8|4@1+ (1,0) "" X"#, "repaired"),
        ] {
            let database = message(statement, "");
            assert_finding(&database, 2, DbcSeverity::Note, reason);
            assert_eq!(value(&database, "S", &[0, 0xF5]), Some(5), "{statement}");
        }
        let digits = message(r#" SG_ 2nd : 8|4@1+ (1,0) [0|0] "" X"#, "");
        assert_finding(&digits, 2, DbcSeverity::Note, "begins with a digit");
        assert_eq!(value(&digits, "2nd", &[0, 0xF5]), Some(5));
        let sender = parse(format!("BO_ 7 2nd: 8\n {GOOD}\n").as_bytes());
        assert_finding(&sender, 1, DbcSeverity::Note, "repaired");
        let glued = message(" SG_ A M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ B m0: 8|8@1+ (1,0) [0|0] \"\" X", "");
        assert_finding(&glued, 3, DbcSeverity::Note, "no space");
        assert_eq!(value(&glued, "B", &[0, 9]), Some(9));
        assert_eq!(value(&glued, "B", &[1, 9]), None);
    }

    #[test]
    fn malformed_signal_rejects_only_itself() {
        for (statement, reason) in [
            (r#"SG_ S : 8|4@4- (1,0) [0|0] "" X"#, "expected"),
            (r#"SG_ S 8|4@1- (1,0) [0|0] "" X"#, r#"expected ":" after "SG_ S""#),
            (r#"SG_ S : 8@1+ (1,0) [0|0] "" X"#, ""),
            (r#"SG_ S : -8|4@1+ (1,0) [0|0] "" X"#, ""),
            (r#"SG_ S : 8|4@1+ [0|0] "" X"#, ""),
            (r#"SG_ S : 8|4@1+ (0,5,0) [0|0] "" X"#, ""),
            (r#"SG_ S : 8|4@1+ (1e999,0) [0|0] "" X"#, "finite"),
            (r#"SG_ S : 8|0@1+ (1,0) [0|0] "" X"#, "1 to 64"),
            (r#"SG_ S : 0|65@1+ (1,0) [0|0] "" X"#, "1 to 64"),
            (r#"SG_ S : 57|8@1+ (1,0) [0|0] "" X"#, "needs 9 bytes"),
            (r#"SG_ S : 56|2@0+ (1,0) [0|0] "" X"#, "needs 9 bytes"),
            (r#"SG_ S : 70000|2@0+ (1,0) [0|0] "" X"#, "beyond"),
            (r#"SG_ S m : 8|4@1+ (1,0) [0|0] "" X"#, "multiplexer value"),
            (r#"SG_ S m1 : 8|4@1+ (1,0) [0|0] "" X"#, "no multiplexor"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] "" X SG_ T : 8|4@1+ (1,0) [0|0] "" X"#, ""),
            (r#"SG_ S : 8|4@1+ (1,0) SG_ T : 8|4@1+ (1,0) [0|0] "" X"#, ""),
            (r#"SG_S : 8|4@1+ (1,0) [0|0] "" X"#, "not a DBC statement"),
        ] {
            let database = message(&format!(" {statement}"), "VAL_ 1 Good 1 \"yes\" ;");
            assert_finding(&database, 2, DbcSeverity::Rejected, reason);
            assert_one_signal_and_one_rejection(&database);
            assert_eq!(signal(&database, "Good").values.len(), 1);
        }
    }

    #[test]
    fn malformed_message_rejects_its_signals_only() {
        for (statement, reason) in [
            ("BO_ 2048 B: 8 X", "more than 11 bits"),
            ("BO_ 4294967295 B: 8 X", "more than 29 bits"),
            ("BO_ 99999999999 B: 8 X", "(with its signals: 1)"),
            ("BO_ 8x70: 8 X", "no 32-bit"),
            ("BO_ 0x70 B: 8 X", "(with its signals: 1)"),
            ("BO_ 2 B: X", "(with its signals: 1)"),
            ("BO_ 2 B: 65 X", "65 bytes"),
            ("BO_ 1 B: 8 X", "taken"),
            ("BO_ 2 M: 8 X", "taken"),
        ] {
            let text = format!("BO_ 1 M: 8 X\n {GOOD}\n{statement}\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n");
            let database = parse(text.as_bytes());
            assert_finding(&database, 3, DbcSeverity::Rejected, reason);
            assert_one_signal_and_one_rejection(&database);
        }
    }

    #[test]
    fn signals_of_malformed_message_are_not_added_to_previous_one() {
        let text = format!("BO_ 1 M: 8 X\n {GOOD}\nB0_ 2 B: 8 X\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n");
        let database = parse(text.as_bytes());
        assert_finding(&database, 3, DbcSeverity::Rejected, "not a DBC statement");
        assert_finding(&database, 4, DbcSeverity::Rejected, "without a message");
        assert_eq!(database.signal_count(), 1);
    }

    #[test]
    fn pseudo_message_of_independent_signals_is_ignored() {
        let after = format!(
            "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 X\n {GOOD}\nVAL_ 3221225472 Good 1 \"x\";"
        );
        let database = message("", &after);
        assert_eq!((database.messages.len(), database.rejected()), (1, 0));
        assert_finding(&database, 5, DbcSeverity::Note, "(with its signals: 1)");
    }

    #[test]
    fn duplicate_signal_name_is_rejected_and_shared_bits_are_noted() {
        let signals = r#" SG_ A : 0|8@1+ (1,0) [0|0] "" X
 SG_ A : 8|8@1+ (1,0) [0|0] "" X
 SG_ B : 3|1@0+ (1,0) [0|0] "" X"#;
        let database = message(signals, "");
        assert_finding(&database, 3, DbcSeverity::Rejected, "same name");
        assert_finding(&database, 4, DbcSeverity::Note, "shares bits with A");
        assert_eq!(value(&database, "A", &[7, 9]), Some(7));
    }

    #[test]
    fn properties_without_target_are_findings() {
        for (property, reason) in [
            ("VAL_ 1 Missing 0 \"a\" ;", "no signal Missing"),
            ("VAL_ 9 Good 0 \"a\" ;", "no message with id 9"),
            ("VAL_ 2049 Good 0 \"a\" ;", "no message with id 2049"),
            ("VAL_ 65537 Good 0 \"a\" ;", "no message with id 65537"),
            ("VAL_ 1 Good Missing ;", "no VAL_TABLE_ Missing"),
            ("VAL_ 1 Good 0 a ;", ""),
            ("VAL_ 1 Good 0 \"a ;", ""),
            ("VAL_ 1 Good 0.5 \"a\" ;", ""),
            ("BA_ \"GenMsgCycleTime\" BO_ 1 -5;", "milliseconds"),
            ("BA_ \"GenMsgCycleTime\" BO_ 1 2.5;", "milliseconds"),
            ("BA_DEF_DEF_ \"flag\" false;", ""),
            ("SIG_VALTYPE_ 1 Good : 1;", "32 bits"),
            ("CM_ BO_ 1 \"\"text\"\";", ""),
            ("VERSION", ""),
            ("CM_ \"text\" BA_ \"GenMsgCycleTime\" BO_ 5 30;", "another statement"),
            ("VAL_ 1 Good 0 \"a\" VAL_ 1 Good 1 \"b\" ;", "another statement"),
            ("FOO_ 1 2 3;", "not a DBC statement"),
            ("080SAS", "not a DBC statement"),
        ] {
            let after = format!("{property}\nBO_ 5 N: 8 X\n {GOOD}\nBA_ \"GenMsgCycleTime\" BO_ 5 20;");
            let database = message("", &after);
            let line = if reason == "32 bits" { 3 } else { 5 };
            assert!(
                database.findings.iter().any(|f| f.line == line && f.reason.contains(reason)),
                "{database:#?}"
            );
            assert_eq!(database.rejected(), 1, "{property}: {:#?}", database.findings);
            assert_eq!(database.message("N").unwrap().cycle_ms, Some(20), "{property}");
        }
    }

    #[test]
    fn first_of_contradictory_properties_is_used() {
        let database = message("", "VAL_ 1 Good 0 \"a\";\nVAL_ 1 Good 0 \"b\";\nVAL_ 1 Good 0 \"a\";");
        assert_finding(&database, 6, DbcSeverity::Rejected, "contradicts");
        assert_eq!(database.rejected(), 1);
        assert_eq!(*signal(&database, "Good").values, [(0, "a".to_owned())]);
    }

    const LONG_NAMES: &str = r#"BO_ 291 Body_Control_0000: 8 X
 SG_ Lever_0000 M : 0|2@1+ (1,0) [0|3] "" X
 SG_ Page m1 : 8|2@1+ (1,0) [0|3] "" X

BO_ 292 Body_Control_0001: 8 X
 SG_ Lever_0000 : 0|2@1+ (1,0) [0|3] "" X

BA_ "SystemMessageLongSymbol" BO_ 291 "Body_Control_Module_Turn_Indicator_Status";
BA_ "SystemSignalLongSymbol" SG_ 291 Lever_0000 "TurnIndicatorSwitchPositionLeverState";
VAL_ 291 Lever_0000 1 "left" ;
"#;

    #[test]
    fn long_names_take_the_place_of_short_ones_which_still_name_the_same() {
        let database = parse(LONG_NAMES.as_bytes());
        assert_eq!(database.findings, []);
        let names: Vec<_> = database.messages.iter().map(|message| message.name.as_str()).collect();
        assert_eq!(names, ["Body_Control_Module_Turn_Indicator_Status", "Body_Control_0001"]);
        for name in [names[0], "Body_Control_0000"] {
            let message = database.message(name).unwrap();
            for signal in ["TurnIndicatorSwitchPositionLeverState", "Lever_0000"] {
                let signal = message.signal(signal).unwrap();
                assert_eq!(
                    (signal.name.as_str(), signal.values.len()),
                    ("TurnIndicatorSwitchPositionLeverState", 1)
                );
                assert_eq!(database.signal_contradiction(message, signal, "Lever_0000"), None);
            }
            assert!(
                !message.signal("Page").unwrap().codec.is_present(&[0; 64]),
                "by its multiplexor's short name"
            );
            assert_eq!(database.contradiction(message, name), None);
        }
        assert_eq!(database.messages[1].signals[0].name, "Lever_0000");
    }

    #[test]
    fn unusable_long_names_are_rejected_and_the_short_ones_stay() {
        for (long, reason) in [
            (r#"BO_ 291 "a.b""#, "only letters"),
            ("BO_ 291 7", "only letters"),
            (r#"SG_ 291 Lever_0000 "a b""#, "only letters"),
            (r#"SG_ 291 Missing "a""#, "no signal Missing"),
            (r#"BO_ 9 "a""#, "no message with id 9"),
            (r#"BO_ 291 "Body_Control_0001""#, "is not the only one"),
            (r#"SG_ 291 Lever_0000 "Page""#, "is not the only one"),
            (
                "SG_ 291 Lever_0000 \"a\";\nBA_ \"SystemSignalLongSymbol\" SG_ 291 Lever_0000 \"b\"",
                "contradicts",
            ),
        ] {
            let kind = if long.starts_with("BO_") { "Message" } else { "Signal" };
            let (messages, _) = LONG_NAMES.split_once("BA_").unwrap();
            let text = format!("{messages}BA_ \"System{kind}LongSymbol\" {long};\n");
            let database = parse(text.as_bytes());
            assert_eq!(database.rejected(), 1, "{long}: {:?}", database.findings);
            assert!(
                database.findings.iter().any(|finding| finding.reason.contains(reason)),
                "{long}: {database:?}"
            );
            assert_eq!(database.messages[0].name, "Body_Control_0000", "{long}");
        }
        let empty = LONG_NAMES.replace("TurnIndicatorSwitchPositionLeverState", "");
        let database = parse(empty.as_bytes());
        assert_eq!((database.findings.len(), &*database.messages[0].signals[0].name), (0, "Lever_0000"));
    }

    #[test]
    fn a_long_name_that_names_two_is_a_contradiction_of_both() {
        let same = "BA_ \"SystemMessageLongSymbol\" BO_ 292 \"Body_Control_Module_Turn_Indicator_Status\";\n";
        let database = parse(format!("{LONG_NAMES}{same}").as_bytes());
        let [a, b] = [0, 1].map(|at| &database.messages[at]);
        assert_eq!([&*a.name, &*b.name], ["Body_Control_0000", "Body_Control_0001"]);
        let long = "Body_Control_Module_Turn_Indicator_Status";
        assert_eq!(database.contradiction(a, long).map(|known| known.lines), Some([1, 5]));
        assert_eq!(database.contradiction(a, "Body_Control_0000"), None);
        // The long name of one signal is the short name of another.
        let page = LONG_NAMES.replace("\"TurnIndicatorSwitchPositionLeverState\"", "\"Page\"");
        let database = parse(page.as_bytes());
        let message = &database.messages[0];
        let lines = |given: &str| {
            let signal = message.signal(given).unwrap();
            database.signal_contradiction(message, signal, given).map(|known| known.lines)
        };
        assert_eq!([lines("Page"), lines("Lever_0000")], [Some([2, 3]), None]);
    }

    #[test]
    fn definitions_that_differ_are_contradictions_and_repeated_ones_are_not() {
        let signal = |name: &str, start| format!(" SG_ {name} : {start}|8@1+ (1,0) [0|0] \"\" X\n");
        let lines = |second: &str| {
            let first = format!("BO_ 1 M: 8 X\n{}{}\n{second}", signal("A", 0), signal("B", 8));
            let database = parse(first.as_bytes());
            let message = &database.messages[0];
            let of_message = database.contradiction(message, "M").map(|known| known.lines);
            let of_signal = database.signal_contradiction(message, message.signal("A").unwrap(), "A");
            assert!(database.rejected() > 0, "{second}: it is a finding as well");
            (of_message, of_signal.map(|known| known.lines))
        };
        let (a, b) = (signal("A", 0), signal("B", 8));
        for (second, expected) in [
            (format!("BO_ 1 M: 8 Y\n{b}{a}"), None),
            (format!("BO_ 1 M: 8 X\n{}{b}", a.replace(" X\n", " Y\n").replace("[0|0]", "[0|9]")), None),
            (format!("BO_ 1 M: 8 X\n{a}"), Some([1, 5])),
            (format!("BO_ 1 M: 8 X\n{a}{}", signal("B", 16)), Some([1, 5])),
            (format!("BO_ 1 M: 8 X\n{a}{}", b.replace("(1,0)", "(2,0)")), Some([1, 5])),
            (format!("BO_ 1 M: 8 X\n{a}{a}"), Some([1, 5])),
            (format!("BO_ 1 M: 8 X\n{a}{b} SG_ C\n"), Some([1, 5])),
            (format!("BO_ 1 M: 7 X\n{a}{b}"), Some([1, 5])),
            (format!("BO_ 2 M: 8 X\n{a}{b}"), Some([1, 5])),
            (format!("BO_ 1 N: 8 X\n{a}{b}"), Some([1, 5])),
        ] {
            assert_eq!(lines(&second), (expected, None), "{second}");
        }
        let database = message(&[a.clone(), a.clone(), b.clone(), signal("B", 24)].concat(), "");
        let message = &database.messages[0];
        let lines = |name: &str| {
            let known = database.signal_contradiction(message, message.signal(name).unwrap(), name);
            known.map(|known| known.lines)
        };
        assert_eq!([lines("A"), lines("B")], [None, Some([4, 5])]);
    }

    #[test]
    fn unterminated_text_ends_with_its_line() {
        let database =
            message("", &format!("CM_ \"open\nBO_ 2 N: 8 X\n {GOOD}\nVAL_ 2 Good 0 \"a\" 1 \"b\" ;"));
        assert_finding(&database, 5, DbcSeverity::Rejected, "");
        assert_eq!((database.messages.len(), database.rejected()), (2, 1), "{:?}", database.findings);
        assert_eq!(database.messages[1].signals[0].values.len(), 2);
    }

    #[test]
    fn texts_over_several_lines_keep_line_numbers() {
        let after =
            "CM_ BO_ 1 \"one\nBO_ 3 K: 8 X\n\n\\\"two\\\"\";VAL_ 1 Good\n 0 \"a\"\n 1 \"b\" ; // c\nfoo";
        let database = message("", after);
        assert_finding(&database, 11, DbcSeverity::Rejected, "not a DBC statement");
        assert_eq!((database.messages.len(), database.findings.len()), (1, 1), "{:?}", database.findings);
        assert_eq!(signal(&database, "Good").values.len(), 2);
    }

    #[test]
    fn cycle_time_is_from_message_or_default_and_0_is_none() {
        let text = "BO_ 1 A: 8 X\nBO_ 2 B: 8 X\nBO_ 3 C: 8 X\nBA_DEF_DEF_ \"GenMsgCycleTime\" 100;\n\
                    BA_ \"GenMsgCycleTime\" BO_ 1 20;\nBA_ \"GenMsgCycleTime\" BO_ 2 0;\n";
        let cycles =
            |text: &str| parse(text.as_bytes()).messages.iter().map(|m| m.cycle_ms).collect::<Vec<_>>();
        assert_eq!(cycles(text), [Some(20), None, Some(100)]);
        assert_eq!(cycles(&text.replace("\" 100", "\" 0")), [Some(20), None, None]);
    }

    #[test]
    fn frame_format_is_from_attribute_or_lengths() {
        use crate::can::frame::FrameFormat::{Classic, Fd};
        let formats = |messages: &str, attributes: &str| {
            let database = parse(format!("{messages}\n{attributes}").as_bytes());
            assert_eq!(database.findings, [], "{attributes}");
            database.messages.iter().map(|message| message.format).collect::<Vec<_>>()
        };
        let short = "BO_ 1 A: 8 X\nBO_ 2 B: 8 X";
        let long = "BO_ 1 A: 8 X\nBO_ 2 B: 8 X\nBO_ 3 C: 12 X";
        assert_eq!(formats(short, ""), [Some(Classic); 2]);
        assert_eq!(formats(long, ""), [None, None, Some(Fd)]);
        let list = "BA_DEF_ BO_ \"VFrameFormat\" ENUM \"StandardCAN\",\"reserved\",\"StandardCAN_FD\";\n\
                    BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";";
        assert_eq!(formats(long, list), [Some(Classic), Some(Classic), Some(Fd)]);
        let given = format!("{list}\nBA_ \"VFrameFormat\" BO_ 1 2;\nBA_ \"VFrameFormat\" BO_ 2 1;");
        assert_eq!(formats(short, &given), [Some(Fd), Some(Classic)], "reserved says nothing");
        assert_eq!(formats(long, &given), [Some(Fd), None, Some(Fd)]);
    }

    #[test]
    fn number_format_is_from_sig_valtype() {
        let signals = r#" SG_ F : 0|32@1- (1,0) [0|0] "" X"#;
        let database = message(signals, "SIG_VALTYPE_ 1 F : 1;");
        assert_eq!(database.findings, []);
        assert_eq!(signal(&database, "F").number, Number::Float32);
    }

    #[test]
    fn size_is_bounded() {
        let garbage = parse("x\n".repeat(model::MAX_ENTRIES + 1).as_bytes());
        assert_eq!((garbage.findings.len(), garbage.is_too_large), (0, true));
        // Names of values also count.
        let values = format!("VAL_ 1 Good {};\n", "0 \"\" ".repeat(model::MAX_ENTRIES / 2));
        assert!(message("", &values.repeat(2)).is_too_large);

        let long = message("", &format!("BU_: {}", "A ".repeat(1 << 19)));
        assert_eq!(long.findings[0].reason, "longer than 1 MiB");
        let signals: String =
            (0..4000).map(|at| format!("SG_ S{at} : 0|8@1+ (1,0) [0|0] \"\" X\n")).collect();
        let many = message(&signals, "");
        assert_eq!(many.messages[0].signals.len(), 4000);
        assert_eq!(many.findings.last().unwrap().reason, "more than 4000 signals in one message");
    }

    proptest! {
        #[test]
        fn any_bytes_are_parsed_without_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            parse(&bytes);
        }

        #[test]
        fn damaged_file_is_parsed_without_panic_or_duplicate_name(
            damage in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0_u8..3), 1..12),
        ) {
            let mut bytes = include_bytes!("../../../fuzz/corpus/dbc_text/multiplexed.dbc").to_vec();
            bytes.extend(include_bytes!("../../../fuzz/corpus/dbc_text/plain.dbc"));
            for (at, byte, kind) in damage {
                let at = at.index(bytes.len());
                match kind {
                    0 => bytes[at] = byte,
                    1 => { bytes.remove(at); }
                    _ => bytes.insert(at, byte),
                }
            }
            for message in parse(&bytes).messages {
                let mut names: Vec<_> = message.signals.iter().map(|signal| &signal.name).collect();
                names.sort();
                prop_assert!(names.is_sorted_by(|a, b| a < b), "{names:?}");
                prop_assert!(message.signals.iter().all(|signal| signal.codec.needed_length() <= message.length));
            }
        }
    }
}
