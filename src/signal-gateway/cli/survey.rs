//! `decide --all-routes`: drives many routes of a map, once or for each value of a sweep.

use std::io::Write;
use std::process::ExitCode;

use serde_json::{Map, Value, json};

use super::failure::Failure;
use super::messages;
use super::progress::ProgressDisplay;
use crate::config::Refused;
use crate::desk::drive::survey::{SignalFault, Surveyor, Sweep, TurnSurvey, WrongTurn};
use crate::report::joined;
use turn_signal::compat::DeciderCompat;

/// Drives the routes and prints the faults, or a table with a row for each value of a sweep.
pub(super) fn run(
    surveyor: impl FnOnce() -> Result<Surveyor, Refused>,
    compat: Option<DeciderCompat>,
    sweep: Option<&Sweep>,
    as_json: bool,
) -> Result<ExitCode, Failure> {
    let reading = ProgressDisplay::spinner("reading the map and driving");
    let surveyor = surveyor()?;
    let compat = compat.unwrap_or_else(|| surveyor.compat());
    let mut out = messages::result_lines(as_json);
    let mut is_wrong = false;
    let compat_key = json!({ "compat": compat.name() });
    if let Some(sweep) = sweep {
        let rows = sweep.variants(surveyor.settings()).into_iter().map(|(value, settings)| {
            let survey = surveyor.survey(compat, &settings)?;
            Ok((value, survey))
        });
        let rows = rows.collect::<Result<Vec<_>, Refused>>()?;
        drop(reading);
        is_wrong = rows.iter().any(|(_, survey)| !survey.wrong.is_empty());
        if as_json {
            for (value, survey) in &rows {
                let keys = json!({ "compat": compat.name(), "sweep": sweep.key(), "value": value });
                writeln!(out, "{}", joined(keys, json_counts(survey)))?;
            }
        } else {
            writeln!(out, "{}, {}\n{}", compat.name(), sweep.key(), table(&rows))?;
        }
    } else {
        let survey = surveyor.survey(compat, surveyor.settings())?;
        drop(reading);
        for wrong in &survey.wrong {
            is_wrong = true;
            if as_json {
                writeln!(out, "{}", joined(compat_key.clone(), json_turn(wrong)))?;
            } else {
                writeln!(out, "{wrong}")?;
            }
        }
        if as_json {
            writeln!(out, "{}", joined(compat_key, json_counts(&survey)))?;
        } else {
            writeln!(out, "{}", sentence(compat, &survey))?;
        }
    }
    out.flush()?;
    Ok(if is_wrong { ExitCode::from(5) } else { ExitCode::SUCCESS })
}

/// Formats a survey: `improved: 60 routes, 79 turns: 0 missed, 0 short, …; by the map: 1 missed`.
fn sentence(compat: DeciderCompat, survey: &TurnSurvey) -> String {
    let named = |counts: [usize; 4]| SignalFault::ALL.map(SignalFault::name).into_iter().zip(counts);
    let text = |counts: Vec<(&str, usize)>| {
        counts.iter().map(|(name, count)| format!("{count} {name}")).collect::<Vec<_>>().join(", ")
    };
    let by_map: Vec<_> = named(survey.counts(true)).filter(|(_, count)| *count > 0).collect();
    let (routes, turns) = (survey.routes, survey.turns);
    let counts = text(named(survey.counts(false)).collect());
    let by_map = if by_map.is_empty() { String::new() } else { format!("; by the map: {}", text(by_map)) };
    format!("{}: {routes} routes, {turns} turns: {counts}{by_map}", compat.name())
}

/// Formats a row for each value. Faults that the map causes are in the last column only.
fn table(rows: &[(String, TurnSurvey)]) -> String {
    let heading = ["value", "routes", "turns"].into_iter().chain(SignalFault::ALL.map(SignalFault::name));
    let heading: Vec<String> = heading.chain(["by the map"]).map(str::to_owned).collect();
    let row = |(value, survey): &(String, TurnSurvey)| {
        let by_map: usize = survey.counts(true).into_iter().sum();
        let counts = [survey.routes, survey.turns].into_iter().chain(survey.counts(false)).chain([by_map]);
        std::iter::once(value.clone()).chain(counts.map(|count| count.to_string())).collect()
    };
    let rows: Vec<Vec<String>> = std::iter::once(heading).chain(rows.iter().map(row)).collect();
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(String::len).max();
    let line = |row: &Vec<String>| {
        let cells = row.iter().enumerate();
        let cells = cells.map(|(column, cell)| format!("{cell:>width$}", width = width(column).unwrap_or(0)));
        cells.collect::<Vec<_>>().join("  ")
    };
    rows.iter().map(line).collect::<Vec<_>>().join("\n")
}

fn json_turn(wrong: &WrongTurn) -> Value {
    let [from, to] = wrong.way;
    json!({
        "lanelet": wrong.lane,
        "side": wrong.side.name(),
        "at_m": (wrong.at_m * 10.0).round() / 10.0,
        "from": from,
        "to": to,
        "fault": wrong.fault.name(),
        "map_flaw": wrong.flaw.as_ref().map(ToString::to_string),
    })
}

fn json_counts(survey: &TurnSurvey) -> Value {
    let counts = |of_map| {
        let named = SignalFault::ALL.map(SignalFault::name).into_iter().zip(survey.counts(of_map));
        named.map(|(name, count)| (name.to_owned(), json!(count))).collect::<Map<String, Value>>()
    };
    json!({
        "routes": survey.routes,
        "turns": survey.turns,
        "by_decider": counts(false),
        "by_map": counts(true),
    })
}
