//! Record less mean trace, as the report shows it.

use super::{
    columns::CROSSTALK,
    ensemble::{Ensemble, Known, Solution, beside},
    regression::Regression,
};

/// Residual of one record at the answer.
#[derive(Debug, Clone, PartialEq)]
pub struct Residual {
    /// Instants of the samples compared, s, record time.
    pub times: Vec<f64>,
    /// Record − expected run, m/s.
    pub left: Vec<f64>,
    /// Standard deviation of that by noise and from run to run, m/s.
    pub deviations: Vec<f64>,
    /// Crosstalk of the drive over the record's peak, and its standard deviation.
    pub crosstalk: [f64; 2],
    /// Of shots of one experiment: ln of the level of the drive over that of all, all other parameters held, and its standard deviation.
    pub level: Option<[f64; 2]>,
}

impl Ensemble {
    /// Residual of every record at the answer, without the most likely shift, drift, crosstalk and sensitivity of its instrument.
    /// `alpha` is the number of the parameter that the level multiplies, where records are shots of one experiment.
    pub(crate) fn residuals(&self, known: &Known, solution: &Solution, alpha: Option<usize>) -> Option<Vec<Residual>> {
        let of = |(number, regression): (usize, &Regression)| {
            let (record, placed) = (known.records[number], solution.placed[number]);
            let (within, rest) = self.remainder(known, number, regression, solution)?;
            let rows = &within.rows;
            // The covariance's own columns: others that differ a little would be taken for signal.
            let (nuisances, mean) = (&known.nuisances[number], regression.mean(&vec![0.0; solution.z.len()]));
            let [further, shift] =
                [nuisances.columns(record, &mean, rows), nuisances.shift_column(record, &mean, rows)];
            let instrument = beside(&[further.as_ref(), shift.as_ref()]);
            let left = &rest - &instrument * within.covariance.inner(instrument.as_ref(), rest.as_ref());
            let louder = record.louder(mean.iter().copied());
            let sigma = |t: usize| record.sigma * louder.get(t).unwrap_or(&1.0);
            let square = |t: usize| record.band * sigma(t).powi(2) + Self::variance(known, number, regression, t);
            let level = alpha.map(|alpha| {
                let slope = self.level_column(regression, alpha, 1.0, rows)?;
                let information = within.covariance.inner(slope.as_ref(), slope.as_ref())[(0, 0)];
                let found = within.covariance.inner(slope.as_ref(), rest.as_ref())[(0, 0)] / information;
                Some([found, information.sqrt().recip()])
            });
            // Its amounts in phase and in quadrature, each 1 beforehand, and what is left of that uncertainty.
            let columns = nuisances.crosstalk(record, rows);
            let amounts = within.covariance.inner(columns.as_ref(), rest.as_ref());
            let found = within.covariance.inner(columns.as_ref(), columns.as_ref());
            let left_open = (1.0 - found[(0, 0)].min(found[(1, 1)])).max(0.0).sqrt();
            Some(Residual {
                crosstalk: [amounts[(0, 0)].hypot(amounts[(1, 0)]), left_open].map(|amount| CROSSTALK * amount),
                times: rows.iter().map(|t| record.time(*t as f64 + placed.shift)).collect(),
                left: (0..rows.len()).map(|i| left[(i, 0)]).collect(),
                deviations: rows.iter().map(|t| square(*t).sqrt()).collect(),
                level: level.flatten(),
            })
        };
        self.regressions(known)?.iter().enumerate().map(of).collect()
    }
}
