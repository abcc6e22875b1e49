//! State of a CAN interface and its controller as reported by the kernel, limited to settings that can be
//! wrong.

use serde::{Deserialize, Serialize};

use super::{ControllerState, ErrorCounters};

/// One interface, whether it exists or not.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct InterfaceState {
    /// Name of the interface.
    pub name: String,
    /// Kind of the interface.
    pub kind: InterfaceKind,
    /// True while the interface is up; frames can arrive then.
    #[serde(default)]
    pub is_up: bool,
    /// Frames that the kernel queues for sending, `txqueuelen`; `None` if it cannot be read.
    #[serde(default)]
    pub transmit_queue: Option<u32>,
    /// The controller; `None` for a virtual interface, which has none.
    #[serde(default)]
    pub controller: Option<ControllerSettings>,
}

/// Result of looking up an interface by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs)] // their names say it
pub enum InterfaceKind {
    Missing,
    NotCan,
    Can,
    /// The kernel did not answer; the value is its `errno`.
    Unknown(i32),
}

/// State and settings of a controller (`IFLA_CAN_*` of netlink).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct ControllerSettings {
    /// Error state.
    pub state: Option<ControllerState>,
    /// Error counters; `None` when the driver cannot read them.
    pub counters: Option<ErrorCounters>,
    /// Time from bus-off to an automatic restart in ms; 0 = manual restart.
    pub restart_ms: Option<u32>,
    /// Bit timing of the arbitration phase; `None` until one has been set.
    pub bit_timing: Option<BitTiming>,
    /// Bit timing of the data phase of CAN FD frames; `None` without CAN FD.
    pub data_bit_timing: Option<BitTiming>,
    /// Modes that are turned on.
    pub modes: ControllerModes,
    /// Modes that the driver supports; `None` before Linux 6.0, which does not report them.
    pub supported: Option<ControllerModes>,
}

/// A bit rate and its sample point.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct BitTiming {
    /// Bit rate, bit/s.
    pub bitrate_bps: u32,
    /// Sample point in thousandths of a bit; 0 when the driver does not report it.
    #[serde(default)]
    pub sample_point_permille: u32,
}

/// Controller modes that affect sending and reporting (`CAN_CTRLMODE_*`).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
#[allow(clippy::struct_excessive_bools)] // independent bits of the kernel
pub struct ControllerModes {
    /// Sends nothing at all: no frame, no acknowledge bit, no error flag.
    pub listen_only: bool,
    /// Receives only its own frames, nothing from the bus.
    pub loopback: bool,
    /// Reports each error on the wire as an error frame.
    pub error_reporting: bool,
    /// Sends and receives CAN FD frames.
    pub fd: bool,
}

impl BitTiming {
    /// Returns bit rate and sample point as text, e.g. `500000 bit/s, sample point 87.5 %`.
    pub fn text(self) -> String {
        let Self { bitrate_bps, sample_point_permille: point } = self;
        if point == 0 {
            return format!("{bitrate_bps} bit/s");
        }
        format!("{bitrate_bps} bit/s, sample point {}.{} %", point / 10, point % 10)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_point_is_left_out_where_the_driver_does_not_tell() {
        let timing = BitTiming { bitrate_bps: 500_000, sample_point_permille: 875 };
        assert_eq!(timing.text(), "500000 bit/s, sample point 87.5 %");
        assert_eq!(BitTiming { sample_point_permille: 0, ..timing }.text(), "500000 bit/s");
    }
}
