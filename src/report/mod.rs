//! What came out, written down: as text for people, as JSON for programs, as a chart.

pub mod chart;
pub mod decision;
pub mod gateway;
pub mod vehicle;
pub mod view;
