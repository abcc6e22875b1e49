//! Statuses of the turn signal decider and the traffic lights.

use signal_gateway::core::diagnostics::Level::{Error, Ok, Warn};

use super::super::{Key, Task};
use super::{ASLEEP, NOTHING, key, message, missing, patterns};

pub(super) fn decider() -> Task {
    let wait_route = "Nothing; it ends when a route is set.";
    Task {
        names: &["turn_signal_decider"],
        about: "What the turn signal decider commands, by whose request, and what its inputs lack. With \
                `[turn_signal]` enabled or in shadow.",
        messages: vec![
            message(Ok, "{command}: nothing to signal[, held]", NOTHING),
            message(Ok, "{command}: intersection[, held]", NOTHING),
            message(Ok, "{command}: roundabout[, held]", NOTHING),
            message(Ok, "{command}: manoeuvre[, held]", NOTHING),
            message(Ok, "{command}: hazard lights[, held]", NOTHING),
            message(Ok, "{command}: path generator", NOTHING),
            message(Ok, "{command}: no route", wait_route),
            message(Ok, "{command}: the scenario is not lane driving", "Nothing; the decider rests."),
            message(Warn, "{command}: no odometry", "Start localisation, or check the topic's name."),
            message(
                Warn,
                "{command}: the planned path is empty",
                "Check the planner; manoeuvres alone are signalled meanwhile.",
            ),
            message(Warn, "{command}: the planned path is too old", "Check the planner."),
            message(
                Warn,
                "{command}: a point of the planned path is not a number",
                "Report it to the planner's maintainers; the path is not used.",
            ),
            message(
                Warn,
                "{command}: the hazard request is too old",
                "Check the sender of the hazard request.",
            ),
            message(
                Warn,
                "{command}: {manoeuvre} is too old",
                "Check the planner's module; the manoeuvre is left out.",
            ),
            message(
                Warn,
                "{command}: {manoeuvre} without a planned path",
                "Check the topic of the planned path; the manoeuvre is left out.",
            ),
            message(
                Warn,
                "{command}: planning factor of {topic}: {flaw}",
                "Report it to the planner's maintainers; the factor is left out. It has `no start and end`, `no side`, or `a \
                 position or an offset is not a number`.",
            ),
            message(
                Warn,
                "{command}: Autoware commands something else",
                "In shadow: read `turn_disagreement` and `hazard_disagreement`.",
            ),
            message(Error, "{command}: odometry is too old", "Check localisation."),
            message(Error, "{command}: odometry is not a number", "Check localisation."),
            message(Error, "{command}: the scenario is too old", "Check the scenario selector."),
            message(Error, "{command}: the route has no lanelet", "Set the route again."),
            message(
                Error,
                "{command}: the route lists lanelet {lane} twice",
                "Report it to the planner's maintainers.",
            ),
            message(
                Error,
                "{command}: lanelet {lane} of the route is not on the map",
                "Give the decider the map that Autoware uses.",
            ),
            message(Error, "{command}: the start of the route is not a number", "Set the route again."),
        ],
        keys: decider_keys(),
    }
}

fn decider_keys() -> Vec<Key> {
    let decided = "after the first decision";
    let candidates = "while candidates are compared";
    let winner = "while a candidate wins";
    let shadow = "in the role `shadow`";
    let measure = "Distance along the path in metres; negative = already begun.";
    vec![
            key("role", "-", "`command` or `shadow`."),
            key("command", "-", "Turn command now: `NO_COMMAND`, `DISABLE`, `LEFT` or `RIGHT`.")
                .when(decided),
            key("hazard", "-", "Hazard command now: `NO_COMMAND`, `DISABLE` or `ENABLE`.").when(decided),
            key("held", "-", "Reason why the command is not yet the requested one, or `no`.").when(decided),
            key("winner", "-", "Candidate that wins, or `none`.").when(decided),
            key("rule", "-", "Rule it wins by, as in `docs/spec/turn-signal-decider.md`, or `none`.")
                .when(candidates),
            key("desired_start_m", "m", measure).when(winner),
            key("desired_end_m", "m", measure).when(winner),
            key("required_start_m", "m", measure).when(winner),
            key("required_end_m", "m", measure).when(winner),
            key("intersection", "-", "What became of the candidate of this source.").when(candidates),
            key("roundabout", "-", "Likewise.").when(candidates),
            key("manoeuvre", "-", "Likewise.").when(candidates),
            key(
                "lanelet",
                "-",
                "Tagged lanelet by which the path generator decided, and why, or `no tagged lanelet`.",
            )
            .when("with `compat = \"path_generator\"`"),
            key("manoeuvres", "-", "What became of each manoeuvre of the planner, or `none`.").when(decided),
            key("findings", "-", "All that is noted of the inputs, in the texts above, ages as `… is 700 ms old`; `new route`; or `none`.")
                .when(decided),
            key("route", "-", "Id of the route in hexadecimal, `none`, or `refused`."),
            key("odometry_age_ms", "ms", "Age of the last odometry, or `none`."),
            key("operation_mode", "-", "Number of the operation mode, or `unknown`."),
            key("cycles", "-", "Decisions since start."),
            key("changes", "-", "Of these, with another command than the one before."),
            key(
                "turn_agreement_percent",
                "%",
                "Share of the compared cycles without a lasting difference, or `nothing compared`.",
            )
            .when(shadow),
            key("turn_disagreement", "-", "`LEFT here, DISABLE of Autoware, for N ms`, or `none`.")
                .when(shadow),
            key("turn_compared", "-", "Cycles: `N alike, N tolerated, N different, N skipped`.").when(shadow),
            key("hazard_agreement_percent", "%", "As for turn.").when(shadow),
            key("hazard_disagreement", "-", "As for turn.").when(shadow),
            key("hazard_compared", "-", "As for turn.").when(shadow),
        ]
}

