//! What the kernel says of a CAN controller: bit rate, state, restart (`IFLA_CAN_*` by netlink).

use socketcan::CanInterface;
use socketcan::nl::InterfaceCanParams;

/// Bit rate, controller state and automatic restart in one line, for the log at start. A virtual
/// interface has none of these; what the kernel refuses to tell is left out.
pub(super) fn describe(interface: &str) -> String {
    let params = CanInterface::open(interface).and_then(|interface| interface.details());
    params.map_or_else(|error| format!("not told: {error}"), |details| text(&details.can))
}

fn text(params: &InterfaceCanParams) -> String {
    let mut parts = Vec::new();
    if let Some(timing) = params.bit_timing {
        parts.push(format!("{} bit/s", timing.bitrate));
    }
    if let Some(timing) = params.data_bit_timing {
        parts.push(format!("data {} bit/s", timing.bitrate));
    }
    if let Some(state) = params.state {
        parts.push(format!("{state:?}"));
    }
    match params.restart_ms {
        Some(0) => parts.push("no automatic restart after bus-off".to_owned()),
        Some(ms) => parts.push(format!("restart {ms} ms after bus-off")),
        None => {}
    }
    if parts.is_empty() { "no controller".to_owned() } else { parts.join(", ") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use socketcan::nl::CanState;

    #[test]
    fn a_controller_is_told_in_one_line() {
        let params = InterfaceCanParams {
            state: Some(CanState::ErrorPassive),
            restart_ms: Some(0),
            ..InterfaceCanParams::default()
        };
        assert_eq!(text(&params), "ErrorPassive, no automatic restart after bus-off");
        assert_eq!(text(&InterfaceCanParams::default()), "no controller");
    }

    #[test]
    fn an_interface_that_is_not_there_is_no_failure() {
        assert!(describe("nosuchcan7").starts_with("not told: "));
    }
}
