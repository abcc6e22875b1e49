//! One CAN bus: its frames, its link, its controller and its condition.

pub mod bus;
pub mod bus_status;
pub mod controller;
pub mod error_frame;
pub mod frame;
pub mod input;
pub mod link;
pub mod mark;
pub mod note;
pub mod snapshot;
