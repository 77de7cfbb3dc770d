//! Runs of all records near an answer, and the parameters inferred from them.

use faer::{Mat, MatRef};

use super::{
    columns::Nuisances,
    difference::Mesh,
    minimum::minimum,
    record::RecordTrace,
    regression::{Covariance, Misfit, Regression, slopes, terms},
};
use granchain_signal::feature::fingerprint::SAMPLES_PER_CYCLE;

/// Largest variance between runs, over the signal's mean square in a cycle, for the cycle to be predictable.
const PREDICTABLE: f64 = 0.1;

/// Shortest window after the record's onset, cycles.
const LEAST_CYCLES: usize = 4;

/// Cycles before its onset that are compared too.
pub(super) const BEFORE: usize = 4;

/// Cycles at the end of record and run that are left out because of the filters.
const EDGE: usize = 1;

/// T/N above which the window is shortened, the factor, and the most repetitions.
const MISFIT: f64 = 1.5;
const SHORTER: f64 = 0.6;
const SHORTENED: i32 = 6;

/// Share of the worst outlier beyond which others are left out with it.
const WORST: f64 = 0.3;

/// Negligible change of the shift, s.
const STILL: f64 = 20e-9;

/// Most shifts of a record.
const SHIFTS: usize = 8;

/// Factor on the standard deviations, tuned on synthetic records, for the non-linearity that Gaussian statistics leave
/// out.
const MARGIN: f64 = 1.05;

/// Most directions that the runs' own differences may cover, over their degrees of freedom.
const MOST_COVERED: f64 = 0.9;

/// Runs distributed about a centre, and the traces of every record.
pub(super) struct Ensemble {
    /// Centre of the parameters, ln.
    pub centre: Vec<f64>,
    /// Rows of the lower triangular matrix that turns z into ln.
    pub lower: Vec<Vec<f64>>,
    pub points: Vec<Vec<f64>>,
    /// A column a run, of every record.
    pub traces: Vec<Mat<f64>>,
}

/// Compared part of one record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placed {
    /// Sample of the record at the run's first.
    pub shift: f64,
    /// Samples of the run that are compared.
    pub from: usize,
    pub to: usize,
    /// Last sample that runs predict, and the last that could be compared.
    pub predictable: usize,
    pub last: usize,
}

pub(super) struct Known<'a> {
    pub records: Vec<&'a RecordTrace>,
    pub nuisances: Vec<Nuisances>,
    /// Standard deviation of ln of the last parameter about 0, if it is a nuisance.
    pub prior: Option<f64>,
    /// Number of the parameter that scales with the drive level, and the uncertainty of ln of that level for each of
    /// several records. For a single record it is added to the answer instead.
    pub level: Option<(usize, Vec<f64>)>,
    /// For every record: mean change of a trace with a finer step, and columns of its uncertainty.
    pub correction: Vec<(Vec<f64>, Mat<f64>)>,
    /// For every record, what a finer mesh changes, where that is known.
    pub meshes: Vec<Option<&'a Mesh>>,
}

/// Parameters inferred from the records.
#[derive(Debug, Clone)]
pub(super) struct Solution {
    pub z: Vec<f64>,
    pub at: Vec<f64>,
    pub covariance: Vec<Vec<f64>>,
    /// T, and its number of samples.
    pub squares: f64,
    pub samples: f64,
    pub placed: Vec<Placed>,
}

impl Solution {
    /// T/N.
    pub(crate) fn reduced(&self) -> f64 {
        self.squares / self.samples.max(1.0)
    }

    /// Sample of every record at the runs' first.
    pub(crate) fn shifts(&self) -> Vec<f64> {
        self.placed.iter().map(|placed| placed.shift).collect()
    }

    /// Distance of a point (ln) in standard deviations, per parameter.
    pub(crate) fn distance(&self, from: &[f64]) -> f64 {
        let unit = inverse(&self.covariance);
        let apart: Vec<f64> = self.at.iter().zip(from).map(|(a, b)| a - b).collect();
        let image = unit.iter().map(|row| row.iter().zip(&apart).map(|(a, b)| a * b).sum::<f64>());
        (image.zip(&apart).map(|(a, b)| a * b).sum::<f64>() / apart.len() as f64).sqrt()
    }
}

