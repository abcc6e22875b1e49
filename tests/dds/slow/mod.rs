//! What takes longer than a quick run may: leases as they really are, and all drives.

mod drives;
mod outage;