pub(super) fn channel() -> Task {
    Task {
        names: &["traffic_lights_conventional", "traffic_lights_v2i"],
        about: "The traffic lights of one channel. With a `[traffic_lights]` section.",
        messages: vec![
            message(Ok, "normal", NOTHING),
            message(
                Warn,
                "{id} shows red and green",
                "Correct the phases, actions or inputs that set this light.",
            ),
            message(Warn, "an input for {id} was rejected", "Correct the id or the state; shown for 10 s."),
            message(Warn, "an unreadable input was rejected", "Correct the sender; shown for 10 s."),
            message(
                Warn,
                "lights are no longer received",
                "Check the sender of the V2I states; the lights were removed.",
            ),
        ],
        keys: vec![
            key("lights", "-", "Lights with a state."),
            key("dark", "-", "Of these, without a lit bulb."),
            key("unknown", "-", "Of these and of the detected ones, with an unknown colour or status."),
            key("detected", "-", "Lights with a detected state."),
            key(
                "contradictory",
                "-",
                "Of these and of the detected ones, with a red and a green circle lit.",
            ),
            key("stale", "-", "Lights removed since they were not renewed; 0 for `conventional`."),
            key("rejected", "-", "Inputs rejected since start."),
            key("rate_hz", "Hz", "Rate of the channel's messages."),
            key("last_rejected", "-", "Id of the last rejected input.").when("after one with an id"),
        ],
    }
}

pub(super) fn scenario() -> Task {
    Task {
        names: &["traffic_lights_scenario"],
        about: "The scenario. With a `[traffic_lights]` section.",
        messages: vec![
            message(Ok, "no scenario", NOTHING),
            message(Ok, "running", NOTHING),
            message(Warn, "waiting for /clock", "Start the simulator; nothing is sent before its first time."),
            message(Warn, "/clock is no longer received", "Check the simulator; time stands still without it."),
            message(Ok, "ended", NOTHING),
            message(Ok, "ended in success", NOTHING),
            message(Warn, "ended in failure", "Read in the log which condition failed it."),
            message(Error, "cannot continue: {reason}", "Correct the scenario."),
        ],
        keys: vec![
            key("controllers", "-", "Controllers of the scenario."),
            key(
                "controller",
                "s",
                "`NAME: PHASE, N s left`, `no phase yet`, `until an action` or `stopped`; the first eight, one each.",
            )
            .when("if the scenario has controllers"),
            key("skipped", "-", "Frames and messages left out after gaps in time."),
            key("refused_commands", "-", "Text commands that were refused."),
            key("clock_restarts", "-", "Times that the simulated clock began anew.").when("with `use_sim_time`"),
            key("clock_overtaken", "-", "Messages of `/clock` older than the one before, which had no effect.")
                .when("with `use_sim_time`"),
        ],
    }
}

pub(super) fn v2i_reception() -> Task {
    let more = "[ (and {others} more)]";
    let message_of = |text: &str| format!("{{group}}: {text}{more}");
    let mut messages = vec![message(Ok, "{known} of {groups} known", NOTHING)];
    messages.extend(missing(Warn, "{group}: ", more));
    messages.extend(patterns(ASLEEP, Warn, "{group}: ", more));
    messages.extend([
        message(
            Warn,
            &message_of("{signal} = {raw} reports that states cannot be used"),
            "Check the V2X unit; it does not trust its own states.",
        ),
        message(Warn, &message_of("{signal} = {raw} means fault"), "Have the V2X unit repaired."),
        message(
            Warn,
            &message_of("{signal} = {raw} is not a defined value"),
            "Find out what the value means and name it in the profile.",
        ),
    ]);
    Task {
        names: &["v2i_traffic_lights"],
        about: "The states that a V2X unit sends on CAN. If the profile has a `[[v2i.source]]`.",
        messages,
        keys: vec![
            key(
                "groups",
                "-",
                "Each group with its state or why there is none; `not received yet`, `not received again` and `means \
                 not available` are as it should be away from an intersection.",
            ),
            key("known_groups", "-", "Groups with a state."),
            key("age_ms", "ms", "Age of the newest state, or `never`."),
            key("frames", "-", "Frames of the unit since start."),
            key("too_short_frames", "-", "Of these, too short for a signal that is bound."),
            key("rejected_frames", "-", "Of these, failed the integrity check."),
            key("unmapped_count", "-", "Frames about a group that the profile does not map."),
            key("undefined_count", "-", "Times a state, status or confidence became undefined."),
        ],
    }
}
