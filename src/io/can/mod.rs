//! CAN buses and recordings of them.
//!
//! | module | contents |
//! |---|---|
//! | [`bus`] | the task that turns one interface into inputs |
//! | [`id_filter`] | the identifiers an interface is received for, changed while it is |
//! | [`interfaces`] | the CAN interfaces of the machine |
//! | `link` | the kernel's view of an interface, and its announcements of changes |
//! | [`controller`] | the kernel's view of the controller below an interface |
//! | `socket` | one raw CAN socket: filters, buffer, stamps, batches |
//! | [`transmit`] | sending on that socket |
//! | [`sender_lock`] | at most one process that sends commands on an interface |
//! | [`traffic`] | all frames of an interface, and the load of the bus |
//! | `wire` | the kernel's structures, as bytes |
//! | [`log`] | recordings on disk, in any format, plain or compressed |
//! | `lines` | their lines, in bounded memory |
//! | `compression` | gzip, xz and Zstandard, recognised by their first bytes |
//! | [`formats`] | the formats of recordings, and how each is recognised |

pub mod bus;
mod compression;
pub mod controller;
pub mod formats;
pub mod id_filter;
pub mod interfaces;
mod lines;
mod link;
pub mod log;
pub mod sender_lock;
mod socket;
pub mod traffic;
pub mod transmit;
mod wire;
