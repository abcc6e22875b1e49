//! Everything that users see of one moment. It is created once from a snapshot; terminal, live page and
//! status text only lay it out.

mod flows;
mod process;
mod reports;
mod signals;
mod value;

use schemars::JsonSchema;
use serde::Serialize;

pub use self::flows::{BusView, CandidateView, ChannelView, DeciderView, LightView, LightsView, bulb_text};
pub use self::process::ProcessView;
pub use self::reports::{
    DOORS, DoorView, HAZARD, Lamp, Mark, MeasureView, Outcome, ReportView, Step, TURN, caption, report_place,
};
pub use self::signals::RawView;
pub use self::value::{Fact, Section, Value, age_text};
use super::text::{cut, escaped};
use crate::process_status::snapshot::Snapshot;
use gateway_base::diagnostics::Level;
use gateway_core::gateway::snapshot::StatusSnapshot;

/// Maximum length of the headline, characters; `systemctl status` shows one line.
const MAX_HEADLINE: usize = 200;

/// What a person is shown of a gateway; as JSON, an event of the live page. The terminal shows a simulated
/// vehicle in the same form.
#[derive(Debug, Clone, PartialEq, Default, Serialize, JsonSchema)]
pub struct GatewayView {
    /// When the state was taken, ms since 1970; in a replay the time of the recording.
    pub stamp_ms: i64,
    /// The worst level of all diagnostics; `None` for a simulated vehicle, which is not judged.
    pub level: Option<Level>,
    /// ROS node name.
    pub node: String,
    /// The process; `None` in a replay and in a simulation.
    pub process: Option<ProcessView>,
    /// What the lights of the vehicle do, in words.
    pub caption: String,
    /// The left and the right turn indicator of the vehicle.
    pub lamps: [Lamp; 2],
    /// What Autoware gets, as far as the profile has it: velocity, steering, gear, control mode, turn
    /// indicators, hazard lights and doors.
    pub reports: Vec<ReportView>,
    /// The statuses that Autoware needs and the profile does not have.
    pub absent: Vec<&'static str>,
    /// Angle of the front wheels, degrees, left positive; `None` while it is not published.
    pub steering_deg: Option<f64>,
    /// The doors; empty while their report is not published.
    pub doors: Vec<DoorView>,
    /// All signals that are received, by flow.
    pub signals: Vec<RawView>,
    /// Commands to the vehicle; `None` unless configured.
    pub commands: Option<Section>,
    /// The buses, in the order of the vehicle profile.
    pub buses: Vec<BusView>,
    /// Traffic lights; `None` unless configured.
    pub traffic_lights: Option<LightsView>,
    /// Turn signal decider; `None` unless it runs.
    pub decider: Option<DeciderView>,
    /// All diagnostic statuses, in the order in which they are published.
    pub diagnostics: Vec<StatusSnapshot>,
}

impl GatewayView {
    /// Creates the view of a snapshot.
    pub fn of(snapshot: &Snapshot) -> Self {
        let reports = reports::reports(snapshot);
        let is_of_lights = |report: &&ReportView| report.is_of_lights();
        let marks: Vec<_> = reports.iter().filter(is_of_lights).map(|report| report.mark).collect();
        let steering = snapshot.vehicle_status.steering.as_ref().and_then(|report| report.published);
        Self {
            stamp_ms: snapshot.stamp_ns / 1_000_000,
            level: Some(snapshot.level),
            node: snapshot.node.clone(),
            process: snapshot.process.as_ref().map(|process| ProcessView::of(process, snapshot.stamp_ns)),
            caption: caption(&marks).to_owned(),
            lamps: [Mark::Left, Mark::Right].map(|side| reports::lamp(side, &marks)),
            absent: reports::absent(&reports),
            reports,
            steering_deg: steering.map(f64::to_degrees),
            doors: reports::doors(snapshot),
            signals: snapshot.signals.iter().map(|signal| RawView::of(snapshot, signal)).collect(),
            commands: snapshot.commands.as_ref().map(flows::commands),
            buses: snapshot.buses.iter().map(BusView::of).collect(),
            traffic_lights: snapshot.traffic_lights.as_ref().map(LightsView::of),
            decider: snapshot.decider.as_ref().map(DeciderView::of),
            diagnostics: snapshot.diagnostics.clone(),
        }
    }

    /// Returns the state in one short line: the published values, or everything at the worst level.
    pub fn headline(&self) -> String {
        let level = self.level.unwrap_or_default();
        let text = if level == Level::Ok {
            // Measured values change constantly, and there are many doors.
            let is_short = |report: &&ReportView| report.mark != Mark::Measured && report.key != "doors";
            let reports = self.reports.iter().filter(is_short);
            let text = |report: &ReportView| format!("{} {}", report.name, report.reported.text);
            let texts: Vec<_> = reports.map(text).collect();
            if texts.is_empty() { "OK".to_owned() } else { format!("OK: {}", texts.join(", ")) }
        } else {
            let worst = self.diagnostics.iter().filter(|status| status.level == level);
            let texts: Vec<_> = worst.map(|status| format!("{}: {}", status.task, status.message)).collect();
            format!("{level}: {}", texts.join("; "))
        };
        cut(&escaped(&text), MAX_HEADLINE)
    }
}
