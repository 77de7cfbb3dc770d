//! A synthetic record's files through the calls that `calibrate` makes: written, read on a bench, fitted, judged.

use std::{collections::BTreeMap, fs, path::Path};

use super::SyntheticPlan;
use granchain_calibration::predict::predicted::with_causes;
use granchain_calibration::{
    Fitted, Plan, Problem, Schedule, bench::Bench, fidelity::Bodies, fit::Fit, plan::Number,
    recorded_run::RecordedRunPlan, refusal::Refusal,
};
use granchain_model::scene::{ModelKind, Scene};
use granchain_record::ReadOptions;
use granchain_signal::feature::Measurand;

impl SyntheticPlan {
    /// Input of `calibrate` for a synthetic record.
    pub(super) fn definition(&self, quantity: Measurand, seed: u64) -> Plan {
        let mut uncertainty = self.uncertainty;
        let drawn = uncertainty.named().map(|(name, .., value)| (name.to_owned(), Number::Plain(*value)));
        Plan {
            quantity: Some(quantity),
            fit: Some(self.parameters.clone()),
            evaluations: Some(self.evaluations),
            seed: Some(seed),
            uncertainty: BTreeMap::from(drawn),
            ..Plan::default()
        }
    }
}

/// Fit records (scene and CSV file of each) together, on `bodies` where they are ready.
pub(super) fn fitted(definition: &Plan, records: &[(Scene, &[u8])], bodies: Option<&Bodies>) -> Result<Fitted, String> {
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    // Where the files lay is of no interest, and another every time.
    let place = format!("{}/", folder.path().display());
    let message = |error: &dyn std::error::Error| with_causes(error).replace(&place, "");
    let written = |(number, (scene, csv)): (usize, &(Scene, &[u8]))| {
        recorded_run(&folder.path().join(number.to_string()), scene, csv).map_err(|error| error.to_string())
    };
    let recorded_runs = records.iter().enumerate().map(written).collect::<Result<_, _>>()?;
    let fit = || -> Result<Fitted, Refusal> {
        let problem = Problem::of(definition, recorded_runs)?;
        problem.fit(Schedule { bodies, ..Schedule::default() })
    };
    fit().map_err(|error| message(&error))
}

/// The answer for one record.
pub(crate) fn fit(definition: &Plan, scene: &Scene, csv: &[u8], bodies: Option<&Bodies>) -> Result<Fit, String> {
    fitted(definition, &[(scene.clone(), csv)], bodies).map(|fitted| fitted.best().fit.clone())
}

/// A record and its scene as files in a folder of their own.
fn recorded_run(folder: &Path, scene: &Scene, csv: &[u8]) -> Result<RecordedRunPlan, Box<dyn std::error::Error>> {
    fs::create_dir(folder)?;
    let (record, scene_file) = (folder.join("twin.csv"), folder.join("scene.toml"));
    fs::write(&record, csv)?;
    fs::write(&scene_file, scene.to_toml())?;
    let how = (granchain_calibration::drive::RecordedDrive::read_at_plateau as _, &ReadOptions::default());
    let bench = Bench::read(&scene_file.display().to_string(), vec![], ModelKind::Chain, None, how)?;
    Ok(RecordedRunPlan::of(&record, bench))
}
