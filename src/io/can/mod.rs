//! CAN buses and recordings of them.