/// Inverse of a small symmetric matrix; zeros if it is singular.
pub(crate) fn inverse(matrix: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let size = matrix.len();
    let full = nalgebra::DMatrix::from_fn(size, size, |i, j| matrix[i][j]);
    let inverse = full.cholesky().map(|factor| factor.inverse());
    (0..size).map(|i| (0..size).map(|j| inverse.as_ref().map_or(0.0, |m| m[(i, j)])).collect()).collect()
}

/// Factor on the standard deviations of an answer of which the runs' own differences cover that share.
fn widening(covered: f64) -> f64 {
    MARGIN / (1.0 - covered.min(MOST_COVERED))
}

/// Adds the entries `of` row and column to a square matrix.
pub(super) fn add(matrix: &mut [Vec<f64>], of: impl Fn(usize, usize) -> f64) {
    for (i, row) in matrix.iter_mut().enumerate() {
        row.iter_mut().enumerate().for_each(|(j, entry)| *entry += of(i, j));
    }
}

/// z of L z = x, L lower triangular by its rows; `None` where it is singular.
pub(super) fn solved(lower: &[Vec<f64>], x: &[f64]) -> Option<Vec<f64>> {
    let full = nalgebra::DMatrix::from_fn(x.len(), x.len(), |a, b| lower[a][b]);
    Some(full.solve_lower_triangular(&nalgebra::DVector::from_column_slice(x))?.as_slice().to_vec())
}

/// Columns of a covariance.
pub(super) struct Columns {
    /// Differences from run to run, the instrument, the correction of the model, the level of the drive.
    pub parts: [Mat<f64>; 4],
    /// The column of the shift, which is the first of the instrument's.
    pub shift: Mat<f64>,
    /// The mean trace.
    pub mean: Vec<f64>,
}

/// Compared samples of one record, whitened by one covariance.
pub(super) struct Compared {
    pub rows: Vec<usize>,
    pub covariance: Covariance,
    /// J, Q and the shift's column.
    others: Mat<f64>,
}

impl Ensemble {
    pub(super) fn dimension(&self) -> usize {
        self.centre.len()
    }

    /// ln of the parameters at z.
    pub(crate) fn at(&self, z: &[f64]) -> Vec<f64> {
        let moved = |row: &Vec<f64>| row.iter().zip(z).map(|(l, z)| l * z).sum::<f64>();
        self.lower.iter().zip(&self.centre).map(|(row, centre)| centre + moved(row)).collect()
    }

    /// Whether there are enough runs for quadratic terms.
    pub(super) fn is_quadratic(&self) -> bool {
        self.points.len() > 3 * terms(self.dimension(), true)
    }

    /// Regression of every record's traces, corrected for the step error.
    pub(super) fn regressions(&self, known: &Known) -> Option<Vec<Regression>> {
        let of = |(record, traces): (usize, &Mat<f64>)| {
            let mut regression = Regression::of(&self.points, traces.as_ref(), self.is_quadratic())?;
            if let Some((mean, _)) = known.correction.get(record) {
                for (t, more) in mean.iter().enumerate().take(regression.coefficients.nrows()) {
                    regression.coefficients[(t, 0)] += more;
                }
            }
            Some(regression)
        };
        self.traces.iter().enumerate().map(of).collect()
    }

    /// Where one record lies on the mean trace, and what of it may be compared.
    fn place(known: &Known, number: usize, regression: &Regression, shift: f64) -> Placed {
        let record = known.records[number];
        let cycle = SAMPLES_PER_CYCLE;
        let len = regression.coefficients.nrows();
        let onset = (record.onset as f64 - shift).max(0.0) as usize;
        let end = (record.len() as f64 - shift).max(0.0) as usize;
        let last = len.min(end).saturating_sub(EDGE * cycle);
        let square = |t: usize| (regression.coefficients[(t, 0)].powi(2), Self::variance(known, number, regression, t));
        let first = onset / cycle + 1;
        let parts = (first..last / cycle).find(|cycle_number| {
            let (mean, rest) = (cycle_number * cycle..(cycle_number + 1) * cycle)
                .map(square)
                .fold((0.0, 0.0), |sum, (mean, rest)| (sum.0 + mean, sum.1 + rest));
            let coarse = known.meshes[number].is_some_and(|mesh| mesh.coarse.get(*cycle_number) == Some(&true));
            coarse || rest > PREDICTABLE * (mean + rest)
        });
        let predictable = parts.map_or(last, |number| number * cycle).clamp(0, last);
        let to = predictable.max(onset + LEAST_CYCLES * cycle).min(last);
        let start = (-shift).max(0.0).ceil() as usize;
        Placed { shift, from: onset.saturating_sub(BEFORE * cycle).max(start).min(to), to, predictable, last }
    }

