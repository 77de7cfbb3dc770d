//! Ctrl-C, and what else asks a process to end.
//!
//! Work that polls [`requested`] (the progress callback of a model is the place) returns an error, so that what it saved is named on the way
//! out. Whatever has not ended after 80 ms, or at a second signal, is ended here: what was being written is removed, a state that can be resumed
//! stays. Only work that saves its state once it is asked to, [`saves_first`], has the time that it needs. The exit code is 128 + the number of
//! the signal, as shells expect of a command ended by one: 130 for Ctrl-C (SIGINT), 143 for SIGTERM, 129 for SIGHUP. A SIGHUP that
//! `nohup` asked to be ignored is ignored.

use std::{
    io::Write,
    sync::atomic::{AtomicBool, AtomicU8, Ordering},
    time::Duration,
};

use super::output;

const SIGHUP: u8 = 1;
const SIGINT: u8 = 2;
const SIGTERM: u8 = 15;

/// How long the work may take to notice a signal.
const PATIENCE: Duration = Duration::from_millis(80);

/// The signal that asked; 0 before.
static REQUESTED: AtomicU8 = AtomicU8::new(0);

/// Whether the work saves its state once it is asked to end.
static SAVES: AtomicBool = AtomicBool::new(false);

/// Why a command ended early.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped by {}", name(REQUESTED.load(Ordering::Relaxed)))]
pub struct Interrupted;

fn name(signal: u8) -> &'static str {
    match signal {
        SIGHUP => "SIGHUP",
        SIGTERM => "SIGTERM",
        _ => "Ctrl-C",
    }
}

/// Whether the process was asked to stop.
pub fn requested() -> bool {
    REQUESTED.load(Ordering::Relaxed) != 0
}

/// Exit code of a run that was asked to stop; none of one that was not.
pub fn exit_code() -> Option<u8> {
    let signal = REQUESTED.load(Ordering::Relaxed);
    (signal != 0).then_some(128 + signal)
}

/// Takes back a Ctrl-C that ended a part of the work only, so that the rest is done; a second one asks again. False where another signal asked, or none.
pub fn taken_back() -> bool {
    REQUESTED.compare_exchange(SIGINT, 0, Ordering::SeqCst, Ordering::SeqCst).is_ok()
}

/// `Err(Interrupted)` once the process was asked to stop.
pub fn check() -> Result<(), Interrupted> {
    if requested() { Err(Interrupted) } else { Ok(()) }
}

/// Let the running work end at its own time, as it saves its state first.
pub fn saves_first() {
    SAVES.store(true, Ordering::Relaxed);
}

#[cfg_attr(not(any(unix, windows)), allow(dead_code, reason = "nothing asks a page"))]
fn ask(signal: u8) {
    if REQUESTED.swap(signal, Ordering::SeqCst) == 0 {
        if SAVES.load(Ordering::Relaxed) {
            return;
        }
        std::thread::sleep(PATIENCE);
        let Some(kept) = output::abandon(true) else { return };
        // Without a standard error there is nobody left to tell.
        let _ = write!(std::io::stderr().lock(), "{}error: {Interrupted}\n{kept}", output::line_cleared());
    } else {
        output::abandon(false);
    }
    std::process::exit(128 + i32::from(signal));
}

/// Start listening; called once by the frame.
#[cfg(unix)]
pub fn watch() -> std::io::Result<()> {
    let watched = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| *signal != SIGHUP || !ignored(SIGHUP));
    let mut signals = signal_hook::iterator::Signals::new(watched.map(i32::from))?;
    std::thread::Builder::new().name("signals".into()).spawn(move || {
        signals.forever().filter_map(|signal| u8::try_from(signal).ok()).for_each(ask);
    })?;
    Ok(())
}

/// Whether the parent process had a signal ignored, or that is unknown.
#[cfg(unix)]
fn ignored(signal: u8) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_none_or(|mask| mask >> (signal - 1) & 1 == 1)
}

/// Start listening; called once by the frame.
#[cfg(windows)]
pub fn watch() -> Result<(), ctrlc::Error> {
    ctrlc::set_handler(|| ask(SIGINT))
}

/// In a browser nothing asks: a page ends the worker that it runs in.
#[cfg(not(any(unix, windows)))]
pub fn watch() -> std::io::Result<()> {
    Ok(())
}
