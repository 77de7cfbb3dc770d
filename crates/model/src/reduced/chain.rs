//! All contacts of a chain at one instant.
//!
//! s of a contact is m of its neighbours, m falls with s as long as the pressed sets stay: with all sets known the coupled contacts are a
//! small linear system in s. A pass solves every contact at the s at hand, then that system; once no set changes, the next pass confirms
//! it to rounding. Should the sets not come to rest, contacts are solved one after another (block Gauss–Seidel), which converges for
//! every positive definite compliance.

use super::contact::{Condensed, State};

/// What a solution took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Effort {
    pub(super) passes: u32,
    pub(super) sets: u32,
}

/// Why there is none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unsolved {
    /// No set of points satisfies the conditions at this contact (0 = piston).
    NoActiveSet(usize),
    /// The forces did not settle, least at this contact.
    NotSettled(usize),
}

/// Passes with the linear system, and all passes.
const LINEAR_PASSES: u32 = 30;
const MOST_PASSES: u32 = 400;
/// Largest mismatch of s over the largest s: a few roundings of its sums.
const SETTLED: f64 = 1e-13;

/// Solve all contacts; `measure` writes q of a contact when it is needed first.
///
/// # Errors
/// [`Unsolved`].
pub(super) fn solve(
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State],
    measure: impl FnMut(usize, &mut [f64]),
) -> Result<Effort, Unsolved> {
    solve_within(LINEAR_PASSES, condensed, of_contact, states, measure)
}

/// The same with so many passes that use the linear system.
fn solve_within(
    linear_passes: u32,
    condensed: &[Condensed],
    of_contact: &[usize],
    states: &mut [State],
    mut measure: impl FnMut(usize, &mut [f64]),
) -> Result<Effort, Unsolved> {
    let mut effort = Effort::default();
    // The neighbours' forces of the last step are the first guess.
    for contact in 0..states.len() {
        seek(condensed, of_contact, states, contact);
    }
    loop {
        effort.passes += 1;
        let is_linear = effort.passes <= linear_passes;
        for contact in 0..states.len() {
            let own = &condensed[of_contact[contact]];
            if !is_linear {
                seek(condensed, of_contact, states, contact);
            }
            let state = &mut states[contact];
            if effort.passes > 1 && state.shift == state.wanted {
                continue;
            }
            if own.is_surely_open(state) {
                own.open(state);
                continue;
            }
            if !state.is_measured {
                measure(contact, &mut state.free);
                state.is_measured = true;
            }
            effort.sets += own.solve(state).map_err(|_| Unsolved::NoActiveSet(contact))?;
        }
        let (worst, mismatch, largest) = mismatch(condensed, of_contact, states);
        if mismatch <= SETTLED * largest {
            return Ok(effort);
        }
        if effort.passes >= MOST_PASSES || !mismatch.is_finite() {
            return Err(Unsolved::NotSettled(worst));
        }
        if is_linear {
            balance(condensed, of_contact, states, SETTLED * largest);
        }
    }
}

/// Set `wanted` of a contact to the moments of its neighbours.
fn seek(condensed: &[Condensed], of_contact: &[usize], states: &mut [State], contact: usize) {
    let own = condensed[of_contact[contact]].before();
    let (earlier, rest) = states.split_at_mut(contact);
    let Some((state, later)) = rest.split_first_mut() else { return };
    if let (Some(neighbour), 1..) = (earlier.last(), own) {
        let from = condensed[of_contact[contact - 1]].before();
        state.wanted[..own].copy_from_slice(&neighbour.moments[from..]);
    }
    if let (Some(neighbour), true) = (later.first(), own < state.wanted.len()) {
        let to = condensed[of_contact[contact + 1]].before();
        state.wanted[own..].copy_from_slice(&neighbour.moments[..to]);
    }
}

