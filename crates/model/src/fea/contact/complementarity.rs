//! The linear complementarity problem of one contact.
//!
//! g = q + W λ,   g ≥ 0,   λ ≥ 0,   λᵢ gᵢ = 0,
//!
//! - W: condensed compliance, m/N, n × n, symmetric positive definite: how far the gap at point i opens per unit force at point j
//! - q: gaps without forces, m
//! - λ: forces, N;  g: gaps, m
//!
//! Points of a contact at a pole are ordered by radius and its active set is a prefix of them, so one Cholesky factor W = L Lᵀ holds a
//! factor of every candidate set in its leading blocks. Any other set is found by a primal–dual active set method (Hintermüller, Ito and
//! Kunisch 2002, *SIAM J. Optim.* 13, 865), and should that cycle, by least-index principal pivoting (Murty 1974, *Linear Algebra
//! Appl.* 9, 237), which ends for every positive definite W.

use std::ops::Range;

use crate::number::dot;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ordering {
    /// The active set is a prefix in nearly all states: a contact at a pole.
    Prefix,
    /// Any set: a ring on an annulus, an interval of its points.
    Any,
}

/// Sets tried before the slower search that cannot cycle.
pub(crate) const MOST_SETS: u32 = 40;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Solved {
    pub iterations: u32,
}

/// The compliance was not positive definite, or the set cycled beyond all bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotSolved {
    pub iterations: u32,
}

/// W of one contact, with the factor of all its leading blocks.
#[derive(Debug, Clone)]
pub(crate) struct Compliance {
    size: usize,
    ordering: Ordering,
    matrix: Vec<f64>,
    /// W = L Lᵀ as [`factorise`] leaves it; empty for [`Ordering::Any`].
    factor: Vec<f64>,
}

#[derive(Debug, Clone)]
pub(crate) struct Scratch {
    /// Whether the factor of the last set is used again for the same set: for one compliance that stays as it is.
    keeps: bool,
    factored: Vec<usize>,
    answered: Vec<usize>,
    forward: Vec<f64>,
    active: Vec<usize>,
    next: Vec<usize>,
    block: Vec<f64>,
    right: Vec<f64>,
}

impl Scratch {
    pub(crate) fn new(size: usize) -> Self {
        Self {
            keeps: false,
            factored: Vec::with_capacity(size),
            answered: Vec::with_capacity(size),
            forward: vec![0.0; size],
            active: Vec::with_capacity(size),
            next: Vec::with_capacity(size),
            block: vec![0.0; size * size],
            right: vec![0.0; size],
        }
    }

    /// For one contact whose compliance never changes: the factor of a set is kept until the set changes.
    pub(crate) fn keeping(size: usize) -> Self {
        Self { keeps: true, ..Self::new(size) }
    }

    /// The set to begin with: of the points pressed so far (`forces`, N), or of those that are closed without forces.
    pub(crate) fn guess(&mut self, free_gaps: &[f64], forces: &[f64]) {
        self.active.clear();
        self.active.extend((0..forces.len()).filter(|&i| forces[i] > 0.0));
        if self.active.is_empty() {
            self.active.extend((0..forces.len()).filter(|&i| free_gaps[i] < 0.0));
        }
    }

    /// Whether the active set is that of the solution, its forces (N) and gaps (m) given; else the next to try is active.
    pub(crate) fn is_the_set(&mut self, forces: &[f64], gaps: &[f64], rounding: f64) -> bool {
        self.next.clear();
        let mut position = 0;
        for i in 0..forces.len() {
            let is_member = position < self.active.len() && self.active[position] == i;
            position += usize::from(is_member);
            if if is_member { forces[i] > 0.0 } else { gaps[i] < -rounding } {
                self.next.push(i);
            }
        }
        let settled = self.next == self.active;
        std::mem::swap(&mut self.active, &mut self.next);
        settled
    }

    /// From the first active point to behind the last.
    pub(crate) fn extent(&self) -> Range<usize> {
        let first = self.active.first().copied().unwrap_or(0);
        first..self.active.last().map_or(first, |last| last + 1)
    }

