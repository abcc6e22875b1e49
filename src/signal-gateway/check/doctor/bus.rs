//! Checks the traffic of the bus: frames at this bit rate, errors, the messages of the vehicle.

use super::facts::{Facts, InterfaceFacts, Known};
use super::row::{CheckRow, FindingRow, Outcome};
use crate::report::text::counted;
use can_signal::can::bus_survey::BusSurvey;
use can_signal::can::interface_state::BitTiming;
use gateway_base::diagnostics::Level;

const RATES: &str = "docs/doctor.md#bit-rate";

const WRONG_RATE: FindingRow = FindingRow {
    name: "wrong_bit_rate",
    level: Level::Error,
    text: "{interface}: {errors} came in {time}, and no frame: {kinds}",
    why: "that is how a wrong bit rate looks; a controller that can send disturbs the vehicle with it",
    remedy: "find the bit rate: ip link set {interface} down; sudo signal-gateway doctor --scan {interface}",
    see: RATES,
};
const SILENT: FindingRow = FindingRow {
    name: "silent_bus",
    level: Level::Warn,
    text: "{interface}: no frame came in {time}",
    why: "without frames nothing is reported: the ignition is off, the bus sleeps, a wire is loose, or the bit rate is wrong",
    remedy: "switch the ignition on{search}",
    see: RATES,
};

pub(super) const BIT_RATE: CheckRow = CheckRow {
    name: "bit_rate",
    asks: "Which bit rate is set, and do frames come with it?",
    findings: &[&WRONG_RATE, &SILENT],
    judge: |facts: &Facts| {
        surveyed(facts, |facts, interface, survey| Some(bit_rate(facts, interface, survey)))
    },
};

fn bit_rate(facts: &Facts, interface: &InterfaceFacts, survey: &BusSurvey) -> Outcome {
    let name = interface.state.name.as_str();
    let time = seconds(facts);
    let found = |row: &FindingRow| row.found().with("interface", name).with("time", &time);
    if survey.frames > 0 {
        let frames = counted(survey.frames, "frame");
        let ids = counted(u64::try_from(survey.ids).unwrap_or(u64::MAX), "identifier");
        Outcome::sound(format!("{name}: {}; {frames} of {ids} in {time}", rates(interface)))
    } else if survey.error_frames > 0 {
        let errors = counted(survey.error_frames, "error frame");
        found(&WRONG_RATE).with("errors", errors).with("kinds", kinds(survey))
    } else {
        let search = interface.state.controller.map_or(String::new(), |_| {
            format!(
                "; if it stays silent, find the bit rate: ip link set {name} down; sudo signal-gateway doctor --scan {name}"
            )
        });
        found(&SILENT).with("search", search)
    }
}

const DISTURBED: FindingRow = FindingRow {
    name: "error_frames",
    level: Level::Warn,
    text: "{interface}: {errors} came beside {frames} in {time}: {kinds}",
    why: "each of them is a frame that was destroyed; with many, reports are late or withheld",
    remedy: "check wiring and terminators; if the bus has CAN FD frames, set the interface up with fd on and its data bit rate",
    see: "docs/doctor.md#error-frames",
};
const DROPS: FindingRow = FindingRow {
    name: "drops",
    level: Level::Warn,
    text: "{interface}: the kernel dropped {drops} in {time}",
    why: "they were not read in time, so that this computer is too busy for its buses",
    remedy: "raise [can.*] receive_buffer_bytes, or the priority of the service",
    see: "docs/troubleshooting.md#high-load-or-too-much-output",
};

pub(super) const ERROR_FRAMES: CheckRow = CheckRow {
    name: "error_frames",
    asks: "Do error frames come, of which kinds, and were frames lost on this computer?",
    findings: &[&DISTURBED, &DROPS],
    judge: |facts: &Facts| surveyed(facts, errors),
};

fn errors(facts: &Facts, interface: &InterfaceFacts, survey: &BusSurvey) -> Option<Outcome> {
    let name = interface.state.name.as_str();
    let time = seconds(facts);
    let found = |row: &FindingRow| row.found().with("interface", name).with("time", &time);
    if survey.error_frames > 0 && survey.frames > 0 {
        let errors = counted(survey.error_frames, "error frame");
        let found = found(&DISTURBED).with("errors", errors).with("frames", counted(survey.frames, "frame"));
        Some(found.with("kinds", kinds(survey)))
    } else if survey.drops > 0 {
        Some(found(&DROPS).with("drops", counted(survey.drops, "frame")))
    } else {
        // Error frames without any other frame put the bit rate in question, which another check judges.
        (survey.error_frames == 0).then(|| Outcome::sound(format!("{name}: no error frame in {time}")))
    }
}

const OTHER_VEHICLE: FindingRow = FindingRow {
    name: "other_vehicle",
    level: Level::Warn,
    text: "{interface}: none of {frames} in {time} belongs to the vehicle profile",
    why: "nothing is reported: it is another bus of the vehicle, or another vehicle",
    remedy: "signal-gateway identify --live {interface} names the profiles that fit; or name the interface of the right bus",
    see: "docs/identify.md",
};

pub(super) const VEHICLE_MESSAGES: CheckRow = CheckRow {
    name: "vehicle_messages",
    asks: "Do frames of the vehicle profile come?",
    findings: &[&OTHER_VEHICLE],
    judge: |facts: &Facts| {
        surveyed(facts, |facts, interface, survey| {
            let (name, time) = (interface.state.name.as_str(), seconds(facts));
            match survey.of_profile.filter(|_| survey.frames > 0)? {
                0 => {
                    let frames = counted(survey.frames, "frame");
                    Some(
                        OTHER_VEHICLE
                            .found()
                            .with("interface", name)
                            .with("time", &time)
                            .with("frames", &frames),
                    )
                }
                count => Some(Outcome::sound(format!("{name}: {} in {time}", counted(count, "frame")))),
            }
        })
    },
};

/// Judges the survey of each interface; reports an interface that could not be surveyed as not checked.
fn surveyed(
    facts: &Facts,
    judge: impl Fn(&Facts, &InterfaceFacts, &BusSurvey) -> Option<Outcome>,
) -> Vec<Outcome> {
    let judge = |interface: &InterfaceFacts| match &interface.survey {
        Known::Yes(survey) => judge(facts, interface, survey),
        Known::No(reason) => Some(Outcome::not_checked(format!("{}: {reason}", interface.state.name))),
    };
    facts.interfaces.iter().filter_map(judge).collect()
}

fn rates(interface: &InterfaceFacts) -> String {
    let Some(controller) = &interface.state.controller else {
        return "virtual, without a bit rate".to_owned();
    };
    let nominal =
        controller.bit_timing.map_or("a bit rate that its driver does not tell".to_owned(), BitTiming::text);
    match controller.data_bit_timing {
        Some(data) => format!("{nominal}, data {}", data.text()),
        None => nominal,
    }
}

/// Returns the error frames by kind, most frequent first: `protocol 12, bus-error 12`.
fn kinds(survey: &BusSurvey) -> String {
    let mut kinds: Vec<_> = survey.errors.iter().collect();
    kinds.sort_by_key(|(_, count)| std::cmp::Reverse(**count));
    kinds.iter().map(|(kind, count)| format!("{kind} {count}")).collect::<Vec<_>>().join(", ")
}

fn seconds(facts: &Facts) -> String {
    format!("{}.{} s", facts.listened_ms / 1000, facts.listened_ms % 1000 / 100)
}
