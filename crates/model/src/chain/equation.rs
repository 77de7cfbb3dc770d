//! The equations of motion, m_i ü_i = F_{i−1} − F_i, as a right-hand side without branches.

use super::{
    coupling::{Coupling, Survey},
    effect_state::EffectState,
    effects,
    system::System,
};
use crate::{
    contact_law::{Dashpot, ElasticLaw, Law, Terms},
    scene::DampingTerm,
};

/// Any law of the last contact, marked with what the chain's loops must know of the others: the compiler makes a copy of the loops for each mark.
///
/// - `COUPLED`: the contacts feel one another through the bodies, see [`Coupling`]. Elastic force and dashpot of a contact then begin and end apart, the
///   force with the overlap δ of the contact, the dashpot with that of the rigid motions, so each contact has two switches: 0…N the elastic
///   ones, N + 1…2N + 1 the dashpots, if there are any.
/// - `EFFECTS`: there are effects of [`acting`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Marked<const COUPLED: bool, const EFFECTS: bool>(pub Law);

impl<const COUPLED: bool, const EFFECTS: bool> ElasticLaw for Marked<COUPLED, EFFECTS> {
    const IS_HERTZ: bool = false;
    const IS_COUPLED: bool = COUPLED;
    const HAS_EFFECTS: bool = EFFECTS;

    fn force(&self, overlap: f64) -> f64 {
        self.0.force(overlap)
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        self.0.tangent_stiffness(overlap)
    }

    fn energy(&self, overlap: f64) -> f64 {
        self.0.energy(overlap)
    }

    fn overlap(&self, force: f64) -> f64 {
        self.0.overlap(force)
    }
}

/// What a contact does at present; frozen within a step, switched at located instants between steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    Pressed,
    /// Still overlapping but parting so fast that the dashpot would pull: no force.
    Clipped,
    Open,
}

/// Right-hand side of one chain with the present modes of its contacts.
///
/// The state is [displacements | velocities | piston work, dissipated energy, 0, 0], the first two blocks padded as in [`System`]; effects of
/// [`acting`] use the two places left and add theirs. A
/// contact that is not pressed has its coefficients set to zero, so the inner loop knows no modes; which effects exist at all is a
/// type parameter, so a run without dampers spends nothing on them.
#[derive(Debug, Clone)]
pub(super) struct Equation<'a, const DAMPED: Terms, L> {
    pub system: &'a System,
    /// Elastic law of each contact and its overlap with all displacements zero (m), as in the system until a contact has yielded.
    pub laws: Vec<Law>,
    pub offset: Vec<f64>,
    /// Law of the last contact when it is not Hertz's.
    pub(super) support: L,
    /// Present coefficients: k (0 for a support of another law), and those of every term of the dashpots.
    hertz: Vec<f64>,
    damping: [Vec<f64>; DampingTerm::ALL.len()],
    /// 1 while the support carries force, else 0.
    pub(super) support_pressed: f64,
    pub(super) force: Vec<f64>,
    /// Mode of every switch: one a contact, unless coupled.
    pub modes: Vec<Mode>,
    pub coupled: Option<CoupledState<'a>>,
    pub acting: Option<EffectState<'a>>,
}

#[derive(Debug, Clone)]
pub(super) struct CoupledState<'a> {
    coupling: &'a Coupling,
    /// 1 where the elastic force is on, 1 where the dashpot is clipped, else 0.
    elastic: Vec<f64>,
    clipped: Vec<f64>,
    rigid: Vec<f64>,
    overlap: Vec<f64>,
    elastic_force: Vec<f64>,
    /// At the start of the step, at its end, and within.
    surveys: [Survey; 3],
    pub within: Vec<[f64; 4]>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Instant {
    Start,
    End,
    Within,
}

