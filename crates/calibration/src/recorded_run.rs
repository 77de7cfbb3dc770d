//! Records of a problem: drive, measurement, comparison and checks.
//!
//! The first record leads: it determines model, candidates and report. Every further one has its own drive, scene
//! overrides and reading options.

use std::path::{Path, PathBuf};

use super::{
    bench::Bench, comparison::Comparison, forward::Uncertainty, measured::Measured, multi_record::StatedFrequency,
    outcome::MaskedStretch, plan::Plan, refusal::Refusal,
};
use granchain_model::scene::Scene;
use granchain_record::{ReadOptions, Record, drive_frequency_line, read_head};
use granchain_signal::feature::fingerprint::FeatureSet;

/// Common file names whose folder serves as label.
const STEMS: [&str; 2] = ["vib", "hydrophone"];

/// A measurement, to be read or already read.
#[derive(Debug, Clone)]
pub enum Source {
    /// File of a record, with its reading options.
    File(PathBuf, Box<ReadOptions>),
    /// A record that has been read, with its options.
    Record(Box<Record>, Box<ReadOptions>),
}

impl Source {
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::File(path, _) => path,
            Self::Record(record, _) => &record.path,
        }
    }

    pub(crate) fn options(&self) -> &ReadOptions {
        match self {
            Self::File(_, options) | Self::Record(_, options) => options,
        }
    }
}

/// A record to be fitted, with its bench.
#[derive(Debug, Clone)]
pub struct RecordedRunPlan {
    pub source: Source,
    pub bench: Bench,
    /// Plan and line that name it, if a plan names several.
    pub origin: Option<(PathBuf, usize)>,
}

/// One record of a problem.
#[derive(Debug, Clone)]
pub struct RecordedRun {
    pub bench: Bench,
    pub options: ReadOptions,
    pub measured: Measured,
    /// Comparison of runs with it.
    pub comparison: Comparison,
    /// Uncertainty drawn in its runs.
    pub uncertainty: Uncertainty,
}

impl RecordedRun {
    /// Masked samples of its record and of its drive record.
    pub(crate) fn masked(&self) -> Vec<MaskedStretch> {
        let record = &self.measured.record;
        let record = MaskedStretch::of(&record.path, &record.masked);
        let drive = self.bench.drive.as_ref().map(|drive| MaskedStretch::of(&drive.input.path, &drive.masked));
        record.into_iter().chain(drive.into_iter().flatten()).collect()
    }
}

impl RecordedRunPlan {
    /// A file on a bench, read as its own header states.
    pub fn of(path: &Path, bench: Bench) -> Self {
        Self { source: Source::File(path.into(), Box::default()), bench, origin: None }
    }

    /// Read and check it, for runs of `scene`.
    pub(super) fn measured(
        &self,
        plan: &Plan,
        scene: &Scene,
        assumptions: &mut Vec<String>,
    ) -> Result<(Measured, Comparison), Refusal> {
        let set = plan.features.unwrap_or(FeatureSet::Full);
        let driven = (scene, self.bench.drive.as_ref());
        let measured = match &self.source {
            Source::File(path, options) => {
                Measured::read(path, (plan.quantity.unwrap_or_default(), set), options, driven, assumptions)?
            }
            Source::Record(record, _) => Measured::of((**record).clone(), set, driven, assumptions)?,
        };
        let comparison = measured.comparison().clone().weighted(&plan.weights)?;
        Ok((measured, comparison))
    }

    /// Drive frequency and its source: the horn-tip record, else the plan, else the record.
    pub(super) fn drive_stated(&self, scene: &Scene) -> StatedFrequency {
        let (path, line) = match (&self.bench.drive, &self.origin) {
            (Some(drive), _) => {
                let path = &drive.input.path;
                (path.clone(), line_of(path).map(|(line, _)| line))
            }
            (None, Some((plan, line))) => (plan.clone(), Some(*line)),
            (None, None) => match self.stated().filter(|stated| stated.frequency == scene.drive.frequency) {
                Some(stated) => return stated,
                None => (format!("the scene `{}`", scene.name).into(), None),
            },
        };
        StatedFrequency { path, line, frequency: scene.drive.frequency }
    }

    /// Drive frequency that the record itself states, if any.
    pub(super) fn stated(&self) -> Option<StatedFrequency> {
        let path = self.source.path();
        let (line, frequency) = line_of(path)?;
        Some(StatedFrequency { path: path.into(), line: Some(line), frequency })
    }
}

/// The line of a file that states the drive frequency; a file that cannot be read is refused where it is read.
fn line_of(path: &Path) -> Option<(usize, f64)> {
    drive_frequency_line(&String::from_utf8_lossy(&read_head(path).ok()?.0))
}

/// Labels of records: the folder of a `vib.csv`, else the file name; numbered if ambiguous.
pub fn labels(paths: &[&Path]) -> Vec<String> {
    let name = |path: &&Path| {
        let text = |part: Option<&std::ffi::OsStr>| part.map(|part| part.to_string_lossy().into_owned());
        let stem = text(path.file_stem()).unwrap_or_else(|| "record".into());
        let folder = text(path.parent().and_then(Path::file_name));
        folder.filter(|_| STEMS.contains(&stem.as_str())).unwrap_or(stem)
    };
    let names: Vec<String> = paths.iter().map(name).collect();
    let unique = |name: &String| names.iter().filter(|other| *other == name).count() == 1;
    let numbered = |(index, name): (usize, &String)| {
        if unique(name) { name.clone() } else { format!("{name} {}", index + 1) }
    };
    names.iter().enumerate().map(numbered).collect()
}

/// Refuses a record that is given twice, since its information would count twice.
pub(super) fn refuse_twice(measured: &[&Measured]) -> Result<(), Refusal> {
    for (number, record) in measured.iter().enumerate() {
        if let Some(known) = measured[..number].iter().find(|known| known.sha256() == record.sha256()) {
            return Err(Refusal::Twice { path: record.path().into(), known: known.path().into() });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_are_called_by_folder_or_name_and_numbered_where_alike() {
        let paths = ["lab/low/vib.csv", "lab/high/vib.csv", "lab/x.csv", "other/x.csv"].map(Path::new);
        assert_eq!(labels(&paths), ["low", "high", "x 3", "x 4"]);
    }
}
