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

mod any;

use std::ops::Range;

use self::any::Single;
use super::rank::Crossing;
use crate::{
    fea::contact::complementarity::{Compliance, NotSolved, Ordering},
    number::{Mask, Number},
};

pub(super) trait Measure<N> {
    /// Write the gaps of these points of a contact without its forces, m.
    fn gaps(&self, contact: usize, points: Range<usize>, free: &mut [N]);
}

#[derive(Debug, Clone)]
pub(super) struct Condensed {
    compliance: Compliance,
    ordering: Ordering,
    points: usize,
    /// Vectors of U, and how many of them couple to the contact before.
    vectors: usize,
    before: usize,
    /// L below the diagonal, Lᵀ above, on it 1/Lᵢᵢ, row by row; empty for [`Ordering::Any`].
    factor: Vec<f64>,
    coupling: Vec<f64>,
    /// L⁻¹ U point by point.
    eliminated: Vec<f64>,
    /// −dm/ds of every prefix, from none to all points.
    slopes: Vec<f64>,
    blocks: Vec<Block>,
    /// Largest amount of every vector of U.
    largest: Vec<f64>,
}

/// Points that are bounded together: those of a contact that are surely open are not looked at.
pub(super) const BLOCK: usize = 16;

#[derive(Debug, Clone)]
struct Block {
    end: usize,
    /// Least and largest value of every vector of U.
    shapes: Vec<[f64; 2]>,
    /// Least compliance between one of its points and any, m/N; 0 where none is below.
    least_compliance: f64,
}

#[derive(Debug, Clone)]
pub(super) struct State<N: Number> {
    /// q, m; only of points that were measured in this step.
    pub(super) free: Vec<N>,
    pub(super) measured: usize,
    /// Least q there can be in every block, and by how much s may lessen it anywhere, m.
    pub(super) least: Vec<N>,
    reach: N,
    /// λ, N.
    pub(super) forces: Vec<N>,
    /// Points from the first pressed to behind the last, in any run.
    pub(super) pressed: [usize; 2],
    /// Axial force of the points, N.
    pub(super) pressing: N,
    /// Force of the dashpot, N.
    pub(super) damping: N,
    /// c + γ √δ, N·s/m; 0 while the dashpot is off.
    pub(super) coefficient: N,
    /// s of the solution, and m.
    pub(super) shift: Vec<N>,
    pub(super) moments: Vec<N>,
    /// −dm/ds at the solution.
    pub(super) slope: Vec<N>,
    /// How many points are pressed where `slope` is that of a prefix, NaN elsewhere.
    prefix: N,
    /// s to be solved for next, and how far that is from the s of the solution.
    pub(super) wanted: Vec<N>,
    pub(super) step: Vec<N>,
    shifted: Vec<N>,
    gaps: Vec<N>,
    /// λ and m of a solution not yet taken.
    trial: Vec<N>,
    found: Vec<N>,
    /// Gap below which a point counts as closed, m.
    rounding: N,
    single: Vec<Single>,
}

impl<N: Number> State<N> {
    pub(super) fn new(condensed: &Condensed) -> Self {
        let (n, k) = (condensed.points, condensed.vectors);
        Self {
            free: vec![N::ZERO; n],
            measured: 0,
            least: vec![N::ZERO; n.div_ceil(BLOCK)],
            reach: N::ZERO,
            forces: vec![N::ZERO; n],
            pressed: [0, 0],
            pressing: N::ZERO,
            damping: N::ZERO,
            coefficient: N::ZERO,
            shift: vec![N::ZERO; k],
            moments: vec![N::ZERO; k],
            slope: vec![N::ZERO; k * k],
            prefix: N::ZERO,
            wanted: vec![N::ZERO; k],
            step: vec![N::ZERO; k],
            shifted: vec![N::ZERO; n],
            gaps: vec![N::ZERO; n],
            trial: vec![N::ZERO; n],
            found: vec![N::ZERO; k],
            rounding: N::ZERO,
            single: (0..N::WIDTH).map(|_| Single::new(n, k)).collect(),
        }
    }

    /// Under given forces of its points (N), whose normals have the axial parts `axial`.
    pub(super) fn pressed_by(condensed: &Condensed, forces: Vec<N>, axial: &[f64]) -> Self {
        let mut state = Self::new(condensed);
        state.pressed = pressed(&forces);
        state.pressing = dot(&forces, axial);
        for (m, vector) in state.moments.iter_mut().zip(condensed.vectors()) {
            *m = dot(&forces, vector);
        }
        state.forces = forces;
        state
    }

