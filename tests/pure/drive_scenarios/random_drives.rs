//! Random drives over the shipped maps against what must hold for every drive by default. A drive that breaks a law is
//! shrunk and printed as a drive file, for `signal-gateway decide`.

use std::fmt::Write as _;
use std::io;
use std::path::Path;

use proptest::prelude::*;
use signal_gateway::config::drive::{DriveFile, Plan, PlanKind, PlannedShift, read};
use signal_gateway::config::files::{Disk, Files};
use signal_gateway::core::light_command::TurnCommand;
use signal_gateway::core::map::lane_network::{Lane, TurnDirection};
use signal_gateway::core::turn_signal::compat::DeciderCompat::Improved;
use signal_gateway::core::turn_signal::resolve::{Contender, Source};
use signal_gateway::core::turn_signal::side::Side;
use signal_gateway::desk::drive::run::Run;
use signal_gateway::desk::drive::simulation::{Cycle, DriveSimulation};

/// Map, and the lanelets that are driven.
const ROUTES: [(&str, &[i64]); 14] = [
    ("lane_change_road", &[201, 202, 203, 211, 212]),
    ("lane_change_road", &[101, 102, 103, 111, 112]),
    ("lane_change_road", &[301, 302, 303, 311, 312]),
    ("consecutive_turns", &[101, 102, 103, 104, 105]),
    ("consecutive_turns", &[105, 106, 107, 108, 109]),
    ("consecutive_turns", &[109, 110, 111, 112]),
    ("chicane", &[101, 102, 103, 104]),
    ("crossing", &[101, 111, 402]),
    ("crossing", &[201, 213, 302]),
    ("bus_bay", &[101, 102, 103, 104, 111, 112]),
    ("roundabout", &[101, 102, 105, 206, 205, 303, 304]),
    ("roundabout_untagged", &[101, 102, 105, 203, 204]),
    ("roundabout_untagged", &[101, 102, 105, 206, 205, 303, 304]),
    ("roundabout_untagged", &[101, 102, 105, 206, 205, 306, 305, 406, 405, 103, 104]),
];
const SIDES: [&str; 3] = ["None", "Left", "Right"];
/// The front of the sample vehicle before its rear axle, metres.
const FRONT_M: f64 = 3.79;
/// Sections are checked this far from their ends, metres: distances are those along the middle of the lanes.
const MARGIN_M: f64 = 1.5;
const MINIMUM_ON_S: f64 = 1.5;
const CYCLE_S: f64 = 0.2;

/// A drive to be written as a file. Manoeuvres follow each other.
#[derive(Debug, Clone)]
struct Recipe {
    route: usize,
    speeds: Vec<(u16, u8)>,
    stop: Option<(u16, u8)>,
    on_entry: usize,
    on_exit: usize,
    persists: bool,
    pulls_out: Option<bool>,
    moves: Vec<Move>,
    pull_over: Option<(u16, u16, bool)>,
}

#[derive(Debug, Clone)]
struct Move {
    gap_m: u16,
    length_m: u16,
    to_left: bool,
    /// Gap to the way back of an avoidance and its length; a lane change without.
    back: Option<(u16, u16)>,
}

fn any_recipe() -> impl Strategy<Value = Recipe> {
    let a_move = (0..80_u16, 8..60_u16, any::<bool>(), proptest::option::of((1..50_u16, 8..50_u16)))
        .prop_map(|(gap_m, length_m, to_left, back)| Move { gap_m, length_m, to_left, back });
    let speeds = proptest::collection::vec((0..300_u16, 2..15_u8), 1..4);
    let pull_over = (0..60_u16, 10..40_u16, any::<bool>());
    (
        (0..ROUTES.len(), speeds, proptest::option::weighted(0.3, (0..250_u16, 1..6_u8))),
        (0..SIDES.len(), 0..SIDES.len(), any::<bool>(), proptest::option::weighted(0.3, any::<bool>())),
        proptest::collection::vec(a_move, 0..4),
        proptest::option::weighted(0.3, pull_over),
    )
        .prop_map(
            |((route, speeds, stop), (on_entry, on_exit, persists, pulls_out), moves, pull_over)| Recipe {
                route,
                speeds,
                stop,
                on_entry,
                on_exit,
                persists,
                pulls_out,
                moves,
                pull_over,
            },
        )
}

