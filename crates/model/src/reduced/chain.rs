//! All contacts of a chain at one instant.
//!
//! s of a contact is m of its neighbours, m falls with s as long as the pressed sets stay: with all sets known the coupled contacts are a
//! small linear system in s. A pass solves every contact at the s at hand, then that system; once no set changes, the next pass confirms
//! it to rounding. Should the sets not come to rest, contacts are solved one after another (block Gauss–Seidel), which converges for
//! every positive definite compliance.

use super::contact::{Condensed, Measure, State};
use crate::number::{Mask, Number};

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Effort {
    pub(super) passes: u32,
    pub(super) sets: u32,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unsolved {
    /// No set of points satisfies the conditions at this contact (0 = piston).
    NoActiveSet(usize),
    NotSettled(usize),
}

/// Passes with the linear system, and all passes.
pub(super) const LINEAR_PASSES: u32 = 30;
const MOST_PASSES: u32 = 400;
/// Largest mismatch of s over the largest s: a few roundings of its sums.
const SETTLED: f64 = 1e-13;

/// Solve all contacts in the runs `live`; `measure` writes q of a contact when it is needed first. Runs without a solution are entered in
/// `unsolved` with their place.
/// `linear_passes`: how many passes use the linear system, [`LINEAR_PASSES`].
#[inline(always)]
pub(super) fn solve<N: Number>(
    linear_passes: u32,
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State<N>],
    live: N::Mask,
    unsolved: &mut Vec<(usize, Unsolved)>,
    measure: &impl Measure<N>,
) -> Effort {
    let mut effort = Effort::default();
    // Where the sets have not settled.
    let mut active = live;
    // The neighbours' forces of the last step are the first guess.
    for contact in 0..states.len() {
        seek(condensed, of_contact, states, contact, active);
    }
    loop {
        effort.passes += 1;
        let is_linear = effort.passes <= linear_passes;
        for contact in 0..states.len() {
            let own = &condensed[of_contact[contact]];
            if !is_linear {
                seek(condensed, of_contact, states, contact, active);
            }
            let without = |place| unsolved.push((place, Unsolved::NoActiveSet(contact)));
            let again = effort.passes > 1;
            effort.sets += own.solve(&mut states[contact], active, again, (measure, contact), without);
        }
        for (place, _) in &*unsolved {
            active = active & N::Mask::but(*place);
        }
        let (worst, mismatch, largest) = mismatch(condensed, of_contact, states, active);
        active = active & !mismatch.within(largest * SETTLED);
        if !active.any() {
            return effort;
        }
        for place in active.places() {
            if effort.passes >= MOST_PASSES || !mismatch.get(place).is_finite() {
                unsolved.push((place, Unsolved::NotSettled(worst.get(place) as usize)));
                active = active & N::Mask::but(place);
            }
        }
        if is_linear {
            balance(condensed, of_contact, states, active, largest * SETTLED);
        }
    }
}

/// Set `wanted` of a contact to the moments of its neighbours in the runs `active`.
#[inline(always)]
fn seek<N: Number>(
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State<N>],
    contact: usize,
    active: N::Mask,
) {
    let own = condensed[of_contact[contact]].before();
    let (earlier, rest) = states.split_at_mut(contact);
    let Some((state, later)) = rest.split_first_mut() else { return };
    let (front, back) = state.wanted.split_at_mut(own);
    let take = |wanted: &mut [N], moments: &[N]| {
        for (wanted, moment) in wanted.iter_mut().zip(moments) {
            *wanted = moment.or_where_not(active, *wanted);
        }
    };
    if let Some(neighbour) = earlier.last() {
        take(front, &neighbour.moments[condensed[of_contact[contact - 1]].before()..]);
    }
    if let Some(neighbour) = later.first() {
        take(back, &neighbour.moments);
    }
}

