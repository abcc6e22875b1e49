//! Entry point of the `signal-gateway` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    signal_gateway::cli::main()
}
