//! Data to be fitted: a record of a vibrometer or hydrophone.

use std::path::Path;

use super::{
    comparison::Comparison,
    drive::RecordedDrive,
    observation::{Observation, Recording},
    refusal::Refusal,
};
use granchain_model::scene::Scene;
use granchain_record::{Beginning, HornDrive, ReadOptions, Record, RecordKind, read_record};
use granchain_signal::{
    Series, about_running_mean,
    feature::{Measurand, Window, fingerprint::FeatureSet, line_amplitude},
    wander,
};

/// A waveform with its fingerprint.
#[derive(Debug, Clone)]
pub struct Measured {
    pub record: Record,
    /// Instrument model for simulated traces.
    pub recording: Recording,
    /// The record conditioned for the fit.
    pub observation: Observation,
}

impl Measured {
    /// Reads and checks a file for runs of `scene` under `drive`, if recorded; assumptions are added to `assumptions`.
    pub(crate) fn read(
        path: &Path,
        (quantity, set): (Measurand, FeatureSet),
        options: &ReadOptions,
        (scene, drive): (&Scene, Option<&RecordedDrive>),
        assumptions: &mut Vec<String>,
    ) -> Result<Self, Refusal> {
        let kind = match quantity {
            Measurand::Velocity => RecordKind::Vibrometer,
            Measurand::Pressure => RecordKind::Hydrophone,
        };
        let options = ReadOptions { drive_frequency: Some(scene.drive.frequency), ..options.clone() };
        Self::of(read_record(path, kind, &options)?, set, (scene, drive), assumptions)
    }

    /// Checks a vibrometer or hydrophone record that has been read.
    pub(crate) fn of(
        mut record: Record,
        set: FeatureSet,
        (scene, drive): (&Scene, Option<&RecordedDrive>),
        assumptions: &mut Vec<String>,
    ) -> Result<Self, Refusal> {
        record.check_sampling(scene.drive.frequency)?;
        record.check_plausible()?;
        if let Some(text) = without_tail(&mut record, scene) {
            record.assumptions.push(text);
        }
        let place = record.path.display();
        assumptions.extend(record.assumptions.iter().map(|text| format!("{place}: {text}")));
        let suspect = drive.and_then(|drive| {
            let HornDrive { drive_frequency, displacement, .. } = &drive.motion;
            swapped(&record, &drive.input.path, *drive_frequency, displacement)
        });
        record
            .warnings
            .splice(0..0, suspect.map(|why| format!("{why}: swap --measured and --drive if the files are swapped")));
        if record.kind == RecordKind::Vibrometer {
            refuse_other_drive(&record, (drive, scene.drive.frequency))?;
        }
        let begins_late = drive.is_some_and(|drive| matches!(drive.motion.begins, Beginning::Inside { .. }));
        let origin = drive.map_or(0.0, |drive| drive.motion.origin);
        let recording = Recording { origin, ..Recording::of(&record, begins_late) };
        let observation = Observation::new(&recording, &scene.drive, set)
            .map_err(|source| Refusal::Observation { path: record.path.clone(), source })?;
        Ok(Self { record, recording, observation })
    }

    /// The comparison of runs with it.
    pub(crate) fn comparison(&self) -> &Comparison {
        &self.observation.comparison
    }

    pub fn path(&self) -> &Path {
        &self.record.path
    }

    pub fn sha256(&self) -> &str {
        &self.record.sha256
    }

    /// Warnings about the record, and what is left out because of them.
    pub(crate) fn warnings(&self) -> Vec<String> {
        [self.record.warnings.clone(), self.observation.warnings.clone()].concat()
    }
}

/// Length of a record that is kept after its burst, in durations of the scene: the comparison ends with the burst.
const KEPT: f64 = 2.0;

/// Cuts the tail of a long record, which is not compared but would cost memory and time; returns a description.
fn without_tail(record: &mut Record, scene: &Scene) -> Option<String> {
    let burst = Window::of_trace(&record.series, scene.drive.frequency).ok()?;
    let last = burst.to.min(burst.from + scene.duration);
    let (until, end) = (last + KEPT * scene.duration, record.series.end());
    let kept = ((until - record.series.start) / record.series.step).ceil() as usize + 1;
    if kept >= record.series.len() {
        return None;
    }
    for values in [&mut record.series.values, &mut record.raw.values] {
        values.truncate(kept);
        values.shrink_to_fit();
    }
    Some(format!(
        "of the record, which goes on to {:.4} ms, what lies behind {:.4} ms is left out: nothing of it is compared",
        1e3 * end,
        1e3 * until
    ))
}

