//! p-value of the waveform: runs that are taken as records.

use faer::Mat;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    ensemble::{Ensemble, Known, Solution, add, beside, inverse, slopes_at},
    regression::Regression,
};
use crate::agreement::tail_share;
use granchain_signal::LowPass;

/// Folds of the cross-validation behind p.
const FOLDS: usize = 5;

/// Degrees of freedom of the tail of ln T.
const TAIL: f64 = 10.0;

impl Ensemble {
    /// p-value: the share of runs that, taken as records, fit the other runs as badly as the records do.
    pub(crate) fn share_beyond(&self, known: &Known, solution: &Solution, random: &mut ChaCha8Rng) -> Option<f64> {
        let own = solution.squares;
        let mut others: Vec<f64> = Vec::new();
        let count = self.points.len();
        for fold in 0..FOLDS {
            let (out, kept): (Vec<usize>, Vec<usize>) = (0..count).partition(|run| run % FOLDS == fold);
            let part = self.only(&kept);
            let regressions = part.regressions(known)?;
            let mut sums: Vec<(f64, Vec<f64>)> = vec![(0.0, vec![0.0; self.dimension()]); out.len()];
            let mut information = self.prior(known);
            for (number, regression) in regressions.iter().enumerate() {
                let (record, placed) = (known.records[number], solution.placed[number]);
                let (_, rows) = record.compared(&placed);
                let within = part.compared(known, number, regression, rows.clone())?;
                let quadratic = part.is_quadratic();
                let slopes = slopes_at(regression, &solution.z, quadratic, &rows);
                let rest = part.left_out(self, known, (number, &out), (regression, &rows), random);
                let all = beside(&[rest.as_ref(), slopes.as_ref()]);
                let inner = within.covariance.inner(all.as_ref(), all.as_ref());
                let runs = out.len();
                for (run, (square, gradient)) in sums.iter_mut().enumerate() {
                    *square += inner[(run, run)];
                    for (d, sum) in gradient.iter_mut().enumerate() {
                        *sum += inner[(run, runs + d)];
                    }
                }
                add(&mut information, |i, j| inner[(runs + i, runs + j)]);
            }
            let unit = inverse(&information);
            for (square, gradient) in sums {
                let image: Vec<f64> =
                    unit.iter().map(|row| row.iter().zip(&gradient).map(|(a, b)| a * b).sum()).collect();
                others.push(square - gradient.iter().zip(&image).map(|(a, b)| a * b).sum::<f64>());
            }
        }
        Some(share(own, &others))
    }

    /// A subset of the runs.
    fn only(&self, kept: &[usize]) -> Self {
        Self {
            centre: self.centre.clone(),
            lower: self.lower.clone(),
            points: kept.iter().map(|run| self.points[*run].clone()).collect(),
            traces: self
                .traces
                .iter()
                .map(|traces| Mat::from_fn(traces.nrows(), kept.len(), |t, run| traces[(t, kept[run])]))
                .collect(),
        }
    }

    /// Left-out runs as records: deviation from the other runs' expectation, with noise and instrument effects.
    fn left_out(
        &self,
        all: &Self,
        known: &Known,
        (number, out): (usize, &[usize]),
        (regression, rows): (&Regression, &[usize]),
        random: &mut ChaCha8Rng,
    ) -> Mat<f64> {
        let (record, nuisances) = (known.records[number], &known.nuisances[number]);
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let (first, len) = (rows[0], rows[rows.len() - 1] + 1 - rows[0]);
        let low_pass = LowPass::new(1.0, len, 0.5 * record.band);
        let mean: Vec<f64> = (0..regression.coefficients.nrows()).map(|t| regression.coefficients[(t, 0)]).collect();
        let further = nuisances.columns((record.step, record.peak), &mean, rows);
        let corrected = known.correction.get(number);
        let louder = record.louder(mean.iter().copied());
        let traces: Vec<Vec<f64>> = out
            .iter()
            .map(|run| {
                let expected = regression.mean(&all.points[*run]);
                // What the record's own noise is known to.
                let sigma = record.sigma * (1.0 + normal() / (2.0 * record.freedom).sqrt()).max(0.3);
                let noise: Vec<f64> = (0..len).map(|_| sigma * normal()).collect();
                let noise = if record.band < 1.0 { low_pass.apply(&noise) } else { noise };
                let mut drawn = |count: usize| -> Vec<f64> { (0..count).map(|_| normal()).collect() };
                let amounts = drawn(further.ncols());
                let unknown = drawn(corrected.map_or(0, |(_, columns)| columns.ncols()));
                rows.iter()
                    .enumerate()
                    .map(|(i, t)| {
                        let known: f64 = amounts.iter().enumerate().map(|(j, amount)| amount * further[(i, j)]).sum();
                        let more = corrected.map_or(0.0, |(mean, columns)| {
                            mean[*t]
                                + unknown.iter().enumerate().map(|(j, amount)| amount * columns[(*t, j)]).sum::<f64>()
                        });
                        all.traces[number][(*t, *run)] + more - expected[*t]
                            + noise[t - first] * louder.get(*t).unwrap_or(&1.0)
                            + known
                    })
                    .collect()
            })
            .collect();
        Mat::from_fn(rows.len(), out.len(), |i, run| traces[run][i])
    }
}

/// Share of `others` that are at least `own`; the tail is as wide as all of their logarithms, or as their upper half
/// if that is wider.
fn share(own: f64, others: &[f64]) -> f64 {
    tail_share(own, others, |logarithms, mean| {
        let scale = |values: &mut dyn Iterator<Item = &f64>| {
            let (sum, number) = values.fold((0.0, 0.0), |(sum, n), value| (sum + (value - mean).powi(2), n + 1.0));
            (sum / f64::max(1.0, number)).sqrt()
        };
        let all = scale(&mut logarithms.iter());
        let upper = scale(&mut logarithms.iter().filter(|value| **value > mean));
        (TAIL, all.max(upper).max(1e-12))
    })
}
