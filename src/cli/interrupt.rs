//! Ctrl-C: the first asks the running work to stop, the second stops the process.
//!
//! Long work polls [`requested`] (the progress callback of a model is the place) and returns an error, so that staged
//! output is removed on the way out and saved state is left whole. The exit code is then 130, as shells expect of a
//! command ended by SIGINT.

use std::sync::atomic::{AtomicBool, Ordering};

use super::output;

/// Exit code of a run stopped by Ctrl-C: 128 + SIGINT.
pub const EXIT_CODE: u8 = 130;

static REQUESTED: AtomicBool = AtomicBool::new(false);

/// Why a command ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped by Ctrl-C")]
pub struct Interrupted;

/// Whether Ctrl-C was pressed.
#[must_use]
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed)
}

/// `Err(Interrupted)` once Ctrl-C was pressed.
///
/// # Errors
/// [`Interrupted`].
pub fn check() -> Result<(), Interrupted> {
    if requested() { Err(Interrupted) } else { Ok(()) }
}

/// Start listening; called once by the frame.
///
/// # Errors
/// When the operating system refuses a handler.
pub fn watch() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| {
        if REQUESTED.swap(true, Ordering::SeqCst) {
            output::remove_staged();
            std::process::exit(i32::from(EXIT_CODE));
        }
    })
}
