//! Checks the computer: the service, the permissions of its user, the clock.

use super::facts::{Facts, Known, Reach};
use super::row::{CheckRow, FindingRow, Outcome};
use gateway_base::diagnostics::Level;

const INSTALLATION: &str = "docs/installation.md";
const SOCKET: &str = "docs/status.md";
const START: &str = "docs/troubleshooting.md#it-does-not-start";
const TIME: &str = "docs/doctor.md#clock";

const DISABLED: FindingRow = FindingRow {
    name: "service_disabled",
    level: Level::Warn,
    text: "the service is installed, and {state}",
    why: "after the next start of the computer no gateway runs",
    remedy: "sudo systemctl enable signal-gateway",
    see: INSTALLATION,
};
const FAILED: FindingRow = FindingRow {
    name: "service_failed",
    level: Level::Error,
    text: "the service has failed, exit code {code}",
    why: "nothing is reported to Autoware",
    remedy: "journalctl -u signal-gateway -n 50 says why; exit code 3 means a refused configuration, which signal-gateway check explains; then sudo systemctl restart signal-gateway",
    see: START,
};
const INACTIVE: FindingRow = FindingRow {
    name: "service_inactive",
    level: Level::Warn,
    text: "the service does not run ({state})",
    why: "nothing is reported to Autoware",
    remedy: "sudo systemctl start signal-gateway",
    see: INSTALLATION,
};
const OTHER_FILE: FindingRow = FindingRow {
    name: "service_other_file",
    level: Level::Warn,
    text: "the service reads {service}, and not {path}",
    why: "what is examined here is not what runs",
    remedy: "signal-gateway doctor --config {service}; or name {path} in ExecStart=: sudo systemctl edit signal-gateway",
    see: INSTALLATION,
};
const NOT_IN_EFFECT: FindingRow = FindingRow {
    name: "not_in_effect",
    level: Level::Warn,
    text: "the running gateway has another configuration: {differences}",
    why: "a change of the file has no effect until it is reloaded",
    remedy: "sudo systemctl reload signal-gateway; signal-gateway check --against-running names what needs a restart",
    see: INSTALLATION,
};

pub(super) const SERVICE: CheckRow = CheckRow {
    name: "service",
    asks: "Is the service installed, enabled and active, with this configuration in effect?",
    findings: &[&DISABLED, &FAILED, &INACTIVE, &OTHER_FILE, &NOT_IN_EFFECT],
    judge: service,
};

fn service(facts: &Facts) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    match &facts.service {
        Known::No(reason) => outcomes.push(Outcome::not_checked(reason.clone())),
        Known::Yes(service) if !service.is_installed => {
            outcomes.push(Outcome::not_checked("the service is not installed on this computer"));
        }
        Known::Yes(service) => {
            if service.unit_file_state == "disabled" || service.unit_file_state == "masked" {
                outcomes.push(DISABLED.found().with("state", &service.unit_file_state));
            }
            match service.active_state.as_str() {
                "failed" => outcomes.push(FAILED.found().with("code", service.exit_code)),
                "active" | "activating" | "reloading" => {}
                state => outcomes.push(INACTIVE.found().with("state", state)),
            }
            let path = facts.configuration.as_ref().map(|configuration| configuration.path.as_str());
            if let (Some(path), Some(other)) = (path, &service.configuration)
                && path != other
            {
                outcomes.push(OTHER_FILE.found().with("path", path).with("service", other));
            }
        }
    }
    let is_found = outcomes.iter().any(|outcome| matches!(outcome, Outcome::Found(_)));
    match (&facts.running.differences, facts.running.reach) {
        (Some(parts), _) if !parts.is_empty() => {
            outcomes.push(NOT_IN_EFFECT.found().with("differences", parts.join(", ")));
        }
        (Some(_), _) => outcomes.push(Outcome::sound("a gateway runs with this configuration")),
        (None, Reach::Served) => outcomes.push(Outcome::sound("a gateway runs")),
        (None, _) if outcomes.is_empty() && !is_found => {
            outcomes.push(Outcome::sound("the service is enabled and runs"));
        }
        (None, Reach::Absent | Reach::Denied | Reach::Unreadable) => {}
    }
    outcomes
}

