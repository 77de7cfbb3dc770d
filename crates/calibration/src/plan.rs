//! Plans: TOML files that say what is fitted to what.
//!
//! ```toml
//! measured = "../measurements/annulus-73khz/vib.csv" # relative to this file
//! drive = "../measurements/annulus-73khz/horn_tip.csv"
//! scene = "annulus"
//! set = ["damping.at=all"]
//! damping = ["linear", "kuwabara-kono"]
//! fit = ["alpha", "damping", "support_stiffness"]
//! features = "full"
//! evaluations = 600
//! seed = 1
//! # several records with one set of parameters, in place of `measured` and `drive`:
//! # [[record]]
//! # measured = "low/vib.csv"
//! # drive = "low/horn_tip.csv"
//! # set = ["chain.beads=7"] # of this record alone, behind the plan's own
//! # of a hydrophone's record besides:
//! # quantity = "pressure"
//! # mount = ["clamped", "supported", "free"]
//! # bench = "bench.toml" # sensitivities, delays, bandwidths of all channels, typed once
//!
//! [reading] # how the record is read
//! channel = "CH2"
//! scale = "125 mm/s/V"
//!
//! [drive] # in place of the line above; `file` may be left out where the horn's channel is in the record's own file
//! file = "scope.csv"
//! [drive.reading]
//! channel = "CH1"
//! scale = "2 um/V"
//!
//! [parameters.alpha]
//! low = 0.2
//! high = 2.0
//!
//! [uncertainty] # drawn into every run
//! gap = "0.3 nm"
//! precompression = "2 mN"
//!
//! [weights]
//! band_3 = 0.5 # half the weight; 0 leaves a feature out
//! ```

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

#[cfg(doc)]
use super::drive::BESIDE;
use super::drive::beside;
use granchain_record::{
    BenchReadings, BenchReadingsError, ReadOptions, Reading, ReadingError, RecordKind, horn_column, key_at, line_of,
    plain_message, sha256,
};
use granchain_signal::feature::{Measurand, fingerprint::FeatureSet};
use granchain_signal::read_back::read_text;

/// Compared part of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Likelihood {
    Amplitudes,
    /// Every sample for as long as runs predict it, and amplitudes as a second verdict.
    #[default]
    Waveform,
}

/// A plan. Every key is optional; options of the command line override it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    pub measured: Option<PathBuf>,
    pub quantity: Option<Measurand>,
    /// The horn-tip record and its reading options.
    pub drive: Option<DrivePlan>,
    /// Reading options of the records.
    pub reading: Option<Reading>,
    /// File that says how each channel is read.
    pub bench: Option<PathBuf>,
    /// Built-in scene or scene file.
    pub scene: Option<String>,
    /// Overrides of the scene, `KEY=VALUE`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    pub damping: Option<Vec<String>>,
    /// Mounts of the disc to compare.
    pub mount: Option<Vec<String>>,
    /// Names of the parameters to fit.
    pub fit: Option<Vec<String>>,
    pub features: Option<FeatureSet>,
    /// Compared part of the record.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub likelihood: Option<Likelihood>,
    /// Number of runs per law.
    pub evaluations: Option<usize>,
    /// Factor, at least 1, on every 90 % interval of the answer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub widen: Option<f64>,
    pub seed: Option<u64>,
    /// Records that are fitted together, instead of `measured` and `drive`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub record: Vec<RecordPlan>,
    /// Bounds, or a fixed value, of the parameters by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Bounds>,
    /// Uncertainties drawn in every run, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub uncertainty: BTreeMap<String, Number>,
    /// Weight of single features by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub weights: BTreeMap<String, f64>,
    /// SHA-256 of the plan file, hexadecimal; empty without a file.
    #[serde(skip)]
    pub sha256: String,
    /// The bench file as read.
    #[serde(skip)]
    pub readings: Option<BenchReadings>,
}

/// A horn-tip record in a plan: a path, or a table with its reading.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(from = "WrittenDrive", into = "WrittenDrive")]
pub struct DrivePlan {
    /// The file; absent if it lies beside the record, or if it is the record's own.
    pub file: Option<PathBuf>,
    pub reading: Reading,
}

/// The two forms of a drive.
#[derive(Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a path, or a table with `file` and `[drive.reading]`")]
enum WrittenDrive {
    File(PathBuf),
    Table(Box<DriveTable>),
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DriveTable {
    file: Option<PathBuf>,
    #[serde(default)]
    reading: Reading,
}

impl From<WrittenDrive> for DrivePlan {
    fn from(written: WrittenDrive) -> Self {
        match written {
            WrittenDrive::File(file) => file.into(),
            WrittenDrive::Table(table) => Self { file: table.file, reading: table.reading },
        }
    }
}

impl From<DrivePlan> for WrittenDrive {
    fn from(DrivePlan { file, reading }: DrivePlan) -> Self {
        match file {
            Some(file) if reading == Reading::default() => Self::File(file),
            file => Self::Table(Box::new(DriveTable { file, reading })),
        }
    }
}

impl From<PathBuf> for DrivePlan {
    fn from(file: PathBuf) -> Self {
        Self { file: Some(file), reading: Reading::default() }
    }
}

/// One of several records: `[[record]]`.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordPlan {
    pub measured: PathBuf,
    /// The horn-tip record that drove it.
    pub drive: Option<DrivePlan>,
    /// Reading options, if not the plan's.
    pub reading: Option<Reading>,
    /// Scene, if not the plan's.
    pub scene: Option<String>,
    /// Overrides of its scene, applied after the plan's.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub set: Vec<String>,
    /// Line of the plan where it begins, from 1.
    #[serde(skip)]
    pub line: usize,
}

