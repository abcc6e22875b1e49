//! The request to the vehicle, computed each time from the whole history.

use gateway_core::command::Turn;

/// A command of one of the writers of its topic.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Command {
    pub(crate) writer: u8,
    pub(crate) raw: u8,
    /// How far the clock of the writer is ahead of that of the gateway.
    pub(crate) ahead_ms: i64,
    /// An earlier message than all others of the writer.
    pub(crate) is_overtaken: bool,
}

/// Something that came in.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Event {
    /// A turn command.
    Turn(Command),
    /// A hazard command.
    Hazard(Command),
    /// The clock of the gateway's host steps by so much.
    ClockStep(i64),
    /// A control mode.
    Mode(u8),
    /// The link goes up or down.
    Link(bool),
    /// The lights are reported like that.
    Report(Option<Turn>, Option<bool>),
    /// The next frame cannot be sent.
    Full,
}

/// What to do about a sender that fell silent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Silence {
    Off,
    Hold,
    Hazard,
}

/// The same rules as in the configuration of the flow.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rules {
    pub(crate) turn_ns: u64,
    pub(crate) hazard_ns: u64,
    pub(crate) mode_ns: u64,
    pub(crate) on_turn_timeout: Silence,
    pub(crate) on_hazard_timeout: Silence,
}

/// The request: turn indicators and hazard lights.
pub(crate) type Requested = (Option<Turn>, Option<bool>);

/// Where one sender stands.
enum Stand {
    /// It requests this raw value.
    Requests(u8),
    /// It requests nothing.
    Nothing,
    /// It is silent, and this was its last request.
    Silent(u8),
}

/// The request at `at`, after `history`.
pub(crate) fn requested(rules: Rules, history: &[(u64, Event)], at: u64) -> Requested {
    let turn = stand(history, at, rules.turn_ns, 3, None, |event| {
        if let Event::Turn(command) = event { Some(command) } else { None }
    });
    let hazard = stand(history, at, rules.hazard_ns, 2, Some(2), |event| {
        if let Event::Hazard(command) = event { Some(command) } else { None }
    });
    let mode = history
        .iter()
        .rev()
        .find_map(|(time, event)| if let Event::Mode(raw) = event { Some((*time, *raw)) } else { None });
    let mode = mode.filter(|(time, _)| at - time <= rules.mode_ns).map(|(_, raw)| raw);
    let (steering, others) = (matches!(mode, Some(1 | 2)), matches!(mode, Some(1..=3)));

    let mut requested_turn = match turn {
        Stand::Requests(raw) => Some(side(raw)),
        Stand::Silent(raw) if rules.on_turn_timeout == Silence::Hold => Some(side(raw)),
        Stand::Silent(_) => Some(Turn::Off),
        Stand::Nothing => None,
    };
    let mut requested_hazard = match (&hazard, rules.on_hazard_timeout) {
        (Stand::Requests(raw), _) | (Stand::Silent(raw), Silence::Hold) => Some(*raw == 2),
        (Stand::Silent(_), Silence::Off) => Some(false),
        (Stand::Silent(_), Silence::Hazard) => Some(true),
        (Stand::Nothing, _) => None,
    };
    if matches!(turn, Stand::Silent(_)) && rules.on_turn_timeout == Silence::Hazard {
        requested_hazard = Some(true);
    }
    if requested_hazard == Some(true) && others {
        requested_turn = requested_turn.map(|_| Turn::Off);
    }
    (requested_turn.filter(|_| steering), requested_hazard.filter(|_| others))
}

fn side(raw: u8) -> Turn {
    match raw {
        2 => Turn::Left,
        3 => Turn::Right,
        _ => Turn::Off,
    }
}

/// Goes through all messages of one topic; `highest` = its highest defined value, `urgent` = the one that
/// counts whatever its stamp.
fn stand(
    history: &[(u64, Event)],
    at: u64,
    limit: u64,
    highest: u8,
    urgent: Option<u8>,
    command: impl Fn(Event) -> Option<Command>,
) -> Stand {
    const MS: i64 = 1_000_000;
    /// For so long a message counts more than an earlier one of its writer.
    const ORDER_NS: u64 = 1_000_000_000;
    let mut taken: Vec<(u64, u8)> = Vec::new();
    // By writer: its last message that was taken, and the first of those that seemed to be stale.
    let mut last_of = [None::<u64>; 256];
    let mut suspected_of = [None::<u64>; 256];
    let mut clock_ms = 0;
    for (time, event) in history {
        if let Event::ClockStep(by_ms) = event {
            clock_ms += by_ms;
        }
        let Some(Command { writer, raw, ahead_ms, is_overtaken }) = command(*event) else { continue };
        let (last, suspected) = (&mut last_of[usize::from(writer)], &mut suspected_of[usize::from(writer)]);
        let is_within = |limit| last.is_some_and(|before| time - before <= limit);
        if raw > highest || (is_overtaken && is_within(limit.min(ORDER_NS))) {
            continue;
        }
        let wall = i64::try_from(*time).unwrap() + clock_ms * MS;
        let stamp = wall + ahead_ms * MS;
        let is_past = stamp < 0 || stamp + i64::try_from(limit).unwrap() < wall;
        if !is_within(limit) && is_past && urgent != Some(raw) {
            let begun = *suspected;
            *suspected = begun.or(Some(*time));
            if begun.is_none_or(|since| time - since < 50_000_000) {
                continue;
            }
        }
        *suspected = None;
        *last = Some(*time);
        taken.push((*time, raw));
    }
    let requested = taken.iter().rev().find(|(_, raw)| *raw > 0);
    match (requested, taken.last()) {
        (Some((time, raw)), _) if at - time <= limit => Stand::Requests(*raw),
        (_, Some((received, raw))) if *raw > 0 && at - received > limit => Stand::Silent(*raw),
        _ => Stand::Nothing,
    }
}
