//! The link between the gateway and its network side, a process or a thread: a socket pair with framed
//! messages.
//!
//! Neither side waits for the other: messages that cannot be written stay with their sender, where newer
//! orders replace them. The gateway trusts nothing that the network side sends; an invalid message is a
//! [`Violation`].

mod bytes;
pub mod confinement_report;
mod counts;
pub mod datagram;
mod frame;
mod layers;
mod message;
mod settings;
mod stream;
mod violation;

pub use counts::{LostLines, ZenohLinks};
pub use frame::FrameBuffer;
pub use layers::{Layer, Layers};
pub use message::{FromNetwork, MAX_SAMPLE, NetworkStatus, Order, Sample, ToNetwork};
pub use settings::{NetworkSettings, ReadTopic, WrittenTopic};
pub use stream::Link;
pub use violation::Violation;
