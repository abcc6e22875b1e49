//! `[control_mode]` of a profile: a signal that names the mode, or a bit for each axis.

use crate::config::reading::{Fields, Keywords};
use crate::config::vehicle::binder::{Binder, NOT_AVAILABLE, UNUSABLE};
use can_signal::validation::table::Role;
use gateway_core::control_mode::ControlMode;
use gateway_core::vehicle_status::control_mode::{Axes, ControlModeBinding, ControlModeSource};

/// Publication while the mode is unknown; true for `NOT_READY`.
const ON_UNKNOWN: Keywords<bool> = &[("withhold", false), ("not_ready", true)];

pub(super) fn control_mode(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<ControlModeBinding> {
    let is_not_ready_while_unknown = fields.keyword("on_unknown", ON_UNKNOWN).unwrap_or_default();
    let source = if fields.has("signal") {
        fields.set_form("with `signal`");
        named(binder, fields).map(ControlModeSource::Named)
    } else {
        fields.set_form("with a bit for each axis");
        axes(binder, fields).map(|axes| ControlModeSource::Axes(Box::new(axes)))
    };
    Some(ControlModeBinding { source: source?, is_not_ready_while_unknown })
}

fn named(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<Role<ControlMode>> {
    let required = [("autonomous", ControlMode::Autonomous), ("manual", ControlMode::Manual)];
    let optional = [
        ("steer_only", ControlMode::AutonomousSteerOnly),
        ("velocity_only", ControlMode::AutonomousVelocityOnly),
        ("disengaged", ControlMode::Disengaged),
        ("not_ready", ControlMode::NotReady),
    ];
    binder.states(fields, [&required, &optional], UNUSABLE, "")
}

fn axes(binder: &mut Binder<'_>, fields: &Fields<'_>) -> Option<Axes> {
    let before = binder.checker.count();
    let mut switch = |fields: &Fields<'_>| binder.switch(fields, ["on", "off"], NOT_AVAILABLE, "");
    let [steering, accelerator, brake, speed, ready] =
        ["steering", "accelerator", "brake", "speed", "ready"].map(|key| fields.read_table(key, &mut switch));
    let longitudinal = [accelerator, brake, speed];
    let [overrides, faults] = ["override", "fault"].map(|key| fields.read_tables(key, &mut switch));
    let longitudinal: Vec<_> = longitudinal.into_iter().flatten().collect();
    if binder.checker.count() > before {
        return None;
    }
    if steering.is_none() && longitudinal.is_empty() {
        let remedy = "give `signal`, or a bit for `steering`, `accelerator`, `brake` or `speed`";
        return fields.refused("steering", "no axis is given", remedy);
    }
    Some(Axes { steering, longitudinal, ready: ready.into_iter().collect(), overrides, faults })
}
