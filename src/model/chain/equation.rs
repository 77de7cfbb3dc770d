//! The equations of motion, m_i ü_i = F_{i−1} − F_i, as a right-hand side without branches.

use super::system::System;
use crate::model::contact_law::{Dashpot, ElasticLaw, Law};

/// What a contact does at present; frozen within a step, switched at located instants between steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    /// Carries the full law.
    Pressed,
    /// Still overlapping but parting so fast that the dashpot would pull: no force.
    Clipped,
    /// Separated: no force.
    Open,
}

/// Right-hand side of one chain with the present modes of its contacts.
///
/// The state is [displacements | velocities | piston work, dissipated energy, 0, 0], the first two blocks padded as in [`System`]. A
/// contact that is not pressed has its coefficients set to zero, so the inner loop knows no modes; which effects exist at all is a
/// type parameter, so a run without dampers spends nothing on them.
#[derive(Debug, Clone)]
pub(super) struct Equation<'a, const LINEAR: bool, const KUWABARA_KONO: bool, L> {
    pub system: &'a System,
    /// Law of the last contact when it is not Hertz's.
    support: L,
    /// Present coefficients: k (0 for a support of another law), c and γ.
    hertz: Vec<f64>,
    linear: Vec<f64>,
    kuwabara_kono: Vec<f64>,
    /// 1 while the support carries force, else 0.
    support_pressed: f64,
    force: Vec<f64>,
    pub modes: Vec<Mode>,
}

impl<'a, const LINEAR: bool, const KUWABARA_KONO: bool, L: ElasticLaw> Equation<'a, LINEAR, KUWABARA_KONO, L> {
    /// All contacts open; `support` is the law of the last contact.
    pub fn new(system: &'a System, support: L) -> Self {
        let zeros = vec![0.0; system.padded];
        Self {
            system,
            support,
            hertz: zeros.clone(),
            linear: zeros.clone(),
            kuwabara_kono: zeros.clone(),
            support_pressed: 0.0,
            force: zeros,
            modes: vec![Mode::Open; system.beads + 1],
        }
    }

    /// Length of the state.
    pub fn state_length(&self) -> usize {
        2 * self.system.padded + 4
    }

    /// Put a contact into a mode.
    pub fn set_mode(&mut self, contact: usize, mode: Mode) {
        let pressed = if mode == Mode::Pressed { 1.0 } else { 0.0 };
        let Dashpot { linear, kuwabara_kono } = self.system.dashpots[contact];
        self.modes[contact] = mode;
        self.linear[contact] = pressed * linear;
        self.kuwabara_kono[contact] = pressed * kuwabara_kono;
        match &self.system.laws[contact] {
            Law::Hertz(hertz) => self.hertz[contact] = pressed * hertz.stiffness,
            Law::Annulus(_) | Law::Spring(_) => self.support_pressed = pressed,
        }
    }

    /// Contact forces with the present modes into `self.force`, and the power lost in the dashpots (W).
    ///
    /// Four contacts at a time; neighbours are moved between registers, since reading back what was just stored at another
    /// alignment would wait for the store.
    #[inline(always)]
    fn evaluate_forces(&mut self, u: &[f64], v: &[f64]) -> f64 {
        let (u, _) = u.as_chunks::<4>();
        let (v, _) = v.as_chunks::<4>();
        let blocks = u.len();
        let v = &v[..blocks];
        let offset = &self.system.offset.as_chunks::<4>().0[..blocks];
        let hertz = &self.hertz.as_chunks::<4>().0[..blocks];
        let linear = &self.linear.as_chunks::<4>().0[..blocks];
        let kuwabara_kono = &self.kuwabara_kono.as_chunks::<4>().0[..blocks];
        let force = &mut self.force.as_chunks_mut::<4>().0[..blocks];
        let mut lost = [0.0; 4];
        for block in 0..blocks {
            let shifted = |x: &[[f64; 4]]| {
                let here = x[block];
                let next = if block + 1 < blocks { x[block + 1][0] } else { 0.0 };
                (here, [here[1], here[2], here[3], next])
            };
            let (lower, upper) = shifted(u);
            let mut pressed = [0.0; 4];
            let mut root = [0.0; 4];
            let mut total = [0.0; 4];
            for i in 0..4 {
                let overlap = offset[block][i] + lower[i] - upper[i];
                pressed[i] = if overlap > 0.0 { overlap } else { 0.0 };
            }
            for i in 0..4 {
                root[i] = pressed[i].sqrt();
            }
            for i in 0..4 {
                total[i] = hertz[block][i] * pressed[i] * root[i];
            }
            if LINEAR || KUWABARA_KONO {
                let (lower_rate, upper_rate) = shifted(v);
                for i in 0..4 {
                    let rate = lower_rate[i] - upper_rate[i];
                    let mut coefficient = 0.0;
                    if LINEAR {
                        coefficient += linear[block][i];
                    }
                    if KUWABARA_KONO {
                        coefficient += kuwabara_kono[block][i] * root[i];
                    }
                    let viscous = coefficient * rate;
                    total[i] += viscous;
                    lost[i] += viscous * rate;
                }
            }
            force[block] = total;
        }
        if !L::IS_HERTZ {
            let last = self.system.beads;
            let (u, offset) = (u.as_flattened(), self.system.offset[last]);
            self.force[last] += self.support_pressed * self.support.force(offset + u[last] - u[last + 1]);
        }
        lost.iter().sum()
    }

