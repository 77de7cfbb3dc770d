//! `granchain report`: what can be done with a finished report.

mod difference;
mod inputs;
mod verify;

use clap::{Args, Subcommand};

use super::{Outcome, arguments::Session};

/// Arguments of `granchain report`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain report verify calibrations/annulus-73khz")]
pub struct Arguments {
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// Derive every number of a calibration's folder anew, and name those that are others
    Verify(verify::Arguments),
}

/// Run it.
///
/// # Errors
/// When the folder, or what it was made from, cannot be read.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    match arguments.action {
        Action::Verify(verify) => verify::execute(&verify, &arguments.session),
    }
}
