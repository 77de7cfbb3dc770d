//! One run of a scene on one thread, and what it takes.

use web_time::Instant;

use crate::{engine::trace, predict::replicates::Watch};
use granchain_model::{ModelError, Prepared, prepare_with, reduced::Cache, scene::Scene};
use granchain_signal::{Series, feature::Measurand};

/// A run is repeated until it has taken this time (s) in all, or so many times.
const REPEATED: (f64, usize) = (0.05, 3);

/// Seconds of one thread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seconds {
    /// Least of the repetitions.
    pub least: f64,
    /// Largest less least, over the least, 1: differences below it are noise.
    pub spread: f64,
}

/// Processor time of this thread, s, where the system tells it (Linux), which other programs on the machine do not lengthen; else the time that passes.
pub(super) struct Clock {
    started: Instant,
    before: Option<f64>,
}

/// Below this time (s) the system's account of a thread, kept to a tick, is the worse clock.
const SHORT: f64 = 0.01;

impl Clock {
    pub fn start() -> Self {
        Self { before: processor_time(), started: Instant::now() }
    }

    pub fn seconds(&self) -> f64 {
        let elapsed = self.started.elapsed().as_secs_f64();
        let counted = processor_time().zip(self.before).map(|(now, before)| now - before);
        counted.filter(|time| elapsed > SHORT && *time > SHORT).unwrap_or(elapsed)
    }
}

/// The first number of `schedstat`, in ns, is the time on the processor. The kernel adds it up when a thread leaves the processor.
fn processor_time() -> Option<f64> {
    std::thread::yield_now();
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    text.split_whitespace().next()?.parse::<f64>().ok().map(|nanoseconds| 1e-9 * nanoseconds)
}

/// The bodies of a scene, and the seconds that making them took.
pub(super) fn bodies(scene: &Scene, cache: Option<&Cache>) -> Result<(Prepared, f64), ModelError> {
    let clock = Clock::start();
    let prepared = prepare_with(scene, cache)?;
    Ok((prepared, clock.seconds()))
}

/// A run repeated: what came out, the same each time, and what it took.
pub(super) fn repeated(
    prepared: &Prepared,
    scene: &Scene,
    measurand: Measurand,
    watch: &dyn Watch,
) -> Result<(Series, Seconds), ModelError> {
    let mut times: Vec<f64> = Vec::new();
    loop {
        let clock = Clock::start();
        let response = prepared.run(scene, &mut |_| !watch.stop())?;
        times.push(clock.seconds());
        if times.len() == REPEATED.1 || times.iter().sum::<f64>() > REPEATED.0 {
            let least = times.iter().copied().fold(f64::INFINITY, f64::min);
            let spread = times.iter().fold(0.0, |most, time| f64::max(most, time / least - 1.0));
            return Ok((trace(response, measurand)?, Seconds { least, spread }));
        }
    }
}

/// What is timed runs on one thread, whatever the program was given.
pub(super) fn on_one_thread<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(work),
        Err(_) => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleeping_is_no_work_where_the_system_tells() {
        let clock = Clock::start();
        let mut sum = 0.0_f64;
        while clock.started.elapsed().as_millis() < 30 {
            sum += std::hint::black_box(1.0);
        }
        let worked = clock.seconds();
        std::thread::sleep(std::time::Duration::from_millis(200));
        let is_idle = processor_time().is_none() || clock.seconds() < 0.15;
        assert!(sum > 0.0 && worked > 1e-3 && is_idle, "{worked} {}", clock.seconds());
    }
}
