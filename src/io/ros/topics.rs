//! Where the messages go: topic names, type names and durability.
//!
//! Reports are reliable with depth 1, diagnostics reliable, volatile, with depth 10
//! (vehicle-interface sections 1.1 and 1.7).

/// Names of the three topics, absolute (`/…`).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics {
    /// `autoware_vehicle_msgs/msg/TurnIndicatorsReport`.
    pub turn_indicators: String,
    /// `autoware_vehicle_msgs/msg/HazardLightsReport`.
    pub hazard_lights: String,
    /// `diagnostic_msgs/msg/DiagnosticArray`.
    pub diagnostics: String,
}

impl Default for Topics {
    /// What Autoware and its diagnostics expect.
    fn default() -> Self {
        Self {
            turn_indicators: "/vehicle/status/turn_indicators_status".to_owned(),
            hazard_lights: "/vehicle/status/hazard_lights_status".to_owned(),
            diagnostics: "/diagnostics".to_owned(),
        }
    }
}

/// Whether a reader that comes later is handed the current report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Durability {
    /// It is. Serves transient-local and volatile readers alike.
    #[default]
    TransientLocal,
    /// It waits for the next report. Transient-local readers are not served at all.
    Volatile,
}

/// A message type as `(package, name)`.
pub type TypeName = (&'static str, &'static str);

/// Type of the turn-indicators topic.
pub const TURN_INDICATORS_TYPE: TypeName = ("autoware_vehicle_msgs", "TurnIndicatorsReport");
/// Type of the hazard-lights topic.
pub const HAZARD_LIGHTS_TYPE: TypeName = ("autoware_vehicle_msgs", "HazardLightsReport");
/// Type of the diagnostics topic.
pub const DIAGNOSTICS_TYPE: TypeName = ("diagnostic_msgs", "DiagnosticArray");

/// Samples kept for a report: the current one.
pub const REPORT_DEPTH: i32 = 1;
/// Samples kept for diagnostics.
pub const DIAGNOSTICS_DEPTH: i32 = 10;
