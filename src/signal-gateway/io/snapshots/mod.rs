//! Snapshots of the gateway for whoever watches it: a feed out of the gateway's loop, and a socket that
//! serves it.
//!
//! Clients are served by a thread of their own. All that the gateway's loop does for them is to take a
//! snapshot, at most once in [`feed::MIN_INTERVAL`], however many clients there are and whatever they do.

pub mod client;
pub mod feed;
pub mod socket;
