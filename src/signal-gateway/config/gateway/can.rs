//! `[can.*]`: the interface of each bus.

use crate::config::reading::{Fields, Refusal, key_rows, text, whole};
use gateway_base::near_miss::did_you_mean;

const DEFAULT_RECEIVE_BUFFER: u32 = 4 << 20;

key_rows! {
    INTERFACE: String = text("interface").example("\"can0\"").restart().doc("SocketCAN interface; also the interface name in recordings");
    RECEIVE_BUFFER_BYTES: usize = whole("receive_buffer_bytes", 4096, 1 << 30, "bytes").or(DEFAULT_RECEIVE_BUFFER as i64).restart()
        .doc("requested kernel receive queue, {range}; the default holds 9,000 frames");
}

/// The interface on which a bus is received.
#[derive(Debug)]
pub(super) struct CanConfig {
    /// Name of the SocketCAN interface, also in recordings.
    pub(super) interface: String,
    /// Kernel receive buffer, bytes.
    pub(super) receive_buffer: usize,
}

impl CanConfig {
    /// Returns the default interface of a bus by its number, without a configuration.
    pub(super) fn numbered(index: usize) -> Self {
        Self { interface: format!("can{index}"), receive_buffer: DEFAULT_RECEIVE_BUFFER as usize }
    }
}

/// Reads the section of each bus of the vehicle, in the order of its `buses`; `None` if they are not known.
pub(super) fn cans(top: &Fields<'_>, buses: Option<&[String]>) -> Vec<CanConfig> {
    let checker = top.checker;
    let is_known = buses.is_some();
    let buses: Vec<_> = buses.unwrap_or_default().iter().map(String::as_str).collect();
    let mut sections = Vec::new();
    let mut taken = Vec::new();
    for entry in top.entries("can", "write [can.<bus>]") {
        if is_known && !buses.contains(&entry.key.as_str()) {
            let reason = format!("the vehicle profile has no bus {}", entry.key);
            let all = format!("it has {}", buses.join(", "));
            checker.refuse(&entry.location, reason, &did_you_mean(&entry.key, buses.iter().copied(), all));
        }
        let Some(fields) = Fields::of(checker, &entry.value) else { continue };
        if let Some(can) = can(&fields) {
            if taken.contains(&can.interface) {
                let reason = format!("{} already serves another bus", can.interface);
                fields.refuse("interface", reason, "give each bus its own interface");
            }
            taken.push(can.interface.clone());
            sections.push((entry.key.as_str(), can));
        }
        fields.done();
    }
    let mut cans = Vec::new();
    for bus in buses {
        if let Some(at) = sections.iter().position(|(name, _)| *name == bus) {
            cans.push(sections.swap_remove(at).1);
        } else if !top.section("can").has(bus) {
            let reason = format!("bus {bus} of the vehicle profile has no interface");
            checker.refuse(top.location(), reason, &format!("add [can.{bus}] interface = \"can0\""));
        }
    }
    cans
}

fn can(fields: &Fields<'_>) -> Option<CanConfig> {
    let receive_buffer = fields.read(&RECEIVE_BUFFER_BYTES);
    // Read before it is required, so that a refusal names a misspelt key.
    let interface = fields.given(&INTERFACE);
    fields.require(&[INTERFACE.name], "")?;
    let interface = interface?;
    if let Err(Refusal { reason, remedy }) = interface_name(&interface) {
        fields.refuse("interface", reason, &remedy);
    }
    Some(CanConfig { interface, receive_buffer })
}

/// Checks the name of an interface by the rule of the kernel's `dev_valid_name`.
///
/// # Errors
/// Fails for an invalid name.
pub fn interface_name(name: &str) -> Result<(), Refusal> {
    let is_valid = (1..=15).contains(&name.len())
        && name != "."
        && name != ".."
        && name.chars().all(|char| char.is_ascii_graphic() && char != '/' && char != ':');
    let remedy = "give 1 to 15 characters without spaces and slashes, e.g. can0";
    let refused = || Refusal::new(format!("{name:?} is not an interface name"), remedy);
    if is_valid { Ok(()) } else { Err(refused()) }
}