    /// `weight` × the time derivative of `state`, into `derivative`; the piston's displacement (m) and velocity (m/s) are written into
    /// their slots of `state` first.
    #[inline(always)]
    pub fn evaluate(&mut self, weight: f64, piston: (f64, f64), state: &mut [f64], derivative: &mut [f64]) {
        let padded = self.system.padded;
        let (u, rest) = state.split_at_mut(padded);
        let (v, _) = rest.split_at_mut(padded);
        u[0] = piston.0;
        v[0] = piston.1;
        let lost = self.evaluate_forces(u, v);
        let (du, rest) = derivative.split_at_mut(padded);
        let (dv, work) = rest.split_at_mut(padded);
        let blocks = padded / 4;
        let (du, dv) = (&mut du.as_chunks_mut::<4>().0[..blocks], &mut dv.as_chunks_mut::<4>().0[..blocks]);
        let v = &v.as_chunks::<4>().0[..blocks];
        let inverse_mass = &self.system.inverse_mass.as_chunks::<4>().0[..blocks];
        let force = &self.force.as_chunks::<4>().0[..blocks];
        let mut before = 0.0;
        for block in 0..blocks {
            let after = force[block];
            let left = [before, after[0], after[1], after[2]];
            before = after[3];
            for i in 0..4 {
                du[block][i] = weight * v[block][i];
            }
            for i in 0..4 {
                dv[block][i] = weight * (left[i] - after[i]) * inverse_mass[block][i];
            }
        }
        work[0] = weight * self.force[0] * piston.1;
        work[1] = weight * lost;
    }

    /// Total force of each contact at a state, N: what the response reports.
    #[inline(always)]
    pub fn contact_forces(&mut self, u: &[f64], v: &[f64]) -> &[f64] {
        self.evaluate_forces(u, v);
        let force = &mut self.force[..=self.system.beads];
        for (i, force) in force.iter_mut().enumerate() {
            // A frozen dashpot may outlive its contact by less than a step; the response shows the law itself.
            let separated = self.system.offset[i] + u[i] - u[i + 1] <= 0.0;
            if separated || (!self.system.tension && *force < 0.0) {
                *force = 0.0;
            }
        }
        force
    }

    /// Whether the contact's force may end before its overlap does.
    pub fn may_clip(&self, contact: usize) -> bool {
        (LINEAR || KUWABARA_KONO) && !self.system.tension && !self.system.dashpots[contact].is_absent()
    }

    /// A continuous function of overlap and rate with the sign of the total force of a pressed contact: the force itself, N, or
    /// without linear dashpot the force over √δ, which is not singular at closing.
    pub fn pull_indicator(&self, contact: usize, overlap: f64, rate: f64) -> f64 {
        let Dashpot { linear, kuwabara_kono } = self.system.dashpots[contact];
        let pressed = overlap.max(0.0);
        let elastic = self.system.laws[contact].force(pressed);
        if linear > 0.0 {
            elastic + (linear + kuwabara_kono * pressed.sqrt()) * rate
        } else if pressed > 0.0 {
            elastic / pressed.sqrt() + kuwabara_kono * rate
        } else {
            kuwabara_kono * rate
        }
    }
}
