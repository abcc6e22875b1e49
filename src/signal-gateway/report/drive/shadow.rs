//! The shadow report of a recorded drive: the verdict on the signal of each manoeuvre, and the agreement.

use serde::Serialize;
use serde_json::Value;

use super::super::seconds;
use super::super::text::counted;
use turn_signal::side::Side;
use turn_signal::signal_judge::{
    DeciderReason, JudgedCounts, JudgedKind, JudgedManoeuvre, SignalVerdict, VerdictKind,
};

/// A judged manoeuvre of a recorded drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShadowManoeuvre {
    /// Description, e.g. `left turn on 111`.
    pub what: String,
    /// Kind of the manoeuvre.
    pub kind: JudgedKind,
    /// Required side; for a needless signal, the side that was signalled.
    pub side: Side,
    /// The verdict on the signal.
    pub verdict: SignalVerdict,
    /// First recorded side; `None` if neither was signalled.
    pub received: Option<Side>,
    /// Start, seconds from the first message.
    pub from_s: f64,
    /// Time at which the signal became required, seconds; `None` if it never did.
    pub required_s: Option<f64>,
    /// End, seconds.
    pub to_s: f64,
    /// Distance driven until its start, metres.
    pub at_m: f64,
    /// x coordinate of the rear axle at its start, metres in the map frame.
    pub x_m: f64,
    /// y coordinate of the rear axle at its start, metres in the map frame.
    pub y_m: f64,
    /// Speed at its start, m/s.
    pub speed_mps: f64,
    /// The decider's decision at its start, in a sentence.
    pub decider: String,
    /// The reason of the decider, for programs.
    pub reason: DeciderReason,
}

/// Summary of a recorded drive.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShadowSummary {
    /// Judged signal.
    pub signal: &'static str,
    /// Topic of the signal.
    pub topic: String,
    /// Number of its samples.
    pub samples: u64,
    /// Length of the recording, seconds.
    pub length_s: f64,
    /// Distance driven, metres.
    pub driven_m: f64,
    /// Share of the manoeuvres whose signal agrees with the rules, percent; `None` if none was judged.
    pub agreement_percent: Option<f64>,
    /// The number of each verdict, by kind.
    pub counts: JudgedCounts,
}

impl ShadowManoeuvre {
    /// Describes a manoeuvre that began after `at_m` metres, with the decider's decision `decider`.
    pub fn new(judged: &JudgedManoeuvre, at_m: f64, decider: String) -> Self {
        let position = judged.odometry.pose.position;
        let side = judged.side;
        let what = judged.subject.and_then(|subject| subject.name(side.into()));
        let what = what.unwrap_or_else(|| match judged.subject {
            Some(_) => format!("signal to the {}", side.name()),
            None => format!("{} signal for nothing", side.name()),
        });
        Self {
            what,
            kind: JudgedKind::of(judged.subject),
            side,
            verdict: judged.verdict,
            received: judged.received,
            from_s: seconds(judged.start),
            required_s: judged.required_since.map(seconds),
            to_s: seconds(judged.end),
            at_m,
            x_m: position.x_m,
            y_m: position.y_m,
            speed_mps: judged.odometry.speed_mps,
            decider,
            reason: judged.reason.clone(),
        }
    }

    /// Returns the text: one line, and if the sides differ, both reasons below it.
    pub fn text(&self) -> String {
        let Self { what, verdict, from_s, at_m, x_m, y_m, .. } = self;
        let line = format!("{from_s:8.1} s {at_m:8.1} m  {what}: {verdict}");
        if verdict.kind() == VerdictKind::Agree {
            return line;
        }
        let received = match self.received {
            Some(side) => format!("the signal to the {}", side.name()),
            None => "no signal".to_owned(),
        };
        format!(
            "{line}\n             at x {x_m:.2}, y {y_m:.2} with {:.1} m/s, until {:.1} s\n             \
             decider:  {}\n             received: {received}",
            self.speed_mps, self.to_s, self.decider
        )
    }

    /// Returns the sentence of its mark in a chart; `None` if the signals agree.
    pub fn mark(&self) -> Option<String> {
        (self.verdict.kind() != VerdictKind::Agree).then(|| format!("{}: {}", self.what, self.verdict))
    }

    /// Returns the JSON object for programs.
    pub fn json(&self) -> Value {
        serde_json::json!({ "manoeuvre": self })
    }
}

impl ShadowSummary {
    /// Returns the text for users.
    pub fn text(&self) -> String {
        let Self { signal, topic, samples, length_s, driven_m, counts, .. } = self;
        let mut text = format!(
            "{length_s:.1} s, {driven_m:.0} m; the signal is the {signal}'s, {topic}, with {}",
            counted(*samples, "sample")
        );
        let total = counts.total();
        match self.agreement_percent {
            Some(percent) => {
                let judged = counted(total.judged(), "manoeuvre");
                text += &format!("\nagreement: {percent:.1} % of {judged}");
            }
            None => text += "\nagreement: nothing to judge",
        }
        for (kind, counts) in &counts.by_kind {
            let verdicts = VerdictKind::ALL.map(|verdict| (counts.of(verdict), verdict_name(verdict)));
            let verdicts = verdicts.into_iter().filter(|(count, _)| *count > 0);
            let verdicts: Vec<_> = verdicts.map(|(count, name)| format!("{count} {name}")).collect();
            text += &format!("\n  {}: {}", kind_name(*kind), verdicts.join(", "));
        }
        if counts.unjudged > 0 {
            text += &format!("\n  without a verdict: {}, since an input was missing", counts.unjudged);
        }
        text
    }

    /// Returns the JSON object for programs.
    pub fn json(&self) -> Value {
        serde_json::json!({ "summary": self })
    }
}

fn verdict_name(verdict: VerdictKind) -> &'static str {
    match verdict {
        VerdictKind::Agree => "agree",
        VerdictKind::Early => "early",
        VerdictKind::Late => "late",
        VerdictKind::Missing => "missing",
        VerdictKind::WrongSide => "on the wrong side",
        VerdictKind::Needless => "needless",
    }
}

fn kind_name(kind: JudgedKind) -> &'static str {
    match kind {
        JudgedKind::Turn => "turns",
        JudgedKind::RoundaboutEntry => "roundabout entries",
        JudgedKind::RoundaboutExit => "roundabout exits",
        JudgedKind::PullOut => "pull-outs",
        JudgedKind::Avoidance => "avoidances",
        JudgedKind::LaneChange => "lane changes",
        JudgedKind::PullOver => "pull-overs",
        JudgedKind::SideShift => "side shifts",
        JudgedKind::Unnamed => "other signals of the decider",
        JudgedKind::Nothing => "signals for nothing",
    }
}