impl<'a, const DAMPED: Terms, L: ElasticLaw> Equation<'a, DAMPED, L> {
    /// All contacts open; `support` is the law of the last contact.
    pub(crate) fn new(system: &'a System, support: L) -> Self {
        let zeros = vec![0.0; system.padded];
        let coupled = system.coupling.as_ref().filter(|_| L::IS_COUPLED).map(|coupling| CoupledState {
            coupling,
            elastic: zeros.clone(),
            clipped: zeros.clone(),
            rigid: zeros.clone(),
            overlap: zeros.clone(),
            elastic_force: zeros.clone(),
            surveys: std::array::from_fn(|_| Survey::new(system.padded)),
            within: system.moment(),
        });
        let switches = if coupled.is_some() && (DAMPED != 0) { 2 } else { 1 };
        let mut equation = Self {
            system,
            laws: system.laws.clone(),
            offset: system.offset.clone(),
            support,
            hertz: zeros.clone(),
            damping: std::array::from_fn(|_| zeros.clone()),
            support_pressed: 0.0,
            force: zeros,
            modes: vec![Mode::Open; switches * (system.beads + 1)],
            coupled,
            acting: None,
        };
        equation.begin_effects();
        equation
    }

    /// δ_i, m.
    #[inline(always)]
    pub(crate) fn overlap(&self, contact: usize, u: &[f64]) -> f64 {
        self.offset[contact] + u[contact] - u[contact + 1]
    }

    /// Elastic energy of every contact, J.
    pub(crate) fn stored_energy(&self, u: &[f64]) -> f64 {
        if L::HAS_EFFECTS && !L::IS_COUPLED { self.stored_with_effects(u) } else { self.system.stored_energy(u) }
    }

    #[inline(always)]
    pub(crate) fn contact(&self, switch: usize) -> usize {
        if L::IS_COUPLED { switch % (self.system.beads + 1) } else { switch }
    }

    #[inline(always)]
    pub(crate) fn is_dashpot(&self, switch: usize) -> bool {
        L::IS_COUPLED && switch > self.system.beads
    }

    pub(crate) fn state_length(&self) -> usize {
        2 * self.system.padded + 4 + if L::HAS_EFFECTS { effects::FURTHER } else { 0 }
    }

    #[inline(always)]
    pub(crate) fn is_coupled_force(&self, switch: usize) -> bool {
        L::IS_COUPLED && switch <= self.system.beads
    }

    /// Whether a switch has nothing to switch: the dashpot of a contact without one.
    #[inline(always)]
    pub(crate) fn is_idle(&self, switch: usize) -> bool {
        self.is_dashpot(switch) && self.system.dashpots[self.contact(switch)].is_absent()
    }

    pub(crate) fn set_mode(&mut self, switch: usize, mode: Mode) {
        let contact = self.contact(switch);
        let pressed = if mode == Mode::Pressed { 1.0 } else { 0.0 };
        let Dashpot { coefficients } = self.system.dashpots[contact];
        self.modes[switch] = mode;
        let is_own = self.coupled.is_some() && switch == contact;
        for term in DampingTerm::ALL.into_iter().filter(|_| !is_own) {
            self.damping[term as usize][contact] = pressed * coefficients[term];
        }
        if let Some(coupled) = &mut self.coupled {
            if switch == contact {
                coupled.elastic[contact] = pressed;
            } else {
                coupled.clipped[contact] = if mode == Mode::Clipped { 1.0 } else { 0.0 };
            }
            return;
        }
        match &self.laws[contact] {
            // What it yields with is no part of its elastic law.
            Law::Hertz(_) if self.yields(contact) => self.hertz[contact] = 0.0,
            Law::Hertz(hertz) => self.hertz[contact] = pressed * hertz.stiffness,
            Law::FiniteHertz(_) | Law::Annulus(_) | Law::Spring(_) | Law::HertzOnSpring(_) => {
                self.support_pressed = pressed;
            }
        }
    }

