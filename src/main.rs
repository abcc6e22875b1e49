//! The `signal-gateway` command.

fn main() {}
