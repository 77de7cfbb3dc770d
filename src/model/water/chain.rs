//! A chain of beads in front of the disc on the water.
//!
//! ```text
//! m_i ü_i = F_{i−1} − F_i,   F_i = k_i δ_i^(3/2) + (c + γ √δ_i) δ̇_i while δ_i > 0,   F_0 the piston's, F_N the disc's ([`super::contact`])
//! ```
//!
//! Velocity Verlet on the clock of the disc: positions of the beads at the end of a step are explicit, so the disc's contact is the one
//! equation left, solved together with the disc's compliance; dashpots see the velocity extrapolated to the end of the step. Second order
//! where contacts do not open or close; see [`crate::model::chain`] for what a fixed step costs there. The disc's contact has no dashpot: its
//! damping is the radiation.

use thiserror::Error;

use super::{
    OnWater,
    contact::{DiscContact, PatchError},
};
use crate::{
    model::contact_law::{Dashpot, bead_flat_stiffness, bead_pair_stiffness, dashpots, hertz_energy, hertz_force},
    scene::{Bead, Damping, DampingKind, DampingPlacement, FlatContact, PistonMotion},
};

/// The beads, and what drives them.
#[derive(Debug, Clone, PartialEq)]
pub struct ChainInFront {
    /// The beads, the first touching the piston.
    pub beads: Vec<Bead>,
    /// Initial gaps of the N + 1 contacts, m.
    pub gaps: Vec<f64>,
    /// The piston's face.
    pub piston: FlatContact,
    /// Dashpots, between beads only.
    pub damping: Damping,
}

/// Why a chain on water does not run.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ChainOnWaterError {
    /// A dashpot where there is none.
    #[error(
        "a dashpot at the disc (`damping.at = \"all\"`): expected dashpots between beads only; set `damping.at = \"beads\"`"
    )]
    DiscDashpot,
    /// No beads, or not N + 1 gaps.
    #[error("{beads} beads and {gaps} gaps: expected at least one bead and one gap more than beads")]
    Count {
        /// N.
        beads: usize,
        /// How many gaps.
        gaps: usize,
    },
    /// The disc's contact.
    #[error("at {time:.6e} s: {source}")]
    Patch {
        /// Simulated time, s.
        time: f64,
        /// What happened.
        source: PatchError,
    },
    /// No longer finite.
    #[error("the chain is not finite at {time:.6e} s (step {step:.3e} s); shorten the step")]
    NonFinite {
        /// Simulated time, s.
        time: f64,
        /// Step, s.
        step: f64,
    },
}

/// What a chain on water did, every step from rest.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct WaterRun {
    /// Step, s.
    pub step: f64,
    /// Pressure at each field point, Pa.
    pub pressure: Vec<Vec<f64>>,
    /// Force on the disc, N, ≥ 0.
    pub disc_force: Vec<f64>,
    /// Velocity of the last bead's centre, m/s.
    pub last_bead_velocity: Vec<f64>,
    /// When the last bead touched the disc for the last time, s; none if never.
    pub last_touch: Option<f64>,
    /// Work of the piston, J.
    pub piston_work: f64,
    /// Kinetic energy of the beads and elastic energy of all contacts at the end, J.
    pub chain_energy: f64,
    /// Energy lost in the dashpots, J.
    pub dissipated: f64,
    /// Energy of the disc at the end, J.
    pub disc_energy: f64,
    /// Work of the disc on the water, J.
    pub work_on_water: f64,
}

impl WaterRun {
    /// Energy unaccounted for over the piston's work, 1: the error of the fixed step.
    #[must_use]
    pub fn imbalance(&self) -> f64 {
        let found = self.chain_energy + self.dissipated + self.disc_energy + self.work_on_water;
        (self.piston_work - found) / self.piston_work.abs().max(f64::MIN_POSITIVE)
    }
}

