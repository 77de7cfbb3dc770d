//! What a scene is fitted to: the record of a vibrometer or a hydrophone, or published features where no waveform exists.

use std::path::Path;

use super::{
    comparison::Comparison,
    drive::{RecordedDrive, displacement},
    observation::{Observation, Recording},
    printed::Printed,
    refusal::Refusal,
};
use crate::{
    feature::{Measurand, Window, fingerprint::FeatureSet},
    measurement::{Beginning, PublishedFeatures, ReadOptions, Record, RecordKind, read_record},
    scene::Scene,
    signal::Series,
};

/// The measurement.
#[derive(Debug, Clone)]
pub enum Measured {
    /// A waveform.
    Record(Box<MeasuredRecord>),
    /// Printed statements.
    Published(Box<MeasuredFeatures>),
}

/// A waveform with its fingerprint.
#[derive(Debug, Clone)]
pub struct MeasuredRecord {
    /// As read.
    pub record: Record,
    /// As the lab's chain sees simulated traces.
    pub recording: Recording,
    /// As the fit sees it.
    pub observation: Observation,
}

/// Printed statements, as read and as the fit sees them.
#[derive(Debug, Clone)]
pub struct MeasuredFeatures {
    /// As read.
    pub published: PublishedFeatures,
    /// As the fit sees them.
    pub printed: Printed,
}

/// Whether a file is one of published features.
#[must_use]
pub fn is_published(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

impl Measured {
    /// Read and check a file, for runs of `scene` under `drive` where that was recorded; what was assumed goes to `assumptions`.
    ///
    /// # Errors
    /// Whatever is wrong with the file, or makes it incomparable with the scene.
    pub fn read(
        path: &Path,
        (quantity, set): (Measurand, FeatureSet),
        options: &ReadOptions,
        (scene, drive): (&Scene, Option<&RecordedDrive>),
        assumptions: &mut Vec<String>,
    ) -> Result<Self, Refusal> {
        if is_published(path) {
            let published = PublishedFeatures::read(path)?;
            let window = Window::of_drive(&displacement(scene), scene.drive.frequency).map_err(Refusal::NoWindow)?;
            let printed = Printed::new(&published, scene.drive.frequency, window)
                .map_err(|source| Refusal::Printed { path: path.into(), source })?;
            assumptions.extend(printed.assumptions().into_iter().map(|text| format!("{}: {text}", path.display())));
            return Ok(Self::Published(Box::new(MeasuredFeatures { published, printed })));
        }
        let kind = match quantity {
            Measurand::Velocity => RecordKind::Vibrometer,
            Measurand::Pressure => RecordKind::Hydrophone,
        };
        let options = ReadOptions { drive_frequency: Some(scene.drive.frequency), ..options.clone() };
        Self::of(read_record(path, kind, &options)?, set, (scene, drive), assumptions)
    }

    /// Check a record that is read already, of a vibrometer or a hydrophone.
    ///
    /// # Errors
    /// Whatever makes it incomparable with the scene.
    pub fn of(
        record: Record,
        set: FeatureSet,
        (scene, drive): (&Scene, Option<&RecordedDrive>),
        assumptions: &mut Vec<String>,
    ) -> Result<Self, Refusal> {
        record.check_sampling(scene.drive.frequency)?;
        let place = record.path.display();
        assumptions.extend(record.assumptions.iter().map(|text| format!("{place}: {text}")));
        let measurand = match record.kind {
            RecordKind::Hydrophone => Measurand::Pressure,
            _ => Measurand::Velocity,
        };
        let recording = Recording {
            measurand,
            signal: record.series.clone(),
            noise_rms: record.noise_rms,
            bandwidth: record.bandwidth,
            quiet: record.pretrigger,
            clipped: record.clipped,
            begins_late: drive.is_some_and(|drive| matches!(drive.motion.begins, Beginning::Inside { .. })),
        };
        let observation = Observation::new(&recording, &scene.drive, set)
            .map_err(|source| Refusal::Observation { path: record.path.clone(), source })?;
        Ok(Self::Record(Box::new(MeasuredRecord { record, recording, observation })))
    }

    /// What every run is compared with.
    #[must_use]
    pub fn comparison(&self) -> Comparison {
        match self {
            Self::Record(measured) => measured.observation.clone().into(),
            Self::Published(measured) => measured.printed.clone().into(),
        }
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        match self {
            Self::Record(measured) => &measured.record.path,
            Self::Published(measured) => &measured.published.path,
        }
    }

    /// SHA-256 of the file.
    #[must_use]
    pub fn sha256(&self) -> &str {
        match self {
            Self::Record(measured) => &measured.record.sha256,
            Self::Published(measured) => &measured.published.sha256,
        }
    }

    /// The waveform, where there is one.
    #[must_use]
    pub fn record(&self) -> Option<&Record> {
        match self {
            Self::Record(measured) => Some(&measured.record),
            Self::Published(_) => None,
        }
    }

    /// The waveform as the fit sees it, where there is one.
    #[must_use]
    pub fn trace(&self) -> Option<&Series> {
        match self {
            Self::Record(measured) => Some(&measured.observation.trace),
            Self::Published(_) => None,
        }
    }

    /// What looks wrong in it, and what is left out for that.
    #[must_use]
    pub fn warnings(&self) -> Vec<String> {
        match self {
            Self::Record(measured) => {
                [measured.record.warnings.clone(), measured.observation.warnings.clone()].concat()
            }
            Self::Published(_) => vec![],
        }
    }

    /// The printed statements, where there is no waveform.
    #[must_use]
    pub fn features(&self) -> Option<&MeasuredFeatures> {
        match self {
            Self::Record(_) => None,
            Self::Published(measured) => Some(measured),
        }
    }

    /// One word for it.
    #[must_use]
    pub fn noun(&self) -> &'static str {
        match self {
            Self::Record(_) => "record",
            Self::Published(_) => "published",
        }
    }
}
