//! `[velocity]` of a profile: sources of the speed, the direction and the heading rate.

use std::time::Duration;

use super::quantity::{HEADING_RATE, QuantityKind, ReadQuantity, SPEED, WHEEL_SPEED, quantity};
use super::sources::sources;
use crate::config::reading::{Fields, Keywords};
use crate::config::vehicle::binder::{Binder, UNUSABLE};
use gateway_core::vehicle_status::velocity::binding::Motion;
use gateway_core::vehicle_status::velocity::binding::{
    DirectionSource, HeadingRateSource, SpeedSignal, SpeedSignals, SpeedSource, VelocityBinding, WheelsUsed,
};

/// Default maximum time by which a part may be older than the speed.
const MAX_SKEW: Duration = Duration::from_millis(100);

/// Publication while the heading rate is unknown; true for 0.
const HEADING_RATE_UNKNOWN: Keywords<bool> = &[("withhold", false), ("zero", true)];

/// Zero offsets of a yaw rate sensor; true for an offset determined at standstill.
const ZEROS: Keywords<bool> = &[("standstill", true), ("none", false)];

const USED: Keywords<WheelsUsed> =
    &[("rear", WheelsUsed::Rear), ("all", WheelsUsed::All), ("front_projected", WheelsUsed::FrontProjected)];

/// Reads a table of one kind.
type Reader<T> = fn(&mut Binder<'_>, &Fields<'_>) -> Option<T>;

const SPEED_KINDS: Keywords<Reader<SpeedSignals>> = &[("speed", vehicle_speed), ("wheels", wheel_speeds)];
const DIRECTION_KINDS: Keywords<Reader<DirectionSource>> = &[
    ("signal", direction_signal),
    ("gear", |_, fields| {
        fields.set_form("with from = \"gear\"");
        Some(DirectionSource::Gear)
    }),
];
const RATE_KINDS: Keywords<Reader<HeadingRateSource>> = &[
    ("yaw_rate", yaw_rate),
    ("steering", |_, _| Some(HeadingRateSource::Steering)),
    ("wheels", |_, _| Some(HeadingRateSource::Wheels)),
];

pub(super) fn velocity(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<VelocityBinding> {
    let before = binder.checker.count();
    let max_skew = fields.limit("max_skew_ms").unwrap_or(MAX_SKEW);
    let is_unknown_heading_rate_zero =
        fields.keyword("heading_rate_unknown", HEADING_RATE_UNKNOWN).unwrap_or_default();
    fields.require(&["source"], "describe where the speed comes from in a [[velocity.source]]")?;
    let speeds = sources(binder, &fields, speed_source);
    let directions = fields.read_tables("direction", |part| direction(binder, part));
    let mut heading_rates = fields.read_tables("heading_rate", |part| heading_rate(binder, part));
    if heading_rates.is_empty() && !fields.has("heading_rate") {
        heading_rates = vec![HeadingRateSource::Steering, HeadingRateSource::Wheels];
    }
    let binding =
        VelocityBinding { speeds, directions, heading_rates, is_unknown_heading_rate_zero, max_skew };
    if binder.checker.count() > before {
        fields.accept_rest();
        return None;
    }
    let is_unsigned = binding.speed_signals().any(|signal| !signal.is_signed);
    if is_unsigned && binding.directions.is_empty() {
        let remedy = "name the sources of the direction in [[velocity.direction]], e.g. from = \"gear\"";
        fields.refuse("direction", "a speed without a sign needs a direction", remedy);
    }
    fields.done();
    (binder.checker.count() == before).then_some(binding)
}

fn speed_source(binder: &mut Binder<'_>, fields: &Fields<'_>, name: String) -> Option<SpeedSource> {
    fields.require(&["kind"], "write kind = \"speed\" or kind = \"wheels\"")?;
    let below_mps = fields.number("below_mps", 0.0..=100.0, "m/s");
    let signals = fields.keyword("kind", SPEED_KINDS)?(binder, fields)?;
    Some(SpeedSource { name, signals, below_mps })
}

fn vehicle_speed(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<SpeedSignals> {
    fields.set_form("with kind = \"speed\"");
    fields.require(&["speed"], "")?;
    fields.read_table("speed", |part| speed_signal(binder, part, &SPEED)).map(SpeedSignals::Vehicle)
}

fn wheel_speeds(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<SpeedSignals> {
    fields.set_form("with kind = \"wheels\"");
    let used = fields.keyword("use", USED).unwrap_or_default();
    let keys = ["front_left", "front_right", "rear_left", "rear_right"];
    let needed = match used {
        WheelsUsed::Rear => &keys[2..],
        WheelsUsed::All => &keys[..],
        WheelsUsed::FrontProjected => &keys[..2],
    };
    let is_complete = fields.require(needed, "name the signals of these wheels");
    let mut wheel = |part: &Fields<'_>| speed_signal(binder, part, &WHEEL_SPEED);
    let wheels = Box::new(keys.map(|key| fields.read_table(key, &mut wheel)));
    is_complete?;
    Some(SpeedSignals::Wheels { wheels, used })
}

fn speed_signal(binder: &mut Binder<'_>, fields: &Fields<'_>, kind: &QuantityKind) -> Option<SpeedSignal> {
    let ReadQuantity { quantity, unit, has_sign } = quantity(binder, fields, kind)?;
    Some(SpeedSignal { quantity, is_signed: has_sign, is_rotation: unit.is_rotation })
}

fn direction(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<DirectionSource> {
    fields.require(&["from"], "write from = \"signal\" or from = \"gear\"");
    fields.form("from", DIRECTION_KINDS)?(binder, fields)
}

fn direction_signal(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<DirectionSource> {
    fields.set_form("with from = \"signal\"");
    let required = [("forward", Motion::Forward), ("backward", Motion::Backward)];
    let optional = [("standstill", Motion::Standstill)];
    let remedy = "a direction needs signal, forward and backward";
    binder.states(fields, [&required, &optional], UNUSABLE, remedy).map(DirectionSource::Signal)
}

fn heading_rate(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<HeadingRateSource> {
    fields.require(&["kind"], "write kind = \"yaw_rate\", \"steering\" or \"wheels\"");
    fields.form("kind", RATE_KINDS)?(binder, fields)
}

fn yaw_rate(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<HeadingRateSource> {
    fields.set_form("with kind = \"yaw_rate\"");
    if fields.require(&["yaw_rate"], "").is_none() {
        fields.accept_rest();
        return None;
    }
    let has_zero_at_standstill = fields.keyword("zero", ZEROS).unwrap_or(true);
    let rate = fields.read_table("yaw_rate", |part| quantity(binder, part, &HEADING_RATE))?.quantity;
    Some(HeadingRateSource::YawRate { rate, has_zero_at_standstill })
}
