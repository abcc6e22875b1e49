//! Counts since start: a row per count, from which metrics, page and status text are generated.

use can_signal::can::BusSnapshot;
use gateway_core::command::snapshot::FunctionSnapshot;
use turn_signal::flow::snapshot::DeciderSnapshot;

pub(super) struct Count<T> {
    /// Name of its metric, without prefix and suffix.
    pub(super) metric: &'static str,
    pub(super) help: &'static str,
    /// Its name on the page and in the status text, which show it if it has a name and is not 0.
    pub(super) label: Option<&'static str>,
    pub(super) value: fn(&T) -> u64,
}

const fn row<T>(metric: &'static str, help: &'static str, value: fn(&T) -> u64) -> Count<T> {
    Count { metric, help, label: None, value }
}

const fn shown<T>(
    metric: &'static str,
    label: &'static str,
    help: &'static str,
    value: fn(&T) -> u64,
) -> Count<T> {
    Count { metric, help, label: Some(label), value }
}

pub(super) const BUS: [Count<BusSnapshot>; 6] = [
    row("bus_frames", "Frames of the vehicle profile", |bus| bus.frames),
    shown("bus_dropped_frames", "drops", "Frames dropped by the kernel or by the gateway", |bus| bus.drops),
    shown("bus_error_frames", "error frames", "Error frames", |bus| bus.error_frames),
    shown("bus_link_losses", "link losses", "Times that the link was lost", |bus| bus.link_losses),
    shown("bus_controller_bus_off", "bus-offs", "Times that the controller went bus-off", |bus| bus.bus_offs),
    shown("bus_bad_records", "unreadable records", "Unreadable records of a recording", |bus| {
        bus.bad_records
    }),
];

pub(super) const FUNCTION: [Count<FunctionSnapshot>; 3] = [
    row("commands_received", "Commands received", |function| function.commands),
    row("command_driver_overrides", "Times that the driver did something else", |function| {
        function.driver_overrides
    }),
    row(
        "command_feedback_mismatches",
        "Times that the report differed from the command for too long",
        |function| function.feedback_mismatches,
    ),
];

pub(super) const DECIDER: [Count<DeciderSnapshot>; 5] = [
    row("decider_cycles", "Cycles of the turn signal decider", |decider| decider.cycles),
    row("decider_changes", "Decisions that differed from the one before", |decider| decider.changes),
    row(
        "decider_shortened_signals",
        "Signals that waited until a junction was passed which offers their side",
        |decider| decider.shortened_signals,
    ),
    row("decider_judged_signals", "Turn signals of another planner that were judged", |decider| {
        decider.signal_verdicts.judged()
    }),
    row(
        "decider_wrong_signals",
        "Turn signals of another planner that did not agree with the rules",
        |decider| decider.signal_verdicts.judged() - decider.signal_verdicts.agree,
    ),
];
