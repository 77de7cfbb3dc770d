//! One explicit Runge–Kutta step of order 8(5,3) with its continuous extension, in fixed buffers.
//!
//! The step runs in σ ∈ [0, 1] with a time map t(σ) = t₀ + a σ + b σ² ([`Clock`]). b = 0 is the plain step. Just after a contact has
//! closed at t*, the force grows like (t − t*)^(3/2), or (t − t*)^(1/2) with a Kuwabara–Kono dashpot, and no polynomial in t follows
//! that; in √(t − t*) both are analytic, and t = t* + (s₀ + S σ)² is of this form. So the order survives the singularity.

use super::tableau::{A, C, D, E, Term};
use crate::scene::PistonMotion;

/// Time within a step, t = start + linear σ + quadratic σ², s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Clock {
    pub start: f64,
    pub linear: f64,
    pub quadratic: f64,
}

impl Clock {
    /// t(σ), s.
    pub(crate) fn at(&self, sigma: f64) -> f64 {
        self.start + (self.linear + self.quadratic * sigma) * sigma
    }

    /// dt/dσ, s.
    pub(crate) fn rate(&self, sigma: f64) -> f64 {
        self.linear + 2.0 * self.quadratic * sigma
    }

    /// Length of the step, s.
    pub(crate) fn length(&self) -> f64 {
        self.linear + self.quadratic
    }

    /// σ at which the clock shows `time` (s), within the step.
    pub(crate) fn sigma(&self, time: f64) -> f64 {
        let elapsed = (time - self.start).max(0.0);
        if elapsed == 0.0 {
            return 0.0;
        }
        let root = (self.linear * self.linear + 4.0 * self.quadratic * elapsed).max(0.0).sqrt();
        (2.0 * elapsed / (self.linear + root)).min(1.0)
    }
}

pub(super) trait Flow {
    /// `weight` × the time derivative of `state`, into `derivative`, with the piston at (m, m/s).
    fn evaluate(&mut self, weight: f64, piston: (f64, f64), state: &mut [f64], derivative: &mut [f64]);
}

/// Interval (s) in which the piston's motion is smooth: it is never asked for outside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SmoothInterval {
    pub from: f64,
    pub to: f64,
}

type Row = Vec<[f64; 4]>;

#[derive(Debug, Clone)]
pub(super) struct Stepper {
    pub state: Row,
    derivative: Row,
    pub end_state: Row,
    end_derivative: Row,
    /// Derivatives of the sixteen stages times dt/dσ, one behind the other.
    stages: Row,
    stage: Row,
    /// Coefficients of the continuous extension; before it is built, what the error is estimated with.
    dense: [Row; 7],
    /// 1/(absolute tolerance) of each entry; 0 for those not controlled.
    pub inverse_scale: Row,
    times: [f64; 16],
    piston_displacement: [f64; 16],
    piston_velocity: [f64; 16],
    pub evaluations: u64,
}

/// Rows taken together: the five of a chain of three to six beads, so that their sums stay in registers.
const BLOCK: usize = 5;

/// out = base + Σ c_j k_j, the stages k lying one behind the other in `stages`; base 0 if there is none.
#[inline(always)]
fn combine(out: &mut [[f64; 4]], base: Option<&[[f64; 4]]>, terms: &[Term], stages: &[[f64; 4]]) {
    let rows = out.len();
    if let (Ok(out), (stages, [])) = (<&mut [[f64; 4]; BLOCK]>::try_from(&mut *out), stages.as_chunks::<BLOCK>()) {
        let mut sum = [[0.0; 4]; BLOCK];
        if let Some(base) = base.and_then(|base| base.first_chunk()) {
            sum = *base;
        }
        for (stage, weight) in terms {
            add(&mut sum, *weight, &stages[*stage]);
        }
        *out = sum;
        return;
    }
    let mut first = 0;
    while first + BLOCK <= rows {
        combine_block::<BLOCK>(out, base, terms, stages, first);
        first += BLOCK;
    }
    while first < rows {
        combine_block::<1>(out, base, terms, stages, first);
        first += 1;
    }
}

#[inline(always)]
fn combine_block<const B: usize>(
    out: &mut [[f64; 4]],
    base: Option<&[[f64; 4]]>,
    terms: &[Term],
    stages: &[[f64; 4]],
    first: usize,
) {
    let rows = out.len();
    let mut sum = [[0.0; 4]; B];
    if let Some(base) = base {
        sum.copy_from_slice(&base[first..first + B]);
    }
    for (stage, weight) in terms {
        let from = stage * rows + first;
        add(&mut sum, *weight, &stages[from..from + B]);
    }
    out[first..first + B].copy_from_slice(&sum);
}

#[inline(always)]
fn add(sum: &mut [[f64; 4]], weight: f64, stage: &[[f64; 4]]) {
    for (sum, k) in sum.iter_mut().zip(stage) {
        for lane in 0..4 {
            sum[lane] += weight * k[lane];
        }
    }
}