    /// Uᵀ W⁻¹ U over the set solved last, row by row: how much Uᵀ λ falls per unit of a shift of the gaps by U. `vectors` holds U vector by
    /// vector, `points` numbers each. `out` is left as it is where the factor is kept and the set is that of the last call.
    pub(crate) fn sensitivity(&mut self, vectors: &[f64], points: usize, out: &mut [f64]) {
        if self.keeps && self.answered == self.active {
            return;
        }
        self.answered.clone_from(&self.active);
        let (m, count) = (self.active.len(), vectors.len() / points);
        for (a, vector) in vectors.chunks_exact(points).enumerate() {
            for (value, &i) in self.right.iter_mut().zip(&self.active) {
                *value = vector[i];
            }
            forward_substitute(&self.block, m, &mut self.right[..m]);
            back_substitute(&self.block, m, &mut self.right[..m]);
            for (b, other) in vectors.chunks_exact(points).enumerate() {
                out[a * count + b] = self.active.iter().zip(&self.right).map(|(&i, x)| other[i] * x).sum();
            }
        }
    }
}

impl Compliance {
    /// Take W (row by row, m/N) and factor it where the ordering allows.
    pub(crate) fn new(matrix: Vec<f64>, size: usize, ordering: Ordering) -> Result<Self, NotSolved> {
        debug_assert_eq!(matrix.len(), size * size);
        let factor = match ordering {
            Ordering::Any => Vec::new(),
            Ordering::Prefix => {
                let mut factor = matrix.clone();
                if !factorise(&mut factor, size) {
                    return Err(NotSolved { iterations: 0 });
                }
                factor
            }
        };
        Ok(Self { size, ordering, matrix, factor })
    }

    pub(crate) fn size(&self) -> usize {
        self.size
    }

