//! Foundation of every flow of the gateway: two kinds of time, diagnostic statuses, and names of variants.
//!
//! [`time::MonoTime`] decides ages and timeouts, [`time::WallStamp`] is only copied into messages. A
//! [`diagnostics::Status`] consists of message rows that a flow lists with [`messages!`]; the documents show
//! the same list.
//!
//! ```
//! use std::time::Duration;
//!
//! use gateway_base::time::MonoTime;
//!
//! let (received, now) = (MonoTime::from_millis(1_000), MonoTime::from_millis(1_250));
//! assert_eq!(now.since(received), Duration::from_millis(250));
//! assert!(now.is_within(Duration::from_millis(500), received));
//! ```
//!
//! All other crates of the workspace depend on this crate; it depends on none of them.

pub mod diagnostics;
pub mod names;
pub mod near_miss;
pub mod time;
