//! Velocity Verlet at a fixed step: the cheap stepper.
//!
//! Kick–drift–kick,
//!
//! v½ = v + (h/2) a(u, v), u' = u + h v½, v' = v½ + (h/2) a(u', v½ + (h/2) a(u, v)),
//!
//! one evaluation of the forces a step, second order (with dashpots too, whose velocity is extrapolated to the end of the step),
//! symplectic without dashpots. A contact is taken to open and close at the steps' ends; there the error of one event is of order
//! h^(5/2) without dashpot, h² with a Kuwabara–Kono one, h with a linear one, whose force jumps.
//!
//! Largest error of the last bead's velocity over its peak, against the adaptive integrator: six beads between rigid flats, five cycles
//! at 73 kHz, 1 µm, first 70 µs (`tests/model/chain_steppers.rs` holds it to this table). A damped step is the worse for the force that a linear
//! dashpot starts with at every closing.
//!
//! | step | no dampers | linear 0.3 N·s/m | Kuwabara–Kono 3660 N·s·m^(-3/2) |
//! |---|---|---|---|
//! | 0.10 µs | 2.5e-2 | 6.7e-2 | 2.8e-3 |
//! | 0.05 µs | 5.8e-3 | 1.5e-2 | 1.0e-3 |
//! | 0.02 µs | 8.9e-4 | 9.3e-3 | 1.5e-4 |
//! | 0.01 µs | 2.2e-4 | 6.1e-3 | 8.1e-5 |
//!
//! A step so long that the energies no longer add up is refused as a typed failure.

use super::{
    InitialState,
    equation::{Equation, Mode},
    record::Grid,
    system::System,
};
use crate::{
    ModelError, Progress,
    contact_law::{ElasticLaw, Terms},
    response::{EnergyBalance, EnergySums, SolverWork},
    scene::PistonMotion,
    valid::positive,
};

const STEPS_A_REPORT: usize = 4096;
/// Energy unaccounted for, over the largest, beyond which the step was too long for a solution.
const LARGEST_RESIDUAL: f64 = 0.2;