impl Recipe {
    /// The drive as a file.
    fn text(&self) -> String {
        let (map, lanes) = ROUTES[self.route];
        let mut text = format!("map = \"../maps/{map}/lanelet2_map.osm\"\nplanning_hz = 5\n");
        let mut speeds = self.speeds.clone();
        speeds.sort_unstable_by_key(|(at_m, _)| *at_m);
        speeds.dedup_by_key(|(at_m, _)| *at_m);
        let step = |(at_m, mps): &(u16, u8)| format!("{{ at_m = {at_m}, mps = {mps} }}");
        let steps: Vec<_> = speeds.iter().map(step).collect();
        let (entry, exit) = (SIDES[self.on_entry], SIDES[self.on_exit]);
        let segments: Vec<_> = lanes.iter().map(|lane| format!("[{lane}]")).collect();
        let _ = writeln!(
            text,
            "\n[route]\nsegments = [{}]\n\n[parameters]\nturn_signal_roundabout_on_entry = \"{entry}\"\n\
             turn_signal_roundabout_on_exit = \"{exit}\"\n\
             turn_signal_roundabout_entry_indicator_persistence = {}\n\n[drive]\nspeed = [{}]",
            segments.join(", "),
            self.persists,
            steps.join(", ")
        );
        if let Some((at_m, for_s)) = self.stop {
            let _ = writeln!(text, "stops = [{{ at_m = {at_m}, for_s = {for_s} }}]");
        }
        let mut at_m = 0;
        if let Some(from_left) = self.pulls_out {
            let offset_m = if from_left { 2.2 } else { -2.2 };
            let _ = writeln!(
                text,
                "\n[[manoeuvre]]\nkind = \"pull_out\"\nfrom_m = 0\nto_m = 25\noffset_m = {offset_m}"
            );
            at_m = 25;
        }
        for Move { gap_m, length_m, to_left, back } in &self.moves {
            let from_m = at_m + gap_m;
            at_m = from_m + length_m;
            match back {
                None => {
                    let side = if *to_left { "left" } else { "right" };
                    let _ = writeln!(
                        text,
                        "\n[[manoeuvre]]\nkind = \"lane_change\"\nside = \"{side}\"\nfrom_m = {from_m}\nto_m = {at_m}"
                    );
                }
                Some((gap_m, length_m)) => {
                    // Within its lane an avoidance is not signalled.
                    let offset_m = if *to_left { 2.5 } else { -2.5 };
                    let back_m = at_m + gap_m;
                    let end_m = back_m + length_m;
                    let _ = writeln!(
                        text,
                        "\n[[manoeuvre]]\nkind = \"avoidance\"\nlines = [{{ from_m = {from_m}, to_m = {at_m}, offset_m \
                         = {offset_m} }}, {{ from_m = {back_m}, to_m = {end_m}, offset_m = 0 }}]"
                    );
                    at_m = end_m;
                }
            }
        }
        if let Some((gap_m, length_m, is_announced)) = self.pull_over {
            let from_m = at_m + 40 + gap_m;
            let to_m = from_m + length_m;
            let _ = writeln!(
                text,
                "\n[[manoeuvre]]\nkind = \"pull_over\"\nfrom_m = {from_m}\nto_m = {to_m}\noffset_m = 2.2"
            );
            if is_announced {
                let (decided_m, braking_m) = (from_m - 25, from_m - 38);
                let _ = writeln!(
                    text,
                    "decided_from_m = {decided_m}\ndeceleration_m = {braking_m}\nstop_m = {from_m}\nstop_path_end_m = {to_m}"
                );
            }
        }
        text
    }
}

/// The text of a drive in the folder of drives, with the maps on disk.
struct InFolder(String);

impl Files for InFolder {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path.ends_with("random.toml") { Ok(self.0.clone().into_bytes()) } else { Disk.read(path) }
    }
}