    /// Parameters inferred from the records; their shifts are roughly known.
    pub(crate) fn solve(&self, known: &Known, shifts: &[f64], shorten: bool) -> Option<Solution> {
        let regressions = self.regressions(known)?;
        let each = regressions.iter().zip(shifts).enumerate();
        let mut placed: Vec<Placed> =
            each.map(|(number, (regression, shift))| Self::place(known, number, regression, *shift)).collect();
        let mut times = 0;
        loop {
            let solution = self.solve_within(known, &regressions, &mut placed, SHORTER.powi(times))?;
            let least = |(placed, record): (&Placed, &&RecordTrace)| {
                let onset = (record.onset as f64 - placed.shift).max(0.0) as usize;
                placed.to <= onset + LEAST_CYCLES * SAMPLES_PER_CYCLE + 1
            };
            let shortest = solution.placed.iter().zip(&known.records).all(least);
            if !shorten || solution.reduced() < MISFIT || shortest || times == SHORTENED {
                return Some(solution);
            }
            times += 1;
        }
    }

    fn solve_within(
        &self,
        known: &Known,
        regressions: &[Regression],
        placed: &mut [Placed],
        shorter: f64,
    ) -> Option<Solution> {
        let mut moved = f64::INFINITY;
        let mut compared: Vec<Option<Compared>> = known.records.iter().map(|_| None).collect();
        let mut result = None;
        for _ in 0..SHIFTS {
            if moved < STILL {
                break;
            }
            let mut total: Option<Misfit> = None;
            let mut of_shifts = Vec::new();
            let mut samples = 0.0;
            for (number, (record, regression)) in known.records.iter().zip(regressions).enumerate() {
                let mut window = Self::place(known, number, regression, placed[number].shift);
                let onset = (record.onset as f64 - window.shift).max(0.0);
                let length = (shorter * (window.to as f64 - onset)).max((LEAST_CYCLES * SAMPLES_PER_CYCLE) as f64);
                window.to = ((onset + length) as usize).min(window.to);
                placed[number] = window;
                let (values, rows) = record.compared(&window);
                if rows.len() < 2 * SAMPLES_PER_CYCLE {
                    return None;
                }
                let within = match &mut compared[number] {
                    Some(within) if within.rows == rows => within,
                    place => place.insert(self.compared(known, number, regression, rows)?),
                };
                let rest = Mat::from_fn(within.rows.len(), 1, |i, _| {
                    let t = within.rows[i];
                    values[t] - regression.coefficients[(t, 0)]
                });
                let all = beside(&[rest.as_ref(), within.others.as_ref()]);
                let inner = within.covariance.inner(all.as_ref(), all.as_ref());
                let count = inner.nrows() - 1;
                samples += within.rows.len() as f64 * record.band;
                of_shifts.push((0..count).map(|j| inner[(count, j)]).collect::<Vec<f64>>());
                let gram = Mat::from_fn(count, count, |i, j| inner[(i, j)]);
                total = Some(match total {
                    None => Misfit { gram, dimension: self.dimension(), quadratic: self.is_quadratic() },
                    Some(sum) => Misfit { gram: sum.gram + gram, ..sum },
                });
            }
            let mut misfit = total?;
            if let Some(prior) = known.prior {
                let last = self.dimension() - 1;
                let slope: Vec<f64> = self.lower[last].iter().map(|l| l / prior).collect();
                misfit.add_prior(&slope, -self.centre[last] / prior);
            }
            let z = minimum(&misfit);
            moved = 0.0;
            for ((placed, of_shift), (record, nuisances)) in
                placed.iter_mut().zip(&of_shifts).zip(known.records.iter().zip(&known.nuisances))
            {
                let phi = misfit.phi(&z);
                let found: f64 = of_shift.iter().zip(&phi).map(|(a, b)| a * b).sum();
                let by = found * nuisances.shift;
                placed.shift -= by / record.step;
                moved = f64::max(moved, by.abs());
            }
            result = Some((z, misfit, samples));
        }
        let (z, misfit, samples) = result?;
        let covered =
            compared.iter().flatten().zip(regressions).map(|(within, regression)| self.covered(within, regression));
        let factor = widening(covered.fold(0.0, f64::max)).powi(2);
        let mut covariance = self.outside(&inverse(&misfit.information(&z)));
        covariance.iter_mut().flatten().for_each(|entry| *entry *= factor);
        let squares = misfit.squares(&z);
        Some(Solution { at: self.at(&z), z, covariance, squares, samples, placed: placed.to_vec() })
    }

