//! Record less mean trace, as the report shows it.

use faer::Mat;

use super::{
    columns::CROSSTALK,
    ensemble::{Compared, Ensemble, Known, Solution, add, beside, inverse, slopes_at},
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
    /// What another clock of the record would explain.
    pub clock: Clock,
    /// Of shots of one experiment: ln of the level of the drive over that of all, all other parameters held, and its standard deviation.
    pub level: Option<[f64; 2]>,
}

/// A second of the record's clock over one of the horn's, less 1.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clock {
    pub late: f64,
    pub deviation: f64,
    /// Share of T² that it explains.
    pub share: f64,
}

/// Standard deviations from which a difference of clocks is certain, the largest that is a clock's, and the share of T² above which it explains much.
const CERTAIN: f64 = 4.0;
const MOST: f64 = 0.02;
const MUCH: f64 = 0.3;

impl Clock {
    /// Whether it is certain, at least `least` and not too much for a clock.
    pub(crate) fn differs_by(self, least: f64) -> bool {
        (least.max(CERTAIN * self.deviation)..MOST).contains(&self.late.abs())
    }

    pub(crate) fn explains_much(self) -> bool {
        self.share > MUCH
    }

    /// Which way the record's clock differs.
    pub(crate) fn direction(self) -> &'static str {
        if self.late > 0.0 { "slow" } else { "fast" }
    }
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
            let [further, shift] = [
                nuisances.columns((record.step, record.peak), &mean, rows),
                nuisances.shift_column(record.step, &mean, rows),
            ];
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
            let columns = nuisances.crosstalk(record.peak, rows);
            let amounts = within.covariance.inner(columns.as_ref(), rest.as_ref());
            let found = within.covariance.inner(columns.as_ref(), columns.as_ref());
            let left_open = (1.0 - found[(0, 0)].min(found[(1, 1)])).max(0.0).sqrt();
            Some(Residual {
                clock: self.clock(known, (number, regression), solution, (&within, &rest)),
                crosstalk: [amounts[(0, 0)].hypot(amounts[(1, 0)]), left_open].map(|amount| CROSSTALK * amount),
                times: rows.iter().map(|t| record.time(*t as f64 + placed.shift)).collect(),
                left: (0..rows.len()).map(|i| left[(i, 0)]).collect(),
                deviations: rows.iter().map(|t| square(*t).sqrt()).collect(),
                level: level.flatten(),
            })
        };
        self.regressions(known)?.iter().enumerate().map(of).collect()
    }

    /// The clock of one record, refitted with the parameters: b/q with q = d'Pd and b = d'Pr, d the clock's column and P what the parameters leave of
    /// Σ⁻¹. Σ has the column once already: freed of it, T² falls by b²/q, and the deviation is √((1 − q)/q).
    fn clock(
        &self,
        known: &Known,
        (number, regression): (usize, &Regression),
        solution: &Solution,
        (within, rest): (&Compared, &Mat<f64>),
    ) -> Clock {
        let (nuisances, rows) = (&known.nuisances[number], &within.rows);
        let mean = regression.mean(&vec![0.0; solution.z.len()]);
        let column = nuisances.clock_column(known.records[number].step, &mean, rows);
        let slopes = slopes_at(regression, &solution.z, self.is_quadratic(), rows);
        let all = beside(&[column.as_ref(), rest.as_ref(), slopes.as_ref()]);
        let inner = within.covariance.inner(all.as_ref(), all.as_ref());
        let mut information = self.prior(known);
        add(&mut information, |i, j| inner[(2 + i, 2 + j)]);
        let unit = inverse(&information);
        let left = |a: usize, b: usize| {
            let taken = |(i, row): (usize, &Vec<f64>)| -> f64 {
                row.iter().enumerate().map(|(j, unit)| inner[(a, 2 + i)] * unit * inner[(2 + j, b)]).sum()
            };
            inner[(a, b)] - unit.iter().enumerate().map(taken).sum::<f64>()
        };
        let (q, b) = (left(0, 0).clamp(f64::MIN_POSITIVE, 1.0), left(0, 1));
        Clock {
            late: nuisances.clock * b / q,
            deviation: nuisances.clock * ((1.0 - q) / q).sqrt(),
            share: b * b / (q * solution.squares),
        }
    }
}
