//! `timing.json`: the only file that holds times and memory, so that all others are the same bytes on every machine.

use std::time::Instant;

use serde_json::{Map, Value, json};

use crate::measurement::sha256;

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

    /// What goes into the file, with the digest of all of it: times come out otherwise every time, so nothing else can show that one was
    /// altered.
    pub fn to_json(&self) -> Vec<u8> {
        let mut timing = self.value();
        timing[SEAL] = seal(&timing).into();
        format!("{timing:#}\n").into_bytes()
    }

    fn value(&self) -> Value {
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
        timing
    }
}

const SEAL: &str = "sha256";

/// SHA-256 of a value as it is written, hexadecimal.
fn seal(value: &Value) -> String {
    sha256(format!("{value:#}\n").as_bytes())
}

/// Whether the file is as it was written; `None` where it holds no digest of itself.
pub fn is_as_sealed(bytes: &[u8]) -> Option<bool> {
    let text = String::from_utf8_lossy(bytes);
    let mut timing: Value = serde_json::from_str(&text).ok()?;
    let whole = format!("{timing:#}\n");
    let stored = timing.as_object_mut()?.remove(SEAL)?;
    Some(whole == text && stored.as_str() == Some(&seal(&timing)))
}

/// Largest resident memory of this process so far, bytes; only Linux tells without further libraries.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_digit_of_a_sealed_file_cannot_be_altered_unseen() {
        let mut timing = Timing::start();
        timing.stage("read");
        let text = String::from_utf8(timing.to_json()).unwrap();
        assert_eq!(is_as_sealed(text.as_bytes()), Some(true));
        for (at, digit) in text.bytes().enumerate().filter(|(_, byte)| byte.is_ascii_digit()) {
            let mut altered = text.clone().into_bytes();
            altered[at] = if digit == b'7' { b'3' } else { b'7' };
            assert_ne!(is_as_sealed(&altered), Some(true), "byte {at} of {text}");
        }
        assert_eq!(is_as_sealed(format!("{:#}\n", timing.value()).as_bytes()), None);
    }
}
