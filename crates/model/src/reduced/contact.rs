//! A contact condensed on its points, and what its neighbours do to it.
//!
//! ```text
//! g = q + U s + W λ,   g ≥ 0,   λ ≥ 0,   λᵢ gᵢ = 0,   m = Uᵀ λ
//! ```
//!
//! - W: residual compliance of both bodies, m/N;  q: gaps without forces, m;  λ: forces, N
//! - U: smooth displacements of the points by the forces at the far ends of both bodies, √(m/N);  s: their amounts, √(N·m)
//!
//! The forces at one pole of a body move the points of the other pole almost together, so that the coupling V of two contacts across a
//! body has a rank of two or three: V = Σ u vᵀ, and s of a contact is m of its neighbours ([`super::chain`]).
//!
//! W = L Lᵀ with the points ordered by radius. Eliminating the pressed points one after another leaves the negative gaps of the open ones,
//! so one pass finds the pressed set (a prefix), its forces and all gaps; leading blocks of L⁻¹ U give dm/ds for every prefix.

use super::rank::Crossing;
use crate::fea::contact::complementarity::{Compliance, NotSolved, Ordering, Scratch};

/// What stays the same through a run.
#[derive(Debug, Clone)]
pub(super) struct Condensed {
    /// W for sets of any kind.
    compliance: Compliance,
    ordering: Ordering,
    points: usize,
    /// Vectors of U, and how many of them couple to the contact before.
    vectors: usize,
    before: usize,
    /// L column by column and row by row; empty for [`Ordering::Any`].
    columns: Vec<f64>,
    rows: Vec<f64>,
    /// U vector by vector.
    coupling: Vec<f64>,
    /// L⁻¹ U point by point.
    eliminated: Vec<f64>,
    /// −dm/ds of every prefix, from none to all points.
    slopes: Vec<f64>,
    /// Least and largest value of every vector of U.
    bounds: Vec<[f64; 2]>,
}

/// One contact in motion.
#[derive(Debug, Clone)]
pub(super) struct State {
    /// q, m; only of points that were measured in this step.
    pub(super) free: Vec<f64>,
    /// Whether q is measured.
    pub(super) is_measured: bool,
    /// Least q there can be, m.
    pub(super) least: f64,
    /// λ, N.
    pub(super) forces: Vec<f64>,
    /// Points from the first pressed to behind the last.
    pub(super) pressed: [usize; 2],
    /// Axial force of the points, N.
    pub(super) pressing: f64,
    /// Force of the dashpot, N.
    pub(super) damping: f64,
    /// c + γ √δ, N·s/m; 0 while the dashpot is off.
    pub(super) coefficient: f64,
    /// s of the solution, and m.
    pub(super) shift: Vec<f64>,
    pub(super) moments: Vec<f64>,
    /// −dm/ds at the solution.
    pub(super) slope: Vec<f64>,
    /// s to be solved for next.
    pub(super) wanted: Vec<f64>,
    shifted: Vec<f64>,
    gaps: Vec<f64>,
    scratch: Scratch,
}

impl State {
    pub(super) fn new(condensed: &Condensed) -> Self {
        let (n, k) = (condensed.points, condensed.vectors);
        Self {
            free: vec![0.0; n],
            is_measured: false,
            least: 0.0,
            forces: vec![0.0; n],
            pressed: [0, 0],
            pressing: 0.0,
            damping: 0.0,
            coefficient: 0.0,
            shift: vec![0.0; k],
            moments: vec![0.0; k],
            slope: vec![0.0; k * k],
            wanted: vec![0.0; k],
            shifted: vec![0.0; n],
            gaps: vec![0.0; n],
            scratch: Scratch::keeping(n),
        }
    }

