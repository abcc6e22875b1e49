//! The services of the node: for its parameters, which are read-only, and for the layout of the doors.
//!
//! [`NodeService::answer`] builds the response to a request; [`Call`] extracts request and client from a
//! sample in the format of the client's middleware. Requests may come from any node: nothing in them is
//! trusted.

mod call;
mod parameter_set;
mod service;
mod value;

pub use call::{Call, Middleware};
pub use parameter_set::Parameters;
pub use service::{DoorLayouts, MAX_REQUEST, MAX_RESPONSE, NodeService, ServiceContents};
pub use value::ParameterValue;
