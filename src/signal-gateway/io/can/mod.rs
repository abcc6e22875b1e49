//! CAN buses.

pub mod bus;
pub mod controller;
pub mod id_filter;
pub mod interface_settings;
pub mod interfaces;
mod link;
pub mod sender_lock;
mod socket;
pub mod traffic;
pub mod transmit;
mod wire;

pub use socket::check_can_sockets;