    /// Under given forces of its points (N), whose normals have the axial parts `axial`.
    pub(super) fn pressed_by(condensed: &Condensed, forces: &[f64], axial: &[f64]) -> Self {
        let mut state = Self::new(condensed);
        state.forces.copy_from_slice(forces);
        state.pressed = pressed(forces);
        state.pressing = dot(forces, axial);
        for (m, vector) in state.moments.iter_mut().zip(condensed.vectors()) {
            *m = dot(vector, forces);
        }
        state
    }

    /// Whole axial force, N.
    pub(super) fn total(&self) -> f64 {
        self.pressing + self.damping
    }

    /// Whether any point is pressed.
    pub(super) fn is_pressed(&self) -> bool {
        self.pressed[1] > 0
    }

    /// Elastic energy in the flexibility W and U of its points, J, half of the coupled one to either side: −½ λ·q.
    pub(super) fn energy(&self) -> f64 {
        if self.is_pressed() { -0.5 * dot(&self.forces, &self.free) } else { 0.0 }
    }
}

impl Condensed {
    /// Of the compliance W (row by row, m/N) and the couplings across the bodies before and after.
    ///
    /// # Errors
    /// [`NotSolved`] when W is not positive definite.
    pub(super) fn new(
        matrix: Vec<f64>,
        points: usize,
        ordering: Ordering,
        before: Option<&Crossing>,
        after: Option<&Crossing>,
    ) -> Result<Self, NotSolved> {
        let factored = Compliance::new(matrix.clone(), points, ordering)?;
        let compliance = Compliance::new(matrix, points, Ordering::Any)?;
        let mut coupling = before.map_or_else(Vec::new, |crossing| crossing.back.concat());
        let left = coupling.len() / points;
        after.iter().for_each(|crossing| coupling.extend(crossing.front.concat()));
        let vectors = coupling.len() / points;
        let bounds = coupling
            .chunks_exact(points)
            .map(|vector| {
                vector.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
            })
            .collect();
        let mut condensed = Self {
            compliance,
            ordering,
            points,
            vectors,
            before: left,
            columns: Vec::new(),
            rows: Vec::new(),
            coupling,
            eliminated: Vec::new(),
            slopes: Vec::new(),
            bounds,
        };
        if ordering == Ordering::Prefix {
            condensed.eliminate_coupling(&factored);
        }
        Ok(condensed)
    }

    fn eliminate_coupling(&mut self, factored: &Compliance) {
        let (n, k) = (self.points, self.vectors);
        self.rows = vec![0.0; n * n];
        self.columns = vec![0.0; n * n];
        for i in 0..n {
            for (j, &value) in factored.factor_row(i)[..=i].iter().enumerate() {
                self.rows[i * n + j] = value;
                self.columns[j * n + i] = value;
            }
        }
        self.eliminated = vec![0.0; n * k];
        self.slopes = vec![0.0; (n + 1) * k * k];
        for i in 0..n {
            let row = &self.rows[i * n..i * n + i + 1];
            for a in 0..k {
                let known: f64 = (0..i).map(|j| row[j] * self.eliminated[j * k + a]).sum();
                self.eliminated[i * k + a] = (self.coupling[a * n + i] - known) / row[i];
            }
            for a in 0..k {
                for b in 0..k {
                    let more = self.eliminated[i * k + a] * self.eliminated[i * k + b];
                    self.slopes[(i + 1) * k * k + a * k + b] = self.slopes[i * k * k + a * k + b] + more;
                }
            }
        }
    }

    /// W.
    pub(super) fn compliance(&self) -> &Compliance {
        &self.compliance
    }

    /// U vector by vector.
    pub(super) fn vectors(&self) -> impl Iterator<Item = &[f64]> {
        self.coupling.chunks_exact(self.points)
    }

    /// Where in s and m the coupling to the contact after begins.
    pub(super) fn before(&self) -> usize {
        self.before
    }

    /// Whether the contact is open with the shift `wanted` for certain, by bounds alone.
    pub(super) fn is_surely_open(&self, state: &State) -> bool {
        let shift: f64 = state.wanted.iter().zip(&self.bounds).map(|(s, [low, high])| (s * low).min(s * high)).sum();
        state.least + shift > 0.0
    }