/// One number of the state, or a difference of two, over a step: the coefficients of the continuous extension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Course(pub [f64; 8]);

impl Course {
    /// Its value at σ.
    #[inline(always)]
    pub(crate) fn at(&self, sigma: f64) -> f64 {
        let [y, d0, d1, d2, d3, d4, d5, d6] = self.0;
        let rest = 1.0 - sigma;
        let inner = d3 + sigma * (d4 + rest * (d5 + sigma * d6));
        y + sigma * (d0 + rest * (d1 + sigma * (d2 + rest * inner)))
    }

    pub(crate) fn above(self, other: Self) -> Self {
        let mut above = self;
        for (above, other) in above.0.iter_mut().zip(other.0) {
            *above -= other;
        }
        above
    }
}

impl Stepper {
    /// Buffers for a state of `length` numbers (a multiple of four).
    pub(crate) fn new(length: usize) -> Self {
        let row = || vec![[0.0; 4]; length / 4];
        Self {
            state: row(),
            derivative: row(),
            end_state: row(),
            end_derivative: row(),
            stages: vec![[0.0; 4]; 4 * length],
            stage: row(),
            dense: std::array::from_fn(|_| row()),
            inverse_scale: row(),
            times: [0.0; 16],
            piston_displacement: [0.0; 16],
            piston_velocity: [0.0; 16],
            evaluations: 0,
        }
    }

    /// Evaluate the derivative at the start: after any change of the state or of the equation.
    pub(crate) fn restart(&mut self, flow: &mut impl Flow, piston: (f64, f64)) {
        flow.evaluate(1.0, piston, self.state.as_flattened_mut(), self.derivative.as_flattened_mut());
        self.evaluations += 1;
    }

    /// Positions of the piston at stages `from..to`.
    #[inline(always)]
    fn sample_piston(
        &mut self,
        motion: &dyn PistonMotion,
        clock: &Clock,
        smooth: &SmoothInterval,
        from: usize,
        to: usize,
    ) {
        for (time, c) in self.times[from..to].iter_mut().zip(&C[from..to]) {
            *time = clock.at(*c).clamp(smooth.from, smooth.to);
        }
        motion.sample(
            &self.times[from..to],
            &mut self.piston_displacement[from..to],
            &mut self.piston_velocity[from..to],
        );
    }

    /// Attempt a step; returns the error over the tolerance (accept at ≤ 1; NaN when the state is not finite).
    #[inline(always)]
    pub(crate) fn attempt(
        &mut self,
        flow: &mut impl Flow,
        motion: &dyn PistonMotion,
        clock: &Clock,
        smooth: &SmoothInterval,
    ) -> f64 {
        self.sample_piston(motion, clock, smooth, 1, 12);
        let rows = self.state.len();
        for (stage, derivative) in self.stages[..rows].as_flattened_mut().iter_mut().zip(self.derivative.as_flattened())
        {
            *stage = clock.linear * derivative;
        }
        for stage in 1..12 {
            self.stage(flow, clock, stage);
        }
        combine(&mut self.end_state, Some(&self.state), A[12], &self.stages);
        let [fifth, third, ..] = &mut self.dense;
        combine(fifth, None, E[0], &self.stages);
        combine(third, None, E[1], &self.stages);
        error_norm(fifth, third, &self.inverse_scale)
    }

    #[inline(always)]
    fn stage(&mut self, flow: &mut impl Flow, clock: &Clock, stage: usize) {
        let rows = self.state.len();
        combine(&mut self.stage, Some(&self.state), A[stage], &self.stages);
        flow.evaluate(
            clock.rate(C[stage]),
            (self.piston_displacement[stage], self.piston_velocity[stage]),
            self.stage.as_flattened_mut(),
            self.stages[stage * rows..(stage + 1) * rows].as_flattened_mut(),
        );
        self.evaluations += 1;
    }

    #[inline(always)]
    pub(crate) fn finish(&mut self, flow: &mut impl Flow, clock: &Clock) {
        let piston = (self.piston_displacement[11], self.piston_velocity[11]);
        flow.evaluate(1.0, piston, self.end_state.as_flattened_mut(), self.end_derivative.as_flattened_mut());
        self.evaluations += 1;
        let rate = clock.rate(1.0);
        let rows = self.state.len();
        for (stage, derivative) in
            self.stages[12 * rows..13 * rows].as_flattened_mut().iter_mut().zip(self.end_derivative.as_flattened())
        {
            *stage = rate * derivative;
        }
    }

