//! What drove the chain while a record was made: a horn tip as read, and how it enters a scene.

use std::path::{Path, PathBuf};

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use thiserror::Error;

use granchain_model::scene::Scene;
use granchain_record::{
    Baseline, HornDrive, Masked, MeasurementError, ReadOptions, Record, RecordKind, Remainder,
    read_back::{LARGE, read_back},
    read_record, read_record_bytes, sha256,
};
use granchain_signal::Series;

/// The file name that a drive record beside a record is looked for under.
pub const BESIDE: &str = "horn_tip.csv";

/// Realisations of a horn's noise that runs mix.
const SHAKES: usize = 4;

const SHAKEN: u64 = 0x5AC3;

/// Noise left in a drive below which no run draws it, over its peak: a tenth of the gaps' scale beside a drive of 1 µm.
const FELT: f64 = 3e-5;

/// A file that went into a run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Input {
    pub path: PathBuf,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// A file that cannot be digested.
#[derive(Debug, Error)]
#[error("{}: cannot be read", path.display())]
pub struct InputError {
    pub path: PathBuf,
    pub source: std::io::Error,
}

impl Input {
    /// The file as it is now.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn digest(path: PathBuf) -> Result<Self, InputError> {
        match read_back(&path, LARGE) {
            Ok(bytes) => Ok(Self { path, sha256: sha256(&bytes) }),
            Err(source) => Err(InputError { path, source }),
        }
    }
}

/// The horn-tip record in the folder of a record, where there is one.
#[must_use]
pub fn beside(measured: &Path) -> Option<PathBuf> {
    let beside = measured.with_file_name(BESIDE);
    (beside.is_file() && beside != measured).then_some(beside)
}

/// A horn-tip record, ready to drive.
#[derive(Debug, Clone)]
pub struct RecordedDrive {
    pub input: Input,
    /// How it was asked to be read.
    pub options: ReadOptions,
    /// The motion that was made of it.
    pub motion: HornDrive,
    /// Realisations of the noise that is left in it, m.
    shakes: Vec<Series>,
    /// Standard error of the horn's baseline, m, where the record tells.
    pub baseline_error: Option<f64>,
    /// Bandwidth of its decoder, Hz, where the record states it.
    pub bandwidth: Option<f64>,
    pub masked: Vec<Masked>,
    /// What was understood and assumed on reading, for people.
    pub assumptions: Vec<String>,
    /// What looks wrong, though it could be read.
    pub warnings: Vec<String>,
}

impl RecordedDrive {
    /// Read a horn tip for a fit: with the baseline of the plateau, or of the first samples where the burst is too short to have one. An error
    /// in the baseline is a gap to the chain, and the plateau's mean is far better known than the first samples'.
    ///
    /// # Errors
    /// [`MeasurementError`].
    pub fn read_at_plateau(path: &Path, options: &ReadOptions) -> Result<Self, MeasurementError> {
        at_plateau(options, |options| Self::read(path, options))
    }

    /// The same of the bytes of a file, or of what stands for one; at its plateau only where no other baseline is asked for.
    ///
    /// # Errors
    /// As [`RecordedDrive::read`].
    pub fn of_bytes_at_plateau(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Self, MeasurementError> {
        let read = |options: &ReadOptions| {
            let drive = Self::of(read_record_bytes(path, bytes, Some(RecordKind::HornTip), options)?)?;
            Ok(Self { options: options.clone(), ..drive })
        };
        if options.baseline == Baseline::Auto { at_plateau(options, read) } else { read(options) }
    }

    /// Read a horn tip.
    ///
    /// # Errors
    /// [`MeasurementError`].
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, MeasurementError> {
        let drive = Self::of(read_record(path, RecordKind::HornTip, options)?)?;
        Ok(Self { options: options.clone(), ..drive })
    }

    /// A horn tip that is read already.
    ///
    /// # Errors
    /// [`MeasurementError`] when it cannot drive, or does not tell its frequency.
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

    /// The scene under this drive, for as long as the record lasts unless it keeps its own duration.
    #[must_use]
    pub fn drive(&self, mut scene: Scene, keep_duration: bool) -> Scene {
        let HornDrive { displacement, recorded_until, drive_frequency, .. } = &self.motion;
        if !keep_duration {
            scene.duration = (recorded_until / scene.output_step).floor() * scene.output_step;
        }
        let file = Some(self.input.path.clone());
        scene.with_continued_record(displacement.clone(), *recorded_until, self.shakes.clone(), *drive_frequency, file)
    }

    /// The noise that is left in its motion; `None` where it is not known, or too weak to be felt.
    #[must_use]
    pub(crate) fn noise(&self) -> Option<HornNoise> {
        HornNoise::of(&self.motion)
    }

    /// Realisations of the noise that is left in a motion, the same every time; none where it is not known, or too weak to be felt.
    fn shakes_of(motion: &HornDrive) -> Vec<Series> {
        let Some(noise) = HornNoise::of(motion) else { return vec![] };
        let mut random = ChaCha8Rng::seed_from_u64(SHAKEN);
        (0..SHAKES).map(|_| noise.realisation(&mut random)).collect()
    }
}

/// Noise that is left in a horn's motion.
#[derive(Debug, Clone)]
pub(crate) struct HornNoise {
    remainder: Remainder,
    displacement: Series,
    /// Time over which it dies out at both ends, s.
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

/// Read with the offset of the burst's plateau, or as the options say where there is no plateau.
fn at_plateau(
    options: &ReadOptions,
    read: impl Fn(&ReadOptions) -> Result<RecordedDrive, MeasurementError>,
) -> Result<RecordedDrive, MeasurementError> {
    let plateau = ReadOptions { baseline: Baseline::Plateau, ..options.clone() };
    match read(&plateau) {
        Err(MeasurementError::NoPlateau { .. }) => read(options),
        drive => Ok(RecordedDrive { options: options.clone(), ..drive? }),
    }
}

/// The piston's displacement under a scene's drive at α = 1, m, over its duration.
#[must_use]
pub fn displacement(scene: &Scene) -> Series {
    let motion = scene.drive.motion(1.0);
    let count = (scene.duration / scene.output_step).round() as usize + 1;
    let values = (0..count).map(|index| motion.at(index as f64 * scene.output_step).0).collect();
    Series::new(0.0, scene.output_step, values)
}