    /// Take every point off.
    pub(super) fn open(&self, state: &mut State) {
        if state.is_pressed() {
            state.forces.fill(0.0);
            state.moments.fill(0.0);
            state.slope.fill(0.0);
            state.pressed = [0, 0];
        }
        state.shift.copy_from_slice(&state.wanted);
    }

    /// Solve at the shift `wanted`, q measured. Returns the number of sets tried.
    ///
    /// # Errors
    /// [`NotSolved`] when no set of points satisfies all conditions.
    pub(super) fn solve(&self, state: &mut State) -> Result<u32, NotSolved> {
        state.shift.copy_from_slice(&state.wanted);
        state.shifted.copy_from_slice(&state.free);
        for (s, vector) in state.shift.iter().zip(self.coupling.chunks_exact(self.points)) {
            if *s != 0.0 {
                state.shifted.iter_mut().zip(vector).for_each(|(gap, u)| *gap += u * s);
            }
        }
        if self.ordering == Ordering::Prefix && self.solve_prefix(state) {
            return Ok(1);
        }
        self.solve_any(state)
    }

    /// Eliminate pressed points from the pole outwards; false if the pressed set is no prefix.
    fn solve_prefix(&self, state: &mut State) -> bool {
        let (n, k) = (self.points, self.vectors);
        let State { shifted, gaps, forces, moments, slope, pressed, .. } = state;
        // −g of the open points, while those before are closed.
        gaps.iter_mut().zip(shifted.iter()).for_each(|(out, gap)| *out = -gap);
        moments.fill(0.0);
        let mut count = 0;
        while count < n && gaps[count] > 0.0 {
            let column = &self.columns[count * n..(count + 1) * n];
            let y = gaps[count] / column[count];
            forces[count] = y;
            gaps[count + 1..].iter_mut().zip(&column[count + 1..]).for_each(|(gap, l)| *gap -= y * l);
            moments.iter_mut().zip(&self.eliminated[count * k..(count + 1) * k]).for_each(|(m, u)| *m += u * y);
            count += 1;
        }
        let rounding = Compliance::rounding(shifted);
        if gaps[count..].iter().any(|negative| !(*negative <= rounding)) {
            return false;
        }
        // Lᵀ λ = y.
        for i in (0..count).rev() {
            let row = &self.rows[i * n..i * n + i + 1];
            forces[i] /= row[i];
            let force = forces[i];
            if !(force >= 0.0) {
                return false;
            }
            forces[..i].iter_mut().zip(row).for_each(|(y, l)| *y -= l * force);
        }
        forces[count..].fill(0.0);
        slope.copy_from_slice(&self.slopes[count * k * k..(count + 1) * k * k]);
        *pressed = [0, count];
        true
    }

    fn solve_any(&self, state: &mut State) -> Result<u32, NotSolved> {
        let State { shifted, gaps, forces, moments, slope, pressed, scratch, .. } = state;
        // What an attempt at a prefix left there is no guess.
        if forces.iter().any(|force| !(*force >= 0.0)) {
            forces.fill(0.0);
        }
        let solved = self.compliance.solve(shifted, forces, gaps, scratch)?;
        for (m, vector) in moments.iter_mut().zip(self.coupling.chunks_exact(self.points)) {
            *m = dot(vector, forces);
        }
        *pressed = self::pressed(forces);
        if pressed[1] > 0 {
            scratch.sensitivity(&self.coupling, self.points, slope);
        } else {
            slope.fill(0.0);
        }
        Ok(solved.iterations)
    }
}

/// From the first pressed point to behind the last.
fn pressed(forces: &[f64]) -> [usize; 2] {
    let first = forces.iter().position(|&force| force > 0.0);
    let last = forces.iter().rposition(|&force| force > 0.0);
    first.zip(last).map_or([0, 0], |(first, last)| [first, last + 1])
}

pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
