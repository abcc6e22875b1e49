//! Lamps, stalks, buttons and several sources: from frames to published reports, through the whole
//! gateway and a profile as an integrator writes it.

pub(super) mod car;
mod conditions;
mod controls;
mod lamps;
mod refusals;
mod sources;
