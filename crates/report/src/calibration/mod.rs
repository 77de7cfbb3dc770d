//! The report of a calibration: what a researcher sends to a colleague.
//!
//! [`CalibrationReport`] is the outcome and what only its figures show, plain data in SI, filled by the program or library and stored
//! beside it (`report.json`), so that a finished calibration can be rendered again without running anything.

mod bench;
mod content;
mod figures;
mod input;
mod joint;
mod shown;
pub(crate) mod spectrum;
mod table;

use super::page::{Files, ReportError};
use granchain_calibration::outcome::{FittedParameter, OutcomeFeature};

pub use bench::{BenchReport, BenchRow, DrawnSupport};
pub use granchain_calibration::fit::Verdict;
pub use input::{CalibrationReport, DensityMap, LawReport, PairMap, RecordReport, RunPoint};
pub use shown::law_name;
pub use table::named_number;

impl CalibrationReport {
    /// `report.html`, `report.md`, the figures, `report.json` (this data) and the tables as CSV.
    pub fn files(&self) -> Result<Files, ReportError> {
        self.check()?;
        let mut files = content::page(self).files()?;
        let mut json = serde_json::to_vec(self)?;
        json.push(b'\n');
        files.push(("report.json".into(), json));
        files.extend(table::csv_files(self)?);
        Ok(files)
    }

    /// The page of a dry run: drive, record and the response of the scene as given, no fit. Needs no law.
    pub fn preview(&self) -> Result<Files, ReportError> {
        content::preview(self).files()
    }

    /// `report.html` alone: with laws that of the fit, else that of a dry run.
    pub fn html(&self) -> Result<String, ReportError> {
        if self.laws.is_empty() {
            return content::preview(self).html();
        }
        self.check()?;
        content::page(self).html()
    }

    /// JSON has no NaN and a reader no use for one: refuse before anything is written.
    fn check(&self) -> Result<(), ReportError> {
        if self.outcome.laws.is_empty() || self.laws.len() != self.outcome.laws.len() {
            return Err(ReportError::Missing { field: "laws" });
        }
        if self.records.is_empty() {
            return Err(ReportError::Missing { field: "records" });
        }
        let finite = |field: &dyn Fn() -> String, value: f64| {
            if value.is_finite() { Ok(()) } else { Err(ReportError::NotFinite { field: field(), found: value }) }
        };
        let parameter = |field: &dyn Fn() -> String, it: &FittedParameter| {
            let all = [it.low, it.high].into_iter().flatten().chain([it.value]).chain(it.bounds);
            all.into_iter().try_for_each(|value| finite(field, value))
        };
        let feature = |name: &str, it: &OutcomeFeature| {
            let all = [it.measured, it.simulated, it.scatter, it.sensitivity].into_iter().flatten();
            all.into_iter().try_for_each(|value| finite(&|| format!("feature {name}"), value))
        };
        for (law, drawn) in self.outcome.laws.iter().zip(&self.laws) {
            let kind = &law.damping_kind;
            finite(&|| format!("misfit ({kind})"), law.misfit)?;
            for (name, fitted) in &law.parameters {
                parameter(&|| format!("{name} ({kind})"), fitted)?;
            }
            for (name, fitted) in law.fidelities.iter().flat_map(|fidelity| &fidelity.parameters) {
                parameter(&|| format!("{name} of a model ({kind})"), fitted)?;
            }
            for record in &law.records {
                for (name, fitted) in &record.alone {
                    parameter(&|| format!("{name} by {} alone", record.label), fitted)?;
                }
            }
            for (index, run) in drawn.runs.iter().enumerate() {
                for value in run.parameters.iter().chain(&run.misfit) {
                    finite(&|| format!("run {} ({kind})", index + 1), *value)?;
                }
            }
        }
        let best = &self.outcome.best;
        for (name, watched) in best.features.iter().chain(best.records.iter().flat_map(|record| &record.features)) {
            feature(name, watched)?;
        }
        for record in &self.records {
            let traces = [Some(&record.drive), Some(&record.recorded), record.simulated.as_ref()];
            for (name, trace) in ["drive", "recorded", "simulated"].into_iter().zip(traces) {
                for (index, value) in trace.iter().flat_map(|trace| &trace.values).enumerate() {
                    finite(&|| format!("{name} sample {index}"), *value)?;
                }
            }
        }
        Ok(())
    }
}
