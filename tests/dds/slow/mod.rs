//! Tests that take longer than a quick run may: leases of real length, and all drives.

mod drives;
mod outage;
