//! A straight road along x, records on it, and the signals along it.

use std::sync::OnceLock;

use lanelet2_map::geometry::Pose;
use lanelet2_map::geometry::path::{NearestLimits, Path, PathFrame};
use turn_signal::light_command::TurnCommand;
use turn_signal::resolve::{Candidates, PairwiseRules, Resolution, resolve};
use turn_signal::section::Section;
use turn_signal::side::Side;

/// The front of the sample vehicle, metres before its rear axle.
pub(crate) const FRONT_M: f64 = 3.79;
/// Limits of the nearest point, as deployed.
pub(crate) const NEAREST: NearestLimits = NearestLimits { distance_m: 3.0, yaw_rad: 1.046 };

/// A pose on the line.
pub(crate) fn at(x_m: f64) -> Pose {
    Pose::new(x_m, 0.0, 0.0)
}

/// The line from `from` to `to`, a point every metre.
pub(crate) fn line(from: i32, to: i32) -> Path {
    Path::new((from..=to).map(|x| at(f64::from(x)))).unwrap()
}

/// `side D[a,b] R[c,d]`
pub(crate) fn record(side: Side, desired: [f64; 2], required: [f64; 2]) -> Section {
    let pair = |[start, end]: [f64; 2]| at(start)..at(end);
    Section::blinking(side, pair(desired), pair(required))
}

/// The resolution with the rear axle at `x_m` on a long line.
pub(crate) fn resolve_at(
    x_m: f64,
    front_m: f64,
    candidates: &Candidates,
    rules: &PairwiseRules,
) -> Resolution {
    static LONG: OnceLock<Path> = OnceLock::new();
    let path = LONG.get_or_init(|| line(-20, 140));
    resolve(&PathFrame::new(path, at(x_m), front_m, NEAREST), candidates, rules)
}

/// Intervals of one signal: it, first and last sample.
pub(crate) fn intervals(
    samples: impl IntoIterator<Item = (f64, TurnCommand)>,
) -> Vec<(TurnCommand, f64, f64)> {
    let mut runs: Vec<(TurnCommand, f64, f64)> = Vec::new();
    for (x, signal) in samples {
        match runs.last_mut() {
            Some((same, _, last)) if *same == signal => *last = x,
            _ => runs.push((signal, x, x)),
        }
    }
    runs
}

/// Intervals that blink, as `LEFT 0 to 60, RIGHT 61 to 116`.
pub(crate) fn blinking(samples: impl IntoIterator<Item = (f64, TurnCommand)>) -> String {
    let blinks = intervals(samples).into_iter().filter(|(signal, ..)| signal.side().is_some());
    blinks.map(|(signal, from, to)| format!("{signal} {from} to {to}")).collect::<Vec<_>>().join(", ")
}

/// `from`, then every `step`, up to `to`, without adding up rounding errors.
pub(crate) fn samples(from: f64, to: f64, step: f64) -> impl Iterator<Item = f64> {
    let count = ((to - from) / step).round();
    (0..=1_000_000_u32).map(f64::from).take_while(move |n| *n <= count).map(move |n| from + n * step)
}