    /// Contact forces with the present modes into `self.force`, and the power lost in the dashpots (W); the piston's displacement (m) and velocity
    /// (m/s) are taken from `piston`, of coupled contacts from their slots.
    ///
    /// Four contacts at a time; neighbours and the piston are moved between registers, since reading back what was just stored at another
    /// alignment or in parts would wait for the store.
    #[inline(always)]
    pub(super) fn evaluate_forces(&mut self, piston: (f64, f64), u: &[f64], v: &[f64]) -> f64 {
        if L::IS_COUPLED {
            return self.evaluate_coupled(u, v);
        }
        let (u, _) = u.as_chunks::<4>();
        let (v, _) = v.as_chunks::<4>();
        let blocks = u.len();
        let v = &v[..blocks];
        let offset = &self.offset.as_chunks::<4>().0[..blocks];
        let hertz = &self.hertz.as_chunks::<4>().0[..blocks];
        let damping: [_; DampingTerm::ALL.len()] =
            std::array::from_fn(|term| &self.damping[term].as_chunks::<4>().0[..blocks]);
        let force = &mut self.force.as_chunks_mut::<4>().0[..blocks];
        let mut lost = [0.0; 4];
        for block in 0..blocks {
            let shifted = |x: &[[f64; 4]], first: f64| {
                let mut here = x[block];
                here[0] = if block == 0 { first } else { here[0] };
                let next = if block + 1 < blocks { x[block + 1][0] } else { 0.0 };
                (here, [here[1], here[2], here[3], next])
            };
            let (lower, upper) = shifted(u, piston.0);
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
            if DAMPED != 0 {
                let (lower_rate, upper_rate) = shifted(v, piston.1);
                for i in 0..4 {
                    let rate = lower_rate[i] - upper_rate[i];
                    let mut resistance = 0.0;
                    for term in DampingTerm::ALL {
                        if DAMPED & term.alone() != 0 {
                            resistance += term.resistance(damping[term as usize][block][i], root[i]);
                        }
                    }
                    let viscous = resistance * rate;
                    total[i] += viscous;
                    lost[i] += viscous * rate;
                }
            }
            force[block] = total;
        }
        if !L::IS_HERTZ {
            let last = self.system.beads;
            let (u, offset) = (u.as_flattened(), self.offset[last]);
            self.force[last] += self.support_pressed * self.support.force(offset + u[last] - u[last + 1]);
        }
        if L::HAS_EFFECTS {
            self.add_effect_forces(u.as_flattened());
        }
        lost.iter().sum()
    }

    /// The same of coupled contacts: a dashpot that is clipped takes up what the elastic force would push with.
    #[inline(always)]
    fn evaluate_coupled(&mut self, u: &[f64], v: &[f64]) -> f64 {
        let Some(coupled) = &mut self.coupled else { return 0.0 };
        let system = self.system;
        let contacts = system.beads + 1;
        for contact in 0..contacts {
            coupled.rigid[contact] = system.offset[contact] + u[contact] - u[contact + 1];
        }
        let CoupledState { coupling, elastic, rigid, overlap, elastic_force, clipped, .. } = coupled;
        coupling.settle(rigid, elastic, overlap, elastic_force);
        self.force.copy_from_slice(elastic_force);
        if DAMPED == 0 {
            return 0.0;
        }
        let mut lost = 0.0;
        for contact in 0..contacts {
            let rate = v[contact] - v[contact + 1];
            let root = rigid[contact].max(0.0).sqrt();
            let mut resistance = 0.0;
            for term in DampingTerm::ALL {
                resistance += term.resistance(self.damping[term as usize][contact], root);
            }
            let viscous = resistance * rate - clipped[contact] * elastic_force[contact];
            self.force[contact] += viscous;
            lost += viscous * rate;
        }
        lost
    }

    /// `weight` × the time derivative of `state`, into `derivative`; the piston's displacement (m) and velocity (m/s) are written into
    /// their slots of `state` first.
    #[inline(always)]
    pub(crate) fn evaluate(&mut self, weight: f64, piston: (f64, f64), state: &mut [f64], derivative: &mut [f64]) {
        if L::HAS_EFFECTS {
            return self.evaluate_with_effects(weight, piston, state, derivative);
        }
        let padded = self.system.padded;
        if L::IS_COUPLED {
            (state[0], state[padded]) = piston;
        }
        let (u, rest) = state.split_at(padded);
        let v = &rest[..padded];
        let lost = self.evaluate_forces(piston, u, v);
        let blocks = padded / 4;
        let (du, rest) = derivative.as_chunks_mut::<4>().0.split_at_mut(blocks);
        let (dv, work) = rest.split_at_mut(blocks);
        let v = &v.as_chunks::<4>().0[..blocks];
        let inverse_mass = &self.system.inverse_mass.as_chunks::<4>().0[..blocks];
        let force = &self.force.as_chunks::<4>().0[..blocks];
        let mut before = [0.0; 4];
        for block in 0..blocks {
            let after = force[block];
            let left = [before[3], after[0], after[1], after[2]];
            before = after;
            let mut speed = v[block];
            speed[0] = if block == 0 { piston.1 } else { speed[0] };
            let mut acceleration = [0.0; 4];
            for speed in &mut speed {
                *speed *= weight;
            }
            for i in 0..4 {
                acceleration[i] = weight * (left[i] - after[i]) * inverse_mass[block][i];
            }
            (du[block], dv[block]) = (speed, acceleration);
        }
        work[0] = [weight * force[0][0] * piston.1, weight * lost, 0.0, 0.0];
        if !L::IS_COUPLED {
            (state[0], state[padded]) = piston;
        }
    }