    /// Row i of W, m/N.
    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.matrix[i * self.size..(i + 1) * self.size]
    }

    /// W = L Lᵀ where the ordering has one factor for all sets, row by row: L below the diagonal, Lᵀ above, on it 1/Lᵢᵢ.
    pub(crate) fn into_factor(self) -> Vec<f64> {
        self.factor
    }

    /// Solve for the forces (N); `forces` holds the last known ones on entry, `gaps` (m) the final gaps on return.
    pub(crate) fn solve(
        &self,
        free_gaps: &[f64],
        forces: &mut [f64],
        gaps: &mut [f64],
        scratch: &mut Scratch,
    ) -> Result<Solved, NotSolved> {
        // An open contact, by far the commonest state, needs no algebra.
        if free_gaps.iter().all(|&gap| gap >= 0.0) {
            forces.fill(0.0);
            gaps.copy_from_slice(free_gaps);
            return Ok(Solved { iterations: 0 });
        }
        if !free_gaps.iter().all(|gap| gap.is_finite()) {
            return Err(NotSolved { iterations: 0 });
        }
        if self.ordering == Ordering::Prefix && self.solve_prefix(free_gaps, forces, gaps, scratch) {
            return Ok(Solved { iterations: 1 });
        }
        self.solve_any(free_gaps, forces, gaps, scratch)
    }

    /// Part of the largest gap below which a point counts as closed: rounding of the sums that make it.
    pub(crate) const ROUNDING: f64 = 64.0 * f64::EPSILON;

    /// Gap below which a point counts as closed, m.
    fn rounding(free_gaps: &[f64]) -> f64 {
        Self::ROUNDING * free_gaps.iter().fold(0.0, |largest: f64, gap| largest.max(gap.abs()))
    }

    /// Try the shortest prefix behind which the next point does not penetrate; false if it is not the solution.
    fn solve_prefix(&self, free_gaps: &[f64], forces: &mut [f64], gaps: &mut [f64], scratch: &mut Scratch) -> bool {
        let n = self.size;
        let y = &mut scratch.forward;
        let mut count = 0;
        // L y = −q; y_k ≤ 0 says that point k stays open while those before it are pressed.
        while count < n {
            let row = &self.factor[count * n..count * n + count + 1];
            let mut value = -free_gaps[count];
            for (l, y) in row[..count].iter().zip(y.iter()) {
                value -= l * y;
            }
            value *= row[count];
            if value <= 0.0 {
                break;
            }
            y[count] = value;
            count += 1;
        }
        back_substitute(&self.factor, n, &mut y[..count]);
        forces.fill(0.0);
        forces[..count].copy_from_slice(&y[..count]);
        if forces[..count].iter().any(|&force| force < 0.0) {
            return false;
        }
        self.gaps(free_gaps, forces, 0..count, gaps);
        let rounding = Self::rounding(free_gaps);
        gaps[..count].fill(0.0);
        gaps[count..].iter().all(|&gap| gap >= -rounding)
    }

    /// g = q + W λ, where no force beyond these points is not zero.
    fn gaps(&self, free_gaps: &[f64], forces: &[f64], pressed: Range<usize>, gaps: &mut [f64]) {
        for ((i, gap), free) in gaps.iter_mut().enumerate().zip(free_gaps) {
            *gap = free + dot(&self.row(i)[pressed.clone()], &forces[pressed.clone()]);
        }
    }

    fn solve_any(
        &self,
        free_gaps: &[f64],
        forces: &mut [f64],
        gaps: &mut [f64],
        scratch: &mut Scratch,
    ) -> Result<Solved, NotSolved> {
        let rounding = Self::rounding(free_gaps);
        scratch.guess(free_gaps, forces);
        let mut iterations = 0;
        while iterations < MOST_SETS {
            iterations += 1;
            self.solve_set(free_gaps, forces, gaps, scratch, iterations)?;
            if scratch.is_the_set(forces, gaps, rounding) {
                return Ok(Solved { iterations });
            }
        }
        self.solve_least_index(free_gaps, forces, gaps, scratch, iterations, rounding)
    }

    fn solve_least_index(
        &self,
        free_gaps: &[f64],
        forces: &mut [f64],
        gaps: &mut [f64],
        scratch: &mut Scratch,
        mut iterations: u32,
        rounding: f64,
    ) -> Result<Solved, NotSolved> {
        scratch.active.clear();
        for _ in 0..100 * self.size {
            iterations += 1;
            self.solve_set(free_gaps, forces, gaps, scratch, iterations)?;
            let offender = (0..self.size).find(|i| match scratch.active.binary_search(i) {
                Ok(_) => forces[*i] < 0.0,
                Err(_) => gaps[*i] < -rounding,
            });
            let Some(offender) = offender else { return Ok(Solved { iterations }) };
            match scratch.active.binary_search(&offender) {
                Ok(position) => drop(scratch.active.remove(position)),
                Err(position) => scratch.active.insert(position, offender),
            }
        }
        Err(NotSolved { iterations })
    }

    fn solve_set(
        &self,
        free_gaps: &[f64],
        forces: &mut [f64],
        gaps: &mut [f64],
        scratch: &mut Scratch,
        iterations: u32,
    ) -> Result<(), NotSolved> {
        self.press_set(free_gaps, forces, scratch).map_err(|_| NotSolved { iterations })?;
        self.gaps(free_gaps, forces, scratch.extent(), gaps);
        for &i in &scratch.active {
            gaps[i] = 0.0;
        }
        Ok(())
    }

    /// Forces that close exactly the active points.
    #[inline(always)]
    pub(crate) fn press_set(
        &self,
        free_gaps: &[f64],
        forces: &mut [f64],
        scratch: &mut Scratch,
    ) -> Result<(), NotSolved> {
        let n = self.size;
        let Scratch { keeps, factored, active, block, right, .. } = scratch;
        let m = active.len();
        for (value, &i) in right.iter_mut().zip(active.iter()) {
            *value = -free_gaps[i];
        }
        if !(*keeps && factored == active) {
            for (row, &i) in active.iter().enumerate() {
                for (column, &j) in active.iter().enumerate() {
                    block[row * m + column] = self.matrix[i * n + j];
                }
            }
            factored.clear();
            if !factorise(&mut block[..m * m], m) {
                return Err(NotSolved { iterations: 0 });
            }
            factored.extend_from_slice(active);
        }
        forward_substitute(block, m, &mut right[..m]);
        back_substitute(block, m, &mut right[..m]);
        forces.fill(0.0);
        for (&i, &force) in active.iter().zip(right.iter()) {
            forces[i] = force;
        }
        Ok(())
    }
}

/// Solve L y = b in place, with `stride` numbers a row of what [`factorise`] left.
#[inline(always)]
fn forward_substitute(factor: &[f64], stride: usize, b: &mut [f64]) {
    for k in 0..b.len() {
        let (known, row) = b.split_at_mut(k + 1);
        let value = known[k] * factor[k * stride + k];
        known[k] = value;
        for (b, l) in row.iter_mut().zip(&factor[k * stride + k + 1..]) {
            *b -= l * value;
        }
    }
}

/// Solve the leading block of Lᵀ x = y in place, with `stride` numbers a row of what [`factorise`] left.
#[inline(always)]
fn back_substitute(factor: &[f64], stride: usize, y: &mut [f64]) {
    for k in (0..y.len()).rev() {
        let row = &factor[k * stride..k * stride + k + 1];
        let value = y[k] * row[k];
        y[k] = value;
        for (y, l) in y[..k].iter_mut().zip(row) {
            *y -= l * value;
        }
    }
}