    #[inline(always)]
    pub(super) fn total(&self) -> N {
        self.pressing + self.damping
    }

    #[inline(always)]
    pub(super) fn is_pressed(&self) -> bool {
        self.pressed[1] > 0
    }

    /// Where the shift it was solved at is not the one that is wanted.
    #[inline(always)]
    fn moved(&self) -> N::Mask {
        let same = self.wanted.iter().zip(&self.shift);
        !same.fold(N::Mask::all(true), |same, (wanted, shift)| same & wanted.equals(*shift))
    }
}

impl State<f64> {
    /// Elastic energy in the flexibility W and U of its points, J, half of the coupled one to either side: −½ λ·q.
    pub(super) fn energy(&self) -> f64 {
        if self.is_pressed() { -0.5 * dot(&self.forces, &self.free) } else { 0.0 }
    }
}

impl Condensed {
    /// Of the compliance W (row by row, m/N) and the couplings across the bodies before and after.
    pub(super) fn new(
        matrix: Vec<f64>,
        points: usize,
        ordering: Ordering,
        before: Option<&Crossing>,
        after: Option<&Crossing>,
    ) -> Result<Self, NotSolved> {
        let mut coupling = before.map_or_else(Vec::new, |crossing| crossing.back.concat());
        let left = coupling.len() / points;
        after.iter().for_each(|crossing| coupling.extend(crossing.front.concat()));
        let vectors = coupling.len() / points;
        let blocks = (0..points).step_by(BLOCK).map(|first| {
            let end = (first + BLOCK).min(points);
            let own = matrix[first * points..end * points].iter();
            Block {
                end,
                shapes: coupling.chunks_exact(points).map(|vector| bounds(&vector[first..end])).collect(),
                least_compliance: own.copied().fold(0.0, f64::min),
            }
        });
        let blocks = blocks.collect();
        let largest = coupling.chunks_exact(points).map(bounds).map(|[low, high]| high.max(-low)).collect();
        let factor = Compliance::new(matrix.clone(), points, ordering)?.into_factor();
        let compliance = Compliance::new(matrix, points, Ordering::Any)?;
        let mut condensed = Self {
            compliance,
            ordering,
            points,
            vectors,
            before: left,
            factor,
            coupling,
            eliminated: Vec::new(),
            slopes: Vec::new(),
            blocks,
            largest,
        };
        if ordering == Ordering::Prefix {
            condensed.eliminate_coupling();
        }
        Ok(condensed)
    }

    fn eliminate_coupling(&mut self) {
        let (n, k) = (self.points, self.vectors);
        self.eliminated = vec![0.0; n * k];
        self.slopes = vec![0.0; (n + 1) * k * k];
        for i in 0..n {
            let row = &self.factor[i * n..i * n + i + 1];
            for a in 0..k {
                let known: f64 = (0..i).map(|j| row[j] * self.eliminated[j * k + a]).sum();
                self.eliminated[i * k + a] = (self.coupling[a * n + i] - known) * row[i];
            }
            for a in 0..k {
                for b in 0..k {
                    let more = self.eliminated[i * k + a] * self.eliminated[i * k + b];
                    self.slopes[(i + 1) * k * k + a * k + b] = self.slopes[i * k * k + a * k + b] + more;
                }
            }
        }
    }

    pub(super) fn compliance(&self) -> &Compliance {
        &self.compliance
    }

    pub(super) fn vectors(&self) -> impl Iterator<Item = &[f64]> {
        self.coupling.chunks_exact(self.points)
    }

    pub(super) fn before(&self) -> usize {
        self.before
    }

    /// In which of the runs a block may be closed at the shift `wanted` and under forces that lessen its gaps by at most `more` (m), by bounds alone.
    #[inline(always)]
    fn may_close<N: Number>(&self, state: &State<N>, block: usize, runs: N::Mask, more: N) -> N::Mask {
        let least = state.least[block] - more;
        // Most blocks are open beyond all doubt.
        let doubtful = runs & !(least - state.reach).above(N::ZERO);
        if !doubtful.any() {
            return doubtful;
        }
        let parts = state.wanted.iter().zip(&self.blocks[block].shapes);
        runs & !parts.fold(least, |sum, (s, [low, high])| sum + (*s * *low).smaller(*s * *high)).above(N::ZERO)
    }

