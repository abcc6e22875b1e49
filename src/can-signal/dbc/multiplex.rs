//! Assigns multiplexors and their values to signals.
//!
//! Where a file is ambiguous, the signal is rejected, because a value read from bits of another signal would
//! look valid.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use can_dbc::MultiplexIndicator;

use super::codec::{LayoutError, SignalCodec};
use super::finding::Reason;
use super::grammar::MultiplexRule;
use super::outline::SignalOutline;
use crate::can::MAX_DATA;

/// Largest number of nested multiplexors; more indicates a cycle.
const MAX_DEPTH: usize = 8;

/// Multiplexor values for which a signal is present.
type Values = Vec<RangeInclusive<u64>>;

/// The signals of one message with their multiplexors.
#[derive(Debug)]
pub(super) struct Multiplexing<'a> {
    message_length: usize,
    signals: &'a [SignalOutline],
    rules: &'a BTreeMap<String, MultiplexRule>,
    by_name: BTreeMap<&'a str, usize>,
    /// The only multiplexor that a mark such as `m3` can refer to, or the reason why there is none.
    only: Result<usize, &'static str>,
}

impl<'a> Multiplexing<'a> {
    /// Joins signals with their rules. `lost_multiplexor`: a rejected statement may have defined a
    /// multiplexor.
    pub(super) fn new(
        signals: &'a [SignalOutline],
        rules: &'a BTreeMap<String, MultiplexRule>,
        message_length: usize,
        lost_multiplexor: bool,
    ) -> Self {
        let names = signals.iter().map(|signal| signal.parsed.name.as_str());
        let count = signals.iter().filter(|signal| is_multiplexor(signal)).count();
        let is_root =
            |signal: &SignalOutline| signal.parsed.multiplexer_indicator == MultiplexIndicator::Multiplexor;
        let only = match signals.iter().position(is_root) {
            _ if lost_multiplexor => Err("multiplexed, but a multiplexor of the message is unreadable"),
            None => Err("multiplexed, but the message has no multiplexor"),
            Some(_) if count > 1 => Err("multiplexed, but no SG_MUL_VAL_ names its multiplexor"),
            Some(root) => Ok(root),
        };
        Self { message_length, signals, rules, by_name: names.zip(0..).collect(), only }
    }

    /// Returns the compiled signal; the error is the text of the finding.
    pub(super) fn codec(&self, index: usize) -> Result<SignalCodec, Reason> {
        self.nested_codec(&self.signals[index], MAX_DEPTH)
    }

    fn nested_codec(&self, signal: &SignalOutline, depth: usize) -> Result<SignalCodec, Reason> {
        let plain = SignalCodec::new(signal.layout, self.message_length)
            .map_err(|error: LayoutError| error.to_string())?;
        let Some((multiplexor, ranges)) = self.parent(signal)? else {
            return Ok(plain);
        };
        let depth = depth.checked_sub(1).ok_or("multiplexed by itself or nested too deeply")?;
        let codec = plain.multiplexed(&self.nested_codec(&self.signals[multiplexor], depth)?, &ranges);
        let reachable = codec.select(&mut [0; MAX_DATA]).is_ok();
        reachable
            .then_some(codec)
            .ok_or_else(|| "its multiplexor has no bits for the value that selects it".into())
    }

    /// Returns the index of the multiplexor above `signal` with its values; `None` for a plain signal.
    fn parent(&self, signal: &SignalOutline) -> Result<Option<(usize, Values)>, Reason> {
        use MultiplexIndicator::{MultiplexedSignal, Multiplexor, MultiplexorAndMultiplexedSignal, Plain};
        match (signal.parsed.multiplexer_indicator, self.rules.get(&signal.parsed.name)) {
            (Plain | Multiplexor, None) => Ok(None),
            (Plain, Some(_)) => Err("multiplexed by SG_MUL_VAL_ but not by SG_".into()),
            (MultiplexedSignal(value) | MultiplexorAndMultiplexedSignal(value), None) => {
                Ok(Some((self.only?, vec![value..=value])))
            }
            (_, Some(rule)) if rule.ranges.is_empty() => Err("its SG_MUL_VAL_ is unreadable".into()),
            // cantools writes every multiplexor as `M`, even below another multiplexor.
            (Multiplexor | MultiplexedSignal(_) | MultiplexorAndMultiplexedSignal(_), Some(rule)) => {
                let multiplexor = self.by_name.get(rule.multiplexor.as_str()).copied();
                let multiplexor = multiplexor.filter(|index| is_multiplexor(&self.signals[*index]));
                let multiplexor =
                    multiplexor.ok_or_else(|| format!("no multiplexor {}", rule.multiplexor))?;
                Ok(Some((multiplexor, rule.ranges.clone())))
            }
        }
    }
}

fn is_multiplexor(signal: &SignalOutline) -> bool {
    use MultiplexIndicator::{Multiplexor, MultiplexorAndMultiplexedSignal};
    matches!(signal.parsed.multiplexer_indicator, Multiplexor | MultiplexorAndMultiplexedSignal(_))
}

#[cfg(test)]
mod tests {
    use crate::dbc::model::{Database, DbcSeverity};
    use crate::dbc::parse;

    /// Returns a message of 8 bytes with one 8-bit signal per name and mark, in consecutive bytes.
    fn message(signals: &[&str], after: &str) -> Database {
        let lines = signals
            .iter()
            .enumerate()
            .map(|(at, signal)| format!(" SG_ {signal} : {}|8@1+ (1,0) [0|0] \"\" X\n", at * 8));
        parse(format!("BO_ 1 M: 8 X\n{}\n{after}\n", lines.collect::<String>()).as_bytes())
    }

