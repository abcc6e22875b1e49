//! From `[command]` of a vehicle profile to what may be sent.

use std::ops::Range;
use std::time::Duration;

use toml::Spanned;

use super::command_message::command_message;
use super::command_profile_file::{
    CommandMessageFile, CommandProfileFile, ControlModeFile, DriverFile, TakesFile,
};
use super::roles::{Binder, Meanings};
use super::vehicle_file::{SwitchFile, VehicleFile};
use crate::core::command::allow_list::AllowList;
use crate::core::command::control_mode::{ControlMode, Grants};
use crate::core::command::message::CommandMessage;
use crate::core::command::settings::{CommandBinding, DriverSign};
use crate::core::trust::meaning::Meaning;
use crate::core::trust::table::{Role, SignalTable};
use crate::core::vehicle_lights::binding::HazardBinding;

/// What the section comes to, still without received messages and signals; `None` when a problem was
/// noted.
pub(super) fn command(
    binder: &mut Binder<'_>,
    file: Option<&Spanned<CommandProfileFile>>,
    hazard: Option<&HazardBinding>,
) -> Option<CommandBinding> {
    let Some(file) = file else { return Some(CommandBinding::default()) };
    let (span, file) = (file.span(), file.get_ref());
    let before = binder.problems.len();
    let mut allowed = AllowList::default();
    let compile = |file: &Spanned<CommandMessageFile>| command_message(binder, &mut allowed, file.get_ref());
    let messages: Vec<_> = file.message.iter().filter_map(compile).collect();
    if messages.len() == file.message.len() {
        ask_for_each_once(binder, file, &span, &messages);
        buttons_need_a_report(binder, file, hazard);
    }
    let control_mode = file.control_mode.as_ref().and_then(|file| control_mode(binder, file.get_ref()));
    let driver: Vec<_> = file.driver.iter().filter_map(|file| driver(binder, file)).collect();
    for message in &file.message {
        refuse_received(binder, &allowed, message.get_ref());
    }
    let table = SignalTable::default();
    (binder.problems.len() == before).then_some(CommandBinding {
        allowed,
        messages,
        table,
        control_mode,
        driver,
    })
}

/// Turn indicators and hazard lights are each asked for in one way.
fn ask_for_each_once(
    binder: &mut Binder<'_>,
    file: &CommandProfileFile,
    span: &Range<usize>,
    messages: &[CommandMessage],
) {
    let turns = messages.iter().map(|message| message.turn.is_some());
    let hazards = messages.iter().map(|message| {
        message.hazard.is_some() || message.turn.as_ref().is_some_and(|part| part.hazard.is_some())
    });
    let functions: [(&str, Vec<bool>, &str); 2] = [
        ("turn indicators", turns.collect(), "give one message `turn`"),
        (
            "hazard lights",
            hazards.collect(),
            "give one message `hazard`, or its `turn` a state `hazard`: Autoware's emergency needs them",
        ),
    ];
    for (what, asks, remedy) in functions {
        let mut asking = file.message.iter().zip(asks).filter(|(_, asks)| *asks).map(|(file, _)| file);
        match (asking.next(), asking.next()) {
            (None, _) => binder.refuse(span.clone(), format!("no message asks for {what}"), remedy),
            (Some(_), Some(second)) => {
                let at = second.get_ref().name.span();
                binder.refuse(at, format!("a second message asks for {what}"), "keep one of them");
            }
            (Some(_), None) => {}
        }
    }
}

/// A button is pressed until the report shows it.
fn buttons_need_a_report(binder: &mut Binder<'_>, file: &CommandProfileFile, hazard: Option<&HazardBinding>) {
    let is_reported = match hazard {
        Some(HazardBinding::From(_)) | None => true,
        Some(HazardBinding::NotFitted | HazardBinding::Unbound | HazardBinding::LeftOut) => false,
    };
    let parts = file.message.iter().filter_map(|message| message.get_ref().hazard.as_ref());
    for button in parts.filter_map(|part| part.get_ref().button.as_ref()).filter(|_| !is_reported) {
        let reason = "a button is pressed until the report shows the lights, and [hazard] binds no signal";
        binder.refuse(button.span(), reason, "bind one, or remove `button` when the switch stays");
    }
}