    /// The parameters' share of what the runs' own differences could as well explain.
    fn covered(&self, within: &Compared, regression: &Regression) -> f64 {
        within.covariance.directions(self.points.len()) / regression.freedom
    }

    /// Cramér–Rao bound at the centre of the runs, (J' Σ⁻¹ J)⁻¹ in ln, for records that lie at `shifts`, as a [`Solution`] without misfit; and the
    /// factor by which the standard deviations of an answer are larger. Values of the records are not used, only which samples are compared.
    pub(crate) fn bound(&self, known: &Known, shifts: &[f64]) -> Option<(Solution, f64)> {
        let dimension = self.dimension();
        let mut information = self.prior(known);
        let (mut placed, mut samples, mut covered) = (Vec::new(), 0.0, 0.0);
        for (number, (regression, shift)) in self.regressions(known)?.iter().zip(shifts).enumerate() {
            let window = Self::place(known, number, regression, *shift);
            let rows = known.records[number].compared(&window).1;
            if rows.len() < 2 * SAMPLES_PER_CYCLE {
                return None;
            }
            samples += rows.len() as f64 * known.records[number].band;
            let within = self.compared(known, number, regression, rows)?;
            let slopes = within.others.as_ref().subcols(0, dimension);
            let inner = within.covariance.inner(slopes, slopes);
            add(&mut information, |a, b| inner[(a, b)]);
            covered = f64::max(covered, self.covered(&within, regression));
            placed.push(window);
        }
        let covariance = self.outside(&inverse(&information));
        let (z, at) = (vec![0.0; dimension], self.centre.clone());
        Some((Solution { z, at, covariance, squares: 0.0, samples, placed }, widening(covered)))
    }

    /// Runs by their misfit to the records over the windows, best first: z of each.
    pub(crate) fn ranked(&self, known: &Known, placed: &[Placed]) -> Vec<&Vec<f64>> {
        let mut sums = vec![0.0; self.points.len()];
        for ((record, placed), traces) in known.records.iter().zip(placed).zip(&self.traces) {
            let (values, rows) = record.compared(placed);
            for (run, sum) in sums.iter_mut().enumerate() {
                *sum += rows.iter().map(|t| (values[*t] - traces[(*t, run)]).powi(2)).sum::<f64>();
            }
        }
        let mut order: Vec<usize> = (0..sums.len()).collect();
        order.sort_by(|a, b| sums[*a].total_cmp(&sums[*b]));
        order.into_iter().map(|run| &self.points[run]).collect()
    }

    /// Samples of every record beyond the given number of standard deviations of noise and runs.
    pub(crate) fn outliers(&self, known: &Known, solution: &Solution) -> Option<Vec<Vec<usize>>> {
        let of = |(number, regression): (usize, &Regression)| {
            let (record, placed) = (known.records[number], solution.placed[number]);
            let (within, rest) = self.remainder(known, number, regression, solution)?;
            let (rows, left) = (&within.rows, within.covariance.left(rest.as_ref()));
            // The worst hides others behind it.
            let worst = (0..rows.len()).map(|i| left[(i, 0)].abs()).fold(0.0, f64::max);
            let far = |i: &usize| left[(*i, 0)].abs() > f64::max(record.outlying().0 * record.sigma, WORST * worst);
            let place = |i: usize| (rows[i] as f64 + placed.shift).round().max(0.0) as usize;
            Some((0..rows.len()).filter(far).map(place).collect())
        };
        self.regressions(known)?.iter().enumerate().map(of).collect()
    }

