//! How probable the mean of the hits is at a point, and what the hits leave of the box.

use nalgebra::Cholesky;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor, StudentsT};

use crate::{
    hit::{FEATURES, Features, INCIDENT_WIDTH},
    regression::{Covariance, Regression},
};

/// Standard deviations of ln of return time, ratio of peaks, ratio of widths and incident width that a hit has until several hits say it better: where
/// a bead comes to rest between two hits, and how the striker meets it.
pub(crate) const FLOOR: [f64; FEATURES] = [0.01, 0.05, 0.05, 0.02];

/// Number of hits that this floor counts for.
pub(crate) const FLOOR_HITS: f64 = 4.0;

/// Standard deviations of the same that all hits of one set-up share: how the column stands, and the response of its sensor, which an impulse of
/// another width passes with another gain. Of 21 set-ups of one column, three on each of seven foams, they are 0.013, 0.14 and 0.06 beside the scatter
/// of the hits (records of pabseb22/SingleSolitaryWaveAnalysis). The incident width has 5 %: in these records it has two values, 54 and 68 µs, those of a
/// sensor that reads one contact or both.
pub const SET_UP: [f64; FEATURES] = [0.0125, 0.1, 0.1, 0.05];

/// Number of set-ups that these deviations count for beside those of an experiment.
const SET_UPS: f64 = 1.0;

/// Cells of the grid by dimension.
const CELLS: [usize; 4] = [1201, 161, 41, 21];

/// Covariance of independent features of these standard deviations.
fn diagonal(deviations: [f64; FEATURES]) -> Covariance {
    Covariance::from_diagonal(&Features::from_iterator(deviations.map(|deviation| deviation * deviation)))
}

/// The mean of several set-ups, each the mean of its hits, and how hits and set-ups scatter.
#[derive(Debug, Clone)]
pub(crate) struct Hits {
    pub mean: Features,
    /// Number of hits of one set-up whose mean scatters as much.
    count: f64,
    /// Degrees of freedom of the scatter of hits.
    pub freedom: f64,
    /// Sum of squares of the hits, each about the mean of its set-up.
    squares: Covariance,
    set_ups: f64,
    /// Covariance of one set-up.
    pub set_up: Covariance,
}

/// Mean, and sum of squares about it.
fn spread(of: &[Features]) -> (Features, Covariance) {
    let mean = of.iter().sum::<Features>() / of.len() as f64;
    (mean, of.iter().map(|one| (one - mean) * (one - mean).transpose()).sum())
}

impl Hits {
    /// Of the hits of each set-up.
    pub(crate) fn of(set_ups: &[Vec<Features>]) -> Self {
        let (means, squares): (Vec<Features>, Vec<Covariance>) = set_ups.iter().map(|hits| spread(hits)).unzip();
        let (mean, between) = spread(&means);
        let count = set_ups.len() as f64;
        let inverse: f64 = set_ups.iter().map(|hits| 1.0 / hits.len() as f64).sum();
        Self {
            mean,
            count: count * count / inverse,
            freedom: FLOOR_HITS + set_ups.iter().map(|hits| hits.len() as f64 - 1.0).sum::<f64>(),
            squares: squares.iter().sum(),
            set_ups: count,
            set_up: (diagonal(SET_UP) * SET_UPS + between) / (SET_UPS + count - 1.0),
        }
    }

    /// Covariance of one hit: that of the hits, and of runs beside the floor, each by the number of hits it counts for.
    pub(crate) fn scatter(&self, runs: &Covariance) -> Covariance {
        let floor = runs + diagonal(FLOOR);
        (floor * FLOOR_HITS + self.squares) / self.freedom
    }
}

/// Likelihood of the hits over the box: a normal density of their mean.
#[derive(Debug, Clone)]
pub(crate) struct Likelihood<'a> {
    pub regression: &'a Regression,
    pub hits: &'a Hits,
    /// Covariance of one hit.
    pub scatter: Covariance,
}

impl<'a> Likelihood<'a> {
    pub(crate) fn new(regression: &'a Regression, hits: &'a Hits) -> Self {
        Self { regression, hits, scatter: hits.scatter(&regression.scatter) }
    }