/// Largest denominator of a fraction of the drive frequency that counts as a line of the chain.
const DENOMINATOR: u32 = 4;
/// Largest distance of a line from those fractions and their multiples, over the drive frequency.
const OFF_FRACTION: f64 = 0.02;
/// Least amplitude of the drive's own lines, over the strongest line.
const OWN_SHARE: f64 = 0.25;

/// Multiples of a foreign drive's line whose leak is taken off a line of the drive.
const FOREIGN: [f64; 5] = [0.5, 1.0, 1.5, 2.0, 3.0];

/// Amplitude of a tone `bins` off a line under a Hann window, over its own.
fn leak(bins: f64) -> f64 {
    let x = std::f64::consts::PI * bins;
    let main = if x.abs() < 1e-6 { 1.0 } else { libm::sin(x) / x };
    if (bins.abs() - 1.0).abs() < 1e-6 { 0.5 } else { (main / (1.0 - bins * bins)).abs() }
}

/// Refuses a record whose strongest line does not belong to the drive and exceeds the drive's lines: it has another
/// drive. What a line of the drive has by leak from the strongest one, its half and its multiples is not its own.
fn refuse_other_drive(record: &Record, (drive, frequency): (Option<&RecordedDrive>, f64)) -> Result<(), Refusal> {
    let Ok(window) = Window::of_trace(&record.series, frequency) else { return Ok(()) };
    let Some(found) = record.strongest_line() else { return Ok(()) };
    let ratio = found / frequency;
    let off = |q: u32| (ratio - (ratio * f64::from(q)).round() / f64::from(q)).abs();
    // Half of what a short record resolves.
    let nearest = OFF_FRACTION.max(0.5 / (window.duration() * frequency));
    if (1..=DENOMINATOR).any(|q| off(q) < nearest) {
        return Ok(());
    }
    let amplitude = |f: f64| line_amplitude(&record.series, window, f);
    let lines = [1.0 / 3.0, 0.5, 2.0 / 3.0, 1.0, 1.5, 2.0];
    let foreign = FOREIGN.map(|multiple| (multiple * found, amplitude(multiple * found)));
    let own = |line: f64| {
        let leaked = foreign.map(|(at, amplitude)| amplitude * leak((line - at) * window.duration()));
        amplitude(line) - leaked.into_iter().fold(0.0, f64::max)
    };
    let own = lines.into_iter().map(|line| own(line * frequency)).fold(0.0, f64::max);
    let share = own / amplitude(found).max(f64::MIN_POSITIVE);
    if share < OWN_SHARE {
        let drive = drive.map(|drive| drive.input.path.clone());
        return Err(Refusal::OtherDrive { path: record.path.clone(), drive, frequency, found, share });
    }
    Ok(())
}

/// Least share of a horn's velocity at the drive frequency.
const PURE: f64 = 0.9;
/// Largest such share of a driven bead.
const STRUCK: f64 = 0.8;
/// Least displacement of a bead pushed into its support, over the remaining amplitude; a horn returns.
const MOVED_ON: f64 = 0.5;

/// Why the two files may be swapped: the horn's displacement `x` (m, read from `path`) looks like a bead's and the record of the bead like a horn's.
/// `frequency`: of the drive, Hz.
pub fn swapped(record: &Record, path: &Path, frequency: f64, x: &Series) -> Option<String> {
    let share = |series: &Series| {
        let window = Window::of_trace(series, frequency).ok()?;
        let samples = &series.values[window.indices(series)];
        let mean = samples.iter().sum::<f64>() / samples.len() as f64;
        let square = samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / samples.len() as f64;
        // A burst that still grows is a little more than its mean line.
        Some((0.5 * line_amplitude(series, window, frequency).powi(2) / square).min(1.0))
    };
    let rates = x.values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let (horn, bead) = (share(&Series::new(x.start, x.step, rates))?, share(&record.series)?);
    let period = (1.0 / (frequency * x.step)).round() as usize;
    let left = about_running_mean(&x.values, period);
    let moved_on = wander(&x.values, period) / left.iter().fold(f64::MIN_POSITIVE, |most, x| most.max(x.abs()));
    (bead > PURE && (horn < STRUCK || moved_on > MOVED_ON)).then(|| {
        format!(
            "{:.0} % of its motion is at {:.4} kHz as a horn's is; of what is said to be the horn's ({}) {:.0} %, and it moves on by {:.0} % of its \
             amplitude as a struck bead does",
            100.0 * bead,
            frequency * 1e-3,
            path.display(),
            100.0 * horn,
            100.0 * moved_on
        )
    })
}

#[cfg(test)]
mod tests {
    use std::fmt::Write as _;

    use super::*;
    use granchain_model::scene::load;

