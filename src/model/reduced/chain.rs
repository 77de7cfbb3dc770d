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
    mut measure: impl FnMut(usize, &mut [f64]),
) -> Result<Effort, Unsolved> {
    let mut effort = Effort::default();
    // The neighbours' forces of the last step are the first guess.
    for contact in 0..states.len() {
        seek(condensed, of_contact, states, contact);
    }
    loop {
        effort.passes += 1;
        let is_linear = effort.passes <= LINEAR_PASSES;
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
