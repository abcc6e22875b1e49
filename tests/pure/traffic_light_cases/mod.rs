//! The cases of docs/spec/traffic-lights.md, "Labels of test cases", by their numbers, and
//! their neighbours.

mod arbiter;
mod clock;
mod inputs;
mod map;
mod messages;
mod model;
mod names;
mod received;
mod scenario;
pub(super) mod scene;
mod stores;
mod storyboard;
mod timelines;
mod unit;