/// Search bounds of one parameter: a plain number is SI, a text carries its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    pub low: Number,
    pub high: Number,
}

/// A number in SI, or a text with its unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number, or a text with its unit")]
pub enum Number {
    Plain(f64),
    Text(String),
}

/// Why a plan cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PlanError {
    #[error("{}: expected a plan, found no such file; check the path", path.display())]
    NotFound { path: PathBuf },
    #[error("{}: the plan cannot be read", path.display())]
    Unreadable { path: PathBuf, source: std::io::Error },
    #[error(
        "{}:{line}: {message} (keys: docs/formats.md#plans-toml)", path.display()
    )]
    Form { path: PathBuf, line: usize, message: String },
    #[error("{}: [{table}] {source}", path.display())]
    Reading { path: PathBuf, table: &'static str, source: ReadingError },
    #[error(transparent)]
    Bench(#[from] BenchReadingsError),
}

/// Reading options of a record and its drive.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadAs {
    pub measured: ReadOptions,
    /// The horn-tip record, if there is one: file, reading options, and how it was found.
    pub drive: Option<(PathBuf, ReadOptions, NamedBy)>,
}

/// How the record of a drive was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NamedBy {
    Flag,
    Plan,
    Folder,
    /// A channel of the record's own file.
    Channel,
}

/// Reading options of the caller, before plan and bench file fill the gaps.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ReadRequest {
    pub measured: ReadOptions,
    pub drive: ReadOptions,
    pub drive_file: Option<PathBuf>,
}

impl Plan {
    /// Reading options of one record and its drive. Precedence: caller, the record's lines, the plan, the bench file.
    /// The drive file is the requested or named one, else the record itself if a channel is named, else [`BESIDE`]
    /// beside the record, else the record itself if the bench file or a column name identifies the horn. For one file,
    /// format options hold for both.
    pub fn read_as(&self, record: &RecordPlan, request: ReadRequest) -> Result<ReadAs, ReadingError> {
        let kind =
            if self.quantity == Some(Measurand::Pressure) { RecordKind::Hydrophone } else { RecordKind::Vibrometer };
        let stated = |kind| self.readings.as_ref().map(|bench| bench.of(kind));
        let filled = |options: ReadOptions, readings: &[Option<&Reading>]| {
            readings.iter().flatten().try_fold(options, |options, reading| reading.below(options))
        };
        let own = record.reading.as_ref();
        let measured = filled(request.measured, &[own, self.reading.as_ref(), stated(kind)])?;
        let drives = [&record.drive, &self.drive].map(|drive| drive.as_ref().map(|drive| &drive.reading));
        let mut drive = filled(request.drive, &drives)?;
        let horn = stated(RecordKind::HornTip);
        let planned = record.drive.as_ref().or(self.drive.as_ref()).and_then(|drive| drive.file.clone());
        let own_file = || (record.measured.clone(), NamedBy::Channel);
        let mut named = request.drive_file.map(|file| (file, NamedBy::Flag));
        named = named.or_else(|| planned.map(|file| (file, NamedBy::Plan)));
        // A channel that is named without a file is one of the record's own.
        named = named.or_else(|| drive.column.is_some().then(own_file));
        named = named.or_else(|| beside(&record.measured).map(|file| (file, NamedBy::Folder)));
        if named.is_none() {
            let stated = horn.and_then(|horn| horn.channel.clone());
            if let Some(channel) = stated.or_else(|| horn_column(&record.measured, &measured)) {
                drive.column = Some(channel);
                named = Some(own_file());
            }
        }
        let Some((file, by)) = named else { return Ok(ReadAs { measured, drive: None }) };
        if file == record.measured {
            drive = drive.of_same_file(&measured);
        }
        let drive = filled(drive, &[horn])?;
        Ok(ReadAs { measured, drive: Some((file, drive, by)) })
    }