/// The contact with the largest mismatch of its s with its neighbours' m, that mismatch, and the largest s there is.
#[inline(always)]
fn mismatch<N: Number>(
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State<N>],
    active: N::Mask,
) -> (N, N, N) {
    let (mut worst, mut most, mut largest) = (N::ZERO, N::ZERO, N::ZERO);
    for contact in 0..states.len() {
        seek(condensed, of_contact, states, contact, active);
        let state = &states[contact];
        for (wanted, shift) in state.wanted.iter().zip(&state.shift) {
            largest = largest.larger(wanted.magnitude());
            let change = (*wanted - *shift).magnitude();
            let less = change.within(most);
            worst = worst.or_where_not(less, N::all(contact as f64));
            most = most.or_where_not(less, change);
        }
    }
    (worst, most, largest)
}

/// Solve the linear system of all s for the sets as they are in the runs `active`: `wanted` of every contact, which holds the moments of its
/// neighbours; by Gauss–Seidel, whose error falls a hundredfold a sweep where bodies are much stiffer than contacts.
#[inline(always)]
fn balance<N: Number>(
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State<N>],
    mut active: N::Mask,
    tolerance: N,
) {
    /// m of the neighbour at the s it is wanted at.
    #[inline(always)]
    fn moment<N: Number>(state: &State<N>, a: usize) -> N {
        let k = state.step.len();
        let steps = state.step.iter().zip(&state.slope[a * k..(a + 1) * k]);
        state.moments[a] - steps.fold(N::ZERO, |sum, (step, slope)| sum + *slope * *step)
    }
    for state in &mut *states {
        for ((step, wanted), shift) in state.step.iter_mut().zip(&state.wanted).zip(&state.shift) {
            *step = *wanted - *shift;
        }
    }
    for _ in 0..MOST_PASSES {
        let mut change = N::ZERO;
        for contact in 0..states.len() {
            let own = condensed[of_contact[contact]].before();
            for a in 0..states[contact].wanted.len() {
                let (neighbour, a_there) = if a < own {
                    (&states[contact - 1], condensed[of_contact[contact - 1]].before() + a)
                } else {
                    (&states[contact + 1], a - own)
                };
                // Without forces there is nothing that could change.
                let value = if neighbour.is_pressed() { moment(neighbour, a_there) } else { N::ZERO };
                let State { wanted, step, shift, .. } = &mut states[contact];
                change = change.larger((value - wanted[a]).magnitude());
                wanted[a] = value.or_where_not(active, wanted[a]);
                step[a] = wanted[a] - shift[a];
            }
        }
        active = active & !change.within(tolerance);
        if !active.any() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;
    use crate::{fea::contact::complementarity::Ordering, reduced::rank::Crossing};

    const POINTS: usize = 6;

    struct Given<'a>(&'a [Vec<f64>]);

    impl Measure<f64> for Given<'_> {
        fn gaps(&self, contact: usize, points: Range<usize>, free: &mut [f64]) {
            free.copy_from_slice(&self.0[contact][points]);
        }
    }

    fn compliance() -> Vec<f64> {
        let entry = |i: usize, j: usize| if i == j { 1.2 } else { 0.5 / (1.0 + i.abs_diff(j) as f64) };
        (0..POINTS * POINTS).map(|k| 1e-7 * entry(k / POINTS, k % POINTS)).collect()
    }

    /// V across a body: almost uniform, of either sign.
    fn crossing(sign: f64) -> Vec<f64> {
        let entry = |i: usize, j: usize| 1.0 + 0.05 * (i * i) as f64 - 0.03 * (j * j) as f64 + 0.002 * (i * j) as f64;
        (0..POINTS * POINTS).map(|k| 4e-9 * sign * entry(k / POINTS, k % POINTS)).collect()
    }

    fn gaps(closed: [f64; 3]) -> Vec<Vec<f64>> {
        closed.iter().map(|closed| (0..POINTS).map(|i| 2e-8 * (i * i) as f64 - closed).collect()).collect()
    }

    /// λ of all points by projected Gauss–Seidel on the whole problem: other algorithm, other form of V.
    fn swept(free: &[Vec<f64>], signs: [f64; 2]) -> Vec<Vec<f64>> {
        let (own, across) = (compliance(), signs.map(crossing));
        let entry = |c: usize, i: usize, d: usize, j: usize| match d as i64 - c as i64 {
            0 => own[i * POINTS + j],
            1 => across[c][j * POINTS + i],
            -1 => across[d][i * POINTS + j],
            _ => 0.0,
        };
        let mut forces = vec![vec![0.0; POINTS]; 3];
        for _ in 0..4000 {
            for c in 0..3 {
                for i in 0..POINTS {
                    let mut gap = free[c][i];
                    for (d, other) in forces.iter().enumerate() {
                        gap += other.iter().enumerate().map(|(j, force)| entry(c, i, d, j) * force).sum::<f64>();
                    }
                    forces[c][i] = f64::max(0.0, forces[c][i] - gap / own[i * POINTS + i]);
                }
            }
        }
        forces
    }

    fn solved(linear_passes: u32, last: Ordering, free: &[Vec<f64>], signs: [f64; 2]) -> (Vec<State<f64>>, Effort) {
        let crossings = signs.map(|sign| Crossing::of(crossing(sign), POINTS));
        let condensed = [
            Condensed::new(compliance(), POINTS, Ordering::Prefix, None, Some(&crossings[0])).unwrap(),
            Condensed::new(compliance(), POINTS, Ordering::Prefix, Some(&crossings[0]), Some(&crossings[1])).unwrap(),
            Condensed::new(compliance(), POINTS, last, Some(&crossings[1]), None).unwrap(),
        ];
        let mut states: Vec<State<f64>> = condensed.iter().map(State::new).collect();
        for (state, free) in states.iter_mut().zip(free) {
            state.least.fill(free.iter().copied().fold(f64::INFINITY, f64::min));
        }
        let measure = Given(free);
        let mut unsolved = Vec::new();
        let effort = solve(linear_passes, &condensed, &[0, 1, 2], &mut states, true, &mut unsolved, &measure);
        assert!(unsolved.is_empty());
        (states, effort)
    }

    #[test]
    fn forces_are_those_of_the_whole_problem_swept() {
        for closed in [[3e-7, 2e-7, 1e-7], [3e-7, -5e-9, 2e-7], [-1e-8, 4e-7, -2e-9], [-1e-8, -1e-8, 2e-7]] {
            for signs in [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]] {
                let free = gaps(closed);
                let expected = swept(&free, signs);
                let largest = expected.iter().flatten().copied().fold(0.0, f64::max);
                for (last, passes) in
                    [(Ordering::Prefix, LINEAR_PASSES), (Ordering::Any, LINEAR_PASSES), (Ordering::Any, 0)]
                {
                    let (states, effort) = solved(passes, last, &free, signs);
                    for (state, expected) in states.iter().zip(&expected) {
                        for (found, expected) in state.forces.iter().zip(expected) {
                            assert!(
                                (found - expected).abs() < 1e-11 * largest,
                                "{closed:?} {signs:?} {found} {expected}"
                            );
                        }
                    }
                    assert!(passes == 0 || effort.passes <= 4, "{effort:?}");
                }
            }
        }
    }

    #[test]
    fn an_open_contact_is_not_even_measured() {
        let free = gaps([-1e-6, 2e-7, -1e-6]);
        let (states, effort) = solved(LINEAR_PASSES, Ordering::Prefix, &free, [1.0, 1.0]);
        assert!(states[1].is_pressed() && states[0].measured == 0 && states[2].measured == 0);
        assert_eq!(effort.sets, 1);
    }

    #[test]
    fn what_has_no_solution_names_its_contact() {
        let mut free = gaps([-1e-6, 2e-7, 1e-7]);
        free[2][3] = f64::NAN;
        let crossings = Crossing::of(crossing(1.0), POINTS);
        let condensed =
            [Condensed::new(compliance(), POINTS, Ordering::Prefix, Some(&crossings), Some(&crossings)).unwrap()];
        let mut states = vec![State::<f64>::new(&condensed[0]); 3];
        states.iter_mut().for_each(|state| state.least.fill(-1.0));
        let measure = Given(&free);
        let mut unsolved = Vec::new();
        solve(LINEAR_PASSES, &condensed, &[0, 0, 0], &mut states, true, &mut unsolved, &measure);
        assert_eq!(unsolved, [(0, Unsolved::NoActiveSet(2))]);
    }
}