    /// Solve at the shift `wanted` in the runs `todo`, which all are if `again` is not set, else those whose shift has moved; q is measured
    /// when it is needed first, `unsolved` is called with places where no set of points satisfies all conditions. Returns the number of sets
    /// tried.
    #[inline(always)]
    pub(super) fn solve<N: Number>(
        &self,
        state: &mut State<N>,
        todo: N::Mask,
        again: bool,
        (measure, contact): (&impl Measure<N>, usize),
        unsolved: impl FnMut(usize),
    ) -> u32 {
        let todo = if again { todo & state.moved() } else { todo };
        if !todo.any() {
            return 0;
        }
        // Where it may be closed, and up to which block.
        let (mut near, mut end) = (N::Mask::all(false), 0);
        let reaches = state.wanted.iter().zip(&self.largest);
        state.reach = reaches.fold(N::ZERO, |sum, (s, largest)| sum + s.magnitude() * *largest);
        for (index, block) in self.blocks.iter().enumerate() {
            let closed = self.may_close(state, index, todo, N::ZERO);
            if closed.any() {
                (near, end) = (near | closed, block.end);
            }
        }
        if end == 0 {
            self.open(state, todo);
            return 0;
        }
        for (shift, wanted) in state.shift.iter_mut().zip(&state.wanted) {
            *shift = wanted.or_where_not(todo, *shift);
        }
        if self.ordering == Ordering::Any {
            end = self.points;
        }
        loop {
            if state.measured < end {
                measure.gaps(contact, state.measured..end, &mut state.free[state.measured..end]);
                state.measured = end;
            }
            self.shift(state, end);
            let solved = match self.ordering {
                Ordering::Prefix => self.solve_prefix(state, todo, near, end),
                Ordering::Any => N::Mask::all(false),
            };
            let left = todo & !solved;
            if !left.any() {
                return 1;
            }
            if end == self.points {
                return self.solve_any(state, left, unsolved);
            }
            end = self.points;
        }
    }

    #[inline(always)]
    fn open<N: Number>(&self, state: &mut State<N>, todo: N::Mask) {
        if state.is_pressed() {
            let [first, end] = state.pressed;
            let State { forces, moments, slope, prefix, .. } = state;
            for value in forces[first..end].iter_mut().chain(moments).chain(slope).chain([prefix]) {
                *value = N::ZERO.or_where_not(todo, *value);
            }
            state.pressed = if todo.every() { [0, 0] } else { pressed(&state.forces) };
        }
        for (shift, wanted) in state.shift.iter_mut().zip(&state.wanted) {
            *shift = wanted.or_where_not(todo, *shift);
        }
    }

    /// Gaps without forces at the shift, up to a point.
    #[inline(always)]
    fn shift<N: Number>(&self, state: &mut State<N>, end: usize) {
        let State { shift, shifted, free, .. } = state;
        let shifted = &mut shifted[..end];
        shifted.copy_from_slice(&free[..end]);
        let vectors = self.coupling.chunks_exact(self.points).map(|vector| &vector[..end]);
        let moving = shift.iter().zip(vectors).filter(|(s, _)| (!s.equals(N::ZERO)).any());
        N::subtract_all(shifted, moving.map(|(s, vector)| (N::ZERO - *s, vector)));
    }

