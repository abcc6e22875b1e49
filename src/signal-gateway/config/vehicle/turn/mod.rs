//! `[turn]` of a profile: the source of the turn-indicator state.

mod lamp;
mod stalk;

use super::binder::{Binder, UNUSABLE};
use super::light_sources::{longest_hold, sources};
use crate::config::reading::{Fields, Keywords};
use gateway_core::vehicle_lights::binding::{BothOn, SidePair, TurnBinding, TurnSource, TurnWhileHazard};
use gateway_core::vehicle_lights::stalk::StalkPosition;
use gateway_core::vehicle_lights::state::TurnCode;
use lamp::lamps;
use stalk::stalk_settings;

/// The forms of a binding of the turn state, for refusals.
const FORMS: &str = "give `signal` with off, left and right, or `left_signal`, `right_signal` and `both_on`, \
                     or `kind`, or [[turn.source]], or `fitted = false`";

/// Sources whose signals do not show the state directly: lamps, which flash while a side is on, or a stalk
/// that springs back.
const KINDS: Keywords<fn(&mut Binder<'_>, &Fields<'_>) -> Option<TurnSource>> =
    &[("lamp", lamp), ("stalk", stalk)];
const BOTH_ON: Keywords<BothOn> = &[("hazard", BothOn::Hazard), ("undefined", BothOn::Undefined)];
const WHILE_HAZARD: Keywords<TurnWhileHazard> =
    &[("disable", TurnWhileHazard::Disable), ("keep", TurnWhileHazard::Keep)];

pub(super) fn turn(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<TurnBinding> {
    if fields.flag("fitted") == Some(false) {
        fields.set_form("with fitted = false");
        return Some(TurnBinding::NotFitted);
    }
    sources(binder, fields, source, longest_hold).map(TurnBinding::From)
}

/// Reads one source: an enumerated signal, a left and a right signal, lamps, or a stalk.
fn source(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<TurnSource> {
    let pair_key = ["left_signal", "right_signal", "both_on"].into_iter().find(|key| fields.has(key));
    let is_enumerated = ["signal", "off", "left", "right", "both"].iter().any(|key| fields.has(key));
    match (fields.keyword("kind", KINDS), pair_key) {
        (Some(read), _) => read(binder, fields),
        (None, Some(pair_key)) if is_enumerated => {
            let reason = "an enumerated signal cannot be combined with a pair of signals";
            fields.refuse(pair_key, reason, FORMS);
            fields.accept_rest();
            None
        }
        (None, _) if fields.has("kind") => {
            fields.accept_rest();
            None
        }
        (None, Some(_)) => {
            fields.set_form("without `kind`");
            let tap_hold = fields.limit("tap_hold_ms");
            pair(binder, fields).map(|pair| TurnSource::Pair { pair, tap_hold })
        }
        (None, None) if is_enumerated => {
            fields.set_form("without `kind`");
            enumerated(binder, fields)
        }
        (None, None) => {
            binder.checker.refused(fields.location(), "no signal is bound for the turn state", FORMS)
        }
    }
}

fn enumerated(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<TurnSource> {
    let required = [("off", TurnCode::Off), ("left", TurnCode::Left), ("right", TurnCode::Right)];
    let remedy = "an enumerated turn signal needs signal, off, left and right";
    let role = binder.states(fields, [&required, &[("both", TurnCode::Both)]], UNUSABLE, remedy);
    let tap_hold = fields.limit("tap_hold_ms");
    role.map(|role| TurnSource::Enumerated { role, tap_hold })
}

fn pair(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<SidePair> {
    let remedy = "a pair of turn signals needs left_signal, right_signal and both_on";
    fields.require(&["left_signal", "right_signal", "both_on"], remedy);
    // Any other value is refused by now, and hides no other problems.
    let both = fields.keyword("both_on", BOTH_ON).or(fields.has("both_on").then_some(BothOn::Undefined));
    let [left, right] = ["left_signal", "right_signal"]
        .map(|key| fields.read_table(key, |side| binder.switch(side, ["on", "off"], UNUSABLE, "")));
    let pair = SidePair { left: left?, right: right?, both: both? };
    if pair.left.signal == pair.right.signal {
        let remedy = "bind one signal for each side";
        return fields.refused("right_signal", "left and right are the same signal", remedy);
    }
    Some(pair)
}

fn lamp(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<TurnSource> {
    fields.set_form("with kind = \"lamp\"");
    let pair = pair(binder, fields);
    fields.section("lamp").read_all(|times| lamps(binder, pair, fields, times))
}

fn stalk(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<TurnSource> {
    fields.set_form("with kind = \"stalk\"");
    let required = [
        ("idle", StalkPosition::Idle),
        ("left_full", StalkPosition::LeftFull),
        ("right_full", StalkPosition::RightFull),
    ];
    let optional = [("left_half", StalkPosition::LeftHalf), ("right_half", StalkPosition::RightHalf)];
    let remedy =
        "a stalk needs signal, idle, left_full and right_full; left_half and right_half if it has them";
    let role = binder.states(fields, [&required, &optional], UNUSABLE, remedy);
    let settings = fields.section("stalk").read_all(stalk_settings);
    Some(TurnSource::Stalk { role: role?, settings })
}

/// Reads the report on turn indicators while the hazard lights are on; `both_sides` means that hazard lights
/// are both turn sides on.
pub(super) fn while_hazard(fields: &Fields<'_>, both_sides: bool) -> TurnWhileHazard {
    let policy = fields.keyword("while_hazard", WHILE_HAZARD).unwrap_or_default();
    if policy == TurnWhileHazard::Keep && both_sides && !fields.has("source") {
        let reason = "hazard comes from both sides, so there is no turn state to keep";
        fields.refuse("while_hazard", reason, "use while_hazard = \"disable\"");
    }
    policy
}
