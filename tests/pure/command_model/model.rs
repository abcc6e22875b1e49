//! What must be asked of the vehicle, worked out anew each time from everything that has happened.

use signal_gateway::core::command::Turn;

/// Something that came in.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Event {
    /// A turn command, its stamp so many ms off.
    Turn(u8, i64),
    /// A hazard command, likewise.
    Hazard(u8, i64),
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

/// What is to be asked for: turn indicators and hazard lights.
pub(crate) type Asked = (Option<Turn>, Option<bool>);

/// Where one sender stands.
enum Stand {
    /// It wants this raw value.
    Wants(u8),
    /// It wants nothing.
    Nothing,
    /// It is silent, and wanted this last.
    Silent(u8),
}

/// What is to be asked for at `at`, after `history`.
pub(crate) fn asked(rules: Rules, history: &[(u64, Event)], at: u64) -> Asked {
    let turn = stand(history, at, rules.turn_ns, 3, |event| {
        if let Event::Turn(raw, offset) = event { Some((raw, offset)) } else { None }
    });
    let hazard = stand(history, at, rules.hazard_ns, 2, |event| {
        if let Event::Hazard(raw, offset) = event { Some((raw, offset)) } else { None }
    });
    let mode = history
        .iter()
        .rev()
        .find_map(|(time, event)| if let Event::Mode(raw) = event { Some((*time, *raw)) } else { None });
    let mode = mode.filter(|(time, _)| at - time <= rules.mode_ns).map(|(_, raw)| raw);
    let (steering, others) = (matches!(mode, Some(1 | 2)), matches!(mode, Some(1..=3)));

    let mut want_turn = match turn {
        Stand::Wants(raw) => Some(side(raw)),
        Stand::Silent(raw) if rules.on_turn_timeout == Silence::Hold => Some(side(raw)),
        Stand::Silent(_) => Some(Turn::Off),
        Stand::Nothing => None,
    };
    let mut want_hazard = match (&hazard, rules.on_hazard_timeout) {
        (Stand::Wants(raw), _) | (Stand::Silent(raw), Silence::Hold) => Some(*raw == 2),
        (Stand::Silent(_), Silence::Off) => Some(false),
        (Stand::Silent(_), Silence::Hazard) => Some(true),
        (Stand::Nothing, _) => None,
    };
    if matches!(turn, Stand::Silent(_)) && rules.on_turn_timeout == Silence::Hazard {
        want_hazard = Some(true);
    }
    if want_hazard == Some(true) && others {
        want_turn = want_turn.map(|_| Turn::Off);
    }
    (want_turn.filter(|_| steering), want_hazard.filter(|_| others))
}

fn side(raw: u8) -> Turn {
    match raw {
        2 => Turn::Left,
        3 => Turn::Right,
        _ => Turn::Off,
    }
}

/// Goes through all messages of one sender; `highest` = its highest defined value.
fn stand(
    history: &[(u64, Event)],
    at: u64,
    limit: u64,
    highest: u8,
    message: impl Fn(Event) -> Option<(u8, i64)>,
) -> Stand {
    let mut taken: Vec<(u64, u8, i64)> = Vec::new();
    // The first message of those that seemed to be of the past.
    let mut suspected_at: Option<u64> = None;
    for (time, event) in history {
        let Some((raw, offset_ms)) = message(*event) else { continue };
        let stamp = i64::try_from(*time).unwrap() + offset_ms * 1_000_000;
        let speaks = taken.last().filter(|(before, ..)| time - before <= limit);
        if raw > highest || speaks.is_some_and(|(_, _, newest)| stamp < *newest) {
            continue;
        }
        let is_past = stamp < 0 || stamp + i64::try_from(limit).unwrap() < i64::try_from(*time).unwrap();
        if speaks.is_none() && is_past {
            let begun = suspected_at;
            suspected_at = begun.or(Some(*time));
            if begun.is_none_or(|since| time - since < 50_000_000) {
                continue;
            }
        }
        suspected_at = None;
        taken.push((*time, raw, stamp));
    }
    let wish = taken.iter().rev().find(|(_, raw, _)| *raw > 0);
    match (wish, taken.last()) {
        (Some((time, raw, _)), _) if at - time <= limit => Stand::Wants(*raw),
        (_, Some((heard, raw, _))) if *raw > 0 && at - heard > limit => Stand::Silent(*raw),
        _ => Stand::Nothing,
    }
}
