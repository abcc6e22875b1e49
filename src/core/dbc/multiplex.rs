//! Which multiplexor decides about which signal, and by which values.
//!
//! Where a file leaves two answers, the signal is refused: a value read from bits that carry
//! something else would look like any other.

use std::collections::BTreeMap;
use std::ops::RangeInclusive;

use can_dbc::MultiplexIndicator;

use super::codec::{Layout, LayoutError, SignalCodec};

/// Multiplexors above a signal at most; more is a circle, or no real file.
const DEEPEST: usize = 8;

/// What `SG_MUL_VAL_` says about one signal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Rule {
    pub(super) multiplexor: String,
    /// Values for which the signal is present; empty when they were unreadable.
    pub(super) ranges: Vec<RangeInclusive<u64>>,
}

/// One signal's part in it.
#[derive(Debug)]
pub(super) struct Placed<'a> {
    pub(super) name: &'a str,
    pub(super) layout: Layout,
    pub(super) indicator: MultiplexIndicator,
    pub(super) rule: Option<&'a Rule>,
}

/// The signals of one message.
#[derive(Debug)]
pub(super) struct Multiplexing<'a> {
    message_length: usize,
    signals: &'a [Placed<'a>],
    by_name: BTreeMap<&'a str, usize>,
    /// The one multiplexor that a mark such as `m3` can mean.
    only: Result<usize, &'static str>,
}

impl<'a> Multiplexing<'a> {
    /// `lost_multiplexor`: a statement that may have been a multiplexor's was left out.
    pub(super) fn new(signals: &'a [Placed<'a>], message_length: usize, lost_multiplexor: bool) -> Self {
        let by_name = signals.iter().enumerate().map(|(index, signal)| (signal.name, index)).collect();
        let count = |wanted: fn(&Placed<'_>) -> bool| signals.iter().filter(|signal| wanted(signal)).count();
        let nested = count(|signal| {
            matches!(signal.indicator, MultiplexIndicator::MultiplexorAndMultiplexedSignal(_))
        });
        let roots = count(|signal| signal.indicator == MultiplexIndicator::Multiplexor);
        let root = signals.iter().position(|signal| signal.indicator == MultiplexIndicator::Multiplexor);
        let only = match root {
            _ if lost_multiplexor => Err("multiplexed, but a multiplexor of the message is unreadable"),
            None => Err("multiplexed, but the message has no multiplexor"),
            Some(_) if roots + nested > 1 => Err("multiplexed, and no SG_MUL_VAL_ says by which multiplexor"),
            Some(root) => Ok(root),
        };
        Self { message_length, signals, by_name, only }
    }

    /// The compiled signal, or why it cannot be trusted.
    pub(super) fn codec(&self, index: usize) -> Result<SignalCodec, String> {
        self.nested_codec(&self.signals[index], DEEPEST)
    }

    fn nested_codec(&self, signal: &Placed<'_>, depth: usize) -> Result<SignalCodec, String> {
        let plain = SignalCodec::new(signal.layout, self.message_length)
            .map_err(|error: LayoutError| error.to_string())?;
        let Some((multiplexor, ranges)) = self.parent(signal)? else {
            return Ok(plain);
        };
        let depth = depth.checked_sub(1).ok_or("multiplexed by itself, or too many times over")?;
        Ok(plain.multiplexed(&self.nested_codec(&self.signals[multiplexor], depth)?, &ranges))
    }

    /// The multiplexor above `signal` and its values for it.
    fn parent(&self, signal: &Placed<'_>) -> Result<Option<(usize, Vec<RangeInclusive<u64>>)>, String> {
        let value = match signal.indicator {
            MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor => None,
            MultiplexIndicator::MultiplexedSignal(value) => Some(value),
            MultiplexIndicator::MultiplexorAndMultiplexedSignal(value) => Some(value),
        };
        match (value, signal.rule) {
            (None, None) => Ok(None),
            (None, Some(_)) => Err("SG_MUL_VAL_ has it multiplexed, SG_ has not".to_owned()),
            (Some(value), None) => Ok(Some((self.only?, vec![value..=value]))),
            (Some(_), Some(rule)) if rule.ranges.is_empty() => {
                Err("its SG_MUL_VAL_ is unreadable".to_owned())
            }
            (Some(_), Some(rule)) => {
                let multiplexor = self.by_name.get(rule.multiplexor.as_str()).copied();
                let multiplexor = multiplexor.filter(|index| self.signals[*index].is_multiplexor());
                let multiplexor =
                    multiplexor.ok_or_else(|| format!("no multiplexor {}", rule.multiplexor))?;
                Ok(Some((multiplexor, rule.ranges.clone())))
            }
        }
    }
}

impl Placed<'_> {
    fn is_multiplexor(&self) -> bool {
        match self.indicator {
            MultiplexIndicator::Multiplexor | MultiplexIndicator::MultiplexorAndMultiplexedSignal(_) => true,
            MultiplexIndicator::Plain | MultiplexIndicator::MultiplexedSignal(_) => false,
        }
    }
}
