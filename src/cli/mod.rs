//! The command line: arguments → checked plan → pipeline. No formulas here.

use std::process::ExitCode;

/// Run `granchain` with the process's own arguments.
#[must_use]
pub fn run() -> ExitCode {
    ExitCode::SUCCESS
}

/// Run `granchain SUBCOMMAND …` with the process's own arguments behind it.
#[must_use]
pub fn run_as_subcommand(subcommand: &str) -> ExitCode {
    let _ = subcommand;
    ExitCode::SUCCESS
}
