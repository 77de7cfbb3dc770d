//! `granchain calibrate`.

use clap::Args;

use super::{Outcome, arguments::Session};

/// Arguments of `granchain calibrate`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// Run it.
///
/// # Errors
/// Not built yet.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let _ = arguments;
    anyhow::bail!("`granchain calibrate` is not built yet")
}