/// What the gateway sends cannot be what it receives.
fn refuse_received(binder: &mut Binder<'_>, allowed: &AllowList, file: &CommandMessageFile) {
    let (bus, name) = split(file.name.get_ref());
    let received = binder.messages.iter().any(|(at, message)| {
        let known = &binder.buses[*at];
        allowed.contains(known.index, message.id)
            && message.name == name
            && bus.is_none_or(|bus| bus == known.name)
    });
    if received {
        let reason = format!("{name} is received as well: the gateway's own frames would count as the car's");
        binder.refuse(file.name.span(), reason, "bind signals of messages that the vehicle sends");
    }
}

/// The gateway's own frames prove nothing of the vehicle.
pub(super) fn refuse_alive_by(binder: &mut Binder<'_>, file: &VehicleFile, allowed: &AllowList) {
    for (name, bus) in &file.bus {
        let own = |message: &Spanned<String>| {
            let known = binder.buses.iter().find(|known| known.name == *name.get_ref())?;
            let message = known.database.message(message.get_ref())?;
            allowed.contains(known.index, message.id).then_some(())
        };
        let own: Vec<_> = bus.alive_by.iter().filter(|message| own(message).is_some()).collect();
        for message in own {
            let reason = format!("{} is sent by the gateway itself", message.get_ref());
            binder.refuse(message.span(), reason, "name messages that the vehicle sends");
        }
    }
}

/// Bus and message of `BUS:MESSAGE` or `MESSAGE`.
pub(super) fn split(name: &str) -> (Option<&str>, &str) {
    name.split_once(':').map_or((None, name), |(bus, name)| (Some(bus), name))
}

fn control_mode(binder: &mut Binder<'_>, file: &ControlModeFile) -> Option<Role<ControlMode>> {
    binder.require_values(&[&file.autonomous, &file.manual]);
    let mode = |mode| Meaning::Defined(mode);
    let mut meanings: Meanings<'_, ControlMode> =
        vec![(&file.autonomous, mode(ControlMode::Autonomous)), (&file.manual, mode(ControlMode::Manual))];
    let optional = [
        (&file.steer_only, mode(ControlMode::AutonomousSteerOnly)),
        (&file.velocity_only, mode(ControlMode::AutonomousVelocityOnly)),
        (&file.disengaged, mode(ControlMode::Disengaged)),
        (&file.not_ready, mode(ControlMode::NotReady)),
        (&file.not_available, Meaning::NotAvailable),
    ];
    meanings.extend(optional.into_iter().filter_map(|(values, meaning)| Some((values.as_ref()?, meaning))));
    binder.role(&file.signal, &meanings)
}

fn driver(binder: &mut Binder<'_>, file: &DriverFile) -> Option<DriverSign> {
    let switch = SwitchFile {
        signal: file.signal.clone(),
        on: file.on.clone(),
        off: file.off.clone(),
        not_available: file.not_available.clone(),
        fault: None,
    };
    let takes = match file.takes {
        TakesFile::Both => Grants { turn: true, hazard: true },
        TakesFile::Turn => Grants { turn: true, hazard: false },
        TakesFile::Hazard => Grants { turn: false, hazard: true },
    };
    Some(DriverSign { role: binder.switch(&switch)?, takes })
}

/// Milliseconds within a range; what is outside is noted.
pub(super) fn within(
    binder: &mut Binder<'_>,
    given: Option<&Spanned<u64>>,
    default: u64,
    (least, most): (u64, u64),
) -> Duration {
    if let Some(given) = given.filter(|given| !(least..=most).contains(given.get_ref())) {
        let reason = format!("{} ms is not possible here", given.get_ref());
        binder.refuse(given.span(), reason, &format!("give {least} to {most} ms"));
    }
    Duration::from_millis(given.map_or(default.clamp(least, most), |given| *given.get_ref()))
}
