//! DBC text to a database, and compiled decoding.
//!
//! Real files are full of slips, and a strict reader would refuse half of them whole. Here every
//! statement stands for itself: one that cannot be read, or contradicts itself or another, is left
//! out with a [finding](model::Finding), and the rest stays usable. Nothing is guessed: a slip is
//! mended only where it leaves a single reading.
//!
//! [`parse`] goes through `statement` (cut), `grammar` (read, with `mend`), `outline` (messages and
//! loose remarks) and `join` (compile, with `multiplex`, and check).

pub mod codec;
mod finding;
mod grammar;
mod join;
mod mend;
pub mod model;
mod multiplex;
mod outline;
mod statement;

use std::borrow::Cow;

use encoding_rs::{UTF_8, WINDOWS_1252};

use model::Database;

/// Reads a DBC file; what cannot be used is among the findings.
///
/// The text is UTF-8 (a byte order mark is fine) or else Windows-1252, which is the format's
/// custom; lines end with LF, CRLF or CR.
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
    use super::model::{Finding, Number, Severity};
    use super::*;
    use crate::core::can::frame::CanId;
    use proptest::prelude::*;

    const GOOD: &str = r#"SG_ Good : 56|8@1+ (1,0) [0|0] "" X"#;

    /// A database of one message of 8 bytes with the signals given, and `after` it.
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
    fn assert_finding(database: &Database, line: usize, severity: Severity, reason: &str) {
        let fits = |finding: &Finding| {
            finding.line == line && finding.severity == severity && finding.reason.contains(reason)
        };
        assert!(database.findings.iter().any(fits), "{line} {reason}: {:#?}", database.findings);
        let lost = database.messages.iter().any(|message| message.signal("Good").is_some());
        assert!(lost, "everything else stays usable");
    }

    #[test]
    fn a_plain_file_has_no_findings() {
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
    fn line_ends_marks_and_code_pages_make_no_difference() {
        let text = "BO_ 1 M: 8 X\n SG_ T : 0|8@1+ (1,0) [0|0] \"°\" X\n\nVAL_ 1 T 1 \"gauche é\" ;\nfoo\n";
        let crlf = text.replace('\n', "\r\n");
        let marked = format!("\u{feff}{text}");
        let (cp1252, _, _) = WINDOWS_1252.encode(text);
        for bytes in [text.as_bytes(), crlf.as_bytes(), marked.as_bytes(), &cp1252] {
            let database = parse(bytes);
            let signal = signal(&database, "T");
            assert_eq!((signal.unit.as_str(), signal.line), ("°", 2));
            assert_eq!(signal.values, [(1, "gauche é".to_owned())]);
            assert_eq!(database.findings.iter().map(|finding| finding.line).collect::<Vec<_>>(), [5]);
        }
    }

    #[test]
    fn slips_with_one_meaning_are_mended_and_noted() {
        for (slip, reason) in [
            (r#"SG_ S : 8|4@1+ (.25,0) [0|0] "" X"#, "decimal point"),
            (r#"SG_ S : 8|4@1+ (1.,0.) [0|0] "" X"#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) [0||1] "" X"#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) [|] "" X"#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] """#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] "" A,B,"#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) [0|0] "" A B;"#, "meaning is plain"),
            (r#"SG_ S : 8|4@1+ (1,0) "" X"#, "meaning is plain"),
        ] {
            let database = message(slip, "");
            assert_finding(&database, 2, Severity::Note, reason);
            assert_eq!(value(&database, "S", &[0, 0xF5]), Some(5), "{slip}");
        }
        let digits = message(r#" SG_ 2nd : 8|4@1+ (1,0) [0|0] "" X"#, "");
        assert_finding(&digits, 2, Severity::Note, "begins with a digit");
        assert_eq!(value(&digits, "2nd", &[0, 0xF5]), Some(5));
        let sender = parse(format!("BO_ 7 2nd: 8\n {GOOD}\n").as_bytes());
        assert_finding(&sender, 1, Severity::Note, "meaning is plain");
        let glued = message(" SG_ A M : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ B m0: 8|8@1+ (1,0) [0|0] \"\" X", "");
        assert_finding(&glued, 3, Severity::Note, "no blank");
        assert_eq!(value(&glued, "B", &[0, 9]), Some(9));
        assert_eq!(value(&glued, "B", &[1, 9]), None);
    }

    #[test]
    fn a_bad_signal_costs_only_itself() {
        for (bad, reason) in [
            (r#"SG_ S : 8|4@4- (1,0) [0|0] "" X"#, "expected"),
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
            (r#"SG_S : 8|4@1+ (1,0) [0|0] "" X"#, "begins like this"),
        ] {
            let database = message(&format!(" {bad}"), "VAL_ 1 Good 1 \"yes\" ;");
            assert_finding(&database, 2, Severity::Rejected, reason);
            assert_eq!(
                (database.signal_count(), database.rejected()),
                (1, 1),
                "{bad}: {:?}",
                database.findings
            );
            assert_eq!(signal(&database, "Good").values.len(), 1);
        }
    }

    #[test]
    fn a_bad_message_takes_its_signals_with_it_and_nothing_else() {
        for (bad, reason) in [
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
            let text = format!("BO_ 1 M: 8 X\n {GOOD}\n{bad}\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n");
            let database = parse(text.as_bytes());
            assert_finding(&database, 3, Severity::Rejected, reason);
            assert_eq!(
                (database.signal_count(), database.rejected()),
                (1, 1),
                "{bad}: {:?}",
                database.findings
            );
        }
    }

    #[test]
    fn signals_below_a_mangled_message_do_not_join_the_one_above() {
        let text = format!("BO_ 1 M: 8 X\n {GOOD}\nB0_ 2 B: 8 X\n SG_ S : 0|8@1+ (1,0) [0|0] \"\" X\n");
        let database = parse(text.as_bytes());
        assert_finding(&database, 3, Severity::Rejected, "begins like this");
        assert_finding(&database, 4, Severity::Rejected, "without a message");
        assert_eq!(database.signal_count(), 1);
    }

    #[test]
    fn signals_without_a_message_are_no_message() {
        let after = format!(
            "BO_ 3221225472 VECTOR__INDEPENDENT_SIG_MSG: 0 X\n {GOOD}\nVAL_ 3221225472 Good 1 \"x\";"
        );
        let database = message("", &after);
        assert_eq!((database.messages.len(), database.rejected()), (1, 0));
        assert_finding(&database, 5, Severity::Note, "(with its signals: 1)");
    }

    #[test]
    fn a_second_signal_of_the_same_name_is_left_out_and_shared_bits_are_noted() {
        let signals = r#" SG_ A : 0|8@1+ (1,0) [0|0] "" X
 SG_ A : 8|8@1+ (1,0) [0|0] "" X
 SG_ B : 3|1@0+ (1,0) [0|0] "" X"#;
        let database = message(signals, "");
        assert_finding(&database, 3, Severity::Rejected, "same name");
        assert_finding(&database, 4, Severity::Note, "shares bits with A");
        assert_eq!(value(&database, "A", &[7, 9]), Some(7));
    }

    #[test]
    fn remarks_that_fit_nothing_are_findings() {
        for (remark, reason) in [
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
            ("FOO_ 1 2 3;", "begins like this"),
            ("080SAS", "begins like this"),
        ] {
            let after = format!("{remark}\nBO_ 5 N: 8 X\n {GOOD}\nBA_ \"GenMsgCycleTime\" BO_ 5 20;");
            let database = message("", &after);
            let line = if reason == "32 bits" { 3 } else { 5 };
            assert!(
                database.findings.iter().any(|f| f.line == line && f.reason.contains(reason)),
                "{database:#?}"
            );
            assert_eq!(database.rejected(), 1, "{remark}: {:#?}", database.findings);
            assert_eq!(database.message("N").unwrap().cycle_ms, Some(20), "{remark}");
        }
    }

    #[test]
    fn the_first_of_two_contradicting_remarks_counts() {
        let database = message("", "VAL_ 1 Good 0 \"a\";\nVAL_ 1 Good 0 \"b\";\nVAL_ 1 Good 0 \"a\";");
        assert_finding(&database, 6, Severity::Rejected, "otherwise");
        assert_eq!(database.rejected(), 1);
        assert_eq!(signal(&database, "Good").values, [(0, "a".to_owned())]);
    }

    #[test]
    fn an_open_text_does_not_swallow_the_rest() {
        let database =
            message("", &format!("CM_ \"open\nBO_ 2 N: 8 X\n {GOOD}\nVAL_ 2 Good 0 \"a\" 1 \"b\" ;"));
        assert_finding(&database, 5, Severity::Rejected, "");
        assert_eq!((database.messages.len(), database.rejected()), (2, 1), "{:?}", database.findings);
        assert_eq!(database.messages[1].signals[0].values.len(), 2);
    }

    #[test]
    fn texts_over_lines_keep_the_count_of_lines() {
        let after =
            "CM_ BO_ 1 \"one\nBO_ 3 K: 8 X\n\n\\\"two\\\"\";VAL_ 1 Good\n 0 \"a\"\n 1 \"b\" ; // c\nfoo";
        let database = message("", after);
        assert_finding(&database, 11, Severity::Rejected, "begins like this");
        assert_eq!((database.messages.len(), database.findings.len()), (1, 1), "{:?}", database.findings);
        assert_eq!(signal(&database, "Good").values.len(), 2);
    }

    #[test]
    fn periods_come_from_the_message_or_the_default_and_nought_is_none() {
        let text = "BO_ 1 A: 8 X\nBO_ 2 B: 8 X\nBO_ 3 C: 8 X\nBA_DEF_DEF_ \"GenMsgCycleTime\" 100;\n\
                    BA_ \"GenMsgCycleTime\" BO_ 1 20;\nBA_ \"GenMsgCycleTime\" BO_ 2 0;\n";
        let cycles =
            |text: &str| parse(text.as_bytes()).messages.iter().map(|m| m.cycle_ms).collect::<Vec<_>>();
        assert_eq!(cycles(text), [Some(20), None, Some(100)]);
        assert_eq!(cycles(&text.replace("\" 100", "\" 0")), [Some(20), None, None]);
    }

    #[test]
    fn floats_are_told_from_integers() {
        let signals = r#" SG_ F : 0|32@1- (1,0) [0|0] "" X"#;
        let database = message(signals, "SIG_VALTYPE_ 1 F : 1;");
        assert_eq!(database.findings, []);
        assert_eq!(signal(&database, "F").number, Number::Float32);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
            parse(&bytes);
        }

        #[test]
        fn no_damage_makes_it_panic_or_repeat_a_name(
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