const STATUS_DENIED: FindingRow = FindingRow {
    name: "status_denied",
    level: Level::Warn,
    text: "{socket}: this user may not ask the running gateway",
    why: "signal-gateway status fails, and what runs cannot be compared with the file",
    remedy: "join the group of the service, then log in again: sudo usermod -aG signal-gateway $USER",
    see: SOCKET,
};
const STATUS_UNREADABLE: FindingRow = FindingRow {
    name: "status_unreadable",
    level: Level::Warn,
    text: "{socket}: what answers there cannot be read",
    why: "a gateway of another version runs, or another program",
    remedy: "install the same version on both sides, and restart the service",
    see: SOCKET,
};
const FOLDER: FindingRow = FindingRow {
    name: "folder_not_writable",
    level: Level::Error,
    text: "{key}: {path}: {problem}",
    why: "nothing is recorded there, so that a fault leaves no frames to look at",
    remedy: "let the user of the gateway write there: sudo install -d -o USER {path}, with signal-gateway as the USER of the service; or name another folder",
    see: "docs/vehicle-lights.md#the-black-box",
};
const HIDDEN: FindingRow = FindingRow {
    name: "hidden_from_service",
    level: Level::Error,
    text: "{path} is hidden from the service",
    why: "its unit hides /home, /root and the folders for temporary files, so that the service does not start with it",
    remedy: "move it to /etc/signal-gateway",
    see: START,
};
const SERVICE_DENIED: FindingRow = FindingRow {
    name: "unreadable_for_service",
    level: Level::Error,
    text: "{path}: the user of the service may not read it",
    why: "the service does not start with it",
    remedy: "sudo chmod a+r {path}, and a+x for its folders",
    see: START,
};
const NO_CAN: FindingRow = FindingRow {
    name: "can_sockets_refused",
    level: Level::Error,
    text: "a CAN socket cannot be opened: {reason}",
    why: "no frame can be received, whatever the interfaces are",
    remedy: "load the kernel's modules: sudo modprobe can can-raw; in a container, use the network of the host and allow AF_CAN",
    see: INSTALLATION,
};
const OTHER_SENDER: FindingRow = FindingRow {
    name: "other_sender",
    level: Level::Warn,
    text: "a process that is not the service sends commands on {interface}",
    why: "only one gateway may: the service does not start while the other one runs",
    remedy: "end the gateway or demo that was started by hand: pgrep -a signal-gateway",
    see: "docs/commands.md",
};

pub(super) const PERMISSIONS: CheckRow = CheckRow {
    name: "permissions",
    asks: "May this user and the service read the files, write the folders, ask the gateway and use CAN?",
    findings: &[
        &STATUS_DENIED,
        &STATUS_UNREADABLE,
        &FOLDER,
        &HIDDEN,
        &SERVICE_DENIED,
        &NO_CAN,
        &OTHER_SENDER,
    ],
    judge: permissions,
};