    /// The samples of one record that are compared, and what the mean trace at the answer leaves of them.
    pub(super) fn remainder(
        &self,
        known: &Known,
        number: usize,
        regression: &Regression,
        solution: &Solution,
    ) -> Option<(Compared, Mat<f64>)> {
        let (values, rows) = known.records[number].compared(&solution.placed[number]);
        let mean = regression.mean(&solution.z);
        let rest = Mat::from_fn(rows.len(), 1, |i, _| values[rows[i]] - mean[rows[i]]);
        Some((self.compared(known, number, regression, rows)?, rest))
    }

    /// Variance of a sample from run to run, with what is not known of a correction.
    pub(super) fn variance(known: &Known, number: usize, regression: &Regression, t: usize) -> f64 {
        let runs: f64 = (0..regression.residuals.ncols()).map(|run| regression.residuals[(t, run)].powi(2)).sum();
        let row = |(_, columns): &(_, Mat<f64>)| (0..columns.ncols()).map(|j| columns[(t, j)].powi(2)).sum::<f64>();
        runs / regression.freedom + known.correction.get(number).map_or(0.0, row)
    }

    /// What a finer mesh changes of the answer, ln: (J' Σ⁻¹ J)⁻¹ J' Σ⁻¹ D, D the change of the trace. `None` where that is not known.
    pub(crate) fn by_mesh(&self, known: &Known, solution: &Solution) -> Option<Vec<f64>> {
        let size = self.dimension();
        let (mut information, mut moved) = (self.prior(known), vec![0.0; size]);
        for (number, regression) in self.regressions(known)?.iter().enumerate() {
            let mesh = known.meshes[number]?;
            let rows = known.records[number].compared(&solution.placed[number]).1;
            let change = Mat::from_fn(rows.len(), 1, |i, _| mesh.change[rows[i]]);
            let slopes = slopes_at(regression, &solution.z, self.is_quadratic(), &rows);
            let within = self.compared(known, number, regression, rows)?;
            let inner = within.covariance.inner(slopes.as_ref(), beside(&[slopes.as_ref(), change.as_ref()]).as_ref());
            add(&mut information, |a, b| inner[(a, b)]);
            moved.iter_mut().enumerate().for_each(|(a, sum)| *sum += inner[(a, size)]);
        }
        let times = |rows: &[Vec<f64>], x: &[f64]| -> Vec<f64> {
            rows.iter().map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
        };
        Some(times(&self.lower, &times(&inverse(&information), &moved)))
    }

    /// Information that the prior gives of z.
    pub(super) fn prior(&self, known: &Known) -> Vec<Vec<f64>> {
        let size = self.dimension();
        let mut information = vec![vec![0.0; size]; size];
        if let Some(prior) = known.prior {
            let last = &self.lower[size - 1];
            add(&mut information, |a, b| last[a] * last[b] / (prior * prior));
        }
        information
    }

    /// Covariance of ln from that of z.
    pub(super) fn outside(&self, unit: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let size = self.dimension();
        let entry = |a: usize, b: usize| -> f64 {
            (0..size)
                .flat_map(|i| (0..size).map(move |j| (i, j)))
                .map(|(i, j)| self.lower[a][i] * unit[i][j] * self.lower[b][j])
                .sum()
        };
        (0..size).map(|a| (0..size).map(|b| entry(a, b)).collect()).collect()
    }