/// Run a chain at rest against a disc at rest for `duration` (s), heard at the disc's first `points` field points.
///
/// # Errors
/// [`ChainOnWaterError`].
pub fn run(
    chain: &ChainInFront,
    motion: &dyn PistonMotion,
    contact: &DiscContact,
    disc: &mut dyn OnWater,
    points: usize,
    duration: f64,
) -> Result<WaterRun, ChainOnWaterError> {
    let count = chain.beads.len();
    if count == 0 || chain.gaps.len() != count + 1 {
        return Err(ChainOnWaterError::Count { beads: count, gaps: chain.gaps.len() });
    }
    if chain.damping.kind != DampingKind::None && chain.damping.placement == DampingPlacement::All {
        return Err(ChainOnWaterError::DiscDashpot);
    }
    let step = disc.step();
    let masses: Vec<f64> = chain.beads.iter().map(Bead::mass).collect();
    let stiffness: Vec<f64> = std::iter::once(bead_flat_stiffness(&chain.beads[0], chain.piston))
        .chain(chain.beads.windows(2).map(|pair| bead_pair_stiffness(&pair[0], &pair[1])))
        .collect();
    let dampers: Vec<Dashpot> = dashpots(&chain.damping, count + 1);
    let tension = chain.damping.tension;
    let instants = (duration / step).round() as usize;
    let mut out = WaterRun { step, pressure: vec![Vec::with_capacity(instants + 1); points], ..WaterRun::default() };
    out.pressure.iter_mut().for_each(|trace| trace.push(0.0));
    out.disc_force.push(0.0);
    out.last_bead_velocity.push(0.0);

    // Slot 0 is the piston, 1…N the beads.
    let (mut u, mut v, mut a) = (vec![0.0; count + 1], vec![0.0; count + 1], vec![0.0; count + 1]);
    let (mut predicted, mut force) = (vec![0.0; count + 1], vec![0.0; count + 1]);
    (u[0], v[0]) = motion.at(0.0);
    let mut power = (0.0, 0.0);
    for instant in 1..=instants {
        let time = instant as f64 * step;
        for i in 1..=count {
            let half = v[i] + 0.5 * step * a[i];
            u[i] += step * half;
            predicted[i] = half + 0.5 * step * a[i];
            v[i] = half;
        }
        let piston = motion.at(time);
        (u[0], predicted[0]) = piston;
        let mut lost = 0.0;
        for i in 0..count {
            let (overlap, rate) = (u[i] - u[i + 1] - chain.gaps[i], predicted[i] - predicted[i + 1]);
            let elastic = hertz_force(stiffness[i], overlap);
            let total = elastic + dampers[i].force(overlap, rate);
            force[i] = if tension { total } else { total.max(0.0) };
            lost += (force[i] - elastic) * rate;
        }
        let overlap = u[count] - chain.gaps[count] - disc.predict();
        force[count] =
            contact.force(overlap, disc.compliance()).map_err(|source| ChainOnWaterError::Patch { time, source })?;
        disc.push(force[count]);
        if force[count] > 0.0 {
            out.last_touch = Some(time);
        }
        for i in 1..=count {
            a[i] = (force[i - 1] - force[i]) / masses[i - 1];
            v[i] += 0.5 * step * a[i];
        }
        v[0] = piston.1;
        let now = (force[0] * piston.1, lost);
        out.piston_work += 0.5 * step * (power.0 + now.0);
        out.dissipated += 0.5 * step * (power.1 + now.1);
        power = now;
        if !(v[count].is_finite() && force[count].is_finite()) {
            return Err(ChainOnWaterError::NonFinite { time, step });
        }
        out.pressure.iter_mut().enumerate().for_each(|(point, trace)| trace.push(disc.pressure(point)));
        out.disc_force.push(force[count]);
        out.last_bead_velocity.push(v[count]);
    }
    let kinetic: f64 = (1..=count).map(|i| 0.5 * masses[i - 1] * v[i] * v[i]).sum();
    let pressed: f64 = (0..count).map(|i| hertz_energy(stiffness[i], u[i] - u[i + 1] - chain.gaps[i])).sum();
    out.chain_energy = kinetic + pressed + contact.energy(force[count]);
    out.disc_energy = disc.energy();
    out.work_on_water = disc.work_on_water();
    Ok(out)
}
