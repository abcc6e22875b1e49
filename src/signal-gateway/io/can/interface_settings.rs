//! Reads the settings of an interface and its controller by netlink, and changes them for the search for a
//! bit rate.

use std::fs;
use std::io;

use socketcan::nl::{CanBitTiming, CanCtrlModes};
use socketcan::{CanCtrlMode, CanInterface, Error, InterfaceCanParams};

use super::controller::report;
use super::link::is_can;
use can_signal::can::bit_rate_scan::ScanSettings;
use can_signal::can::interface_state::{
    BitTiming, ControllerModes, ControllerSettings, InterfaceKind, InterfaceState,
};

/// Modes that are changed for a search, and restored after it.
const CHANGED_MODES: [CanCtrlMode; 2] = [CanCtrlMode::ListenOnly, CanCtrlMode::BerrReporting];

/// Returns the state of the interface with this name, including whether it exists. Changes nothing.
pub fn interface_state(name: &str) -> InterfaceState {
    let state = InterfaceState {
        name: name.to_owned(),
        kind: InterfaceKind::Missing,
        is_up: false,
        transmit_queue: None,
        controller: None,
    };
    let details = match CanInterface::open(name).and_then(|interface| interface.details()).map_err(system) {
        Ok(details) => details,
        Err(error) if matches!(error.raw_os_error(), Some(libc::ENODEV | libc::ENXIO)) => return state,
        Err(error) => {
            let errno = error.raw_os_error().unwrap_or(libc::EIO);
            return InterfaceState { kind: InterfaceKind::Unknown(errno), ..state };
        }
    };
    let queue = fs::read_to_string(format!("/sys/class/net/{name}/tx_queue_len"));
    InterfaceState {
        kind: if is_can(name) { InterfaceKind::Can } else { InterfaceKind::NotCan },
        is_up: details.is_up,
        transmit_queue: queue.ok().and_then(|text| text.trim().parse().ok()),
        controller: settings(&details.can),
        ..state
    }
}

/// The settings of an interface before a search.
#[derive(Debug)]
pub struct InterfaceBackup {
    interface: CanInterface,
    params: InterfaceCanParams,
}

impl InterfaceBackup {
    /// Reads the settings of an interface.
    pub fn new(name: &str) -> io::Result<Self> {
        let interface = CanInterface::open(name).map_err(system)?;
        let params = interface.can_params().map_err(system)?;
        Ok(Self { interface, params })
    }

    /// Returns true if a bit rate had been set. A bit rate that is set later cannot be removed.
    pub fn has_bitrate(&self) -> bool {
        self.params.bit_timing.is_some_and(|timing| is_known(timing.bitrate))
    }

    /// Sets a bit rate and turns listen-only on, in one request. The interface must be down.
    pub fn configure(&self, settings: ScanSettings) -> io::Result<()> {
        let mut modes = CanCtrlModes::from_mode(CanCtrlMode::ListenOnly, true);
        if settings.error_reporting {
            modes.add(CanCtrlMode::BerrReporting, true);
        }
        let timing = CanBitTiming { bitrate: settings.bitrate_bps, ..CanBitTiming::default() };
        self.set(Some(timing), modes)
    }

    /// Brings the interface up or down.
    pub fn set_up(&self, is_up: bool) -> io::Result<()> {
        if is_up { self.interface.bring_up() } else { self.interface.bring_down() }.map_err(system)
    }

    /// Restores bit timing and modes. Without an earlier bit rate the controller keeps the last one and only
    /// listens: it must not send at a rate that no one has chosen.
    pub fn restore(&self) -> io::Result<()> {
        let had = |mode| self.params.ctrl_mode.is_some_and(|modes| modes.has_mode(mode));
        let mut modes = CanCtrlModes::default();
        for mode in CHANGED_MODES.into_iter().filter(|mode| self.supports(*mode)) {
            let keeps_listening = mode == CanCtrlMode::ListenOnly && !self.has_bitrate();
            modes.add(mode, had(mode) || keeps_listening);
        }
        let timing = self.params.bit_timing.filter(|_| self.has_bitrate());
        self.set(timing.map(|timing| self.exact(timing)), modes)
    }

    /// Returns a bit timing in the form that the kernel accepts: segments if it can calculate them, otherwise
    /// only the rate.
    fn exact(&self, timing: CanBitTiming) -> CanBitTiming {
        if self.params.bit_timing_const.is_some() && timing.tq > 0 {
            CanBitTiming { bitrate: 0, ..timing }
        } else {
            CanBitTiming { bitrate: timing.bitrate, ..CanBitTiming::default() }
        }
    }

