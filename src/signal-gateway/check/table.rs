//! The bound signals and the reports of a recording as tables over time.

use std::collections::BTreeMap;
use std::io::{self, Write};

use super::vehicle_status::report_names;
use crate::config::Settings;
use crate::report::table::{Cell, Rows, Table, TableSummary, column_name};
use can_signal::can::BusIndex;
use can_signal::dbc::model::Signal;
use can_signal::validation::display::RoleTexts;
use can_signal::validation::meaning::Meaning;
use can_signal::validation::table::{BoundSignal, SignalIndex, SignalTable};
use gateway_base::time::{MonoTime, Now};
use gateway_core::gateway::Gateway;
use gateway_core::gateway::event::Output;
use gateway_core::vehicle_lights::Task;
use gateway_core::vehicle_lights::output::VehicleLightsOutput;
use gateway_core::vehicle_lights::role_texts::roles;
use gateway_core::vehicle_lights::verdict::{HazardLights, TurnIndicators};
use gateway_core::vehicle_status::StatusReport;
use gateway_core::vehicle_status::doors::DoorState;
use gateway_core::vehicle_status::output::VehicleStatusOutput;
use gateway_core::vehicle_status::role_texts::StatusTexts;

/// Values of the bound signals, as far as the gateway trusts them.
pub struct SignalValues<W: Write> {
    table: Table<W>,
    signals: Vec<SignalColumn>,
    status_texts: StatusTexts,
    /// Raw values of the last frame that was added.
    last: Vec<Option<i128>>,
}

/// A signal in a table.
struct SignalColumn {
    /// Position of its raw value among those of the gateway.
    value: usize,
    /// Factor and offset of a number.
    scale: [f64; 2],
    /// Position among the signals of the status if it is a measurement there, which may be invalid.
    measured: Option<SignalIndex>,
    /// Uses with names for its values; none for a number.
    roles: Vec<RoleTexts>,
}

impl<W: Write> SignalValues<W> {
    /// Creates a table with a column for each signal. Fails if `out` does.
    pub fn new(settings: &Settings, out: W, rows: Rows) -> io::Result<Self> {
        let (lights, status) = (&settings.gateway.lights, &settings.gateway.status);
        let status_texts = StatusTexts::of(status);
        let (light_roles, status_roles) = (roles(lights), status_texts.roles().collect::<Vec<_>>());
        let of_lights = all_signals(&lights.table, &light_roles);
        let of_status = all_signals(&status.table, &status_roles);
        let light_count = lights.table.signals.len();
        let mut known: BTreeMap<&str, usize> = BTreeMap::new();
        let (mut names, mut signals) = (Vec::new(), Vec::<SignalColumn>::new());
        for (value, (index, signal, bus, roles)) in of_lights.chain(of_status).enumerate() {
            // A signal of both is a column with the meanings of both.
            if let Some(column) = known.get(signal.name.as_str()) {
                signals[*column].roles.extend(roles);
                continue;
            }
            known.insert(&signal.name, signals.len());
            let described = described(settings, bus, signal);
            let measured = (value >= light_count && status_texts.is_measured(index)).then_some(index);
            let is_number = measured.is_some() || roles.is_empty();
            let unit = described.filter(|_| is_number).map_or("", |signal| signal.unit.as_str());
            names.push(column_name(&signal.name, unit));
            let scale = described.map_or([1.0, 0.0], |signal| [signal.factor, signal.offset]);
            signals.push(SignalColumn {
                value,
                scale,
                measured,
                roles: if is_number { Vec::new() } else { roles },
            });
        }
        let last = vec![None; signals.len()];
        Ok(Self { table: Table::new(out, names, rows)?, signals, status_texts, last })
    }

    /// Counts an entry of the recording, in proportion to which the table may grow.
    pub fn entry(&mut self) {
        self.table.entry();
    }

    /// Adds the values that a gateway has at the time of its last call. Fails if the output does.
    pub fn take(&mut self, gateway: &Gateway, now: Now) -> io::Result<()> {
        let values = gateway.raw_values(now.mono);
        self.table.set_clock(now);
        self.table.advance(now.mono)?;
        for (column, (signal, last)) in self.signals.iter().zip(&mut self.last).enumerate() {
            let value = values.get(signal.value).copied().flatten();
            if *last != value {
                *last = value;
                let cell = value.map_or(Cell::Unknown, |raw| signal.cell(raw, &self.status_texts));
                self.table.set(column, cell);
            }
        }
        Ok(())
    }

    /// Writes the last rows. Fails if the output does.
    pub fn finish(self, end: MonoTime) -> io::Result<TableSummary> {
        self.table.finish(end)
    }
}

/// Returns all signals of a table, each with its bus and its uses among `roles`.
fn all_signals<'a>(
    table: &'a SignalTable,
    roles: &'a [RoleTexts],
) -> impl Iterator<Item = (SignalIndex, &'a BoundSignal, BusIndex, Vec<RoleTexts>)> {
    table.signals.iter().enumerate().map(move |(index, signal)| {
        let index = SignalIndex(index);
        let uses = roles.iter().filter(|role| role.signal == index).cloned().collect();
        (index, signal, table.messages[signal.message.0].bus, uses)
    })
}

/// Returns the DBC's description of a signal.
fn described<'a>(settings: &'a Settings, bus: BusIndex, bound: &BoundSignal) -> Option<&'a Signal> {
    let dbc = settings.dbcs.iter().find(|dbc| dbc.index == bus)?;
    let name = bound.name.strip_prefix(&format!("{}:", dbc.bus)).unwrap_or(&bound.name);
    dbc.database.messages.iter().find_map(|message| {
        let signal = name.strip_prefix(message.name.as_str())?.strip_prefix('.')?;
        message.signals.iter().find(|described| described.name == signal)
    })
}