/// W = L Lᵀ in place, row by row: L below the diagonal, Lᵀ above, on it 1/Lᵢᵢ, so that solving divides by nothing; false if a pivot is not
/// positive.
fn factorise(matrix: &mut [f64], size: usize) -> bool {
    // Rounding of a positive definite matrix leaves positive pivots; a singular one does not.
    let least = 1e-14 * matrix.iter().step_by(size + 1).copied().fold(0.0, f64::max);
    for k in 0..size {
        let (row, below) = matrix[k * size..].split_at_mut(size);
        if !(row[k] > least) {
            return false;
        }
        row[k] = 1.0 / row[k].sqrt();
        for j in k + 1..size {
            row[j] *= row[k];
        }
        for (i, other) in (k + 1..).zip(below.chunks_exact_mut(size)) {
            let value = row[i];
            other[k] = value;
            for (other, l) in other[i..].iter_mut().zip(&row[i..]) {
                *other -= l * value;
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A compliance like that of a half-space under rings: 1/(1 + |i − j|) made definite.
    fn compliance(n: usize, ordering: Ordering) -> Compliance {
        let matrix = (0..n * n)
            .map(|k| {
                let (i, j) = (k / n, k % n);
                (if i == j { 1.2 } else { 0.5 / (1.0 + i.abs_diff(j) as f64) }) * 1e-7
            })
            .collect();
        Compliance::new(matrix, n, ordering).unwrap()
    }

    fn check(compliance: &Compliance, free: &[f64], forces: &[f64], gaps: &[f64]) {
        for i in 0..free.len() {
            let gap = free[i] + dot(compliance.row(i), forces);
            // Rounding of sums of at most 1e-6 m.
            assert!((gap - gaps[i]).abs() < 1e-20, "{i}: {gap:e} {:e}", gaps[i]);
            assert!(forces[i] >= 0.0 && gap > -1e-20 && (forces[i] * gap).abs() < 1e-19, "{i}: {} {gap:e}", forces[i]);
        }
    }

    #[test]
    fn prefix_and_general_solutions_agree_and_satisfy_every_condition() {
        for closed in [1e-9, 1e-7, 4e-7, 2e-6] {
            let n = 20;
            let free: Vec<f64> = (0..n).map(|i| 2e-9 * (i * i) as f64 - closed).collect();
            let solve = |ordering| {
                let compliance = compliance(n, ordering);
                let (mut forces, mut gaps) = (vec![0.0; n], vec![0.0; n]);
                compliance.solve(&free, &mut forces, &mut gaps, &mut Scratch::new(n)).unwrap();
                check(&compliance, &free, &forces, &gaps);
                forces
            };
            let (prefix, any) = (solve(Ordering::Prefix), solve(Ordering::Any));
            assert!(prefix.iter().any(|&force| force > 0.0));
            for (a, b) in prefix.iter().zip(&any) {
                assert!((a - b).abs() < 1e-12, "{a} {b}");
            }
        }
    }

    #[test]
    fn a_set_that_is_no_prefix_is_found() {
        let n = 20;
        let free: Vec<f64> = (0..n).map(|i| 3e-9 * (i as f64 - 11.0).powi(2) - 1e-7).collect();
        for ordering in [Ordering::Prefix, Ordering::Any] {
            let compliance = compliance(n, ordering);
            let (mut forces, mut gaps) = (vec![0.0; n], vec![0.0; n]);
            compliance.solve(&free, &mut forces, &mut gaps, &mut Scratch::new(n)).unwrap();
            check(&compliance, &free, &forces, &gaps);
            assert!(forces[11] > 0.0 && forces[0] == 0.0 && forces[19] == 0.0);
        }
    }

    #[test]
    fn least_index_pivoting_reaches_the_same_forces() {
        let n = 20;
        let free: Vec<f64> = (0..n).map(|i| if i % 3 == 0 { -1e-7 } else { 1e-9 * i as f64 }).collect();
        let compliance = compliance(n, Ordering::Any);
        let (mut forces, mut gaps) = (vec![0.0; n], vec![0.0; n]);
        let mut scratch = Scratch::new(n);
        compliance.solve(&free, &mut forces, &mut gaps, &mut scratch).unwrap();
        let expected = forces.clone();
        let rounding = Compliance::rounding(&free);
        compliance.solve_least_index(&free, &mut forces, &mut gaps, &mut scratch, 0, rounding).unwrap();
        check(&compliance, &free, &forces, &gaps);
        for (a, b) in expected.iter().zip(&forces) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }

    #[test]
    fn an_indefinite_compliance_is_refused() {
        assert!(Compliance::new(vec![1.0, 2.0, 2.0, 1.0], 2, Ordering::Prefix).is_err());
    }
}
