//! The files of a discovered vehicle, verified against the session from which they were made.
//!
//! The gateway itself loads the files and processes the frames of the session. Its reports must match the
//! driver's marks: a file that contradicts its own session would also be wrong on the road.

use std::io;
use std::path::Path;

use derive_more::Display;

use crate::config::draft::{VehicleDraft, VehicleFiles};
use crate::config::files::Files;
use crate::config::{Overrides, Settings, load};
use can_signal::can::{BusIndex, CanInput, LinkState};
use gateway_base::time::{MonoTime, Now, WallStamp};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::{Input, Output};
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use vehicle_bringup::discovery::capture::{Capture, MessageKey};
use vehicle_bringup::discovery::proof::{self, Contradiction, ReportedState, Requirements};
use vehicle_bringup::discovery::timeline::{ActionTimeline, DriverAction};

/// Reason why no files are written.
#[derive(Debug, Clone, PartialEq, Eq, Display)]
pub enum Refutation {
    /// Not both sides are certain.
    #[display("a wrong signal would be worse than none")]
    NotSure,
    /// The gateway does not accept the files.
    #[display("the gateway does not accept the profile: {_0}")]
    Refused(String),
    /// The reports contradict the session.
    #[display("the profile contradicts its own session: {_0}")]
    Contradicted(Contradiction),
}

/// Drafts the files and verifies them against the session. Fails with the reason why no files may be written.
pub fn proven_files(draft: &VehicleDraft<'_>, timeline: &ActionTimeline) -> Result<VehicleFiles, Refutation> {
    let files = draft.files().ok_or(Refutation::NotSure)?;
    let required = Requirements::of(draft.findings).ok_or(Refutation::NotSure)?;
    let settings = load(&DraftFiles(&files), Path::new("gateway.toml"), &Overrides::default())
        .map_err(|refused| Refutation::Refused(refused.to_string()))?;
    let changes = reported(&settings, draft.interfaces, draft.capture);
    let (_, end) = draft.capture.span().unwrap_or_default();
    proof::compare(timeline, &changes, end, required).map_err(Refutation::Contradicted)?;
    Ok(files)
}

/// The drafted files by their names; all other files are absent.
struct DraftFiles<'a>(&'a VehicleFiles);

impl Files for DraftFiles<'_> {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let file = self.0.iter().find(|(name, _)| Path::new(name) == path);
        file.map(|(_, text)| text.clone().into_bytes()).ok_or_else(|| io::ErrorKind::NotFound.into())
    }
}

/// Returns the changes in the reports of a gateway with these settings over the frames of a session, whose
/// interfaces are indexed by [`BusIndex`].
pub fn reported(
    settings: &Settings,
    interfaces: &[String],
    capture: &Capture,
) -> Vec<(MonoTime, ReportedState)> {
    let mut inputs = Vec::new();
    for (bus, bus_settings) in (0..).map(BusIndex).zip(&settings.gateway.buses) {
        let interface = interfaces.iter().position(|interface| *interface == bus_settings.interface);
        let captured = interface.and_then(|index| u8::try_from(index).ok()).map_or(bus, BusIndex);
        for ids in settings.gateway.relevant_ids(bus) {
            if let Some(track) = capture.track(MessageKey { bus: captured, id: ids.described() }) {
                inputs.extend(track.frames().map(|(at, frame)| (at, bus, frame)));
            }
        }
    }
    inputs.sort_by_key(|(at, ..)| *at);
    let (start, end) = capture.span().unwrap_or_default();
    let now = |mono: MonoTime| Now { mono, wall: WallStamp::default().after(mono.since(MonoTime::ZERO)) };
    let mut gateway = Gateway::new(settings.gateway.clone().dry(), LinkState::Up, now(start));
    let mut reports = Reports::default();
    for (at, bus, frame) in inputs {
        reports.pass(&mut gateway, at, now);
        let input = CanInput::Frame { bus, frame: *frame, stamp: now(at).wall };
        gateway.handle_can(&input, now(at));
        reports.take(&mut gateway, at);
    }
    reports.pass(&mut gateway, end, now);
    reports.changes
}

#[derive(Debug, Default)]
struct Reports {
    turn: Option<TurnIndicators>,
    hazard: Option<HazardLights>,
    changes: Vec<(MonoTime, ReportedState)>,
}

impl Reports {
    /// Advances time to `end`, from deadline to deadline.
    fn pass(&mut self, gateway: &mut Gateway, end: MonoTime, now: impl Fn(MonoTime) -> Now) {
        while gateway.next_deadline() <= end {
            let deadline = now(gateway.next_deadline());
            gateway.handle(Input::Tick, deadline);
            self.take(gateway, deadline.mono);
        }
    }

    fn take(&mut self, gateway: &mut Gateway, at: MonoTime) {
        while let Some(output) = gateway.poll_output() {
            let Output::VehicleLights(output) = output else { continue };
            match output {
                VehicleLightsOutput::TurnIndicators(step) => self.turn = step.value(),
                VehicleLightsOutput::HazardLights(step) => self.hazard = step.value(),
            }
        }
        let state = match (self.hazard, self.turn) {
            (Some(HazardLights::Enable), _) => ReportedState::Action(DriverAction::Hazard),
            (_, Some(TurnIndicators::EnableLeft)) => ReportedState::Action(DriverAction::Left),
            (_, Some(TurnIndicators::EnableRight)) => ReportedState::Action(DriverAction::Right),
            (_, Some(TurnIndicators::Disable)) => ReportedState::Off,
            (_, None) => ReportedState::Unknown,
        };
        if self.changes.last().is_none_or(|(_, last)| *last != state) {
            self.changes.push((at, state));
        }
    }
}
