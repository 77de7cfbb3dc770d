//! One run, and what it costs on one thread.

use std::time::Instant;

use serde::{Deserialize, Serialize};

use super::{AccuracyError, ladder::Setting};
use granchain_calibration::predict::replicates::Watch;
use granchain_model::{
    self as model, Estimate, ModelError,
    fea::{Control, Simulation},
    response::Response,
    scene::{self, Limits, ModelKind, Scene},
};

/// Steps of the finite element analysis between two looks at whether to stop.
const STEPS_PER_LOOK: u64 = 50;

/// Seconds of one thread, and how often they were measured.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Least of all repetitions, s.
    pub least: f64,
    /// Median of all repetitions, s.
    pub median: f64,
    pub repetitions: u32,
}

impl Seconds {
    fn of(mut times: Vec<f64>) -> Self {
        times.sort_by(f64::total_cmp);
        let (count, middle) = (times.len(), times.len() / 2);
        let median = match times[..] {
            [] => 0.0,
            _ if count.is_multiple_of(2) => 0.5 * (times[middle - 1] + times[middle]),
            _ => times[middle],
        };
        Self { least: times.first().copied().unwrap_or(0.0), median, repetitions: count as u32 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Meshing, factoring, modes, fits: once for any number of runs.
    pub setup_s: Seconds,
    pub run_s: Seconds,
    /// Largest resident memory of the program meanwhile, bytes; none where the system does not tell.
    pub peak_memory_bytes: Option<u64>,
}

impl Cost {
    /// Bodies made and one run, least of each, s.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.setup_s.least + self.run_s.least
    }
}

/// Where scenes of the ladder come from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Source<'a> {
    pub name: &'a str,
    /// Overrides of the caller, under those of the settings.
    pub sets: &'a [String],
    /// What a run may ask for.
    pub limits: Limits,
}

impl Source<'_> {
    /// The scene at a setting, with more overrides.
    pub fn scene(&self, setting: &Setting, more: &[String]) -> Result<Scene, AccuracyError> {
        let sets: Vec<String> = self.sets.iter().chain(&setting.sets).chain(more).cloned().collect();
        Ok(scene::load(self.name, &sets)?.with_limits(self.limits))
    }
}

/// One run of a scene, its bodies made again.
pub(super) fn once(scene: &Scene, watch: &dyn Watch) -> Result<(Response, f64, f64), ModelError> {
    Estimate::of(scene).check(&scene.model.limits)?;
    let clock = Clock::start();
    let started = clock.seconds();
    let stopped = || ModelError::Stopped { time: 0.0 };
    if scene.model.kind == ModelKind::Fea {
        let mut simulation = Simulation::new(scene, Control::default())?;
        let ready = clock.seconds();
        let mut steps = 0_u64;
        while !simulation.is_done() {
            simulation.advance()?;
            steps += 1;
            if steps.is_multiple_of(STEPS_PER_LOOK) && watch.stop() {
                return Err(stopped());
            }
        }
        let response = simulation.response();
        return Ok((response, ready - started, clock.seconds() - ready));
    }
    let prepared = model::prepare(scene)?;
    let ready = clock.seconds();
    if watch.stop() {
        return Err(stopped());
    }
    let response = prepared.run(scene, &mut |_| !watch.stop())?;
    Ok((response, ready - started, clock.seconds() - ready))
}

/// Times a run of this length (s, bodies and run) is repeated.
fn repetitions(seconds: f64) -> u32 {
    match seconds {
        ..0.05 => 9,
        ..0.5 => 5,
        ..2.0 => 3,
        _ => 2,
    }
}

/// The same run several times: what came out, the same each time, and what it took.
pub(super) fn repeated(scene: &Scene, watch: &dyn Watch) -> Result<(Response, Cost), ModelError> {
    let counted = reset_peak_memory();
    let (response, setup, run) = once(scene, watch)?;
    let (mut setups, mut runs) = (vec![setup], vec![run]);
    for _ in 1..repetitions(setup + run) {
        let (_, setup, run) = once(scene, watch)?;
        setups.push(setup);
        runs.push(run);
    }
    let peak_memory_bytes = peak_memory().filter(|_| counted);
    Ok((response, Cost { setup_s: Seconds::of(setups), run_s: Seconds::of(runs), peak_memory_bytes }))
}

/// Processor time of this thread where the system tells it (Linux), which other programs on the machine do not lengthen; else the time that
/// passes.
pub(super) struct Clock(Instant);

impl Clock {
    pub fn start() -> Self {
        Self(Instant::now())
    }

    pub fn seconds(&self) -> f64 {
        // The kernel adds up a thread's time when it leaves the processor.
        std::thread::yield_now();
        let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat")
            .ok()
            .and_then(|line| line.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()));
        nanoseconds.map_or_else(|| self.0.elapsed().as_secs_f64(), |nanoseconds| 1e-9 * nanoseconds)
    }
}

/// Whether times are of the processor.
#[must_use]
pub fn is_processor_time() -> bool {
    std::path::Path::new("/proc/thread-self/schedstat").is_file()
}

/// Begin to count the largest resident memory again; whether the system can.
fn reset_peak_memory() -> bool {
    std::fs::write("/proc/self/clear_refs", "5").is_ok()
}

/// Largest resident memory since then, bytes.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}

/// What the processor calls itself.
#[must_use]
pub fn processor() -> String {
    let text = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_calibration::predict::replicates::Unwatched;

    #[test]
    fn least_and_median_of_repetitions() {
        let seconds = Seconds::of(vec![3.0, 1.0, 2.0, 10.0]);
        assert_eq!(seconds, Seconds { least: 1.0, median: 2.5, repetitions: 4 });
    }

    #[test]
    fn the_clock_counts_the_work_of_its_own_thread() {
        let clock = Clock::start();
        let begun = clock.seconds();
        let mut sum = 0.0_f64;
        while clock.0.elapsed().as_millis() < 30 {
            sum += std::hint::black_box(1.0);
        }
        let worked = clock.seconds() - begun;
        assert!(sum > 0.0 && worked > 1e-3 && worked < 0.5, "{worked}");
    }

    #[test]
    fn a_run_repeated_is_the_run() {
        let scene = scene::load("rigid", &["model.kind=chain".into(), "duration=5 us".into()]).unwrap();
        let (response, cost) = repeated(&scene, &Unwatched).unwrap();
        assert_eq!(response, model::run(&scene, &mut |_| true).unwrap());
        assert!(cost.run_s.repetitions >= 2 && cost.run_s.median >= cost.run_s.least && cost.run_s.least > 0.0);
    }
}
