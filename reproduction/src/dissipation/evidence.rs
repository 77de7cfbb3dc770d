//! Evidence of a pair of printed peaks for a grid of runs.
//!
//! ```text
//! Z = ∫ N(p; P(x), σ²(x)) dx / ∫ dx        x = (ln α, ln strength, …), each over the range that was run: flat priors
//! ```
//!
//! N is the product of both peaks' Gaussians. Between the points of the grid the means P and the variances σ² are multilinear, and a cell is halved until no
//! mean changes by more than σ within it: the printed numbers then cannot fall between two points. A quantity that decides nothing leaves Z as it is, one
//! that must be set to hit the printed numbers costs the share of its range that hits (Occam's factor; MacKay (2003), *Information Theory, Inference, and
//! Learning Algorithms*, ch. 28).

use std::f64::consts::TAU;

/// What the runs at a point of the grid say of both peaks: means (m/s) and variances (m²/s²) of what a single run may have.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoPeaks {
    /// Means of the positive and the negative peak, m/s.
    pub mean: [f64; 2],
    pub variance: [f64; 2],
}

/// What comes of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// ln Z, of a density in (m/s)⁻².
    pub log: f64,
    /// Where the printed peaks are most likely, on the axes.
    pub at: Vec<f64>,
}

/// Largest change of a mean within a piece, in σ: midpoints of pieces of one σ integrate a Gaussian to 1e-8.
const FINEST: f64 = 1.0;
/// Pieces this far (in ln) below the best are left out: of a thousandth of the range they are 1e-8 of the rest.
const NEGLIGIBLE: f64 = 25.0;
/// Halvings at most: a millionth of a cell.
const DEEPEST: u32 = 60;

/// The evidence of `printed` peaks (m/s) for the points over `axes` (last one fastest), none where no cell of the grid has all its corners. What of
/// the range has not all its corners counts as unlikely.
#[must_use]
pub fn evidence(axes: &[Vec<f64>], points: &[Option<TwoPeaks>], printed: [f64; 2]) -> Option<Evidence> {
    let mut pieces = cells(axes, points);
    // The likely ones first, so that the others need not be looked into.
    pieces.sort_by(|a, b| b.bound(printed).total_cmp(&a.bound(printed)));
    let mut sum = Sum { log: f64::NEG_INFINITY, best: f64::NEG_INFINITY, at: Vec::new() };
    pieces.into_iter().for_each(|piece| sum.take(piece, printed, 0));
    (!sum.at.is_empty()).then_some(Evidence { log: sum.log, at: sum.at })
}

/// A box of the grid or a part of one.
struct Piece {
    /// Bit k of the index: upper end of axis k.
    corners: Vec<TwoPeaks>,
    low: Vec<f64>,
    size: Vec<f64>,
    /// ln of its share of the whole range.
    log_share: f64,
}

fn cells(axes: &[Vec<f64>], points: &[Option<TwoPeaks>]) -> Vec<Piece> {
    let counts: Vec<usize> = axes.iter().map(|axis| axis.len().saturating_sub(1)).collect();
    let stride = |axis: usize| axes[axis + 1..].iter().map(Vec::len).product::<usize>();
    let cell = |mut number: usize| {
        let mut place = vec![0; axes.len()];
        for (axis, count) in counts.iter().enumerate().rev() {
            (place[axis], number) = (number % count, number / count);
        }
        let corner = |upper: usize| {
            let index = |axis: usize| (place[axis] + (upper >> axis & 1)) * stride(axis);
            points[(0..axes.len()).map(index).sum::<usize>()]
        };
        let low: Vec<f64> = place.iter().zip(axes).map(|(at, axis)| axis[*at]).collect();
        let size: Vec<f64> = place.iter().zip(axes).map(|(at, axis)| axis[at + 1] - axis[*at]).collect();
        let share = size.iter().zip(axes).map(|(own, axis)| (own / (axis[axis.len() - 1] - axis[0])).ln());
        let log_share = share.sum();
        Some(Piece { corners: (0..1 << axes.len()).map(corner).collect::<Option<_>>()?, low, size, log_share })
    };
    (0..counts.iter().product()).filter_map(cell).collect()
}

