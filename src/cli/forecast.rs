//! Remaining time of a run, printed once for people who see no progress bar, from the time of its first part.

use std::{
    sync::{Mutex, PoisonError},
    time::Duration,
};

use web_time::Instant;

use super::arguments::Session;

/// Before a forecast rests on enough.
const AFTER: Duration = Duration::from_secs(2);
/// What is over sooner is not worth a word.
const WORTH: Duration = Duration::from_secs(5);

/// Watches the share of a run that is done.
pub struct Forecast {
    session: Session,
    what: &'static str,
    state: Mutex<State>,
}

#[derive(Clone, Copy)]
enum State {
    New,
    /// Since when, and what was done then: a run that is taken up begins in its middle.
    Waiting(Instant, f64),
    Said,
}

impl Forecast {
    /// Of what is about to begin, such as `the run`.
    pub fn new(session: &Session, what: &'static str) -> Self {
        Self { session: session.clone(), what, state: Mutex::new(State::New) }
    }

    /// Told of the share done, 0 to 1; first at the beginning.
    pub fn at(&self, share: f64) {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        match *state {
            State::New => *state = State::Waiting(Instant::now(), share),
            State::Waiting(since, begun) => {
                let left = 1.0 - begun;
                if let Some(whole) = whole(since.elapsed(), (share - begun) / left) {
                    *state = State::Said;
                    self.session.note(format_args!("{} takes about {}", self.what, rough_time(whole)));
                }
            }
            State::Said => {}
        }
    }
}

/// What the whole takes where `share` of it took this long; none where too little is known, or where it is soon over.
fn whole(elapsed: Duration, share: f64) -> Option<Duration> {
    let known = elapsed >= AFTER && share > 0.0 && share < 1.0;
    known.then(|| elapsed.div_f64(share)).filter(|whole| *whole >= WORTH)
}

/// A time as one says it.
pub fn rough_time(time: Duration) -> String {
    let seconds = time.as_secs_f64();
    if seconds < 90.0 { format!("{:.0} s", seconds.max(1.0).round()) } else { format!("{:.0} min", seconds / 60.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_forecast_waits_until_it_knows_and_is_silent_on_short_runs() {
        let seconds = Duration::from_secs;
        assert_eq!(whole(seconds(1), 0.01), None);
        assert_eq!(whole(seconds(3), 0.0), None);
        assert_eq!(whole(seconds(3), 0.9), None);
        assert_eq!(whole(seconds(3), 0.1), Some(seconds(30)));
        assert_eq!([rough_time(seconds(30)), rough_time(seconds(600))], ["30 s", "10 min"]);
    }
}
