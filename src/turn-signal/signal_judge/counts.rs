//! Verdicts on received signals, and their counts.

use std::collections::BTreeMap;

use derive_more::{Add, Display};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::subject::{ManoeuvreKind, SignalSubject};
use gateway_base::names::display_by_name;

/// The verdict on a received signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema, Display)]
#[serde(rename_all = "snake_case")]
pub enum SignalVerdict {
    /// It was given as the rules demand.
    #[display("agrees")]
    Agree,
    /// It began before the stretch in which it may be given.
    #[display("{by_ms} ms early")]
    Early {
        /// Time from its begin to the desired start, ms.
        by_ms: u64,
    },
    /// It began after the start of the stretch in which it must be given.
    #[display("{by_ms} ms late")]
    Late {
        /// Time from the required start to its begin, ms.
        by_ms: u64,
    },
    /// It was not given, or went off while it was required.
    #[display("missing")]
    Missing,
    /// The other side was given.
    #[display("wrong side")]
    WrongSide,
    /// It was given, and nothing asked for it.
    #[display("needless")]
    Needless,
}

/// A [`SignalVerdict`] without its content.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // as those of `SignalVerdict`
pub enum VerdictKind {
    Agree,
    Early,
    Late,
    Missing,
    WrongSide,
    Needless,
}

display_by_name!(VerdictKind);

/// What a judged signal was asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // as those of `SignalSubject` and `ManoeuvreKind`
pub enum JudgedKind {
    Turn,
    RoundaboutEntry,
    RoundaboutExit,
    PullOut,
    Avoidance,
    LaneChange,
    PullOver,
    SideShift,
    /// The decider gives no subject, as when it follows the path generator.
    Unnamed,
    /// Nothing asked for the signal.
    Nothing,
}

display_by_name!(JudgedKind);

/// The number of verdicts of each kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema, Add)]
#[allow(missing_docs)] // as those of `VerdictKind`
pub struct VerdictCounts {
    pub agree: u64,
    pub early: u64,
    pub late: u64,
    pub missing: u64,
    pub wrong_side: u64,
    pub needless: u64,
}

/// The number of verdicts of each kind, by what was signalled.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct JudgedCounts {
    /// The verdicts on each kind of manoeuvre that occurred.
    pub by_kind: BTreeMap<JudgedKind, VerdictCounts>,
    /// Manoeuvres without a verdict: the received signal or an input of the decider was missing.
    pub unjudged: u64,
}

impl SignalVerdict {
    /// Returns the verdict without its content.
    pub const fn kind(self) -> VerdictKind {
        match self {
            Self::Agree => VerdictKind::Agree,
            Self::Early { .. } => VerdictKind::Early,
            Self::Late { .. } => VerdictKind::Late,
            Self::Missing => VerdictKind::Missing,
            Self::WrongSide => VerdictKind::WrongSide,
            Self::Needless => VerdictKind::Needless,
        }
    }
}

impl VerdictKind {
    /// Every verdict, in the order of the variants.
    pub const ALL: [Self; 6] =
        [Self::Agree, Self::Early, Self::Late, Self::Missing, Self::WrongSide, Self::Needless];
}

impl JudgedKind {
    /// Returns the kind of a subject; `None` stands for a needless signal.
    pub const fn of(subject: Option<SignalSubject>) -> Self {
        match subject {
            None => Self::Nothing,
            Some(SignalSubject::Unnamed) => Self::Unnamed,
            Some(SignalSubject::Turn(_)) => Self::Turn,
            Some(SignalSubject::RoundaboutEntry(_)) => Self::RoundaboutEntry,
            Some(SignalSubject::RoundaboutExit(_)) => Self::RoundaboutExit,
            Some(SignalSubject::Manoeuvre(ManoeuvreKind::PullOut)) => Self::PullOut,
            Some(SignalSubject::Manoeuvre(ManoeuvreKind::Avoidance)) => Self::Avoidance,
            Some(SignalSubject::Manoeuvre(ManoeuvreKind::LaneChange)) => Self::LaneChange,
            Some(SignalSubject::Manoeuvre(ManoeuvreKind::PullOver)) => Self::PullOver,
            Some(SignalSubject::Manoeuvre(ManoeuvreKind::SideShift)) => Self::SideShift,
        }
    }
}

impl VerdictCounts {
    /// Returns the number of verdicts of a kind.
    pub const fn of(mut self, kind: VerdictKind) -> u64 {
        *self.of_mut(kind)
    }

    /// Returns the number of all verdicts.
    pub fn judged(&self) -> u64 {
        VerdictKind::ALL.into_iter().map(|kind| self.of(kind)).sum()
    }

    /// Returns the share of a verdict, percent; `None` when nothing was judged.
    #[allow(clippy::cast_precision_loss)] // manoeuvres of a year stay far below 2^52
    pub fn percent(&self, kind: VerdictKind) -> Option<f64> {
        let judged = self.judged();
        (judged > 0).then(|| self.of(kind) as f64 * 100.0 / judged as f64)
    }

    /// Returns the share of signals that agree with the rules, percent; `None` when nothing was judged.
    pub fn agreement_percent(&self) -> Option<f64> {
        self.percent(VerdictKind::Agree)
    }

    const fn of_mut(&mut self, kind: VerdictKind) -> &mut u64 {
        match kind {
            VerdictKind::Agree => &mut self.agree,
            VerdictKind::Early => &mut self.early,
            VerdictKind::Late => &mut self.late,
            VerdictKind::Missing => &mut self.missing,
            VerdictKind::WrongSide => &mut self.wrong_side,
            VerdictKind::Needless => &mut self.needless,
        }
    }
}

impl JudgedCounts {
    /// Returns the verdicts on all kinds of manoeuvres together.
    pub fn total(&self) -> VerdictCounts {
        self.by_kind.values().fold(VerdictCounts::default(), |total, counts| total + *counts)
    }

    pub(super) fn add(&mut self, kind: JudgedKind, verdict: VerdictKind) {
        *self.by_kind.entry(kind).or_default().of_mut(verdict) += 1;
    }
}
