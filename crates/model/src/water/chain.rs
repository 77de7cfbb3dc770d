//! A chain of beads in front of the disc on the water.
//!
//! ```text
//! m_i ü_i = F_{i−1} − F_i,   F_i = k_i δ_i^(3/2) + (c + γ √δ_i) δ̇_i while δ_i > 0,   F_0 the piston's, F_N the disc's ([`super::contact`])
//! ```
//!
//! Velocity Verlet on the clock of the disc: positions of the beads at the end of a step are explicit, so of the elastic forces the disc's alone
//! is an equation, solved together with the disc's compliance. Dashpots see the velocities at the end of the step, which their own forces
//! change: they are found in turn until none changes, whatever their coefficients. Second order where contacts do not open or close; the error
//! of one that does is of order h^(5/2) without dashpot, h² with a Kuwabara–Kono one, h with a linear one, whose force jumps.

use thiserror::Error;

use super::{
    OnWater,
    contact::{Approach, DiscContact, PatchError, Pressing},
};
use crate::{
    attached::Attached,
    contact_law::{Dashpot, bead_face_stiffness, bead_pair_stiffness, dashpots, hertz_energy, hertz_force},
    holder::HoldLoss,
    horn::{HornMotion, HornStep},
    response::EnergySums,
    scene::{Bead, PistonMotion, Scene},
};

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ChainOnWaterError {
    #[error("{beads} beads and {gaps} gaps: expected at least one bead and one gap more than beads")]
    Count { beads: usize, gaps: usize },
    #[error("`chain.precompression` {force:e} N on a free disc: nothing holds it; set `disc.rim` or no precompression")]
    FreeUnderForce { force: f64 },
    #[error("stopped at {time:.6e} s")]
    Stopped { time: f64 },
    #[error("at {time:.6e} s: {source}")]
    Patch { time: f64, source: PatchError },
    #[error("the chain is not finite at {time:.6e} s (step {step:.3e} s); shorten the step")]
    NonFinite { time: f64, step: f64 },
}

pub(super) struct Moment<'a> {
    /// Number of the instant, 0 at the start.
    pub instant: usize,
    pub time: f64,
    /// Displacements of the piston and of each bead, m.
    pub displacement: &'a [f64],
    /// Velocities of the same, m/s.
    pub velocity: &'a [f64],
    /// Forces of the contacts, N.
    pub force: &'a [f64],
    pub disc: &'a dyn OnWater,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Totals {
    /// Of beads and contacts; what is no longer there went into disc and water.
    pub balance: EnergySums,
    pub events: u64,
    pub dashpots: u64,
    /// Evaluations of the horn, and of the bead guide of a bead.
    pub horn: u64,
    pub holder: u64,
}