    /// Older kernels do not report a driver's modes. There the search sets only listen-only, which it needs.
    fn supports(&self, mode: CanCtrlMode) -> bool {
        let supported = self.params.ctrl_mode_supported;
        supported.map_or(mode == CanCtrlMode::ListenOnly, |supported| supported & mode.mask() != 0)
    }

    fn set(&self, bit_timing: Option<CanBitTiming>, modes: CanCtrlModes) -> io::Result<()> {
        let ctrl_mode = Some(modes);
        let params = InterfaceCanParams { bit_timing, ctrl_mode, ..InterfaceCanParams::default() };
        self.interface.set_can_params(&params).map_err(system)
    }
}

/// Returns the kernel's error, if there is one.
fn system(error: Error) -> io::Error {
    match error {
        Error::Io(error) => error,
        Error::Nl(error) => error.errno().map_or(io::Error::other(error), io::Error::from_raw_os_error),
        error @ Error::Can(_) => io::Error::other(error),
    }
}

/// Returns the settings that the kernel reports for a controller; `None` without one.
fn settings(params: &InterfaceCanParams) -> Option<ControllerSettings> {
    let reported = report(params)?;
    let timing = |timing: CanBitTiming| BitTiming {
        bitrate_bps: timing.bitrate,
        sample_point_permille: timing.sample_point,
    };
    let is_on = |mode| params.ctrl_mode.is_some_and(|modes| modes.has_mode(mode));
    Some(ControllerSettings {
        state: Some(reported.state),
        counters: reported.counters,
        restart_ms: params.restart_ms,
        // A driver without a rate reports 0; a serial-line driver reports it as unknown.
        bit_timing: params.bit_timing.map(timing).filter(|timing| is_known(timing.bitrate_bps)),
        data_bit_timing: params.data_bit_timing.map(timing).filter(|timing| is_known(timing.bitrate_bps)),
        modes: modes(is_on),
        supported: params.ctrl_mode_supported.map(|supported| modes(|mode| supported & mode.mask() != 0)),
    })
}

/// `CAN_BITRATE_UNSET` is 0, `CAN_BITRATE_UNKNOWN` the largest number.
fn is_known(bitrate_bps: u32) -> bool {
    (1..u32::MAX).contains(&bitrate_bps)
}

fn modes(is_on: impl Fn(CanCtrlMode) -> bool) -> ControllerModes {
    ControllerModes {
        listen_only: is_on(CanCtrlMode::ListenOnly),
        loopback: is_on(CanCtrlMode::Loopback),
        error_reporting: is_on(CanCtrlMode::BerrReporting),
        fd: is_on(CanCtrlMode::Fd),
    }
}

#[cfg(test)]
mod tests {
    use socketcan::nl::CanState;

    use super::*;
    use can_signal::can::ControllerState;

    #[test]
    fn interfaces_that_are_missing_and_of_another_kind_differ() {
        assert_eq!(interface_state("nosuchcan7").kind, InterfaceKind::Missing);
        assert_eq!(interface_state("lo").kind, InterfaceKind::NotCan);
    }

    #[test]
    fn modes_rates_and_state_of_a_controller_are_read() {
        let rate = |bitrate| CanBitTiming { bitrate, sample_point: 800, ..CanBitTiming::default() };
        let params = InterfaceCanParams {
            state: Some(CanState::BusOff),
            restart_ms: Some(0),
            bit_timing: Some(rate(500_000)),
            data_bit_timing: Some(rate(0)),
            ctrl_mode: Some(CanCtrlModes::new(u32::MAX, 0x12)),
            ctrl_mode_supported: Some(0x02),
            ..InterfaceCanParams::default()
        };
        let expected = ControllerSettings {
            state: Some(ControllerState::BusOff),
            counters: None,
            restart_ms: Some(0),
            bit_timing: Some(BitTiming { bitrate_bps: 500_000, sample_point_permille: 800 }),
            data_bit_timing: None,
            modes: ControllerModes { listen_only: true, error_reporting: true, ..ControllerModes::default() },
            supported: Some(ControllerModes { listen_only: true, ..ControllerModes::default() }),
        };
        assert_eq!(settings(&params), Some(expected));
        assert_eq!(settings(&InterfaceCanParams::default()), None);
    }
}