    /// Covariance of the mean about what the model expects.
    fn covariance(&self, leverage: f64) -> Covariance {
        // The scatter is estimated: a mean over its square is that of a Student t.
        let estimated = self.hits.freedom / (self.hits.freedom - 2.0);
        let set_up = self.hits.set_up / self.hits.set_ups;
        self.scatter * (estimated / self.hits.count) + self.shared() + set_up + self.regression.scatter * leverage
    }

    /// Covariance of what all hits of all set-ups share. What the regression leaves of a run is counted too: collisions at the foot answer to a velocity
    /// that all hits have in a way that no polynomial follows. The incident impulse has not been there.
    pub(crate) fn shared(&self) -> Covariance {
        let mut foot = self.regression.scatter;
        foot.fill_row(INCIDENT_WIDTH, 0.0);
        foot.fill_column(INCIDENT_WIDTH, 0.0);
        self.regression.shared + foot
    }

    /// T² of the mean, and ln of its density.
    pub(crate) fn at(&self, at: &[f64]) -> [f64; 2] {
        let expected = self.regression.expected(at);
        let Some(root) = Cholesky::new(self.covariance(expected.leverage)) else {
            return [f64::INFINITY, f64::NEG_INFINITY];
        };
        let off = self.hits.mean - expected.mean;
        let square = off.dot(&root.solve(&off));
        let determinant: f64 = root.l().diagonal().iter().map(|root| root.ln()).sum();
        [square, -determinant - 0.5 * square]
    }

    /// The deviation of each feature of the mean from the model at a point, in standard deviations.
    pub(crate) fn deviations(&self, at: &[f64]) -> Features {
        let expected = self.regression.expected(at);
        let covariance = self.covariance(expected.leverage);
        Features::from_fn(|feature, _| {
            (expected.mean[feature] - self.hits.mean[feature]) / covariance[(feature, feature)].sqrt()
        })
    }

    /// Degrees of freedom of T² at a point: of its covariance the hits estimate their own scatter alone, the rest is stated. Yao (1965), Biometrika 52, 139.
    fn freedom(&self, at: &[f64]) -> f64 {
        let expected = self.regression.expected(at);
        let Some(root) = Cholesky::new(self.covariance(expected.leverage)) else { return self.hits.freedom };
        let off = self.hits.mean - expected.mean;
        let toward = root.solve(&off);
        let share = toward.dot(&(self.scatter * toward)) / self.hits.count / off.dot(&toward);
        self.hits.freedom / (share * share).max(f64::MIN_POSITIVE)
    }

    /// Share of right experiments whose mean is as far from the model as the nearest point of a grid, by Hotelling's T² of what `fitted` parameters leave; of
    /// none left as of one.
    pub(crate) fn p_value(&self, grid: &Grid, fitted: usize) -> f64 {
        let left = FEATURES.saturating_sub(fitted).max(1) as f64;
        let freedom = self.freedom(&grid.nearest).clamp(self.hits.freedom, MOST_FREEDOM);
        let second = (freedom - left + 1.0).max(1.0);
        let fisher = FisherSnedecor::new(left, second);
        fisher.map_or(0.0, |fisher| fisher.sf(grid.square * second / (freedom * left)))
    }
}

/// Degrees of freedom from which an estimated covariance is a known one.
const MOST_FREEDOM: f64 = 1e4;

/// Posterior of the parameters on a grid over a part of the box, uniform in their logarithms before.
#[derive(Debug, Clone)]
pub struct Grid {
    within: Vec<[f64; 2]>,
    cells: usize,
    mass: Vec<f64>,
    /// Least T², and where.
    pub square: f64,
    nearest: Vec<f64>,
    /// The most likely point.
    pub best: Vec<f64>,
}

