//! Snapshots of the gateway for clients: a feed from the gateway's loop, a socket that serves it, and the
//! places of such sockets.
//!
//! A separate thread serves the clients. The gateway's loop only takes a snapshot for them, at most once per
//! [`feed::MIN_INTERVAL`], regardless of their number and behaviour.

pub mod client;
pub mod feed;
pub mod places;
pub mod socket;
