//! What a scene is fitted to: the record of a vibrometer or a hydrophone, or published features where no waveform exists.

use std::path::Path;

use anyhow::Context;

use super::definition::Definition;
use crate::{
    calibration::{
        comparison::Comparison,
        fit::Fit,
        observation::{Observation, Recording},
        parameter::{Parameter, Target},
        printed::Printed,
    },
    feature::Measurand,
    measurement::{PublishedFeatures, Record, RecordKind, read_record},
    scene::Scene,
    study::{
        Bodies, EnsemblePlan,
        confirmation::{Confirmation, ConfirmationError, confirm, confirm_printed},
        observation::settings,
    },
};

/// The measurement.
pub enum Measured {
    /// A waveform.
    Record(Box<MeasuredRecord>),
    /// Printed statements.
    Published(Box<MeasuredFeatures>),
}

/// A waveform with its fingerprint.
pub struct MeasuredRecord {
    /// As read.
    pub record: Record,
    /// As the lab's chain sees simulated traces.
    pub recording: Recording,
    /// As the fit sees it.
    pub observation: Observation,
}

/// Printed statements, as read and as the fit sees them.
pub struct MeasuredFeatures {
    /// As read.
    pub published: PublishedFeatures,
    /// As the fit sees them.
    pub printed: Printed,
}

/// Whether a file is one of published features.
pub fn is_published(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"))
}

/// What a simulated trace passes through before it is held against the record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Instrument {
    /// The bandwidth that the record states, if any.
    AsStated,
    /// One that was fitted, Hz.
    Fitted {
        /// Its cutoff.
        bandwidth: f64,
    },
}

impl Instrument {
    /// Of a fit.
    pub fn of(fit: &Fit) -> Self {
        let fitted = |(parameter, value): (&Parameter, f64)| (parameter.target == Target::Bandwidth).then_some(value);
        match fit.parameters.iter().zip(fit.values()).find_map(fitted) {
            Some(bandwidth) => Self::Fitted { bandwidth },
            None => Self::AsStated,
        }
    }
}

impl Measured {
    /// Read and check a file of the definition's, for runs of `scene`; what was assumed goes to `assumptions`.
    ///
    /// # Errors
    /// Whatever is wrong with the file, or makes it incomparable with the scene.
    pub fn read(
        path: &Path,
        definition: &Definition,
        scene: &Scene,
        assumptions: &mut Vec<String>,
    ) -> anyhow::Result<Self> {
        let place = path.display();
        if is_published(path) {
            let published = PublishedFeatures::read(path)?;
            let window = settings(scene).with_context(|| "the drive has no analysis window")?.window;
            let window = window.with_context(|| "the drive has no analysis window")?;
            let printed =
                Printed::new(&published, scene.drive.frequency, window).with_context(|| format!("{place}"))?;
            assumptions.extend(printed.assumptions().into_iter().map(|text| format!("{place}: {text}")));
            return Ok(Self::Published(Box::new(MeasuredFeatures { published, printed })));
        }
        let measurand = definition.quantity;
        let kind = match measurand {
            Measurand::Velocity => RecordKind::Vibrometer,
            Measurand::Pressure => RecordKind::Hydrophone,
        };
        let record = read_record(path, kind, &definition.reading.options(Some(scene.drive.frequency)))?;
        record.check_sampling(scene.drive.frequency)?;
        assumptions.extend(record.assumptions.iter().chain(&record.warnings).map(|text| format!("{place}: {text}")));
        let recording = Recording {
            measurand,
            signal: record.series.clone(),
            noise_rms: record.noise_rms,
            bandwidth: record.bandwidth,
        };
        let observation = Observation::new(&recording, &scene.drive, definition.features)
            .with_context(|| format!("{place}: nothing can be fitted to it"))?;
        Ok(Self::Record(Box::new(MeasuredRecord { record, recording, observation })))
    }

    /// What every run is compared with.
    pub fn comparison(&self) -> Comparison {
        match self {
            Self::Record(measured) => measured.observation.clone().into(),
            Self::Published(measured) => measured.printed.clone().into(),
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        match self {
            Self::Record(measured) => &measured.record.path,
            Self::Published(measured) => &measured.published.path,
        }
    }

    /// SHA-256 of the file.
    pub fn sha256(&self) -> &str {
        match self {
            Self::Record(measured) => &measured.record.sha256,
            Self::Published(measured) => &measured.published.sha256,
        }
    }

    /// The waveform, where there is one.
    pub fn record(&self) -> Option<&Record> {
        match self {
            Self::Record(measured) => Some(&measured.record),
            Self::Published(_) => None,
        }
    }

    /// The printed statements, where there is no waveform.
    pub fn features(&self) -> Option<&MeasuredFeatures> {
        match self {
            Self::Record(_) => None,
            Self::Published(measured) => Some(measured),
        }
    }

    /// One word for it.
    pub fn noun(&self) -> &'static str {
        match self {
            Self::Record(_) => "record",
            Self::Published(_) => "published",
        }
    }

    /// Hold `scene` against it, on the model it asks for.
    ///
    /// # Errors
    /// When the accurate run fails or cannot be compared.
    pub fn confirm(
        &self,
        scene: &Scene,
        bodies: &Bodies,
        plan: &EnsemblePlan,
        seen_by: Instrument,
    ) -> Result<Confirmation, ConfirmationError> {
        match self {
            Self::Record(measured) => {
                let bandwidth = match seen_by {
                    Instrument::AsStated => measured.recording.bandwidth,
                    Instrument::Fitted { bandwidth } => Some(bandwidth),
                };
                let recording = Recording { bandwidth, ..measured.recording.clone() };
                confirm(scene, bodies, &recording, &measured.observation, plan)
            }
            Self::Published(measured) => confirm_printed(scene, bodies, &measured.printed, plan),
        }
    }
}