impl Grid {
    /// `None` where no point has a density.
    pub(crate) fn of(likelihood: &Likelihood<'_>, within: &[[f64; 2]]) -> Option<Self> {
        let cells = CELLS[within.len().clamp(1, CELLS.len()) - 1];
        let (mass, nearest, best) = (Vec::new(), Vec::new(), Vec::new());
        let mut grid = Self { within: within.to_vec(), cells, mass, square: 0.0, nearest, best };
        let count = cells.pow(within.len() as u32);
        let values: Vec<[f64; 2]> = (0..count).into_par_iter().map(|cell| likelihood.at(&grid.centre(cell))).collect();
        let most = (0..count).max_by(|a, b| values[*a][1].total_cmp(&values[*b][1]))?;
        let nearest = (0..count).min_by(|a, b| values[*a][0].total_cmp(&values[*b][0]))?;
        let densest = values[most][1];
        if !densest.is_finite() {
            return None;
        }
        grid.mass = values.iter().map(|[_, density]| (density - densest).exp()).collect();
        let total: f64 = grid.mass.iter().sum();
        grid.mass.iter_mut().for_each(|mass| *mass /= total);
        (grid.square, grid.nearest, grid.best) = (values[nearest][0], grid.centre(nearest), grid.centre(most));
        Some(grid)
    }

    /// Where the middle of a cell lies, unit coordinates.
    fn centre(&self, cell: usize) -> Vec<f64> {
        let place = |(d, [low, high]): (usize, &[f64; 2])| {
            let number = cell / self.cells.pow(d as u32) % self.cells;
            low + (high - low) * (number as f64 + 0.5) / self.cells as f64
        };
        self.within.iter().enumerate().map(place).collect()
    }

    /// Mean and covariance of a function of the point.
    pub(crate) fn moments(&self, of: impl Fn(&[f64]) -> Features) -> (Features, Covariance) {
        let cells = self.mass.iter().enumerate().filter(|(_, mass)| **mass > 1e-9);
        let values: Vec<(f64, Features)> = cells.map(|(cell, mass)| (*mass, of(&self.centre(cell)))).collect();
        let mean = values.iter().map(|(mass, value)| value * *mass).sum::<Features>();
        let covariance = values.iter().map(|(mass, value)| (value - mean) * (value - mean).transpose() * *mass).sum();
        (mean, covariance)
    }

    /// Quantiles of one coordinate.
    pub(crate) fn quantiles<const N: usize>(&self, d: usize, shares: [f64; N]) -> [f64; N] {
        let mut marginal = vec![0.0; self.cells];
        self.mass
            .iter()
            .enumerate()
            .for_each(|(cell, mass)| marginal[cell / self.cells.pow(d as u32) % self.cells] += mass);
        let [low, high] = self.within[d];
        shares.map(|share| {
            let mut sum = 0.0;
            let inside = marginal.iter().position(|mass| {
                sum += mass;
                sum >= share
            });
            let cell = inside.unwrap_or(self.cells - 1);
            let part = 1.0 - (sum - share) / marginal[cell].max(f64::MIN_POSITIVE);
            low + (high - low) * (cell as f64 + part.clamp(0.0, 1.0)) / self.cells as f64
        })
    }

    /// Correlation of two coordinates.
    pub(crate) fn correlation(&self, a: usize, b: usize) -> f64 {
        let (_, covariance) = self.moments(|at| Features::new(at[a], at[b], 0.0, 0.0));
        covariance[(0, 1)] / (covariance[(0, 0)] * covariance[(1, 1)]).sqrt()
    }

    /// The part of the box that holds what the hits leave, `reach` standard deviations about its middle and at least `least` wide, inside the box.
    pub(crate) fn holds(&self, reach: f64, least: f64) -> Vec<[f64; 2]> {
        let part = |d: usize| {
            let (mean, covariance) = self.moments(|at| Features::new(at[d], 0.0, 0.0, 0.0));
            let half = (reach * covariance[(0, 0)].sqrt()).max(0.5 * least);
            [(mean[0] - half).max(0.0), (mean[0] + half).min(1.0)]
        };
        (0..self.within.len()).map(part).collect()
    }
}

/// Quantile of a Student t.
pub(crate) fn student(freedom: f64, share: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |student| student.inverse_cdf(share))
}