impl Piece {
    /// No point of it is likelier, in ln.
    fn bound(&self, printed: [f64; 2]) -> f64 {
        let of = |peak: usize| {
            let means = self.corners.iter().map(|corner| corner.mean[peak]);
            let variances = self.corners.iter().map(|corner| corner.variance[peak]);
            let (low, high) = ends(means);
            let (least, largest) = ends(variances);
            let distance = (low - printed[peak]).max(printed[peak] - high).max(0.0);
            -0.5 * (distance * distance / largest + (TAU * least).ln())
        };
        of(0) + of(1)
    }

    /// ln of the likelihood in its middle.
    fn middle(&self, printed: [f64; 2]) -> f64 {
        let count = self.corners.len() as f64;
        let of = |peak: usize| {
            let mean = self.corners.iter().map(|corner| corner.mean[peak]).sum::<f64>() / count;
            let variance = self.corners.iter().map(|corner| corner.variance[peak]).sum::<f64>() / count;
            -0.5 * ((mean - printed[peak]).powi(2) / variance + (TAU * variance).ln())
        };
        of(0) + of(1)
    }

    /// The axis along which most changes, and by how many σ a mean or by what factor's logarithm a σ.
    fn steepest(&self) -> (usize, f64) {
        let change = |axis: usize| {
            let pairs = (0..self.corners.len()).filter(|corner| corner >> axis & 1 == 0);
            let of = |corner: usize| {
                let (one, other) = (&self.corners[corner], &self.corners[corner | 1 << axis]);
                let peak = |peak: usize| {
                    let least = one.variance[peak].min(other.variance[peak]);
                    let widening = 0.5 * (one.variance[peak] / other.variance[peak]).ln().abs();
                    ((one.mean[peak] - other.mean[peak]).abs() / least.sqrt()).max(widening)
                };
                peak(0).max(peak(1))
            };
            pairs.map(of).fold(0.0, f64::max)
        };
        (0..self.low.len()).map(|axis| (axis, change(axis))).fold((0, -1.0), |a, b| if b.1 > a.1 { b } else { a })
    }

    /// Its two halves along an axis.
    fn halves(&self, axis: usize) -> [Self; 2] {
        let between = |one: &TwoPeaks, other: &TwoPeaks| TwoPeaks {
            mean: [0, 1].map(|peak| 0.5 * (one.mean[peak] + other.mean[peak])),
            variance: [0, 1].map(|peak| 0.5 * (one.variance[peak] + other.variance[peak])),
        };
        let middles: Vec<TwoPeaks> = (0..self.corners.len())
            .map(|corner| between(&self.corners[corner & !(1 << axis)], &self.corners[corner | 1 << axis]))
            .collect();
        [0, 1].map(|upper| {
            let own = |corner: usize| if corner >> axis & 1 == upper { self.corners[corner] } else { middles[corner] };
            let (mut low, mut size) = (self.low.clone(), self.size.clone());
            size[axis] *= 0.5;
            low[axis] += upper as f64 * size[axis];
            let log_share = self.log_share - std::f64::consts::LN_2;
            Self { corners: (0..self.corners.len()).map(own).collect(), low, size, log_share }
        })
    }
}

/// The integral so far, and the likeliest place.
struct Sum {
    log: f64,
    best: f64,
    at: Vec<f64>,
}

impl Sum {
    fn take(&mut self, piece: Piece, printed: [f64; 2], depth: u32) {
        if piece.bound(printed) < self.best - NEGLIGIBLE {
            return;
        }
        let (axis, change) = piece.steepest();
        if change > FINEST && depth < DEEPEST {
            let mut halves = piece.halves(axis);
            halves.sort_by(|a, b| b.bound(printed).total_cmp(&a.bound(printed)));
            halves.into_iter().for_each(|half| self.take(half, printed, depth + 1));
            return;
        }
        let likelihood = piece.middle(printed);
        if likelihood > self.best {
            self.best = likelihood;
            self.at = piece.low.iter().zip(&piece.size).map(|(low, size)| low + 0.5 * size).collect();
        }
        let (small, large) = ends([self.log, piece.log_share + likelihood].into_iter());
        self.log = large + (small - large).exp().ln_1p();
    }
}