    /// Eliminate pressed points from the pole outwards in the runs `near`, which may be closed before the point `end`; those of `todo` beyond
    /// are open. Returns in which of `todo` the pressed set is a prefix of these points: those have their forces.
    #[inline(always)]
    fn solve_prefix<N: Number>(&self, state: &mut State<N>, todo: N::Mask, near: N::Mask, end: usize) -> N::Mask {
        let (n, k) = (self.points, self.vectors);
        let State { shifted, gaps, trial, found, .. } = state;
        // −g of the open points, while those before are closed.
        let gaps = &mut gaps[..end];
        let mut largest = N::ZERO;
        for (out, gap) in gaps.iter_mut().zip(&*shifted) {
            *out = N::ZERO - *gap;
            largest = largest.larger(gap.magnitude());
        }
        let rounding = largest * Compliance::ROUNDING;
        found.fill(N::ZERO);
        let (mut pressed, mut prefix, mut counts) = (near, todo, N::ZERO);
        // Points are taken two by two: of the first of two, what only its neighbour knows of.
        let mut held: Option<(N, &[f64])> = None;
        let mut count = 0;
        while count < end {
            let here = gaps[count];
            pressed = pressed & here.above(N::ZERO);
            // Behind the last pressed point no gap may be closed.
            prefix = prefix & (pressed | here.within(rounding) | !near);
            if !pressed.any() {
                break;
            }
            let column = &self.factor[count * n..count * n + end];
            let y = (here * column[count]).or_where_not(pressed, N::ZERO);
            trial[count] = y;
            N::subtract(found, [N::ZERO - y], [&self.eliminated[count * k..(count + 1) * k]]);
            counts = (counts + 1.0).or_where_not(pressed, counts);
            count += 1;
            held = if let Some((other, before)) = held {
                N::subtract(&mut gaps[count..], [other, y], [&before[count..], &column[count..]]);
                None
            } else {
                if let Some(gap) = gaps.get_mut(count) {
                    *gap = *gap - y * column[count];
                }
                Some((y, column))
            };
        }
        if let Some((y, column)) = held {
            let behind = (count + 1).min(end);
            N::subtract(&mut gaps[behind..], [y], [&column[behind..]]);
        }
        let beyond = gaps[count..].iter().fold(N::Mask::all(true), |all, gap| all & gap.within(rounding));
        prefix = prefix & (beyond | !near);
        // Lᵀ λ = y.
        let mut pressing = N::ZERO;
        held = None;
        for i in (0..count).rev() {
            let row = &self.factor[i * n..i * n + i + 1];
            let force = trial[i] * row[i];
            trial[i] = force;
            pressing = pressing + force;
            prefix = prefix & N::ZERO.within(force);
            held = if let Some((other, before)) = held {
                N::subtract(&mut trial[..i], [other, force], [before, row]);
                None
            } else {
                if let Some(next) = trial[..i].last_mut() {
                    *next = *next - force * row[i - 1];
                }
                Some((force, row))
            };
        }
        trial[count..end.max(state.pressed[1])].fill(N::ZERO);
        // What the forces do to the points that were not looked at must leave them open.
        for (index, block) in self.blocks.iter().enumerate().filter(|(_, block)| block.end > end) {
            prefix = prefix & !self.may_close(state, index, near, N::ZERO - pressing * block.least_compliance);
        }
        self.take(state, prefix, counts, count);
        prefix
    }

    /// Make the solution that was tried, whose points from `end` on are open and without force, that of the runs `taken`, so many points pressed.
    #[inline(always)]
    fn take<N: Number>(&self, state: &mut State<N>, taken: N::Mask, counts: N, end: usize) {
        let size = self.vectors * self.vectors;
        let State { forces, trial, moments, found, slope, prefix, pressed, .. } = state;
        let last = end.max(pressed[1]);
        for (force, trial) in forces[..last].iter_mut().zip(trial) {
            *force = trial.or_where_not(taken, *force);
        }
        for (moment, found) in moments.iter_mut().zip(found) {
            *moment = found.or_where_not(taken, *moment);
        }
        let changed = taken & !counts.equals(*prefix);
        if changed.any() {
            for place in changed.places() {
                let count = counts.get(place) as usize;
                let slopes = &self.slopes[count * size..(count + 1) * size];
                slope.iter_mut().zip(slopes).for_each(|(out, slope)| out.put(place, *slope));
            }
            *prefix = counts.or_where_not(changed, *prefix);
        }
        *pressed = self::pressed(&forces[..last]);
    }
}

/// From the first point with a force in any run to behind the last.
#[inline(always)]
fn nonzero<N: Number>(forces: &[N]) -> [usize; 2] {
    extent(forces, |force| (!force.equals(N::ZERO)).any())
}

/// From the first point that is pressed in any run to behind the last.
#[inline(always)]
fn pressed<N: Number>(forces: &[N]) -> [usize; 2] {
    extent(forces, |force| force.above(N::ZERO).any())
}

/// From the first number of which it holds to behind the last.
#[inline(always)]
fn extent<N: Number>(values: &[N], holds: impl Fn(&N) -> bool) -> [usize; 2] {
    let Some(last) = values.iter().rposition(&holds) else { return [0, 0] };
    [values.iter().position(&holds).unwrap_or(0), last + 1]
}

pub(super) fn bounds(values: &[f64]) -> [f64; 2] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| [low.min(*v), high.max(*v)])
}

#[inline(always)]
pub(super) fn dot<N: Number>(values: &[N], factors: &[f64]) -> N {
    values.iter().zip(factors).fold(N::ZERO, |sum, (value, factor)| sum + *value * *factor)
}