impl SignalColumn {
    fn cell(&self, raw: i128, texts: &StatusTexts) -> Cell {
        if self.measured.is_some_and(|index| texts.meaning(index, raw) != Meaning::Defined(())) {
            return Cell::Unknown;
        }
        match self.roles.as_slice() {
            [] => {
                let [factor, offset] = self.scale;
                #[allow(clippy::cast_precision_loss)] // beyond 2⁵³ the result is rounded
                Cell::Number(factor.mul_add(raw as f64, offset))
            }
            [role] => Cell::word(role.state_text(raw)),
            roles => {
                let texts = roles.iter().map(|role| role.value_text(raw).text);
                Cell::word(&texts.collect::<Vec<_>>().join(" + "))
            }
        }
    }
}

/// The reports over time, as they are published.
pub struct ReportValues<W: Write> {
    table: Table<W>,
    /// Position of the first column of each report.
    columns: Vec<(&'static str, usize)>,
    doors: usize,
}

impl<W: Write> ReportValues<W> {
    /// Creates a table with the columns of all reports that a configuration provides. Fails if `out` does.
    pub fn new(settings: &Settings, out: W, rows: Rows) -> io::Result<Self> {
        let (mut names, mut columns) = (Vec::new(), Vec::new());
        let doors = &settings.gateway.status.doors;
        for report in report_names(settings) {
            columns.push((report, names.len()));
            if report == StatusReport::Velocity.name() {
                names.extend(["velocity_mps".to_owned(), "heading_rate_radps".to_owned()]);
            } else if report == StatusReport::Steering.name() {
                names.push("steering_tire_angle_rad".to_owned());
            } else if report == StatusReport::Doors.name() {
                names.extend(
                    doors
                        .iter()
                        .map(|door| column_name(&format!("door {}", door.name), "").replace(' ', "_")),
                );
            } else {
                names.push(report.to_owned());
            }
        }
        Ok(Self { table: Table::new(out, names, rows)?, columns, doors: doors.len() })
    }

    /// Counts an entry of the recording, in proportion to which the table may grow.
    pub fn entry(&mut self) {
        self.table.entry();
    }

    /// Sets the recording's clock at a virtual time.
    pub fn set_clock(&mut self, now: Now) {
        self.table.set_clock(now);
    }

    /// Adds an output. Fails if the output of the table does.
    pub fn given_out(&mut self, output: &Output, at: MonoTime) -> io::Result<()> {
        self.table.advance(at)?;
        match output {
            Output::VehicleLights(VehicleLightsOutput::TurnIndicators(step)) => {
                let word = step.value().map(|value| match value {
                    TurnIndicators::Disable => "off",
                    TurnIndicators::EnableLeft => "left",
                    TurnIndicators::EnableRight => "right",
                });
                self.set(Task::TurnIndicators.name(), [word.map_or(Cell::Unknown, Cell::word)]);
            }
            Output::VehicleLights(VehicleLightsOutput::HazardLights(step)) => {
                let word = step.value().map(|value| match value {
                    HazardLights::Disable => "off",
                    HazardLights::Enable => "on",
                });
                self.set(Task::HazardLights.name(), [word.map_or(Cell::Unknown, Cell::word)]);
            }
            Output::VehicleStatus(output) => self.vehicle_status(*output),
            Output::TrafficLights(_)
            | Output::TurnSignal(_)
            | Output::Command(_)
            | Output::Diagnostics { .. } => {}
        }
        Ok(())
    }

    fn vehicle_status(&mut self, output: VehicleStatusOutput) {
        let report = output.report().name();
        let number = |value: Option<f64>| value.map_or(Cell::Unknown, Cell::Number);
        match output {
            VehicleStatusOutput::Velocity(step) => {
                let value = step.value();
                let speed = number(value.map(|velocity| velocity.longitudinal_mps));
                self.set(report, [speed, number(value.map(|velocity| velocity.heading_rate_radps))]);
            }
            VehicleStatusOutput::Steering(step) => {
                self.set(report, [number(step.value().map(|angle| angle.0))]);
            }
            VehicleStatusOutput::Gear(step) => {
                self.set(report, [step.value().map_or(Cell::Unknown, |gear| Cell::word(gear.name()))]);
            }
            VehicleStatusOutput::ControlMode(step) => {
                self.set(report, [step.value().map_or(Cell::Unknown, |mode| Cell::word(mode.name()))]);
            }
            VehicleStatusOutput::Doors(step) => {
                let states = step.value();
                let cell = |door: usize| match states.as_ref().and_then(|states| states.as_slice().get(door))
                {
                    None | Some(DoorState::Unknown | DoorState::NotAvailable) => Cell::Unknown,
                    Some(state) => Cell::word(state.name()),
                };
                self.set(report, (0..self.doors).map(cell).collect::<Vec<_>>());
            }
        }
    }

    fn set(&mut self, report: &str, cells: impl IntoIterator<Item = Cell>) {
        let Some((_, first)) = self.columns.iter().find(|(name, _)| *name == report) else { return };
        for (column, cell) in (*first..).zip(cells) {
            self.table.set(column, cell);
        }
    }

    /// Writes the last rows. Fails if the output does.
    pub fn finish(self, end: MonoTime) -> io::Result<TableSummary> {
        self.table.finish(end)
    }
}
