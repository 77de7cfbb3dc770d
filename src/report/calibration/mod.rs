//! The report of a calibration: what a researcher sends to a colleague.
//!
//! [`CalibrationReport`] is plain data in SI, filled by whoever made the calibration and stored beside it (`report.json`), so
//! that a finished calibration can be rendered again without running anything.

mod content;
mod figures;
mod input;
mod joint;
mod spectrum;
mod table;

use super::page::{Files, ReportError};

pub use crate::calibration::fit::Verdict;
pub use input::{
    AlphaSweep, CalibrationReport, DensityMap, Estimate, FeatureRow, InputFile, LawReport, Lobe, PairMap, Provenance,
    Pull, RecordReport, RunPoint, RungReport, RungRow, RungsReport, ShareReport,
};

impl CalibrationReport {
    /// `report.html`, `report.md`, the figures, `report.json` (this data) and the tables as CSV.
    ///
    /// # Errors
    /// [`ReportError`] when no law was fitted, a number is not finite or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        self.check()?;
        let mut files = content::page(self).files()?;
        let mut json = serde_json::to_vec(self)?;
        json.push(b'\n');
        files.push(("report.json".into(), json));
        files.extend(table::csv_files(self));
        Ok(files)
    }

    /// The page of a dry run: drive, record and the response of the scene as given, no fit. Needs no law.
    ///
    /// # Errors
    /// [`ReportError`] when a figure cannot be drawn.
    pub fn preview(&self) -> Result<Files, ReportError> {
        content::preview(self).files()
    }

    /// JSON has no NaN and a reader no use for one: refuse before anything is written.
    fn check(&self) -> Result<(), ReportError> {
        if self.laws.is_empty() {
            return Err(ReportError::Missing { field: "laws" });
        }
        let finite = |field: &dyn Fn() -> String, value: f64| {
            if value.is_finite() { Ok(()) } else { Err(ReportError::NotFinite { field: field(), found: value }) }
        };
        for law in &self.laws {
            for parameter in &law.parameters {
                let interval = [parameter.low, parameter.high].into_iter().flatten();
                for value in interval.chain([parameter.value, parameter.bounds.0, parameter.bounds.1]) {
                    finite(&|| format!("{} ({})", parameter.name, law.damping_kind), value)?;
                }
            }
            finite(&|| format!("misfit ({})", law.damping_kind), law.misfit)?;
            let runs = law.runs.iter().enumerate();
            for (index, run) in runs {
                for value in run.parameters.iter().chain(&run.misfit) {
                    finite(&|| format!("run {} ({})", index + 1, law.damping_kind), *value)?;
                }
            }
        }
        for row in self.laws.iter().filter_map(|law| law.rungs.as_ref()).flat_map(|rungs| &rungs.features) {
            let optional = row.expected.iter().chain(&row.scatter).chain([&row.recorded]).flatten();
            for value in optional.chain([&row.difference, &row.standard_error]) {
                finite(&|| format!("feature {} of the rungs", row.name), *value)?;
            }
        }
        for share in self.laws.iter().flat_map(|law| &law.shares) {
            for parameter in &share.parameters {
                for value in [parameter.low, parameter.high].into_iter().flatten().chain([parameter.value]) {
                    finite(&|| format!("{} by {} alone", parameter.name, share.label), value)?;
                }
            }
            finite(&|| format!("misfit of {}", share.label), share.misfit)?;
        }
        for row in self.features.iter().chain(self.companions.iter().flat_map(|record| &record.features)) {
            let numbers =
                [row.recorded, row.simulated, row.scatter, row.sensitivity, row.published, row.published_uncertainty];
            for value in numbers.into_iter().flatten() {
                finite(&|| format!("feature {}", row.name), value)?;
            }
        }
        let of_lead = [Some(&self.drive), self.recorded.as_ref(), self.simulated.as_ref()];
        let of_others = self.companions.iter();
        let of_others = of_others.flat_map(|it| [Some(&it.drive), it.recorded.as_ref(), it.simulated.as_ref()]);
        for (name, trace) in
            ["drive", "recorded", "simulated"].into_iter().cycle().zip(of_lead.into_iter().chain(of_others))
        {
            for (index, value) in trace.iter().flat_map(|trace| &trace.values).enumerate() {
                finite(&|| format!("{name} sample {index}"), *value)?;
            }
        }
        Ok(())
    }
}