    /// Build the continuous extension of the finished step (three more evaluations).
    #[inline(always)]
    pub(crate) fn extend(
        &mut self,
        flow: &mut impl Flow,
        motion: &dyn PistonMotion,
        clock: &Clock,
        smooth: &SmoothInterval,
    ) {
        self.sample_piston(motion, clock, smooth, 13, 16);
        for stage in 13..16 {
            self.stage(flow, clock, stage);
        }
        let rows = self.state.len();
        let (first, last) = (&self.stages[..rows], &self.stages[12 * rows..13 * rows]);
        let [d0, d1, d2, d3, d4, d5, d6] = &mut self.dense;
        for r in 0..rows {
            for lane in 0..4 {
                let difference = self.end_state[r][lane] - self.state[r][lane];
                d0[r][lane] = difference;
                d1[r][lane] = first[r][lane] - difference;
                d2[r][lane] = 2.0 * difference - (last[r][lane] + first[r][lane]);
            }
        }
        for (row, terms) in [d3, d4, d5, d6].into_iter().zip(D) {
            combine(row, None, terms, &self.stages);
        }
    }

    #[inline]
    pub(crate) fn course(&self, index: usize) -> Course {
        let (r, lane) = (index / 4, index % 4);
        let mut course = Course([self.state[r][lane]; 8]);
        for (out, dense) in course.0[1..].iter_mut().zip(&self.dense) {
            *out = dense[r][lane];
        }
        course
    }

    /// The first `out.len()` rows of the state at σ, by the continuous extension.
    #[inline(always)]
    pub(crate) fn values(&self, sigma: f64, out: &mut [[f64; 4]]) {
        let rest = 1.0 - sigma;
        let length = out.len();
        let y = &self.state[..length];
        let [d0, d1, d2, d3, d4, d5, d6] = &self.dense;
        let (d0, d1, d2, d3) = (&d0[..length], &d1[..length], &d2[..length], &d3[..length]);
        let (d4, d5, d6) = (&d4[..length], &d5[..length], &d6[..length]);
        for r in 0..length {
            for lane in 0..4 {
                let inner = d3[r][lane] + sigma * (d4[r][lane] + rest * (d5[r][lane] + sigma * d6[r][lane]));
                let outer = d1[r][lane] + sigma * (d2[r][lane] + rest * inner);
                out[r][lane] = y[r][lane] + sigma * (d0[r][lane] + rest * outer);
            }
        }
    }

    pub(crate) fn advance(&mut self) {
        std::mem::swap(&mut self.state, &mut self.end_state);
        std::mem::swap(&mut self.derivative, &mut self.end_derivative);
    }

    /// Go on from within the step, at σ; needs [`Stepper::restart`] before the next attempt.
    pub(crate) fn truncate(&mut self, sigma: f64) {
        let mut end = std::mem::take(&mut self.end_state);
        self.values(sigma, &mut end);
        self.end_state = end;
        std::mem::swap(&mut self.state, &mut self.end_state);
    }

    pub(crate) fn derivative(&self) -> &[f64] {
        self.derivative.as_flattened()
    }

    /// The piston (m, m/s) at the end of the step attempted last.
    pub(crate) fn end_piston(&self) -> (f64, f64) {
        (self.piston_displacement[11], self.piston_velocity[11])
    }

    pub(crate) fn worst_entry(&self) -> usize {
        let rows = self.state.len();
        let error = |index: usize| {
            let (r, lane) = (index / 4, index % 4);
            let sum: f64 = E[0].iter().map(|(stage, fifth)| fifth * self.stages[stage * rows + r][lane]).sum();
            (sum * self.inverse_scale[r][lane]).abs()
        };
        (0..4 * self.state.len()).max_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(0)
    }
}

/// Largest-entry norm of the estimates of order 5 and 3 combined, e₅²/√(e₅² + 0.01 e₃²); NaN when any entry is.
#[inline(always)]
fn error_norm(fifth: &[[f64; 4]], third: &[[f64; 4]], inverse_scale: &[[f64; 4]]) -> f64 {
    let mut largest5 = [0.0f64; 4];
    let mut largest3 = [0.0f64; 4];
    let mut sum = [0.0f64; 4];
    for ((fifth, third), inverse_scale) in fifth.iter().zip(third).zip(inverse_scale) {
        for lane in 0..4 {
            let fifth = (fifth[lane] * inverse_scale[lane]).abs();
            let third = (third[lane] * inverse_scale[lane]).abs();
            sum[lane] += fifth + third;
            largest5[lane] = if fifth > largest5[lane] { fifth } else { largest5[lane] };
            largest3[lane] = if third > largest3[lane] { third } else { largest3[lane] };
        }
    }
    if !sum.iter().sum::<f64>().is_finite() {
        return f64::NAN;
    }
    let fifth = largest5.into_iter().fold(0.0, f64::max);
    let third = largest3.into_iter().fold(0.0, f64::max);
    if fifth == 0.0 { 0.0 } else { fifth * fifth / (fifth * fifth + 0.01 * third * third).sqrt() }
}
