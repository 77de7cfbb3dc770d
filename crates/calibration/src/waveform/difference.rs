//! What the model above the chain changes of a trace, by pairs of runs under the same nuisances.
//!
//! Near an answer V_above(t) − V_chain(t) = D₀(t) + D(t) z + R(t) with z about the answer in units of the pairs' spread. D₀ + D z is added to every run
//! of the chain; R, what a pair leaves, joins the covariance as columns.

use faer::{Mat, MatRef};

use super::{
    ensemble::{as_columns, beside, solved},
    regression::Regression,
};

/// Fewest pairs behind the number of coefficients that say anything.
const FEWEST: usize = 8;

/// Farthest from the middle of the pairs that their straight line is followed, in their spread.
const REACH: f64 = 2.5;

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Difference {
    centre: Vec<f64>,
    /// Rows of the lower triangular matrix that turns z into ln.
    lower: Vec<Vec<f64>>,
    /// D₀ and D, a column each.
    coefficients: Mat<f64>,
    /// R of every pair over √(n − k), with what is not known of D₀; then what is not known of the change by a finer mesh.
    pub(super) columns: Mat<f64>,
    pairs: usize,
    /// That change, where it is known.
    pub(super) mesh: Option<Mesh>,
}

/// What a finer mesh changes of a trace.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mesh {
    pub change: Vec<f64>,
    /// Cycles of a run in which that is too much of it for a correction.
    pub coarse: Vec<bool>,
}

impl Difference {
    /// Of pairs at points (ln) about a centre, some of which may have failed; `None` of too few.
    pub(crate) fn of(
        (centre, lower): (&[f64], &[Vec<f64>]),
        at: &[Vec<f64>],
        own: Vec<Option<Vec<f64>>>,
        above: Vec<Option<Vec<f64>>>,
    ) -> Option<Self> {
        let finished = at.iter().zip(differences(own, above)).filter_map(|(at, apart)| Some((at, apart?)));
        let (at, apart): (Vec<&Vec<f64>>, Vec<Vec<f64>>) = finished.unzip();
        let points = at.into_iter().map(|at| z(centre, lower, at)).collect::<Option<Vec<_>>>()?;
        let pairs = points.len();
        if pairs < centre.len() + 1 + FEWEST {
            return None;
        }
        let traces = as_columns(&apart);
        let Regression { coefficients, residuals, freedom } = Regression::of(&points, traces.as_ref(), false)?;
        let scale = ((1.0 + 1.0 / pairs as f64) / freedom).sqrt();
        let columns = Mat::from_fn(traces.nrows(), pairs, |t, pair| scale * residuals[(t, pair)]);
        Some(Self { centre: centre.to_vec(), lower: lower.to_vec(), coefficients, columns, pairs, mesh: None })
    }

    /// The same with what a finer mesh changes, and columns of what is not known of that.
    pub(crate) fn with(self, mesh: Mesh, unknown: &Mat<f64>) -> Self {
        let rows = mesh.change.len().min(self.columns.nrows());
        let change = |t: usize, j: usize| if j == 0 { mesh.change[t] } else { 0.0 };
        let coefficients =
            Mat::from_fn(rows, self.coefficients.ncols(), |t, j| self.coefficients[(t, j)] + change(t, j));
        let columns = beside(&[self.columns.as_ref().subrows(0, rows), unknown.as_ref().subrows(0, rows)]);
        Self { coefficients, columns, mesh: Some(mesh), ..self }
    }

    /// What is not known of the change from the chain alone.
    pub(crate) fn of_pairs(&self) -> MatRef<'_, f64> {
        self.columns.as_ref().subcols(0, self.pairs)
    }

    /// The same for a bench that is altered a little: the whole of D₀ is uncertain.
    pub(crate) fn altered(&self) -> Self {
        let mean = self.coefficients.subcols(0, 1);
        Self { columns: beside(&[self.columns.as_ref(), mean]), ..self.clone() }
    }

    /// Turn a run of the chain at a point (ln) into what the model above expects: factor 1. −1 takes it back.
    pub(crate) fn add_times(&self, factor: f64, run: &mut [f64], at: &[f64]) {
        let Some(z) = z(&self.centre, &self.lower, at) else { return };
        let z: Vec<f64> = z.into_iter().map(|z| z.clamp(-REACH, REACH)).collect();
        for (t, value) in run.iter_mut().enumerate().take(self.coefficients.nrows()) {
            let slope = z.iter().enumerate().map(|(d, z)| self.coefficients[(t, d + 1)] * z).sum::<f64>();
            *value += factor * (self.coefficients[(t, 0)] + slope);
        }
    }

    /// Largest distance of a point (ln) from the middle of the pairs, in their spread.
    pub(crate) fn distance(&self, at: &[f64]) -> f64 {
        z(&self.centre, &self.lower, at)
            .map_or(f64::INFINITY, |z| z.iter().fold(0.0, |most, z| f64::max(most, z.abs())))
    }
}

/// Other − own, of every pair of runs that both finished.
pub(super) fn differences(own: Vec<Option<Vec<f64>>>, other: Vec<Option<Vec<f64>>>) -> Vec<Option<Vec<f64>>> {
    let of = |(own, other): (Option<Vec<f64>>, Option<Vec<f64>>)| {
        let (own, other) = own.zip(other)?;
        Some(other.iter().zip(&own).map(|(other, own)| other - own).collect())
    };
    own.into_iter().zip(other).map(of).collect()
}

fn z(centre: &[f64], lower: &[Vec<f64>], at: &[f64]) -> Option<Vec<f64>> {
    let apart: Vec<f64> = at.iter().zip(centre).map(|(a, b)| a - b).collect();
    solved(lower, &apart)
}