pub(super) fn integrate<const DAMPED: Terms, L: ElasticLaw>(
    system: &System,
    support: L,
    motion: &dyn PistonMotion,
    initial: &InitialState,
    step: f64,
    grid: &mut Grid,
    progress: Progress<'_>,
) -> Result<(EnergyBalance, SolverWork), ModelError> {
    positive("model.step", "a positive time, s", step)?;
    let (padded, beads) = (system.padded, system.beads);
    let mut equation = Equation::<DAMPED, L>::new(system, support);
    for switch in 0..equation.modes.len() {
        // Every contact always pressed: the law itself is zero when separated.
        equation.set_mode(switch, Mode::Pressed);
    }
    let (mut u, mut v) = system.initial_blocks(initial)?;
    let mut predicted = vec![0.0; padded];
    let mut acceleration = vec![0.0; padded];
    let mut force = vec![0.0; padded];
    let mut balance = EnergySums::starting((system.kinetic_energy(&v), system.stored_energy(&u)), None);
    let steps = (grid.end() / step).ceil() as usize;
    (u[0], v[0]) = motion.at(0.0);
    let mut power = forces(&mut equation, &u, &v, &mut force);
    accelerations(system, &force, &mut acceleration);
    let buffer = grid.buffer().as_flattened_mut();
    buffer[..padded].copy_from_slice(&u);
    buffer[padded..].copy_from_slice(&v);
    grid.store(&mut equation);
    let (mut before_u, mut before_v, mut before_a) = (u.clone(), v.clone(), acceleration.clone());
    for index in 0..steps {
        let time = (index + 1) as f64 * step;
        before_u.copy_from_slice(&u);
        before_v.copy_from_slice(&v);
        before_a.copy_from_slice(&acceleration);
        for i in 1..=beads {
            let half = v[i] + 0.5 * step * acceleration[i];
            u[i] += step * half;
            predicted[i] = half + 0.5 * step * acceleration[i];
            v[i] = half;
        }
        let piston = motion.at(time);
        (u[0], predicted[0]) = piston;
        let previous = power;
        power = forces(&mut equation, &u, &predicted, &mut force);
        accelerations(system, &force, &mut acceleration);
        for i in 1..=beads {
            v[i] += 0.5 * step * acceleration[i];
        }
        v[0] = piston.1;
        balance.step(0.5 * step * (previous.0 + power.0), 0.5 * step * (previous.1 + power.1));
        balance.note();
        while !grid.is_full() && grid.next_time() <= time * (1.0 + 1e-14) {
            let sigma = 1.0 - (time - grid.next_time()) / step;
            interpolate(
                grid.buffer().as_flattened_mut(),
                sigma,
                step,
                (&before_u, &before_v, &before_a),
                (&u, &v, &acceleration),
            );
            grid.store(&mut equation);
        }
        if (index + 1) % STEPS_A_REPORT == 0 || index + 1 == steps {
            if let Some(slot) = (1..=beads).find(|i| !(u[*i].is_finite() && v[*i].is_finite())) {
                return Err(ModelError::NonFinite { time, step, bead: slot });
            }
            if !progress(time) {
                return Err(ModelError::Stopped { time });
            }
        }
    }
    balance.hold((system.kinetic_energy(&v), system.stored_energy(&u)));
    let balance = balance.balance();
    let largest_j = balance.largest_j.max(balance.kinetic_j + balance.stored_j);
    if balance.residual_j.abs() > LARGEST_RESIDUAL * largest_j {
        return Err(ModelError::EnergyNotConserved { step, residual_j: balance.residual_j, largest_j });
    }
    let steps = steps as u64;
    let evaluations = steps + 1;
    let dashpot_evaluations = evaluations * system.damped_contacts();
    let unknowns = 2 * beads as u64;
    Ok((balance, SolverWork { unknowns, steps, evaluations, dashpot_evaluations, ..SolverWork::default() }))
}

/// Contact forces (N) as the response reports them, and the powers of the piston and into the dashpots (W).
#[inline(always)]
fn forces<const DAMPED: Terms, L: ElasticLaw>(
    equation: &mut Equation<'_, DAMPED, L>,
    u: &[f64],
    v: &[f64],
    force: &mut [f64],
) -> (f64, f64) {
    let system = equation.system;
    let total = equation.contact_forces(u, v);
    force[..total.len()].copy_from_slice(total);
    let mut lost = 0.0;
    if DAMPED != 0 {
        for (contact, force) in force[..=system.beads].iter().enumerate() {
            let overlap = system.overlap(contact, u);
            if overlap > 0.0 {
                lost += (force - equation.elastic_force(contact, overlap)) * (v[contact] - v[contact + 1]);
            }
        }
    }
    (force[0] * v[0], lost)
}

#[inline(always)]
fn accelerations(system: &System, force: &[f64], acceleration: &mut [f64]) {
    for i in 1..=system.beads {
        acceleration[i] = (force[i - 1] - force[i]) * system.inverse_mass[i];
    }
}

/// Cubic Hermite interpolation of displacements and velocities within a step.
fn interpolate(
    out: &mut [f64],
    sigma: f64,
    step: f64,
    (u0, v0, a0): (&[f64], &[f64], &[f64]),
    (u1, v1, a1): (&[f64], &[f64], &[f64]),
) {
    let padded = u0.len();
    let rest = 1.0 - sigma;
    let hermite = |y0: f64, d0: f64, y1: f64, d1: f64| {
        let chord = y1 - y0;
        rest * y0 + sigma * y1 + sigma * rest * (rest * (step * d0 - chord) - sigma * (step * d1 - chord))
    };
    for i in 1..padded - 1 {
        out[i] = hermite(u0[i], v0[i], u1[i], v1[i]);
        out[padded + i] = hermite(v0[i], a0[i], v1[i], a1[i]);
    }
}
