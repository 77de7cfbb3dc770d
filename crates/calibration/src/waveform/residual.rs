//! Record less mean trace, as the report shows it.

use faer::Mat;

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
}

impl Ensemble {
    /// Residual of every record at the answer, without the most likely shift, drift, crosstalk and sensitivity of its instrument.
    pub fn residuals(&self, known: &Known, solution: &Solution) -> Option<Vec<Residual>> {
        let of = |(number, regression): (usize, &Regression)| {
            let (record, placed) = (known.records[number], solution.placed[number]);
            let (values, rows) = record.compared(&placed);
            let within = self.compared(known, number, regression, rows.clone())?;
            let mean = regression.mean(&solution.z);
            let rest = Mat::from_fn(rows.len(), 1, |i, _| values[rows[i]] - mean[rows[i]]);
            // The covariance's own columns: others that differ a little would be taken for signal.
            let (nuisances, mean) = (&known.nuisances[number], regression.mean(&vec![0.0; solution.z.len()]));
            let [further, shift] =
                [nuisances.columns(record, &mean, &rows), nuisances.shift_column(record, &mean, &rows)];
            let instrument = beside(&[further.as_ref(), shift.as_ref()]);
            let left = &rest - &instrument * within.covariance.inner(instrument.as_ref(), rest.as_ref());
            let square = |t: usize| {
                let runs = regression.residuals.row(t).squared_norm_l2() / regression.freedom;
                let further = known.correction.get(number).map_or(0.0, |(_, columns)| columns.row(t).squared_norm_l2());
                record.band * record.sigma.powi(2) + runs + further
            };
            // Its amounts in phase and in quadrature, each 1 beforehand, and what is left of that uncertainty.
            let columns = nuisances.crosstalk(record, &rows);
            let amounts = within.covariance.inner(columns.as_ref(), rest.as_ref());
            let known = within.covariance.inner(columns.as_ref(), columns.as_ref());
            let left_open = (1.0 - known[(0, 0)].min(known[(1, 1)])).max(0.0).sqrt();
            Some(Residual {
                crosstalk: [amounts[(0, 0)].hypot(amounts[(1, 0)]), left_open].map(|amount| CROSSTALK * amount),
                times: rows.iter().map(|t| record.time(*t as f64 + placed.shift)).collect(),
                left: (0..rows.len()).map(|i| left[(i, 0)]).collect(),
                deviations: rows.iter().map(|t| square(*t).sqrt()).collect(),
            })
        };
        self.regressions(known)?.iter().enumerate().map(of).collect()
    }

    /// ln of the level of each record's drive over that of all records, and its standard deviation, by all other parameters held; `alpha` is the number
    /// of the parameter that the level multiplies.
    pub fn levels(&self, known: &Known, solution: &Solution, alpha: usize) -> Option<Vec<[f64; 2]>> {
        let of = |(number, regression): (usize, &Regression)| {
            let (values, rows) = known.records[number].compared(&solution.placed[number]);
            let within = self.compared(known, number, regression, rows.clone())?;
            let mean = regression.mean(&solution.z);
            let rest = Mat::from_fn(rows.len(), 1, |i, _| values[rows[i]] - mean[rows[i]]);
            let slope = self.level_column(regression, alpha, 1.0, &rows)?;
            let information = within.covariance.inner(slope.as_ref(), slope.as_ref())[(0, 0)];
            Some([
                within.covariance.inner(slope.as_ref(), rest.as_ref())[(0, 0)] / information,
                information.sqrt().recip(),
            ])
        };
        self.regressions(known)?.iter().enumerate().map(of).collect()
    }
}