/// Where a manoeuvre moves to a side: the rear axle between the front at its start and the rear axle at its end.
#[derive(Debug, Clone, Copy)]
struct Stretch {
    side: Side,
    from_m: f64,
    /// It is required at least to here.
    required_to_m: f64,
    to_m: f64,
}

impl Stretch {
    fn new(side: Side, from_m: f64, required_to_m: f64, to_m: f64) -> Self {
        Self { side, from_m: from_m - FRONT_M, required_to_m, to_m }
    }

    fn rivals(&self, other: &Self) -> bool {
        let apart = self.to_m + MARGIN_M < other.from_m || other.to_m + MARGIN_M < self.from_m;
        self.side != other.side && !apart
    }
}

/// Sides that the file plans, or that turns and exits of the route have.
fn stretches(file: &DriveFile) -> Vec<Stretch> {
    let mut found: Vec<Stretch> = file.manoeuvres.iter().flat_map(planned).collect();
    let mut from_m = 0.0;
    for segment in &file.route.segments {
        let lane = file.road.lane(segment.preferred).unwrap();
        let to_m = from_m + lane.length_m();
        let side = match lane.turn_direction {
            TurnDirection::Left => Some(Side::Left),
            TurnDirection::Right => Some(Side::Right),
            TurnDirection::None | TurnDirection::Straight => leaving_side(file, lane),
        };
        // The bend of a lanelet can be over soon.
        found.extend(side.map(|side| Stretch::new(side, from_m, from_m + 0.2 * (to_m - from_m), to_m)));
        from_m = to_m;
    }
    found
}

fn leaving_side(file: &DriveFile, lane: &Lane) -> Option<Side> {
    let leaves = file.road.roundabouts_of(lane.id).any(|element| element.exits.contains(&lane.id));
    file.parameters.roundabout_on_exit.filter(|_| leaves)
}

fn planned(plan: &Plan) -> Vec<Stretch> {
    let side = |offset_m: f64| if offset_m > 0.0 { Side::Left } else { Side::Right };
    match &plan.kind {
        PlanKind::Avoidance { lines } => {
            let mut before_m = 0.0;
            let mut stretch = |line: &PlannedShift| {
                let moved_m = line.offset_m - std::mem::replace(&mut before_m, line.offset_m);
                Stretch::new(side(moved_m), line.from_m, line.to_m, line.to_m)
            };
            lines.iter().map(&mut stretch).collect()
        }
        PlanKind::LaneChange { side, from_m, to_m, crossing_m, .. } => {
            vec![Stretch::new(*side, *from_m, *crossing_m, *to_m)]
        }
        PlanKind::PullOut { shift, .. } => {
            vec![Stretch::new(side(-shift.offset_m), shift.from_m, shift.to_m, shift.to_m)]
        }
        PlanKind::PullOver { shift, .. } => {
            vec![Stretch::new(side(shift.offset_m), shift.from_m, shift.to_m, shift.to_m)]
        }
        PlanKind::SideShift(_) => Vec::new(),
    }
}

/// One cycle of a drive.
struct Shown {
    at_s: f64,
    at_m: f64,
    side: Option<Side>,
    winner: Option<Contender>,
}

impl Shown {
    /// The manoeuvre that is signalled, by its source, its side and where it ends.
    fn signalled(&self) -> Option<(Source, Side, f64)> {
        let winner = self.winner.filter(|winner| Some(winner.side) == self.side)?;
        Some((winner.source, winner.side, self.at_m + winner.distances.desired_end_m))
    }
}

fn driven(simulation: &DriveSimulation) -> Vec<Shown> {
    let mut run = Run::new(simulation, Improved);
    let shown = |cycle: Cycle| {
        let decision = run.step(&cycle);
        let winner = decision.resolution().and_then(|resolution| resolution.winner);
        assert_ne!(decision.turn, TurnCommand::NoCommand, "at {} m", cycle.at_m);
        Shown { at_s: cycle.at_s, at_m: cycle.at_m, side: decision.turn.side(), winner }
    };
    simulation.cycles().map(shown).collect()
}

