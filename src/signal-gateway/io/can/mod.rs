//! CAN buses and recordings of them.

pub(super) mod bag_folder;
pub mod bus;
mod compression;
pub mod controller;
mod counted_source;
mod exact;
pub mod formats;
pub mod id_filter;
pub mod interface_settings;
pub mod interfaces;
mod lines;
mod link;
pub mod log;
pub mod sender_lock;
mod socket;
pub mod traffic;
pub mod transmit;
mod wire;

pub use socket::check_can_sockets;