    /// The columns of the covariance of the samples `rows` by origin.
    pub(super) fn columns(
        &self,
        known: &Known,
        number: usize,
        regression: &Regression,
        rows: &[usize],
    ) -> Option<Columns> {
        let (record, nuisances) = (known.records[number], &known.nuisances[number]);
        let scale = regression.freedom.sqrt().recip();
        let runs = regression.residuals.ncols();
        let spread = Mat::from_fn(rows.len(), runs, |i, run| scale * regression.residuals[(rows[i], run)]);
        let mean: Vec<f64> = (0..regression.coefficients.nrows()).map(|t| regression.coefficients[(t, 0)]).collect();
        let further = nuisances.columns((record.step, record.peak), &mean, rows);
        let shift = nuisances.shift_column(record.step, &mean, rows);
        let finer = known.correction.get(number).map_or_else(
            || Mat::zeros(rows.len(), 0),
            |(_, columns)| Mat::from_fn(rows.len(), columns.ncols(), |i, j| columns[(rows[i], j)]),
        );
        let level = match &known.level {
            Some((parameter, deviations)) => self.level_column(regression, *parameter, deviations[number], rows)?,
            None => Mat::zeros(rows.len(), 0),
        };
        Some(Columns { parts: [spread, beside(&[shift.as_ref(), further.as_ref()]), finer, level], shift, mean })
    }

    /// The samples `rows` of one record with the covariance of their uncertainty.
    pub(super) fn compared(
        &self,
        known: &Known,
        number: usize,
        regression: &Regression,
        rows: Vec<usize>,
    ) -> Option<Compared> {
        let columns = self.columns(known, number, regression, &rows)?;
        Self::whitened(known.records[number], regression, &columns, rows)
    }

    /// The same by columns that are known.
    pub(super) fn whitened(
        record: &RecordTrace,
        regression: &Regression,
        Columns { parts, shift, mean }: &Columns,
        rows: Vec<usize>,
    ) -> Option<Compared> {
        let columns = beside(&parts.each_ref().map(Mat::as_ref));
        let louder = record.louder(rows.iter().map(|t| mean[*t]));
        let covariance = Covariance::of(record.sigma, louder, columns)?;
        let count = regression.coefficients.ncols();
        let slopes = Mat::from_fn(rows.len(), count - 1, |i, j| regression.coefficients[(rows[i], j + 1)]);
        let others = beside(&[slopes.as_ref(), shift.as_ref()]);
        Some(Compared { rows, covariance, others })
    }

    /// Change of one record for a drive level higher by one standard deviation.
    pub(super) fn level_column(
        &self,
        regression: &Regression,
        parameter: usize,
        deviation: f64,
        rows: &[usize],
    ) -> Option<Mat<f64>> {
        let size = self.dimension();
        let unit: Vec<f64> = (0..size).map(|d| f64::from(u8::from(d == parameter))).collect();
        let z = solved(&self.lower, &unit)?;
        let value = |t: usize| (0..size).map(|d| regression.coefficients[(t, 1 + d)] * z[d]).sum::<f64>();
        Some(Mat::from_fn(rows.len(), 1, |i, _| deviation * value(rows[i])))
    }
}

/// Derivative of the mean trace at z, a column a parameter.
pub(super) fn slopes_at(regression: &Regression, z: &[f64], quadratic: bool, rows: &[usize]) -> Mat<f64> {
    let slopes = slopes(z, quadratic);
    Mat::from_fn(rows.len(), z.len(), |i, d| {
        slopes[d].iter().enumerate().map(|(j, slope)| slope * regression.coefficients[(rows[i], j)]).sum()
    })
}

/// Traces as columns, as long as the shortest.
pub(super) fn as_columns<T: AsRef<[f64]>>(traces: &[T]) -> Mat<f64> {
    let len = traces.iter().map(|trace| trace.as_ref().len()).min().unwrap_or(0);
    Mat::from_fn(len, traces.len(), |t, run| traces[run].as_ref()[t])
}

pub(super) fn beside(parts: &[MatRef<'_, f64>]) -> Mat<f64> {
    let rows = parts.first().map_or(0, |part| part.nrows());
    let columns = parts.iter().map(|part| part.ncols()).sum();
    let mut all = Mat::zeros(rows, columns);
    let mut at = 0;
    for part in parts {
        all.as_mut().subcols_mut(at, part.ncols()).copy_from(part);
        at += part.ncols();
    }
    all
}