fn ends(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

#[cfg(test)]
mod tests {
    use super::*;

    const PRINTED: [f64; 2] = [0.289, -0.247];

    /// Φ(b) − Φ(a).
    fn between(a: f64, b: f64) -> f64 {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        0.5 * (libm::erf(b * half) - libm::erf(a * half))
    }

    fn grid(axes: &[Vec<f64>], of: impl Fn(&[f64]) -> TwoPeaks) -> Vec<Option<TwoPeaks>> {
        let mut places = vec![Vec::new()];
        for axis in axes {
            places = places
                .into_iter()
                .flat_map(|place: Vec<f64>| axis.iter().map(move |value| [place.as_slice(), &[*value]].concat()))
                .collect();
        }
        places.iter().map(|place| Some(of(place))).collect()
    }

    #[test]
    fn a_peak_that_grows_along_one_axis_has_the_evidence_of_the_textbook() {
        // P₊ = a + b x over x = 0…1, P₋ fixed: Z = N(P₋) [Φ((p − a)/σ) − Φ((p − a − b)/σ)]/b.
        let (a, b, sigma) = (0.1, 0.5, 0.004);
        let axes = vec![vec![0.0, 0.3, 1.0]];
        let points = grid(&axes, |x| TwoPeaks { mean: [a + b * x[0], -0.25], variance: [sigma * sigma, 1e-4] });
        let found = evidence(&axes, &points, PRINTED).unwrap();
        let fixed = -0.5 * ((0.003_f64 / 0.01).powi(2) + (TAU * 1e-4).ln());
        let expected = fixed + (between((PRINTED[0] - a - b) / sigma, (PRINTED[0] - a) / sigma) / b).ln();
        assert!((found.log - expected).abs() < 1e-6, "{} {expected}", found.log);
        assert!((a + b * found.at[0] - PRINTED[0]).abs() < sigma, "{:?}", found.at);
        // At the end of the range half of it is missing.
        let axes = vec![vec![0.0, (PRINTED[0] - a) / b]];
        let points = grid(&axes, |x| TwoPeaks { mean: [a + b * x[0], -0.25], variance: [sigma * sigma, 1e-4] });
        let half = evidence(&axes, &points, PRINTED).unwrap();
        let expected = expected + 0.5_f64.ln() - axes[0][1].ln();
        assert!((half.log - expected).abs() < 2e-3, "{} {expected}", half.log);
    }

    #[test]
    fn two_peaks_set_by_two_axes_cost_the_area_that_they_span_and_a_third_axis_without_effect_nothing() {
        // Z = 1/|∂(P₊, P₋)/∂(x, y)| per unit of range, well inside.
        let of = |x: &[f64]| TwoPeaks {
            mean: [0.1 + 0.3 * x[0] + 0.1 * x[1], -0.1 - 0.1 * x[0] - 0.2 * x[1]],
            variance: [4e-6, 9e-6],
        };
        let axes = vec![vec![0.0, 0.5, 1.0], vec![0.0, 1.0]];
        let found = evidence(&axes, &grid(&axes, of), PRINTED).unwrap();
        let area: f64 = 0.3 * 0.2 - 0.1 * 0.1;
        assert!((found.log - (1.0 / area).ln()).abs() < 1e-5, "{}", found.log);
        let more = vec![axes[0].clone(), axes[1].clone(), vec![-2.0, 0.0, 3.0]];
        let idle = evidence(&more, &grid(&more, of), PRINTED).unwrap();
        assert!((idle.log - found.log).abs() < 1e-9, "{} {}", idle.log, found.log);
        // Ten times the range of an axis that matters costs ln 10.
        let wide = vec![vec![0.0, 0.5, 1.0, 10.0], axes[1].clone()];
        let wide = evidence(&wide, &grid(&wide, of), PRINTED).unwrap();
        assert!((found.log - wide.log - 10f64.ln()).abs() < 1e-5, "{}", wide.log);
    }

    #[test]
    fn what_has_not_all_its_corners_is_unlikely_and_a_hopeless_grid_still_has_a_number() {
        let axes = vec![vec![0.0, 1.0, 2.0]];
        let of = |x: &[f64]| TwoPeaks { mean: [0.289 + x[0], -0.247], variance: [1e-4, 1e-4] };
        let mut points = grid(&axes, of);
        points[0] = None;
        let far = evidence(&axes, &points, PRINTED).unwrap();
        // 100 σ off at best.
        assert!(far.log.is_finite() && far.log < -4000.0 && far.log > -6000.0, "{}", far.log);
        points[1] = None;
        assert_eq!(evidence(&axes, &points, PRINTED), None);
    }
}
