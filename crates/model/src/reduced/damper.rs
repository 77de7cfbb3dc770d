//! Dashpots at the end of a step.
//!
//! D = (c + γ √δ) δ̇ with the overlap δ of the rigid motions and their velocities after the second kick, which the dashpots change
//! themselves: the D of all contacts are found together, contact by contact until none changes.

use super::{contact::State, motion::Moving};

/// Sweeps after which they have not settled.
const MOST_SWEEPS: u32 = 400;
/// Sweeps after which a change counts as rounding where it is one of what a dashpot makes of a velocity alone.
const ROUNDING_SWEEPS: u32 = 40;
/// Largest change in the last sweep over the largest force: a few roundings.
const SETTLED: f64 = 1e-14;

/// What the last dashpot stands on, if it moves without being a body of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Behind {
    /// Velocity at the end of the step without the dashpot's force, m/s.
    pub(super) velocity: f64,
    /// What a unit of its force adds, m/s/N.
    pub(super) mobility: f64,
}

/// Find the forces of all dashpots, their coefficients given, the piston moving at `piston` (m/s); returns how often a dashpot was
/// evaluated. On failure the contact.
pub(super) fn solve(
    states: &mut [State],
    bodies: &[Option<Moving>],
    piston: f64,
    behind: Option<Behind>,
    tension: bool,
) -> Result<u64, usize> {
    let mut evaluations = 0;
    for sweep in 0..MOST_SWEEPS {
        let (mut worst, mut change, mut largest) = (0, 0.0, 0.0);
        for contact in 0..states.len() {
            let coefficient = states[contact].coefficient;
            let own = states[contact].damping;
            if coefficient == 0.0 {
                states[contact].damping = 0.0;
                continue;
            }
            let (mut rate, mut mobility, mut fastest) = (0.0, 0.0, 0.0);
            for (slot, sign) in [(contact, 1.0), (contact + 1, -1.0)] {
                match &bodies[slot] {
                    Some(body) => {
                        let net = states[slot - 1].total() - states.get(slot).map_or(0.0, State::total);
                        rate += sign * (body.rigid_velocity + body.mobility() * net);
                        mobility += body.mobility();
                        fastest = f64::max(fastest, body.rigid_velocity.abs());
                    }
                    None if slot == 0 => {
                        rate += piston;
                        fastest = f64::max(fastest, piston.abs());
                    }
                    None => {
                        if let Some(behind) = behind {
                            rate -= behind.velocity + behind.mobility * own;
                            mobility += behind.mobility;
                        }
                    }
                }
            }
            // Without this dashpot's own force the rate is larger by mobility × D.
            let force = coefficient * (rate + mobility * own) / (1.0 + coefficient * mobility);
            let force = if tension { force } else { force.max(-states[contact].pressing) };
            states[contact].damping = force;
            evaluations += 1;
            largest = f64::max(largest, force.abs().max(states[contact].pressing));
            if sweep >= ROUNDING_SWEEPS {
                largest = largest.max(coefficient * fastest);
            }
            if !((force - own).abs() <= change) {
                (worst, change) = (contact, (force - own).abs());
            }
        }
        if change <= SETTLED * largest {
            return Ok(evaluations);
        }
        if !change.is_finite() {
            return Err(worst);
        }
    }
    Err(0)
}
