//! A simulated vehicle on virtual time, from the start of its script to the end, without a bus.

use std::time::Duration;

use gateway_base::time::MonoTime;
use vehicle_bringup::simulated_vehicle::plan::VehiclePlan;
use vehicle_bringup::simulated_vehicle::request::SimulationRequest;
use vehicle_bringup::simulated_vehicle::{SimulatedVehicle, SimulationSettings, VehicleOutput};

/// Runs a vehicle for `length` and passes each output to `take`, whose first error ends the run. The times of
/// the script count from the start.
pub fn run<E>(
    plan: VehiclePlan,
    simulation: SimulationSettings,
    script: Vec<(Duration, SimulationRequest)>,
    length: Duration,
    mut take: impl FnMut(&VehicleOutput, MonoTime) -> Result<(), E>,
) -> Result<(), E> {
    let mut vehicle = SimulatedVehicle::new(plan, simulation, MonoTime::ZERO);
    for (at, request) in script {
        vehicle.schedule(MonoTime::ZERO.after(at), request);
    }
    let end = MonoTime::ZERO.after(length);
    let mut next = Some(MonoTime::ZERO);
    while let Some(now) = next.filter(|next| *next <= end) {
        vehicle.settle(now);
        while let Some(output) = vehicle.poll_output() {
            take(&output, now)?;
        }
        next = vehicle.next_deadline(now);
        debug_assert!(next.is_none_or(|next| next > now), "a deadline that does not move");
    }
    Ok(())
}