/// Step the chain of a scene from equilibrium under its precompression through `instants` steps against a disc at rest, whose motion is
/// counted from that equilibrium. `observe` sees every instant, the first included, and stops the run by `false`.
pub(super) fn integrate_on_disc(
    scene: &Scene,
    Attached { horn, hold }: &Attached<f64>,
    motion: &dyn PistonMotion,
    contact: &DiscContact,
    disc: &mut dyn OnWater,
    instants: usize,
    observe: &mut dyn FnMut(&Moment<'_>) -> bool,
) -> Result<Totals, ChainOnWaterError> {
    let Scene { chain, damping, .. } = scene;
    let (count, preload) = (chain.beads.len(), chain.precompression);
    if count == 0 || chain.gaps.len() != count + 1 {
        return Err(ChainOnWaterError::Count { beads: count, gaps: chain.gaps.len() });
    }
    let step = disc.step();
    let masses: Vec<f64> = chain.beads.iter().map(Bead::mass).collect();
    let stiffness: Vec<f64> = std::iter::once(bead_face_stiffness(&chain.beads[0], scene.piston_face()))
        .chain(chain.beads.windows(2).map(|pair| bead_pair_stiffness(&pair[0], &pair[1])))
        .collect();
    // Overlaps at rest, less the gaps.
    let mut rest: Vec<f64> = stiffness.iter().map(|stiffness| (preload / stiffness).powf(2.0 / 3.0)).collect();
    rest.push(contact.indentation(preload) + contact.residual * preload);
    rest.iter_mut().zip(&chain.gaps).for_each(|(rest, gap)| *rest -= gap);
    let dampers: Vec<Dashpot> = dashpots(damping, count + 1);
    let tension = damping.tension;
    // The bead contacts with a dashpot: a run without any asks none for its force.
    let damped = dampers[..count].iter().filter(|dashpot| !dashpot.is_absent()).count();
    let at_disc = Some(dampers[count]).filter(|dashpot| !dashpot.is_absent());
    let (compliance, modal) = (disc.compliance(), if at_disc.is_some() { disc.modal_compliance() } else { 0.0 });

    // Slot 0 is the piston, 1…N the beads.
    let (mut u, mut v) = (vec![0.0; count + 1], vec![0.0; count + 1]);
    let (mut a, mut moved) = (u.clone(), u.clone());
    // What a unit of force held through the second half of a step adds to a velocity, m/s/N; to the piston's only where the horn gives way.
    let of_piston = horn.as_ref().map_or(0.0, HornStep::mobility);
    let mobility: Vec<f64> = std::iter::once(of_piston).chain(masses.iter().map(|mass| 0.5 * step / mass)).collect();
    let mut force = vec![preload; count + 1];
    let mut before = force.clone();
    let mut pairs = vec![Pair { elastic: preload, ..Pair::default() }; count];
    let mut pressing = Pressing { force: preload, indentation: contact.indentation(preload) };
    (u[0], v[0]) = motion.at(0.0);
    let mut own = horn.as_ref().map(|_| HornMotion::at_rest());
    let (mut driven, mut held) = (u[0], HoldLoss::none());
    let pressed = |u: &[f64], pressing: &Pressing| -> f64 {
        let pairs = (0..count).map(|i| hertz_energy(stiffness[i], u[i] - u[i + 1] + rest[i]));
        pairs.sum::<f64>() + contact.stored(pressing)
    };
    let balance = EnergySums::starting((0.0, pressed(&vec![0.0; count + 1], &pressing)), None);
    let mut totals = Totals { balance, ..Totals::default() };
    let stopped = |time| Err(ChainOnWaterError::Stopped { time });
    if !observe(&Moment { instant: 0, time: 0.0, displacement: &u, velocity: &v, force: &force, disc }) {
        return stopped(0.0);
    }
    let mut damper_force = 0.0;
    for instant in 1..=instants {
        let time = instant as f64 * step;
        for i in 1..=count {
            v[i] += 0.5 * step * a[i];
            moved[i] = step * v[i];
            if let Some(hold) = hold {
                // Half-way through the drift.
                let left = hold.slowed(i - 1, v[i], [force[i - 1], force[i]]);
                hold.add_loss(i - 1, v[i], left, &mut held);
                moved[i] = 0.5 * step * (v[i] + left[2]);
                v[i] = left[2];
                totals.holder += 1;
            }
            u[i] += moved[i];
        }
        let (pushed, drawn) = (u[0], driven);
        (u[0], v[0]) = motion.at(time);
        driven = u[0];
        if let (Some(horn), Some(own)) = (horn, &mut own) {
            let velocity = horn.begin(own, force[0]);
            (u[0], v[0]) = (u[0] + own.displacement, v[0] + velocity);
            totals.horn += 1;
        }
        moved[0] = u[0] - pushed;
        before.copy_from_slice(&force);
        for (i, pair) in pairs.iter_mut().enumerate() {
            let overlap = u[i] - u[i + 1] + rest[i];
            pair.lost = force[i] - pair.elastic;
            pair.elastic = hertz_force(stiffness[i], overlap);
            if damped > 0 {
                pair.damping = dampers[i].force(overlap, 1.0);
            }
            force[i] = pair.elastic;
        }
        totals.dashpots += (damped + usize::from(at_disc.is_some())) as u64;
        // Of the force, the disc knows what exceeds the static one.
        let overlap = u[count] + rest[count] - disc.predict() + compliance * preload;
        let patch = |source| ChainOnWaterError::Patch { time, source };
        match &at_disc {
            None => {
                force[count] = contact.force(overlap, compliance).map_err(patch)?;
                pressing = Pressing { force: force[count], indentation: contact.indentation(force[count]) };
                if damped > 0 {
                    settle(&pairs, (&v, &mobility), tension, &mut force, |_| Ok(None))?;
                }
            }
            Some(dashpot) => {
                let (receding, indentation) = (disc.predicted_modal_velocity() - modal * preload, pressing.indentation);
                settle(&pairs, (&v, &mobility), tension, &mut force, |pushing| {
                    let rate = v[count] + mobility[count] * pushing - receding;
                    let approach = Approach { rate, yielding: mobility[count] + modal };
                    pressing = contact.damped(overlap, compliance, dashpot, approach, tension).map_err(patch)?;
                    Ok(Some(pressing.force))
                })?;
                let now = pressing.force - hertz_force(contact.hertz_stiffness, pressing.indentation);
                totals.balance.step(0.0, 0.5 * (damper_force + now) * (pressing.indentation - indentation));
                damper_force = now;
            }
        }
        let switched = force.iter().zip(&before).filter(|(now, before)| (**now != 0.0) != (**before != 0.0));
        totals.events += switched.count() as u64;
        disc.push(pressing.force - preload);
        for i in 1..=count {
            a[i] = (force[i - 1] - force[i]) / masses[i - 1];
            v[i] += 0.5 * step * a[i];
        }
        if horn.is_some() || hold.is_some() {
            let channels = totals.balance.channels.get_or_insert_default();
            (channels.drag_j, channels.friction_j) = (held.drag, held.friction);
            if let (Some(horn), Some(own)) = (horn, &mut own) {
                v[0] -= of_piston * force[0];
                horn.kick(own, force[0]);
                channels.source_work_j += 0.5 * (before[0] + force[0]) * (driven - drawn);
                (channels.horn_j, channels.horn_lost_j) = (horn.energy(own), own.lost);
            }
        }
        if damped > 0 {
            for (i, pair) in pairs.iter().enumerate() {
                totals.balance.step(0.0, 0.5 * (pair.lost + force[i] - pair.elastic) * (moved[i] - moved[i + 1]));
            }
        }
        let balance = &mut totals.balance;
        balance.step(0.5 * (before[0] + force[0]) * moved[0], 0.0);
        let lost = balance.dissipated + balance.lost();
        balance.largest = balance.largest.max(balance.initial + balance.piston_work - lost);
        if !(v[count].is_finite() && force[count].is_finite()) {
            return Err(ChainOnWaterError::NonFinite { time, step });
        }
        if !observe(&Moment { instant, time, displacement: &u, velocity: &v, force: &force, disc }) {
            return stopped(time);
        }
    }
    let kinetic = (1..=count).map(|i| 0.5 * masses[i - 1] * v[i] * v[i]).sum();
    totals.balance.hold((kinetic, pressed(&u, &pressing)));
    Ok(totals)
}

/// Sweeps after which dashpots are left as they are, and the change of a force over the largest at which they have settled, or over what a dashpot
/// makes of a velocity alone: a few roundings of either.
const MOST_SWEEPS: u32 = 400;
const SETTLED: f64 = 1e-14;

/// A contact between piston and first bead or two beads in a step.
#[derive(Debug, Clone, Copy, Default)]
struct Pair {
    elastic: f64,
    /// c + γ √δ, N·s/m; 0 while open.
    damping: f64,
    /// Force of the dashpot at the step before, N.
    lost: f64,
}

/// Forces at the end of a step, the elastic ones with those of the dashpots, which see velocities that all forces change:
/// F_i = F_el + D (v_i − v_{i+1} + h_i F_{i−1} − (h_i + h_{i+1}) F_i + h_{i+1} F_{i+1}), contact by contact until none changes.
///
/// - `v`, `h`: velocities without the forces of the second half of the step, m/s, and what a unit force then adds, m/s/N
/// - `last`: the disc's force under that of the contact before; none where it does not depend on it
fn settle(
    pairs: &[Pair],
    (v, h): (&[f64], &[f64]),
    tension: bool,
    force: &mut [f64],
    mut last: impl FnMut(f64) -> Result<Option<f64>, ChainOnWaterError>,
) -> Result<(), ChainOnWaterError> {
    let count = pairs.len();
    for _ in 0..MOST_SWEEPS {
        let (mut change, mut largest) = (0.0, 0.0);
        let mut take = |force: &mut f64, now: f64| {
            (change, largest) = (f64::max(change, (now - *force).abs()), f64::max(largest, now.abs()));
            *force = now;
        };
        let mut rounded = 0.0;
        for (i, pair) in pairs.iter().enumerate().filter(|(_, pair)| pair.damping > 0.0) {
            let pushing = if i > 0 { h[i] * force[i - 1] } else { 0.0 };
            let rate = v[i] + pushing - v[i + 1] + h[i + 1] * force[i + 1];
            let now = (pair.elastic + pair.damping * rate) / (1.0 + pair.damping * (h[i] + h[i + 1]));
            take(&mut force[i], if tension { now } else { now.max(0.0) });
            rounded = f64::max(rounded, pair.damping * v[i].abs().max(v[i + 1].abs()));
        }
        if let Some(now) = last(force[count - 1])? {
            take(&mut force[count], now);
        }
        if change <= SETTLED * f64::max(largest, rounded) {
            break;
        }
    }
    Ok(())
}
