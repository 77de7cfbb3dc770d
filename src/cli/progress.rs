//! Progress bars with the time left, on a terminal only.

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle};

use super::{arguments::Session, interrupt};
use crate::study::replicates::Watch;

/// A bar that counts what a study has done; Ctrl-C stops the study.
pub struct Bar(pub ProgressBar);

impl Watch for Bar {
    fn advance(&self, done: u64) {
        self.0.inc(done);
    }

    fn stop(&self) -> bool {
        interrupt::requested()
    }
}

/// A bar over `length` pieces of work, on standard error; invisible with `--quiet` or when the output is not a terminal.
pub fn bar(session: &Session, length: u64, what: &'static str) -> ProgressBar {
    styled(session, length, what, "{msg} [{bar:40}] {pos}/{len}, {left}")
}

/// A bar over pieces of work of unequal cost, `length` in all.
pub fn work(session: &Session, length: u64, what: &'static str) -> ProgressBar {
    styled(session, length, what, "{msg} [{bar:40}] {percent} %, {left}")
}

/// A bar over simulated time; advance it with [`advance_to`].
pub fn simulated_time(session: &Session, what: &'static str) -> ProgressBar {
    styled(session, PER_MILLE, what, "{msg} [{bar:40}] {percent} %, {left}")
}

/// Move a bar of [`simulated_time`] to the fraction `time`/`duration`.
pub fn advance_to(bar: &ProgressBar, time: f64, duration: f64) {
    bar.set_position((time / duration * PER_MILLE as f64).clamp(0.0, PER_MILLE as f64) as u64);
}

const PER_MILLE: u64 = 1000;

fn styled(session: &Session, length: u64, what: &'static str, template: &str) -> ProgressBar {
    if session.quiet {
        return ProgressBar::hidden();
    }
    // The stderr target hides itself when standard error is no terminal.
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr()).with_message(what);
    match ProgressStyle::with_template(template) {
        Ok(style) => bar.with_style(style.with_key("left", left).progress_chars("=> ")),
        Err(_) => bar,
    }
}

/// The time left; before anything is done nobody knows it.
fn left(state: &ProgressState, out: &mut dyn std::fmt::Write) {
    // A bar that cannot be written shows less.
    let _ = match state.pos() {
        0 => write!(out, "time left not known yet"),
        _ => write!(out, "{:#} left", HumanDuration(state.eta())),
    };
}
