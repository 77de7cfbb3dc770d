//! `granchain twins`.

use clap::Args;

use super::{Outcome, arguments::Session};

/// Arguments of `granchain twins`.
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
    anyhow::bail!("`granchain twins` is not built yet")
}
