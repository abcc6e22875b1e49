//! `[velocity]` of a profile: sources of the speed, the direction and the heading rate.

use std::time::Duration;

use super::quantity::{HEADING_RATE, SPEED, WHEEL_SPEED, quantity};
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

#[derive(Clone, Copy)]
enum SpeedKind {
    Vehicle,
    Wheels,
}

const SPEED_KINDS: Keywords<SpeedKind> = &[("speed", SpeedKind::Vehicle), ("wheels", SpeedKind::Wheels)];

#[derive(Clone, Copy)]
enum DirectionKind {
    Signal,
    Gear,
}

const DIRECTION_KINDS: Keywords<DirectionKind> =
    &[("signal", DirectionKind::Signal), ("gear", DirectionKind::Gear)];

#[derive(Clone, Copy, PartialEq)]
enum RateKind {
    YawRate,
    Steering,
    Wheels,
}

const RATE_KINDS: Keywords<RateKind> =
    &[("yaw_rate", RateKind::YawRate), ("steering", RateKind::Steering), ("wheels", RateKind::Wheels)];

/// Reads the binding; `None` if a problem was recorded.
pub(super) fn velocity(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<VelocityBinding> {
    let before = binder.checker.count();
    let max_skew = fields.limit("max_skew_ms").unwrap_or(MAX_SKEW);
    let is_unknown_heading_rate_zero =
        fields.keyword("heading_rate_unknown", HEADING_RATE_UNKNOWN).unwrap_or_default();
    fields.require(&["source"], "describe where the speed comes from in a [[velocity.source]]")?;
    let speeds = sources(binder, &fields, speed_source);
    let directions: Vec<_> = fields.tables("direction").filter_map(|part| direction(binder, part)).collect();
    let mut heading_rates: Vec<_> =
        fields.tables("heading_rate").filter_map(|part| heading_rate(binder, part)).collect();
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
    let signals = match fields.keyword("kind", SPEED_KINDS)? {
        SpeedKind::Vehicle => {
            fields.set_form("with kind = \"speed\"");
            fields.require(&["speed"], "")?;
            SpeedSignals::Vehicle(speed_signal(binder, fields.table("speed")?, false)?)
        }
        SpeedKind::Wheels => {
            fields.set_form("with kind = \"wheels\"");
            let used = fields.keyword("use", USED).unwrap_or_default();
            let keys = ["front_left", "front_right", "rear_left", "rear_right"];
            let needed = match used {
                WheelsUsed::Rear => &keys[2..],
                WheelsUsed::All => &keys[..],
                WheelsUsed::FrontProjected => &keys[..2],
            };
            let is_complete = fields.require(needed, "name the signals of these wheels");
            let mut wheel = |key| fields.table(key).and_then(|fields| speed_signal(binder, fields, true));
            let wheels = Box::new(keys.map(&mut wheel));
            is_complete?;
            SpeedSignals::Wheels { wheels, used }
        }
    };
    Some(SpeedSource { name, signals, below_mps })
}

fn speed_signal(binder: &mut Binder<'_>, fields: Fields<'_>, is_wheel: bool) -> Option<SpeedSignal> {
    let kind = if is_wheel { &WHEEL_SPEED } else { &SPEED };
    let read = quantity(binder, fields, kind)?;
    Some(SpeedSignal {
        quantity: read.quantity,
        is_signed: read.has_sign,
        is_rotation: read.unit.is_rotation,
    })
}

fn direction(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<DirectionSource> {
    fields.require(&["from"], "write from = \"signal\" or from = \"gear\"")?;
    let source = match fields.keyword("from", DIRECTION_KINDS)? {
        DirectionKind::Gear => {
            fields.set_form("with from = \"gear\"");
            Some(DirectionSource::Gear)
        }
        DirectionKind::Signal => {
            fields.set_form("with from = \"signal\"");
            let required = [("forward", Motion::Forward), ("backward", Motion::Backward)];
            let optional = [("standstill", Motion::Standstill)];
            let remedy = "a direction needs signal, forward and backward";
            binder.states(&fields, [&required, &optional], UNUSABLE, remedy).map(DirectionSource::Signal)
        }
    };
    fields.done();
    source
}

fn heading_rate(binder: &mut Binder<'_>, fields: Fields<'_>) -> Option<HeadingRateSource> {
    fields.require(&["kind"], "write kind = \"yaw_rate\", \"steering\" or \"wheels\"")?;
    let source = match fields.keyword("kind", RATE_KINDS)? {
        RateKind::Steering => Some(HeadingRateSource::Steering),
        RateKind::Wheels => Some(HeadingRateSource::Wheels),
        RateKind::YawRate => {
            fields.set_form("with kind = \"yaw_rate\"");
            fields.require(&["yaw_rate"], "")?;
            let has_zero_at_standstill = fields.keyword("zero", ZEROS).unwrap_or(true);
            let rate = fields.table("yaw_rate").and_then(|part| quantity(binder, part, &HEADING_RATE));
            rate.map(|rate| HeadingRateSource::YawRate { rate: rate.quantity, has_zero_at_standstill })
        }
    };
    fields.done();
    source
}
