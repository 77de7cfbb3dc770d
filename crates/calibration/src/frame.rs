//! Coordinates in which the best runs are isotropic. With more than two parameters the good region is narrow in some
//! directions of the unit box and long in others, so distances and cells in the box's own coordinates are not useful.

use nalgebra::{Cholesky, DMatrix};
use serde::{Deserialize, Serialize};

/// Standard deviation below which points count as equal, unit coordinates.
const FINEST: f64 = 1e-4;

/// u = u₀ + L y, with y of mean 0 and unit covariance over the given points.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    centre: Vec<f64>,
    /// Rows of L, lower triangular.
    rows: Vec<Vec<f64>>,
}

impl Frame {
    /// From points in unit coordinates; `None` if there are not more points than coordinates plus one.
    pub(crate) fn of(points: &[&[f64]]) -> Option<Self> {
        let dimension = points.first()?.len();
        if points.len() <= dimension + 1 {
            return None;
        }
        let count = points.len() as f64;
        let centre: Vec<f64> = (0..dimension).map(|d| points.iter().map(|u| u[d]).sum::<f64>() / count).collect();
        let moment = |a: usize, b: usize| {
            let sum: f64 = points.iter().map(|u| (u[a] - centre[a]) * (u[b] - centre[b])).sum();
            sum / (count - 1.0) + if a == b { FINEST * FINEST } else { 0.0 }
        };
        let lower = Cholesky::new(DMatrix::from_fn(dimension, dimension, moment))?.unpack();
        let rows = (0..dimension).map(|a| (0..=a).map(|b| lower[(a, b)]).collect()).collect();
        Some(Self { centre, rows })
    }

    /// From mean and covariance in unit coordinates; `None` if the covariance is not positive definite.
    pub(crate) fn with(centre: &[f64], covariance: &[Vec<f64>]) -> Option<Self> {
        let dimension = centre.len();
        let lower = Cholesky::new(DMatrix::from_fn(dimension, dimension, |a, b| covariance[a][b]))?.unpack();
        let rows = (0..dimension).map(|a| (0..=a).map(|b| lower[(a, b)]).collect()).collect();
        Some(Self { centre: centre.to_vec(), rows })
    }

    /// y of a point u.
    pub(crate) fn inside(&self, u: &[f64]) -> Vec<f64> {
        let mut y: Vec<f64> = Vec::with_capacity(u.len());
        for (row, (u, centre)) in self.rows.iter().zip(u.iter().zip(&self.centre)) {
            let known: f64 = row.iter().zip(&y).map(|(l, y)| l * y).sum();
            y.push((u - centre - known) / row[y.len()]);
        }
        y
    }

    /// u of a point y.
    pub(crate) fn outside(&self, y: &[f64]) -> Vec<f64> {
        let moved = |row: &Vec<f64>| row.iter().zip(y).map(|(l, y)| l * y).sum::<f64>();
        self.rows.iter().zip(&self.centre).map(|(row, centre)| centre + moved(row)).collect()
    }

    /// Volume in u of a unit of y.
    pub(crate) fn volume(&self) -> f64 {
        self.rows.iter().enumerate().map(|(d, row)| row[d]).product()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_round_in_their_own_frame_and_come_back_out_of_it() {
        let points: Vec<[f64; 3]> = (0..200)
            .map(|i| {
                let [a, b, c] = [0, 1, 2].map(|d| f64::from(sobol_burley::sample(i, d, 3)) - 0.5);
                [0.5 + 0.3 * a, 0.4 + 0.3 * a + 0.01 * b, 0.6 - 0.2 * a + 0.05 * c]
            })
            .collect();
        let points: Vec<&[f64]> = points.iter().map(|point| &point[..]).collect();
        let frame = Frame::of(&points).unwrap();
        let inside: Vec<Vec<f64>> = points.iter().map(|point| frame.inside(point)).collect();
        for a in 0..3 {
            for b in 0..3 {
                let moment = inside.iter().map(|y| y[a] * y[b]).sum::<f64>() / 199.0;
                // Points closer than FINEST count for a quarter of a per cent along the thinnest direction.
                assert!((moment - f64::from(u8::from(a == b))).abs() < 5e-3, "{a} {b} {moment}");
            }
        }
        for (point, y) in points.iter().zip(&inside) {
            assert!(frame.outside(y).iter().zip(*point).all(|(a, b)| (a - b).abs() < 1e-12));
        }
        assert!(Frame::of(&points[..4]).is_none());
    }
}