fn permissions(facts: &Facts) -> Vec<Outcome> {
    let (permissions, running) = (&facts.permissions, &facts.running);
    let mut outcomes = match running.reach {
        Reach::Denied => vec![STATUS_DENIED.found().with("socket", &running.socket)],
        Reach::Unreadable => vec![STATUS_UNREADABLE.found().with("socket", &running.socket)],
        Reach::Served | Reach::Absent => Vec::new(),
    };
    outcomes.extend(permissions.folders.iter().filter_map(|folder| {
        let problem = folder.problem.as_ref()?;
        Some(FOLDER.found().with("key", &folder.key).with("path", &folder.path).with("problem", problem))
    }));
    outcomes.extend(permissions.hidden_from_service.iter().map(|path| HIDDEN.found().with("path", path)));
    let unreadable = permissions.unreadable_for_service.iter().flatten();
    outcomes.extend(unreadable.map(|path| SERVICE_DENIED.found().with("path", path)));
    if let Some(errno) = permissions.can_socket_errno {
        let reason = std::io::Error::from_raw_os_error(errno).to_string();
        outcomes.push(NO_CAN.found().with("reason", &reason));
    }
    let is_service = running.reach == Reach::Served
        || matches!(&facts.service, Known::Yes(service) if service.active_state == "active");
    if !is_service {
        let locked = permissions.locked_interfaces.iter();
        outcomes.extend(locked.map(|interface| OTHER_SENDER.found().with("interface", interface)));
    }
    if outcomes.is_empty() {
        let writable: Vec<_> = permissions.folders.iter().map(|folder| folder.path.as_str()).collect();
        let folders =
            if writable.is_empty() { String::new() } else { format!("; writable: {}", writable.join(", ")) };
        outcomes.push(Outcome::sound(format!("CAN sockets can be opened{folders}")));
    }
    if permissions.unreadable_for_service.is_none() {
        let reason =
            "whether the service can read the files: that needs root, and the configuration of the service";
        outcomes.push(Outcome::not_checked(reason));
    }
    outcomes
}

/// Maximum step of a clock that is only slewed, ms.
const MAX_STEP_MS: i64 = 50;
/// Maximum difference between the stamp of a frame and the time of reading it, ms.
const MAX_STAMP_DISTANCE_MS: i64 = 1000;

const UNSYNCHRONISED: FindingRow = FindingRow {
    name: "clock_unsynchronised",
    level: Level::Warn,
    text: "the clock of this computer is not synchronised",
    why: "stamps of messages differ from those of other computers, and recordings cannot be laid beside each other",
    remedy: "sudo timedatectl set-ntp true, or set up chrony or PTP as for the other computers of the vehicle",
    see: TIME,
};
const JUMPED: FindingRow = FindingRow {
    name: "clock_jumped",
    level: Level::Warn,
    text: "the clock was set by {step} ms while it was watched",
    why: "stamps run backward or leave gaps; the gateway decides by another clock, but readers of its messages may not",
    remedy: "let one program alone set the clock, and let it slew instead of step: chrony with makestep only at the start",
    see: TIME,
};
const STAMPS: FindingRow = FindingRow {
    name: "stamps_apart",
    level: Level::Warn,
    text: "{interface}: stamps of frames are {distance} ms away from the clock",
    why: "reports carry stamps that other nodes take for too old or for the future",
    remedy: "if the clock was set just now, run doctor again; else the computer is too busy to read the frames in time",
    see: TIME,
};

pub(super) const CLOCK: CheckRow = CheckRow {
    name: "clock",
    asks: "Is the clock synchronised and steady, and do stamps of frames fit it?",
    findings: &[&UNSYNCHRONISED, &JUMPED, &STAMPS],
    judge: clock,
};

fn clock(facts: &Facts) -> Vec<Outcome> {
    let mut outcomes = Vec::new();
    match facts.clock.is_synchronised {
        Some(true) => {}
        Some(false) => outcomes.push(UNSYNCHRONISED.found()),
        None => {
            outcomes.push(Outcome::not_checked("the kernel does not tell whether the clock is synchronised"));
        }
    }
    let step = facts.clock.jump_ms;
    if step.saturating_abs() > MAX_STEP_MS {
        outcomes.push(JUMPED.found().with("step", step));
    }
    outcomes.extend(facts.interfaces.iter().filter_map(|interface| {
        let Known::Yes(survey) = &interface.survey else { return None };
        let distance = survey.stamp_distance_ms;
        let found = || STAMPS.found().with("interface", &interface.state.name).with("distance", distance);
        (distance.saturating_abs() > MAX_STAMP_DISTANCE_MS).then(found)
    }));
    if outcomes.is_empty() {
        outcomes.push(Outcome::sound("synchronised, and not set while it was watched"));
    }
    outcomes
}