/// The contact with the largest mismatch of its s with its neighbours' m, that mismatch, and the largest s there is.
fn mismatch(condensed: &[Condensed], of_contact: &[usize], states: &mut [State]) -> (usize, f64, f64) {
    let (mut worst, mut most, mut largest) = (0, 0.0, 0.0);
    for contact in 0..states.len() {
        seek(condensed, of_contact, states, contact);
        let state = &states[contact];
        for (wanted, shift) in state.wanted.iter().zip(&state.shift) {
            largest = f64::max(largest, wanted.abs());
            if !((wanted - shift).abs() <= most) {
                (worst, most) = (contact, (wanted - shift).abs());
            }
        }
    }
    (worst, most, largest)
}

/// Solve the linear system of all s for the sets as they are: `wanted` of every contact; by Gauss–Seidel, whose error falls a
/// hundredfold a sweep where bodies are much stiffer than contacts.
fn balance(condensed: &[Condensed], of_contact: &[usize], states: &mut [State], tolerance: f64) {
    /// m of the neighbour at the s it is wanted at.
    fn moment(state: &State, a: usize) -> f64 {
        let k = state.wanted.len();
        let steps = state.wanted.iter().zip(&state.shift).zip(&state.slope[a * k..(a + 1) * k]);
        state.moments[a] - steps.map(|((wanted, shift), slope)| slope * (wanted - shift)).sum::<f64>()
    }
    states.iter_mut().for_each(|state| state.wanted.copy_from_slice(&state.shift));
    for _ in 0..MOST_PASSES {
        let mut change: f64 = 0.0;
        for contact in 0..states.len() {
            let own = condensed[of_contact[contact]].before();
            for a in 0..states[contact].wanted.len() {
                let value = if a < own {
                    let from = condensed[of_contact[contact - 1]].before();
                    moment(&states[contact - 1], from + a)
                } else {
                    moment(&states[contact + 1], a - own)
                };
                let wanted = &mut states[contact].wanted[a];
                change = change.max((value - *wanted).abs());
                *wanted = value;
            }
        }
        if change <= 0.1 * tolerance {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{fea::contact::complementarity::Ordering, reduced::rank::Crossing};

    const POINTS: usize = 6;

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

    fn solved(linear_passes: u32, last: Ordering, free: &[Vec<f64>], signs: [f64; 2]) -> (Vec<State>, Effort) {
        let crossings = signs.map(|sign| Crossing::of(crossing(sign), POINTS));
        let condensed = [
            Condensed::new(compliance(), POINTS, Ordering::Prefix, None, Some(&crossings[0])).unwrap(),
            Condensed::new(compliance(), POINTS, Ordering::Prefix, Some(&crossings[0]), Some(&crossings[1])).unwrap(),
            Condensed::new(compliance(), POINTS, last, Some(&crossings[1]), None).unwrap(),
        ];
        let mut states: Vec<State> = condensed.iter().map(State::new).collect();
        for (state, free) in states.iter_mut().zip(free) {
            state.least = free.iter().copied().fold(f64::INFINITY, f64::min);
        }
        let measure = |contact: usize, out: &mut [f64]| out.copy_from_slice(&free[contact]);
        let effort = solve_within(linear_passes, &condensed, &[0, 1, 2], &mut states, measure).unwrap();
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
        assert!(states[1].is_pressed() && !states[0].is_measured && !states[2].is_measured);
        assert_eq!(effort.sets, 1);
    }

    #[test]
    fn what_has_no_solution_names_its_contact() {
        let mut free = gaps([-1e-6, 2e-7, 1e-7]);
        free[2][3] = f64::NAN;
        let crossings = Crossing::of(crossing(1.0), POINTS);
        let condensed =
            [Condensed::new(compliance(), POINTS, Ordering::Prefix, Some(&crossings), Some(&crossings)).unwrap()];
        let mut states = vec![State::new(&condensed[0]); 3];
        states.iter_mut().for_each(|state| state.least = -1.0);
        let measure = |contact: usize, out: &mut [f64]| out.copy_from_slice(&free[contact]);
        let unsolved = solve(&condensed, &[0, 0, 0], &mut states, measure);
        assert_eq!(unsolved, Err(Unsolved::NoActiveSet(2)));
    }
}
