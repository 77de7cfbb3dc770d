//! Recorded drive: a horn-tip record, and how it enters a scene.

use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use thiserror::Error;

use granchain_model::scene::Scene;
use granchain_record::{
    Baseline, Ending, HornDrive, Masked, MeasurementError, ReadOptions, Record, RecordKind, Remainder,
    read_back::{LARGE, read_back},
    read_record, read_record_bytes, sha256,
};
use granchain_signal::Series;

/// File name of a drive record that is looked for beside a record.
pub const BESIDE: &str = "horn_tip.csv";

/// Realisations of the horn's noise that runs mix.
const SHAKES: usize = 4;

const SHAKEN: u64 = 0x5AC3;

/// Residual drive noise below which runs do not draw it, over the peak: a tenth of the gap scale for a drive of 1 µm.
const FELT: f64 = 3e-5;

/// Cycles of a drive that a fit simulates and compares: what follows is steady, or parts from run to run.
const MOST_CYCLES: f64 = 400.0;

/// Cycles of motion that are kept beyond the last one compared.
const FOLLOWED: f64 = 10.0;

/// An input file of a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Input {
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// Why a file cannot be digested.
#[derive(Debug, Error)]
#[error("{}: cannot be read", path.display())]
pub struct InputError {
    pub path: PathBuf,
    pub source: std::io::Error,
}

impl Input {
    /// Reads and digests the file.
    pub fn digest(path: PathBuf) -> Result<Self, InputError> {
        match read_back(&path, LARGE) {
            Ok(bytes) => Ok(Self { path, sha256: sha256(&bytes) }),
            Err(source) => Err(InputError { path, source }),
        }
    }
}

/// The horn-tip record in the folder of a record, if there is one.
pub(crate) fn beside(measured: &Path) -> Option<PathBuf> {
    let beside = measured.with_file_name(BESIDE);
    (beside.is_file() && beside != measured).then_some(beside)
}

/// A horn-tip record as a drive.
#[derive(Debug, Clone)]
pub struct RecordedDrive {
    pub input: Input,
    pub options: ReadOptions,
    /// The piston motion derived from it.
    pub motion: HornDrive,
    /// Realisations of the residual noise, m.
    shakes: Vec<Series>,
    /// Standard error of the horn's baseline, m, if known.
    pub baseline_error: Option<f64>,
    /// Bandwidth of its vibrometer, Hz, if stated.
    pub bandwidth: Option<f64>,
    pub masked: Vec<Masked>,
    /// Assumptions made while reading, as text.
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
}

impl RecordedDrive {
    /// Reads a horn tip for a fit. The baseline is the mean of the plateau, or of the first samples if the burst has
    /// no plateau: an error in the baseline acts like a gap to the chain, and the plateau's mean is far more accurate.
    pub fn read_at_plateau(path: &Path, options: &ReadOptions) -> Result<Self, MeasurementError> {
        at_plateau(options, |options| Self::read(path, options))
    }

    /// The same from the bytes of a file; the plateau is used only if no other baseline is requested.
    pub fn of_bytes_at_plateau(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Self, MeasurementError> {
        let read = |options: &ReadOptions| {
            let drive = Self::of(read_record_bytes(path, bytes, Some(RecordKind::HornTip), options)?)?;
            Ok(Self { options: options.clone(), ..drive })
        };
        if options.baseline == Baseline::Auto { at_plateau(options, read) } else { read(options) }
    }

    /// Read a horn tip.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, MeasurementError> {
        let drive = Self::of(read_record(path, RecordKind::HornTip, options)?)?;
        Ok(Self { options: options.clone(), ..drive })
    }

    /// Uses a horn-tip record that has been read.
    pub fn of(record: Record) -> Result<Self, MeasurementError> {
        record.check_plausible()?;
        let motion = record.to_drive()?;
        let frequency = format!("drive frequency {:.4} kHz; {}", motion.drive_frequency * 1e-3, motion.statement());
        let placed = |text: &String| format!("{}: {text}", record.path.display());
        let assumptions = record.assumptions.iter().chain([&frequency]).map(placed).collect();
        let warnings = record.warnings.iter().chain(&motion.warnings()).map(placed).collect();
        let (baseline_error, bandwidth, masked) = (record.baseline_error, record.bandwidth, record.masked);
        let input = Input { path: record.path, sha256: record.sha256 };
        let shakes = Self::shakes_of(&motion);
        let options = ReadOptions::default();
        Ok(Self { input, options, motion, shakes, baseline_error, bandwidth, masked, assumptions, warnings })
    }

    /// The scene under this drive, with the record's duration unless `keep_duration`.
    pub(crate) fn drive(&self, mut scene: Scene, keep_duration: bool) -> Scene {
        let HornDrive { displacement, recorded_until, drive_frequency, .. } = &self.motion;
        if !keep_duration {
            scene.duration = (recorded_until / scene.output_step).floor() * scene.output_step;
        }
        let file = Some(self.input.path.clone());
        scene.with_continued_record(displacement.clone(), *recorded_until, self.shakes.clone(), *drive_frequency, file)
    }

