//! Every shipped drive scenario, driven improved and as upstream: expectations, coverage, and laws for all of
//! them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;
use std::time::Duration;

use signal_gateway::config::drive::{DriveFile, read};
use signal_gateway::config::files::Disk;
use signal_gateway::desk::drive::run::DriveRun;
use signal_gateway::desk::drive::simulation::DriveSimulation;
use signal_gateway::desk::drive::verdict::DriveVerdicts;
use signal_gateway::report::drive::Verdict;
use turn_signal::compat::DeciderCompat::{Improved, PathGenerator, Upstream};
use turn_signal::decision::Basis;
use turn_signal::light_command::{HazardCommand, TurnCommand};
use turn_signal::min_duration::MinDurations;
use turn_signal::resolve::{CandidateOutcome, EvaluatedCandidate};
use turn_signal::side::Side;

use super::coverage::{CONFLICTS, MANOEUVRES, ONLY_A_GAP, WEAKNESSES};

/// One cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shown {
    at_s: f64,
    at_m: f64,
    turn: TurnCommand,
    hazard: HazardCommand,
    /// Candidates were evaluated; otherwise a signal may be switched off early.
    has_candidates: bool,
    /// Candidates that are valid, whether they win or not.
    contenders: usize,
    /// A required section has begun, which comes before minimum durations.
    is_required: bool,
}

/// One scenario with one `compat`.
struct Driven {
    shown: Vec<Shown>,
    met: usize,
    failures: Vec<String>,
}

/// One scenario, driven as upstream and improved, and as the path generator where the file is for it.
struct Scenario {
    file: DriveFile,
    upstream: Driven,
    improved: Driven,
    path_generator: Option<Driven>,
}

static SCENARIOS: LazyLock<BTreeMap<String, Scenario>> = LazyLock::new(|| {
    let all = names();
    // Two at a time: each is driven alone.
    let (one, other) = all.split_at(all.len() / 2);
    let drive = |names: &[String]| -> Vec<(String, Scenario)> {
        names.iter().map(|name| (name.clone(), scenario(name))).collect()
    };
    std::thread::scope(|scope| {
        let first = scope.spawn(|| drive(one));
        let mut scenarios = drive(other);
        scenarios.extend(first.join().unwrap());
        scenarios.into_iter().collect()
    })
});

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("config/drives")
}

fn names() -> Vec<String> {
    let entries = std::fs::read_dir(folder()).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.retain(|name| name != "README.md");
    names.sort_unstable();
    names
}

fn scenario(name: &str) -> Scenario {
    let file = read(&Disk, &folder().join(name)).unwrap_or_else(|refused| panic!("{name}: {refused}"));
    let simulation = DriveSimulation::new(file.clone()).unwrap_or_else(|refused| panic!("{name}: {refused}"));
    let path_generator = file.compats.contains(&PathGenerator).then_some(PathGenerator);
    let compats = [Upstream, Improved].into_iter().chain(path_generator);
    let mut runs: Vec<_> = compats
        .map(|compat| {
            (DriveRun::new(&simulation, compat), DriveVerdicts::new(&simulation, compat), Vec::new())
        })
        .collect();
    for cycle in simulation.cycles() {
        for (run, verdicts, shown) in &mut runs {
            let decision = run.step(&cycle);
            verdicts.take(&cycle, &decision);
            shown.push(Shown {
                at_s: cycle.at_s,
                at_m: cycle.at_m,
                turn: decision.turn,
                hazard: decision.hazard,
                has_candidates: matches!(decision.basis, Basis::Candidates(_)),
                contenders: decision.evaluated().iter().filter(|candidate| contends(candidate)).count(),
                is_required: decision.evaluated().iter().any(|candidate| {
                    candidate.turn.side().is_some()
                        && candidate.distances.is_some_and(|distances| distances.are_required())
                }),
            });
        }
    }
    let mut driven = runs.into_iter().map(|(_, verdicts, shown)| {
        let Verdict { met, failed, .. } = verdicts.verdict();
        Driven { shown, met, failures: failed.iter().map(ToString::to_string).collect() }
    });
    let (upstream, improved) = (driven.next().unwrap(), driven.next().unwrap());
    let path_generator = driven.next();
    drop(driven);
    Scenario { file, upstream, improved, path_generator }
}

fn contends(candidate: &EvaluatedCandidate) -> bool {
    matches!(candidate.outcome, CandidateOutcome::Won | CandidateOutcome::LostTo { .. })
}

impl Driven {
    fn commands(&self) -> Vec<(TurnCommand, HazardCommand)> {
        self.shown.iter().map(|shown| (shown.turn, shown.hazard)).collect()
    }

    /// Sides in the order they are shown, each once however often it is interrupted.
    fn sides(&self) -> Vec<Side> {
        let mut sides: Vec<Side> = self.shown.iter().filter_map(|shown| shown.turn.side()).collect();
        sides.dedup();
        sides
    }

    /// The commands with their positions, for messages.
    fn story(&self) -> String {
        let mut story = String::new();
        let mut before = None;
        for shown in &self.shown {
            if before.replace(shown.turn) != Some(shown.turn) {
                story.push_str(&format!(" {} from {:.1} m,", shown.turn, shown.at_m));
            }
        }
        story
    }
}