/// The first law that the drive breaks.
fn broken(file: &DriveFile, shown: &[Shown]) -> Option<String> {
    required_sections(file, shown).or_else(|| durations(shown)).or_else(|| signalled_once(shown))
}

/// In a required section that nobody rivals, its side is shown.
fn required_sections(file: &DriveFile, shown: &[Shown]) -> Option<String> {
    let all = stretches(file);
    for stretch in all.iter().filter(|stretch| !all.iter().any(|other| stretch.rivals(other))) {
        let within = stretch.from_m + MARGIN_M..=stretch.required_to_m - MARGIN_M;
        let is_wrong = |shown: &&Shown| within.contains(&shown.at_m) && shown.side != Some(stretch.side);
        if let Some(Shown { at_m, side, .. }) = shown.iter().find(is_wrong) {
            return Some(format!("{side:?} at {at_m:.2} m, in {stretch:?}"));
        }
    }
    None
}

/// A side is shown for a minimum time unless another is required, and no longer than it is wanted or for that time.
fn durations(shown: &[Shown]) -> Option<String> {
    let mut since = 0.0;
    for pair in shown.windows(2) {
        let [before, now] = pair else { continue };
        if now.side != before.side {
            let lasted_s = now.at_s - since;
            let is_urgent = now.side.is_some() && now.winner.is_some_and(|winner| winner.is_required());
            if before.side.is_some() && lasted_s < MINIMUM_ON_S - 1e-6 && !is_urgent {
                return Some(format!("{:?} for {lasted_s:.1} s up to {:.2} m", before.side, now.at_m));
            }
            since = now.at_s;
        }
        let is_held = now.side.is_some() && now.signalled().is_none();
        if is_held && now.at_s - since > MINIMUM_ON_S + CYCLE_S {
            return Some(format!("{:?} at {:.2} m without a manoeuvre", now.side, now.at_m));
        }
    }
    None
}

/// What was signalled comes back only after another manoeuvre, and while its required section is not over.
fn signalled_once(shown: &[Shown]) -> Option<String> {
    let mut ended: Vec<((Source, Side, f64), bool)> = Vec::new();
    let mut present: Option<(Source, Side, f64)> = None;
    let is_same = |one: &(Source, Side, f64), other: &(Source, Side, f64)| {
        (one.0, one.1) == (other.0, other.1) && (one.2 - other.2).abs() < 2.0
    };
    for now in shown {
        let signalled = now.signalled();
        if let Some(other) = signalled {
            for (_, was_displaced) in ended.iter_mut().filter(|(gone, _)| gone.1 != other.1) {
                *was_displaced = true;
            }
            let returns = ended.iter().position(|(gone, _)| is_same(gone, &other));
            if let Some(index) = returns {
                let (_, was_displaced) = ended.remove(index);
                let is_over = now.winner.is_some_and(|winner| winner.distances.required_end_m < 0.0);
                if !was_displaced || is_over {
                    return Some(format!("{other:?} comes back at {:.2} m", now.at_m));
                }
            }
        }
        match (present, signalled) {
            (Some(before), Some(now)) if is_same(&before, &now) => {}
            (Some(before), now) => ended.push((before, now.is_some_and(|now| now.1 != before.1))),
            (None, _) => {}
        }
        present = signalled;
    }
    None
}

fn check(recipe: &Recipe) -> Result<(), TestCaseError> {
    let text = recipe.text();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives/random.toml");
    let file = read(&InFolder(text.clone()), &path);
    let file = file.map_err(|refused| TestCaseError::fail(format!("{refused}\n{text}")))?;
    let simulation = DriveSimulation::new(file);
    let simulation = simulation.map_err(|refused| TestCaseError::fail(format!("{refused}\n{text}")))?;
    let law = broken(simulation.file(), &driven(&simulation));
    law.map_or(Ok(()), |law| Err(TestCaseError::fail(format!("{law}\n\n{text}"))))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_drives_keep_the_laws(recipe in any_recipe()) {
        check(&recipe)?;
    }
}

mod slow {
    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 10_000, failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn ten_thousand_random_drives_keep_the_laws(recipe in any_recipe()) {
            check(&recipe)?;
        }
    }
}