    /// A line at 0.29 of the drive: another drive's in a long record, that at 1/3 in one of eight periods, which cannot tell them apart.
    #[test]
    fn a_line_is_anothers_only_where_the_record_is_long_enough_to_tell() {
        let frequency = 73e3;
        let refused = |cycles: usize| {
            let mut text = String::from("time_s,velocity_m_per_s\n");
            for sample in 0..40 * cycles {
                let t = sample as f64 / (40.0 * frequency);
                let line = |ratio: f64| (std::f64::consts::TAU * ratio * frequency * t).sin();
                writeln!(text, "{t:.10},{:.9}", 0.1 * line(0.29) + 1e-3 * line(1.0)).unwrap();
            }
            let path = Path::new("vib.csv");
            let options = ReadOptions { drive_frequency: Some(frequency), ..ReadOptions::default() };
            let record =
                granchain_record::read_record_bytes(path, text.as_bytes(), Some(RecordKind::Vibrometer), &options);
            refuse_other_drive(&record.unwrap(), (None, frequency)).is_err()
        };
        assert!(refused(60) && !refused(8));
    }

    #[test]
    fn a_record_sampled_far_above_all_that_is_compared_is_averaged_down_and_has_the_same_features() {
        let scene = load("annulus", &["model.kind=chain".to_owned()]).unwrap();
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../measurements/twin-annulus/vib.csv");
        let record = read_record(&shipped, RecordKind::Vibrometer, &ReadOptions::default()).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("fast.csv");
        // 40 times the samples, on lines between the record's own.
        let mut text = String::from("time_s,velocity_m_per_s\n");
        for i in 0..40 * (record.raw.len() - 1) {
            let (whole, part) = (i / 40, (i % 40) as f64 / 40.0);
            let value = (1.0 - part) * record.raw.values[whole] + part * record.raw.values[whole + 1];
            writeln!(text, "{:.11},{value:.9}", record.raw.start + i as f64 * record.raw.step / 40.0).unwrap();
        }
        std::fs::write(&path, text).unwrap();
        let measured = |path: &Path| {
            let read = (Measurand::Velocity, FeatureSet::Full);
            Measured::read(path, read, &ReadOptions::default(), (&scene, None), &mut Vec::new()).unwrap()
        };
        let (own, fast) = (measured(&shipped), measured(&path));
        assert!(fast.record.series.len() > 100_000 && fast.recording.signal.len() < 20_000);
        // Less noise has an earlier onset: what is measured in the ring-up, and faint lines, are others.
        let strong = ["positive_peak", "negative_peak", "band_1/3", "band_2/3", "band_1", "band_2"];
        let names = own.observation.fingerprint.names();
        let both = own.observation.comparison.features.iter().zip(&fast.observation.comparison.features);
        for (name, (a, b)) in names.iter().zip(both).filter(|(name, _)| strong.contains(&&***name)) {
            assert!((a - b).abs() < 0.02, "{name}: {a} {b}");
        }
        assert!((fast.recording.noise_rms / own.recording.noise_rms - 0.8).abs() < 0.2);
    }

    #[test]
    fn what_a_long_memory_holds_behind_the_motion_changes_no_feature() {
        let scene = load("annulus", &["model.kind=chain".to_owned()]).unwrap();
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../measurements/twin-annulus/vib.csv");
        let mut text = std::fs::read_to_string(&shipped).unwrap();
        let folder = tempfile::tempdir().unwrap();
        let measured = |path: &Path| {
            let mut assumptions = Vec::new();
            let compared = (Measurand::Velocity, FeatureSet::Full);
            let read = Measured::read(path, compared, &ReadOptions::default(), (&scene, None), &mut assumptions);
            (read.unwrap(), assumptions)
        };
        let (short, assumed) = measured(&shipped);
        assert!(!assumed.iter().any(|text| text.contains("is left out")), "{assumed:?}");
        // 20 ms behind the 0.8 ms of the record, at the value it ends with.
        for i in 1..=100_000 {
            writeln!(text, "{:.4},4.000", 800.0 + 0.2 * f64::from(i)).unwrap();
        }
        let path = folder.path().join("vib.csv");
        std::fs::write(&path, text).unwrap();
        let (long, assumed) = measured(&path);
        assert!(assumed.iter().any(|text| text.contains("goes on to 20.8000 ms")), "{assumed:?}");
        assert!(long.record.series.len() < 4 * short.record.series.len(), "{}", long.record.series.len());
        assert_eq!(long.record.series.len(), long.record.raw.len());
        for (a, b) in short.observation.comparison.features.iter().zip(&long.observation.comparison.features) {
            assert!((a - b).abs() < 1e-9 * a.abs(), "{a:e} {b:e}");
        }
    }
}
