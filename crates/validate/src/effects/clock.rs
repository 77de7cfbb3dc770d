//! How long a computation on this thread took.

use std::{fs, time::Instant};

/// Above this time (s) the system's account of a thread, kept to a tick or so, is the better clock.
const LONG: f64 = 0.01;

/// A clock that other work on the machine does not run on: processor time of this thread, as Linux accounts for it; for short spans, and on
/// other systems, the clock on the wall.
pub(super) struct Clock {
    wall: Instant,
    processor: Option<f64>,
}

impl Clock {
    pub(super) fn start() -> Self {
        Self { wall: Instant::now(), processor: processor_time() }
    }

    /// Time since the start, s.
    pub(super) fn elapsed(&self) -> f64 {
        let wall = self.wall.elapsed().as_secs_f64();
        let processor = processor_time().zip(self.processor).map(|(now, then)| now - then);
        processor.filter(|time| *time > LONG).unwrap_or(wall)
    }
}

/// Processor time of this thread so far, s: the first number of `schedstat`, in ns.
fn processor_time() -> Option<f64> {
    let text = fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(1e-9 * nanoseconds)
}

#[cfg(test)]
mod tests {
    use std::{thread, time::Duration};

    use super::*;

    #[test]
    fn sleeping_is_no_work_where_the_system_tells() {
        let clock = Clock::start();
        thread::sleep(Duration::from_millis(120));
        let short = clock.elapsed();
        let busy = Clock::start();
        let mut sum = 0.0_f64;
        while busy.wall.elapsed() < Duration::from_millis(10)
            || processor_time().is_some_and(|t| t - busy.processor.unwrap() < 0.1)
        {
            sum = (sum + 1.0).sqrt();
        }
        let found = busy.elapsed();
        assert!(sum > 0.0 && short >= 0.12, "{short}");
        assert!(busy.processor.is_none() || (0.09..0.2).contains(&found), "{found}");
    }
}