    /// Returns the signals present in a frame with these bytes.
    fn present(database: &Database, bytes: &[u8]) -> Vec<String> {
        let mut data = [0; 64];
        data[..bytes.len()].copy_from_slice(bytes);
        let signals = database.messages[0].signals.iter();
        signals.filter(|signal| signal.codec.is_present(&data)).map(|signal| signal.name.clone()).collect()
    }

    /// Returns the names of the accepted signals and the reasons for rejected signals.
    fn outcome(database: &Database) -> (Vec<&str>, Vec<&str>) {
        let accepted = database.messages[0].signals.iter().map(|signal| signal.name.as_str()).collect();
        let rejected = database.findings.iter().filter(|finding| finding.severity == DbcSeverity::Rejected);
        (accepted, rejected.map(|finding| finding.reason.as_str()).collect())
    }

    #[test]
    fn mark_refers_to_only_multiplexor() {
        let database = message(&["Page M", "A m0", "B m1", "Always"], "");
        assert_eq!(database.findings, []);
        assert_eq!(present(&database, &[0]), ["Page", "A", "Always"]);
        assert_eq!(present(&database, &[1]), ["Page", "B", "Always"]);
        assert_eq!(present(&database, &[2]), ["Page", "Always"]);
    }

    #[test]
    fn nested_rules_with_ranges_select_signals() {
        let rules =
            "SG_MUL_VAL_ 1 Row Page 1-2, 7-7;\nSG_MUL_VAL_ 1 Cell Row 5-5;\nSG_MUL_VAL_ 1 Flat Page 3-3;";
        let database = message(&["Page M", "Row m1M", "Cell m5", "Flat m3"], rules);
        assert_eq!(database.findings, []);
        assert_eq!(present(&database, &[2, 5]), ["Page", "Row", "Cell"]);
        assert_eq!(present(&database, &[7, 6]), ["Page", "Row"]);
        assert_eq!(present(&database, &[3, 5]), ["Page", "Flat"]);
    }

    #[test]
    fn rule_multiplexes_a_multiplexor_without_a_value_in_its_mark() {
        let rules = "SG_MUL_VAL_ 1 Row Page 1-1;\nSG_MUL_VAL_ 1 Cell Row 5-5;\nSG_MUL_VAL_ 1 Own Other 2-2;";
        let database = message(&["Page M", "Row M", "Cell m5", "Other M", "Own m2"], rules);
        assert_eq!(database.findings, []);
        assert_eq!(present(&database, &[1, 5]), ["Page", "Row", "Cell", "Other"]);
        assert_eq!(present(&database, &[0, 5, 0, 2]), ["Page", "Other", "Own"]);
        for (rule, reason) in [("Page x", "unreadable"), ("Missing 1-1", "no multiplexor Missing")] {
            let database = message(&["Page M", "Row M"], &format!("SG_MUL_VAL_ 1 Row {rule};"));
            let (accepted, rejected) = outcome(&database);
            assert_eq!(accepted, ["Page"], "{rule}");
            assert!(rejected.iter().any(|text| text.contains(reason)), "{rule}: {rejected:?}");
        }
    }

    #[test]
    fn ambiguous_mark_is_rejected_without_rule() {
        let database = message(&["Page M", "Row m1M", "Cell m5"], "SG_MUL_VAL_ 1 Row Page 1-1;");
        let reason = "multiplexed, but no SG_MUL_VAL_ names its multiplexor";
        assert_eq!(outcome(&database), (vec!["Page", "Row"], vec![reason]));
        let database = message(&["Page M", "Other M", "Cell m5"], "");
        assert_eq!(outcome(&database), (vec!["Page", "Other"], vec![reason]));
    }

    #[test]
    fn unreadable_multiplexor_rejects_its_signals() {
        let database = message(&["Page M", "Row m1M :", "Cell m5"], "");
        let (accepted, rejected) = outcome(&database);
        assert_eq!((accepted, rejected.len()), (vec!["Page"], 2));
        assert!(rejected[1].contains("unreadable"), "{rejected:?}");
    }

    #[test]
    fn contradictory_or_unreadable_rules_reject_signal() {
        for (rules, reason) in [
            ("SG_MUL_VAL_ 1 A Page x;", "unreadable"),
            ("SG_MUL_VAL_ 1 A Page 3-1;", "unreadable"),
            ("SG_MUL_VAL_ 1 A Page 1-1;\nSG_MUL_VAL_ 1 A Page 2-2;", "unreadable"),
            ("SG_MUL_VAL_ 1 A Missing 1-1;", "no multiplexor Missing"),
            ("SG_MUL_VAL_ 1 A Always 1-1;", "no multiplexor Always"),
            ("SG_MUL_VAL_ 1 A A 1-1;", "no multiplexor A"),
            ("SG_MUL_VAL_ 1 A Page 256-300;", "no bits for the value"),
        ] {
            let database = message(&["Page M", "A m1", "Always"], rules);
            let (accepted, rejected) = outcome(&database);
            assert_eq!(accepted, ["Page", "Always"], "{rules}");
            assert!(rejected.iter().any(|text| text.contains(reason)), "{rules}: {rejected:?}");
        }
        let database = message(&["Page M", "Always"], "SG_MUL_VAL_ 1 Always Page 1-1;");
        assert_eq!(outcome(&database), (vec!["Page"], vec!["multiplexed by SG_MUL_VAL_ but not by SG_"]));
    }

    #[test]
    fn cyclic_multiplexors_are_rejected() {
        let database =
            message(&["A m1M", "B m1M", "Always"], "SG_MUL_VAL_ 1 A B 1-1;\nSG_MUL_VAL_ 1 B A 1-1;");
        let (accepted, rejected) = outcome(&database);
        assert_eq!((accepted, rejected.len()), (vec!["Always"], 2));
    }
}
