//! CAN buses and recordings of them.
//!
//! | module | what it is |
//! |---|---|
//! | [`bus`] | the task that turns one interface into inputs, whatever becomes of the interface |
//! | `link` | what the kernel says of an interface, and when that may have changed |
//! | [`controller`] | what the kernel says of the controller below an interface |
//! | `socket` | one raw CAN socket: filters, buffer, stamps, batches |
//! | [`transmit`] | sending on that socket |
//! | `wire` | the kernel's structures, as bytes |
//! | [`log`] | recordings on disk, in any format, plain or gzip |
//! | [`candump`] | one line of a candump log |
//! | [`formats`] | the other formats, and how each is recognised |

pub mod bus;
pub mod candump;
pub mod controller;
pub mod formats;
mod link;
pub mod log;
mod socket;
pub mod transmit;
mod wire;
