//! `timing.json`: the only file that holds times and memory, so that all others are the same bytes on every machine.

use serde_json::{Map, Value, json};
use web_time::Instant;

pub const FILE: &str = "timing.json";

/// A clock that notes how long each stage took.
#[derive(Debug)]
pub struct Timing {
    started: Instant,
    last: Instant,
    stages: Map<String, Value>,
    breakdowns: Map<String, Value>,
    settings: Option<Value>,
}

impl Timing {
    pub fn start() -> Self {
        let now = Instant::now();
        Self { started: now, last: now, stages: Map::new(), breakdowns: Map::new(), settings: None }
    }

    /// The stage that ends now; its key gets the unit, `NAME_s`. Returns what it took, s.
    pub fn stage(&mut self, name: &str) -> f64 {
        let now = Instant::now();
        let seconds = (now - self.last).as_secs_f64();
        self.stages.insert(format!("{name}_s"), json!(seconds));
        self.last = now;
        seconds
    }

    /// Where the time of a stage went, by name and seconds.
    pub fn breakdown(&mut self, stage: &str, parts: &[(&'static str, f64)]) {
        let parts: Map<String, Value> =
            parts.iter().map(|(name, seconds)| (format!("{}_s", name.replace(' ', "_")), json!(seconds))).collect();
        self.breakdowns.insert(stage.to_owned(), Value::Object(parts));
    }

    /// What each of many settings took.
    pub fn settings(&mut self, settings: Value) {
        self.settings = Some(settings);
    }

    /// What goes into the file.
    pub fn to_json(&self) -> Vec<u8> {
        let mut timing = json!({
            "stages": self.stages,
            "total_s": self.started.elapsed().as_secs_f64(),
            "threads": rayon::current_num_threads(),
            "peak_memory_bytes": peak_memory(),
        });
        if !self.breakdowns.is_empty() {
            timing["breakdown"] = json!(self.breakdowns);
        }
        if let Some(settings) = &self.settings {
            timing["settings"] = settings.clone();
        }
        format!("{timing:#}\n").into_bytes()
    }
}

/// Largest resident memory of this process so far, bytes; only Linux tells without further libraries.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}
