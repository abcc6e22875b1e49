//! One CAN bus: frames, link, controller and condition.

pub mod bit_rate_scan;
pub mod bus;
pub mod bus_status;
pub mod bus_survey;
pub mod catalogue;
pub mod controller;
pub mod error_frame;
pub mod frame;
pub mod id_match;
pub mod input;
pub mod interface_state;
pub mod link;
pub mod mark;
pub mod note;
pub mod snapshot;

pub use bus::{Bus, BusFinding, BusReception, BusSettings, ReceiveTime};
pub use bus_status::link_message;
pub use bus_status::link_text;
pub use controller::ControllerReport;
pub use error_frame::{ControllerState, ErrorCounters, ErrorFrame};
pub use frame::{CanId, Frame, FrameFormat, MAX_DATA};
pub use id_match::{IdMask, IdMatch, IdTable, SourceAddresses, source_address};
pub use input::CanInput;
pub use link::{BusIndex, LinkState};
pub use mark::DriverMark;
pub use note::LogNote;
pub use snapshot::{BusSnapshot, TrafficSnapshot};