    /// The drive without what no fit compares.
    fn shortened(mut self) -> Self {
        let motion = &mut self.motion;
        let last = motion.begins_at + MOST_CYCLES / motion.drive_frequency;
        if motion.recorded_until <= last {
            return self;
        }
        let cycles = (motion.recorded_until - motion.begins_at) * motion.drive_frequency;
        // Whether the burst ends within the record no longer matters.
        let before = motion.warnings();
        motion.ends = Ending::Rest;
        let after = motion.warnings();
        let settled = |text: &String| before.iter().any(|it| text.ends_with(it) && !after.contains(it));
        self.warnings.retain(|text| !settled(text));
        motion.recorded_until = last;
        let followed = last + FOLLOWED / motion.drive_frequency - motion.displacement.start;
        motion.displacement.values.truncate((followed / motion.displacement.step) as usize);
        motion.displacement.values.shrink_to_fit();
        self.shakes = Self::shakes_of(motion);
        self.assumptions.push(format!(
            "{}: of the {cycles:.0} cycles of the drive only the first {MOST_CYCLES} are simulated and compared",
            self.input.path.display()
        ));
        self
    }

    /// Residual noise of the motion; `None` if unknown or negligible.
    pub(crate) fn noise(&self) -> Option<HornNoise> {
        HornNoise::of(&self.motion)
    }

    /// Realisations of the residual noise of a motion, from a fixed seed; none if it is unknown or negligible.
    fn shakes_of(motion: &HornDrive) -> Vec<Series> {
        let Some(noise) = HornNoise::of(motion) else { return vec![] };
        let mut random = ChaCha8Rng::seed_from_u64(SHAKEN);
        (0..SHAKES).map(|_| noise.realisation(&mut random)).collect()
    }
}

/// Residual noise of a horn's motion.
#[derive(Debug, Clone)]
pub(crate) struct HornNoise {
    remainder: Remainder,
    displacement: Series,
    /// Time over which it decays at both ends, s.
    settle: f64,
}

impl HornNoise {
    fn of(motion: &HornDrive) -> Option<Self> {
        let HornDrive { displacement, remainder, drive_frequency, .. } = motion;
        let remainder = remainder.as_ref().filter(|remainder| remainder.rms() > FELT * displacement.peak())?.clone();
        Some(Self { remainder, displacement: displacement.clone(), settle: 0.25 / drive_frequency })
    }

    /// One realisation, m.
    pub(crate) fn realisation(&self, random: &mut ChaCha8Rng) -> Series {
        self.remainder.realisation(&self.displacement, self.settle, random)
    }
}

/// Reads with the offset of the burst's plateau, or as the options state if there is no plateau.
fn at_plateau(
    options: &ReadOptions,
    read: impl Fn(&ReadOptions) -> Result<RecordedDrive, MeasurementError>,
) -> Result<RecordedDrive, MeasurementError> {
    let plateau = ReadOptions { baseline: Baseline::Plateau, ..options.clone() };
    let drive = match read(&plateau) {
        Err(MeasurementError::NoPlateau { .. }) => read(options)?,
        drive => RecordedDrive { options: options.clone(), ..drive? },
    };
    Ok(drive.shortened())
}

/// The piston's displacement under a scene's drive at α = 1, m, over its duration.
pub fn displacement(scene: &Scene) -> Series {
    let motion = scene.drive.motion(1.0);
    let count = (scene.duration / scene.output_step).round() as usize + 1;
    let values = (0..count).map(|index| motion.at(index as f64 * scene.output_step).0).collect();
    Series::new(0.0, scene.output_step, values)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use std::fmt::Write as _;

    use super::*;

    /// A horn that moves by 1 µm at 73 kHz from t = 0 to the end of its record.
    fn record(cycles: f64) -> String {
        let mut text = String::from("time_us,displacement_nm\n");
        for sample in -400..(cycles / 73e3 / 0.5e-6) as i32 {
            let time = 0.5e-6 * f64::from(sample);
            let moved = if time > 0.0 { 1e3 * (std::f64::consts::TAU * 73e3 * time).sin() } else { 0.0 };
            let _ = writeln!(text, "{:.1},{moved:.3}", 1e6 * time);
        }
        text
    }

    #[test]
    fn of_a_long_burst_the_first_cycles_are_compared_and_that_is_said() {
        let read = |cycles: f64| {
            let text = record(cycles);
            RecordedDrive::of_bytes_at_plateau(Path::new("h.csv"), text.as_bytes(), &ReadOptions::default()).unwrap()
        };
        let (short, long) = (read(300.0), read(1000.0));
        assert!((short.motion.recorded_until - 300.0 / 73e3).abs() < 1e-6, "{}", short.motion.recorded_until);
        assert!((long.motion.recorded_until - 400.0 / 73e3).abs() < 1e-6, "{}", long.motion.recorded_until);
        let kept = long.motion.displacement.end() * 73e3;
        assert!((400.0..411.0).contains(&kept), "{kept}");
        let says = |drive: &RecordedDrive| drive.assumptions.iter().any(|it| it.contains("only the first 400"));
        assert!(says(&long) && !says(&short), "{:?}", long.assumptions);
        // The burst of the long record ends within what is compared.
        assert!(long.warnings.is_empty() && short.warnings[0].contains("ends inside the burst"), "{:?}", long.warnings);
    }
}