    /// Read a plan; paths in it are relative to the file.
    pub fn read(path: &Path) -> Result<Self, PlanError> {
        let text = read_text(path).map_err(|source| match source.kind() {
            std::io::ErrorKind::NotFound => PlanError::NotFound { path: path.into() },
            _ => PlanError::Unreadable { path: path.into(), source },
        })?;
        let mut plan: Self = toml::from_str(&text).map_err(|error| PlanError::Form {
            path: path.into(),
            line: line_of(&text, error.span().map(|span| span.start)),
            message: plain_message(error.message(), key_at(&text, error.span())),
        })?;
        plan.sha256 = sha256(text.as_bytes());
        plan.check_readings(path)?;
        let folder = path.parent().unwrap_or(Path::new("."));
        let begins =
            |(index, line): (usize, &str)| line.replace(' ', "").starts_with("[[record]]").then_some(index + 1);
        let lines: Vec<usize> = text.lines().enumerate().filter_map(begins).collect();
        for (number, record) in plan.record.iter_mut().enumerate() {
            // Records written as one array have no line of their own.
            record.line = lines.get(number).copied().unwrap_or(1);
        }
        let of_records = plan.record.iter_mut();
        let (files, scenes): (Vec<_>, Vec<_>) = of_records
            .map(|RecordPlan { measured, drive, scene, .. }| ([Some(measured), file_of(drive)], scene.as_mut()))
            .unzip();
        let own = [plan.measured.as_mut(), file_of(&mut plan.drive), plan.bench.as_mut()];
        let files = files.into_iter().flatten().chain(own);
        for file in files.flatten() {
            *file = from_here(folder.join(&*file));
        }
        for scene in scenes.into_iter().chain([plan.scene.as_mut()]).flatten() {
            if folder.join(&*scene).is_file() {
                *scene = from_here(folder.join(&*scene)).display().to_string();
            }
        }
        plan.readings = plan.bench.as_deref().map(BenchReadings::read).transpose()?;
        Ok(plan)
    }

    fn check_readings(&self, path: &Path) -> Result<(), PlanError> {
        let pair = |tables: [&'static str; 2], reading: &Option<Reading>, drive: &Option<DrivePlan>| {
            let of_drive = drive.as_ref().map(|drive| &drive.reading);
            for (table, reading) in tables.into_iter().zip([reading.as_ref(), of_drive]) {
                let refused = |source| PlanError::Reading { path: path.into(), table, source };
                reading.map(|reading| reading.below(ReadOptions::default())).transpose().map_err(refused)?;
            }
            Ok::<(), PlanError>(())
        };
        pair(["reading", "drive.reading"], &self.reading, &self.drive)?;
        for record in &self.record {
            pair(["record.reading", "record.drive.reading"], &record.reading, &record.drive)?;
        }
        Ok(())
    }
}

fn file_of(drive: &mut Option<DrivePlan>) -> Option<&mut PathBuf> {
    drive.as_mut().and_then(|drive| drive.file.as_mut())
}

/// `path` relative to the current folder if it lies below it, as shown in reports.
fn from_here(path: PathBuf) -> PathBuf {
    let below = || {
        let here = std::env::current_dir().ok()?.canonicalize().ok()?;
        Some(path.canonicalize().ok()?.strip_prefix(here).ok()?.to_path_buf())
    };
    below().unwrap_or(path)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn the_digest_is_of_the_bytes_that_were_read() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("fit.toml");
        fs::write(&file, "seed = 1\n").unwrap();
        let plan = Plan::read(&file).unwrap();
        fs::write(&file, "seed = 2\n").unwrap();
        assert_eq!((plan.seed, plan.sha256), (Some(1), sha256(b"seed = 1\n")));
    }

    #[test]
    fn paths_are_relative_to_the_plan() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("fit.toml");
        fs::write(&file, "measured = \"vib.csv\"\n[parameters.alpha]\nlow = 0.3\nhigh = \"1.5\"\n").unwrap();
        let plan = Plan::read(&file).unwrap();
        assert_eq!(plan.measured.unwrap(), place.path().join("vib.csv"));
        assert_eq!(plan.parameters["alpha"].high, Number::Text("1.5".into()));
    }

    #[test]
    fn records_of_a_plan_know_their_line_and_lie_beside_it() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("fit.toml");
        let text = "scene = \"annulus\"\n\n[[record]]\nmeasured = \"low.csv\"\n\n[[record]]\nmeasured = \"high.csv\"\n\
                    drive = \"horn.csv\"\nset = [\"chain.beads=7\"]\n";
        fs::write(&file, text).unwrap();
        let plan = Plan::read(&file).unwrap();
        let records: Vec<_> = plan.record.iter().map(|record| (record.line, record.measured.clone())).collect();
        assert_eq!(records, [(3, place.path().join("low.csv")), (6, place.path().join("high.csv"))]);
        assert_eq!(plan.record[1].drive, Some(place.path().join("horn.csv").into()));
        assert_eq!(plan.record[1].set, ["chain.beads=7"]);
        fs::write(&file, text.replace("drive =", "horn =")).unwrap();
        assert!(Plan::read(&file).unwrap_err().to_string().contains("fit.toml:8"));
    }

    #[test]
    fn an_unknown_key_is_refused_with_its_line() {
        let place = tempfile::tempdir().unwrap();
        let file = place.path().join("fit.toml");
        fs::write(&file, "seed = 1\nmesured = \"vib.csv\"\n").unwrap();
        let error = Plan::read(&file).unwrap_err().to_string();
        assert!(error.contains("fit.toml:2") && error.contains("mesured"), "{error}");
    }
}
