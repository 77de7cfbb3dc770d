//! Dashpots at the end of a step.
//!
//! D = (c + γ √δ) δ̇ with the overlap δ of the rigid motions and their velocities after the second kick, which the dashpots change
//! themselves: the D of all contacts are found together, contact by contact until none changes.

use super::{contact::State, motion::Moving};
use crate::number::{Mask, Number};

const MOST_SWEEPS: u32 = 400;
/// Sweeps after which a change counts as rounding where it is one of what a dashpot makes of a velocity alone.
const ROUNDING_SWEEPS: u32 = 40;
/// Largest change in the last sweep over the largest force: a few roundings.
const SETTLED: f64 = 1e-14;

/// What the last dashpot stands on, if it moves without being a body of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct DashpotBase<N> {
    /// Velocity at the end of the step without the dashpot's force, m/s.
    pub(super) velocity: N,
    /// What a unit of its force adds, m/s/N.
    pub(super) mobility: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Face<N> {
    /// Its velocity without the forces of the last half step, m/s.
    pub(super) velocity: N,
    /// What a unit of force takes from that, m/(N·s); none where the horn does not give way.
    pub(super) mobility: Option<N>,
}

/// Find the forces of all dashpots in the runs `live`, their coefficients given; returns how often a
/// dashpot was evaluated. Runs in which they do not settle are shown to `unsettled` with the place and the contact.
#[inline(always)]
pub(super) fn solve<N: Number>(
    states: &mut [State<N>],
    bodies: &[Option<Moving<N>>],
    piston: Face<N>,
    base: Option<DashpotBase<N>>,
    tension: bool,
    live: N::Mask,
    mut unsettled: impl FnMut(usize, usize),
) -> u64 {
    let mut evaluations = 0;
    // Where they have not settled.
    let mut active = live;
    let mut worst = N::ZERO;
    for sweep in 0..MOST_SWEEPS {
        let (mut change, mut largest) = (N::ZERO, N::ZERO);
        worst = N::ZERO;
        for contact in 0..states.len() {
            let coefficient = states[contact].coefficient;
            let own = states[contact].damping;
            let on = !coefficient.equals(N::ZERO);
            if !on.any() {
                states[contact].damping = N::ZERO;
                continue;
            }
            let (mut rate, mut mobility, mut fastest) = (N::ZERO, 0.0, N::ZERO);
            let mut yielding = None;
            for (slot, is_before) in [(contact, true), (contact + 1, false)] {
                let toward = |rate: N, velocity: N| if is_before { rate + velocity } else { rate - velocity };
                match &bodies[slot] {
                    Some(body) => {
                        let net = states[slot - 1].total() - states.get(slot).map_or(N::ZERO, State::total);
                        rate = toward(rate, body.rigid_velocity + net * body.mobility());
                        mobility += body.mobility();
                        fastest = fastest.larger(body.rigid_velocity.magnitude());
                    }
                    None if slot == 0 => {
                        rate = rate + piston.velocity;
                        if let Some(mobility) = piston.mobility {
                            rate = rate - states[0].total() * mobility;
                            yielding = Some(mobility);
                        }
                        fastest = fastest.larger(piston.velocity.magnitude());
                    }
                    None => {
                        if let Some(base) = base {
                            rate = rate - (base.velocity + own * base.mobility);
                            mobility += base.mobility;
                        }
                    }
                }
            }
            // Without this dashpot's own force the rate is larger by mobility × D.
            let force = match yielding {
                None => coefficient * (rate + own * mobility) / (coefficient * mobility + 1.0),
                Some(face) => {
                    let mobility = face + mobility;
                    coefficient * (rate + own * mobility) / (coefficient * mobility + 1.0)
                }
            };
            let force = if tension { force } else { force.larger(N::ZERO - states[contact].pressing) };
            let force = force.or_where_not(on, N::ZERO);
            states[contact].damping = force.or_where_not(active, own);
            evaluations += 1;
            let mut scale = force.magnitude().larger(states[contact].pressing);
            if sweep >= ROUNDING_SWEEPS {
                scale = scale.larger(coefficient * fastest);
            }
            largest = largest.larger(scale.or_where_not(on, N::ZERO));
            let moved = (force - own).magnitude();
            let less = moved.within(change) | !on;
            worst = worst.or_where_not(less, N::all(contact as f64));
            change = change.or_where_not(less, moved);
        }
        active = active & !change.within(largest * SETTLED);
        if !active.any() {
            return evaluations;
        }
        for place in active.places() {
            if !change.get(place).is_finite() {
                unsettled(place, worst.get(place) as usize);
                active = active & N::Mask::but(place);
            }
        }
    }
    active.places().for_each(|place| unsettled(place, worst.get(place) as usize));
    evaluations
}