    /// Total force of each contact at a state, N: what the response reports.
    #[inline(always)]
    pub(crate) fn contact_forces(&mut self, u: &[f64], v: &[f64]) -> &[f64] {
        self.evaluate_forces((u[0], v[0]), u, v);
        let force = &mut self.force[..=self.system.beads];
        if DAMPED == 0 && !L::IS_COUPLED && !L::HAS_EFFECTS {
            return force;
        }
        if let Some(coupled) = &self.coupled {
            for (i, force) in force.iter_mut().enumerate() {
                if coupled.rigid[i] <= 0.0 {
                    *force = coupled.elastic_force[i];
                }
                if !self.system.tension && *force < 0.0 {
                    *force = 0.0;
                }
            }
            return force;
        }
        for (i, force) in force.iter_mut().enumerate() {
            // A frozen dashpot may outlive its contact by less than a step; the response shows the law itself.
            let separated = self.offset[i] + u[i] - u[i + 1] <= 0.0;
            if separated || (!self.system.tension && *force < 0.0) {
                *force = 0.0;
            }
        }
        force
    }

    /// Whether the switch's force may end before its overlap does.
    pub(crate) fn may_clip(&self, switch: usize) -> bool {
        if L::IS_COUPLED && !self.is_dashpot(switch) {
            return false;
        }
        if self.relaxes(switch) {
            return true;
        }
        let has_dashpot = (DAMPED != 0) && !self.system.tension;
        has_dashpot && !self.system.dashpots[self.contact(switch)].is_absent()
    }

    /// A continuous function of overlap and rate with the sign of the total force of a pressed contact: the force itself, N, or
    /// without linear dashpot the force over √δ, which is not singular at closing.
    #[inline(always)]
    fn pull_indicator(&self, instant: Instant, contact: usize, overlap: f64, rate: f64) -> f64 {
        let pressed = overlap.max(0.0);
        let elastic = self.pressing(contact, pressed) + self.relaxation(instant, contact);
        self.system.dashpots[contact].pull(elastic, pressed, rate)
    }

    /// Look at all contacts of a state, its piston in place; nothing to do where none feels another.
    #[inline(always)]
    pub(crate) fn survey(&mut self, instant: Instant, state: &[f64]) {
        self.relax(state, Some(instant));
        if let Some(coupled) = &mut self.coupled {
            let system = self.system;
            let survey = &mut coupled.surveys[instant as usize];
            for contact in 0..=system.beads {
                survey.rigid_rate[contact] = state[system.padded + contact] - state[system.padded + contact + 1];
            }
            system.survey(coupled.coupling, state, survey);
            coupled.coupling.rates(&system.laws, survey);
        }
    }

    /// δ (m) and δ̇ (m/s) that a switch follows, at a state that has been surveyed.
    #[inline(always)]
    pub(crate) fn overlap_and_rate(&self, instant: Instant, switch: usize, state: &[f64]) -> (f64, f64) {
        match &self.coupled {
            Some(coupled) if L::IS_COUPLED => {
                let survey = &coupled.surveys[instant as usize];
                let contact = self.contact(switch);
                if self.is_dashpot(switch) {
                    (survey.rigid[contact], survey.rigid_rate[contact])
                } else {
                    (survey.overlap[contact], survey.rate[contact])
                }
            }
            _ => {
                let padded = self.system.padded;
                (self.overlap(switch, state), state[padded + switch] - state[padded + switch + 1])
            }
        }
    }

    /// [`Equation::pull_indicator`] of a switch at an instant that has been surveyed.
    #[inline(always)]
    pub(crate) fn pull(&self, instant: Instant, switch: usize, (overlap, rate): (f64, f64)) -> f64 {
        match &self.coupled {
            Some(coupled) if L::IS_COUPLED => {
                let contact = self.contact(switch);
                self.system.dashpots[contact].pull(
                    coupled.surveys[instant as usize].force[contact],
                    overlap.max(0.0),
                    rate,
                )
            }
            _ => self.pull_indicator(instant, switch, overlap, rate),
        }
    }
}