#[test]
fn every_shipped_scenario_keeps_its_expectations() {
    let mut failures = Vec::new();
    for (name, scenario) in &*SCENARIOS {
        assert_eq!(scenario.file.compats[..2], [Improved, Upstream], "{name}: for both");
        let both = [("upstream", &scenario.upstream), ("improved", &scenario.improved)];
        let path_generator = scenario.path_generator.iter().map(|driven| ("path generator", driven));
        for (compat, driven) in both.into_iter().chain(path_generator) {
            assert!(driven.met + driven.failures.len() > 0, "{name}: nothing is expected, {compat}");
            if !driven.failures.is_empty() {
                failures.push(format!("{name}, {compat}:{}", driven.story()));
                failures.extend(driven.failures.iter().cloned());
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn manoeuvres_conflicts_and_weaknesses_are_covered() {
    let mut used: BTreeSet<&str> = BTreeSet::new();
    for (_, files) in MANOEUVRES.iter().chain(WEAKNESSES) {
        used.extend(*files);
    }
    used.extend(CONFLICTS.iter().map(|(_, file, _)| *file));
    let shipped: BTreeSet<&str> = SCENARIOS.keys().map(String::as_str).collect();
    assert_eq!(used, shipped);
    for (pattern, file, cases) in CONFLICTS {
        for (compat, case) in
            [Upstream, Improved].into_iter().flat_map(|compat| cases.iter().map(move |case| (compat, *case)))
        {
            let expects = SCENARIOS[*file].file.expectations.iter().any(|expected| {
                let decided = expected.decision.case.map(|case| case.to_string());
                expected.compats.contains(&compat) && decided.as_deref() == Some(case)
            });
            // Half a second of A4 is too short to be expected by position where a gap follows.
            assert!(expects || case == "A4" && compat == Improved, "{pattern}: {case} in {file}, {compat:?}");
        }
    }
    let numbers: Vec<&str> = WEAKNESSES.iter().map(|(weakness, _)| *weakness).collect();
    let expected = (1..=10).chain([15]).chain(18..=24).map(|number| format!("W{number}"));
    assert_eq!(numbers, expected.collect::<Vec<_>>());
}

#[test]
fn three_candidates_compete_at_once() {
    let Scenario { upstream, improved, .. } = &SCENARIOS["three_candidates.toml"];
    for driven in [upstream, improved] {
        let all_m: Vec<f64> =
            driven.shown.iter().filter(|shown| shown.contenders == 3).map(|shown| shown.at_m).collect();
        assert!(all_m.len() > 40 && all_m[0] < 61.0 && all_m[all_m.len() - 1] > 85.0, "{all_m:?}");
    }
}

#[test]
fn improved_differs_from_upstream_where_a_weakness_shows_and_nowhere_else() {
    let weak: BTreeSet<&str> = WEAKNESSES.iter().flat_map(|(_, files)| files.iter().copied()).collect();
    for (name, Scenario { upstream, improved, .. }) in &*SCENARIOS {
        let same = upstream.commands() == improved.commands();
        let stories = format!("{name}\nupstream:{}\nimproved:{}", upstream.story(), improved.story());
        if weak.contains(name.as_str()) {
            assert!(!same, "{stories}");
        } else if ONLY_A_GAP.contains(&name.as_str()) {
            assert!(!same, "{stories}");
            assert_eq!(upstream.sides(), improved.sides(), "{stories}");
        } else {
            assert!(same, "{stories}");
        }
    }
}

#[test]
fn the_path_generator_differs_from_both_others() {
    let mut differing = 0;
    for (name, Scenario { upstream, improved, path_generator, .. }) in &*SCENARIOS {
        let Some(path_generator) = path_generator else { continue };
        let stories = format!("{name}\npath generator:{}", path_generator.story());
        for other in [upstream, improved] {
            assert_ne!(path_generator.commands(), other.commands(), "{stories}\nother:{}", other.story());
        }
        assert!(
            path_generator.shown.iter().all(|shown| shown.hazard == HazardCommand::NoCommand),
            "{stories}"
        );
        differing += 1;
    }
    assert!(differing >= 3, "{differing} drives are for the path generator");
}

#[test]
fn by_default_minimum_durations_hold_outside_required_sections() {
    let min_durations = MinDurations::READABLE;
    let after = |from: f64, to: f64| Duration::from_secs_f64(to - from + 1e-6);
    for (name, Scenario { improved, .. }) in &*SCENARIOS {
        let mut on: Option<(Side, f64)> = None;
        let mut last_on: Option<f64> = None;
        for shown in &improved.shown {
            match (on, shown.turn.side()) {
                (Some((side, _)), Some(next)) if side == next => {}
                (Some((side, since)), next) => {
                    let is_urgent = next.is_some() && shown.is_required;
                    assert!(
                        next.is_none() || is_urgent,
                        "{name}: from {side} to the other at {:.1} m",
                        shown.at_m
                    );
                    let long_enough = after(since, shown.at_s) >= min_durations.minimum_on;
                    assert!(
                        long_enough || is_urgent || !shown.has_candidates,
                        "{name}: {side} too short at {:.1} m",
                        shown.at_m
                    );
                    (on, last_on) = (next.map(|next| (next, shown.at_s)), Some(shown.at_s));
                }
                (None, Some(side)) => {
                    let dark = last_on.map(|last| after(last, shown.at_s));
                    assert!(
                        shown.is_required || dark.is_none_or(|dark| dark >= min_durations.minimum_gap),
                        "{name}: {:.1} m",
                        shown.at_m
                    );
                    on = Some((side, shown.at_s));
                }
                (None, None) => {}
            }
        }
    }
}

#[test]
fn the_readme_lists_every_scenario() {
    let readme = std::fs::read_to_string(folder().join("README.md")).unwrap();
    for (name, scenario) in &*SCENARIOS {
        let row = readme.lines().find(|line| line.starts_with(&format!("- `{name}`: ")));
        let title = scenario.file.name.as_deref().unwrap();
        assert!(row.is_some_and(|row| row.contains(title)), "{name}: {title}");
    }
}
