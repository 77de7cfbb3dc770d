//! Where the width of every interval comes from.

use faer::Mat;
use serde::{Deserialize, Serialize};

use super::ensemble::{Ensemble, Known, Solution, add, inverse, slopes_at};

/// Where the width of an interval comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Noise of the record.
    Noise,
    /// Gaps, and what else differs from run to run.
    Runs,
    /// Sensitivity, clock, coupling, crosstalk and drift of the vibrometer.
    Instrument,
    /// Step and mesh of the model, or what a finer model changes.
    Model,
    StiffnessOverMass,
    /// True over recorded motion of the horn.
    HornScale,
    /// Mass of the beads.
    Mass,
}

impl Origin {
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Noise => "the noise of the record",
            Self::Runs => "gaps, which differ from run to run",
            Self::Instrument => "the vibrometer (sensitivity, clock, crosstalk, drift)",
            Self::Model => "step and mesh of the model",
            Self::StiffnessOverMass => "the beads' stiffness over their mass",
            Self::HornScale => "the scale of the horn's record",
            Self::Mass => "the mass of the beads",
        }
    }

    /// What would narrow an interval that mostly comes from it.
    #[must_use]
    pub fn remedy(self) -> &'static str {
        match self {
            Self::Noise => "a longer record, or a mean of several shots (averages)",
            Self::Runs => {
                "several shots of the same bench fitted together, or gaps that are stated smaller (--uncertainty gap)"
            }
            Self::Instrument => "a calibrated vibrometer: --uncertainty sensitivity",
            Self::Model => "a finer model or mesh (--model, model.mesh_density)",
            Self::StiffnessOverMass => "measured diameters and modulus: --uncertainty modulus",
            Self::HornScale => "a calibrated horn record: --uncertainty drive",
            Self::Mass => "weighed beads: --uncertainty mass",
        }
    }
}

impl Ensemble {
    /// Variance of ln of every parameter at the answer by its origin, G C (G C)' with G = (J' Σ⁻¹ J)⁻¹ J' Σ⁻¹ and C the columns of that origin: those of
    /// [`columns`](Self::columns), what is not known beforehand of stiffness over mass, and noise, which is the rest.
    pub(crate) fn origins(&self, known: &Known, solution: &Solution) -> Option<Vec<(Origin, Vec<f64>)>> {
        let size = self.dimension();
        let mut information = self.prior(known);
        let mut parts = Vec::new();
        for (number, regression) in self.regressions(known)?.iter().enumerate() {
            let rows = known.records[number].compared(&solution.placed[number]).1;
            let slopes = slopes_at(regression, &solution.z, self.is_quadratic(), &rows);
            let columns = self.columns(known, number, regression, &rows)?;
            let within = Self::whitened(known.records[number], regression, &columns, rows)?;
            let inner = within.covariance.inner(slopes.as_ref(), slopes.as_ref());
            add(&mut information, |a, b| inner[(a, b)]);
            parts.push(columns.parts.map(|columns| within.covariance.inner(slopes.as_ref(), columns.as_ref())));
        }
        let unit = inverse(&information);
        let moved = Mat::from_fn(size, size, |d, j| (0..size).map(|i| self.lower[d][i] * unit[i][j]).sum::<f64>());
        let total: Vec<f64> = self.outside(&unit).iter().enumerate().map(|(d, row)| row[d]).collect();
        let squares = |of: &Mat<f64>| -> Vec<f64> {
            let image = &moved * of;
            (0..size).map(|d| (0..image.ncols()).map(|j| image[(d, j)].powi(2)).sum()).collect()
        };
        let together = |part: usize| {
            let mut sum = vec![0.0; size];
            for of_record in &parts {
                sum.iter_mut().zip(squares(&of_record[part])).for_each(|(sum, more)| *sum += more);
            }
            sum
        };
        let origins = [Origin::Runs, Origin::Instrument, Origin::Model, Origin::HornScale];
        let mut all: Vec<(Origin, Vec<f64>)> =
            origins.into_iter().enumerate().map(|(part, it)| (it, together(part))).collect();
        if let Some(prior) = known.prior {
            let slope = Mat::from_fn(size, 1, |a, _| self.lower[size - 1][a] / prior);
            all.push((Origin::StiffnessOverMass, squares(&slope)));
        }
        let rest = |d: usize| (total[d] - all.iter().map(|(_, of)| of[d]).sum::<f64>()).max(0.0);
        let noise = (0..size).map(rest).collect();
        all.insert(0, (Origin::Noise, noise));
        for (_, variance) in &mut all {
            let widened = |d: usize| solution.covariance[d][d] / total[d];
            variance.iter_mut().enumerate().for_each(|(d, value)| *value *= widened(d));
        }
        Some(all)
    }
}
