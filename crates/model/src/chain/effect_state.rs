//! Effects beside contacts and dashpots: a compliant horn, drag and friction of the bead guide, contacts that yield, an annulus that relaxes.
//!
//! They live in one mark of the support's law ([`Marked`](super::equation::Marked)), by which the compiler makes a second copy of the chain's loops;
//! chains without them run the first, in which none of this exists. What has a history (slip or stick of a bead, yield of a contact) is frozen within a step, as
//! the modes of the contacts are, and switched at instants located on the continuous extension: the laws are met exactly, not regularised.

use super::{
    crossing::{Crossing, Event, Resolution, first_fall, may_rise},
    dormand_prince::{Clock, Stepper},
    effects::{Effects, place},
    equation::{Equation, Instant, Mode},
};
use crate::{
    contact_law::{ElasticLaw, Law, Terms, Yielding},
    response::{Channels, SolverWork},
    scene::PistonMotion,
};

/// Overlap at which a contact yields (again), over that up to which it is elastic: as often as it is pressed just as hard, it does not.
const PRESSED_HARDER: f64 = 1.0 + 1e-9;

#[derive(Debug, Clone, Copy)]
struct Contact {
    law: Yielding,
    /// Overlap from the lasting indentation on up to which it is elastic, m.
    elastic_to: f64,
    /// Overlap (m) and force (N) since which it yields.
    yields_since: Option<(f64, f64)>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Slip {
    /// Held, with this force (N) more than friction has: not 0 where the force beyond it is gone before the bead has moved.
    Stuck(f64),
    Forward,
    Backward,
}

impl Slip {
    fn sign(self) -> f64 {
        match self {
            Self::Stuck(_) => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }

    fn along(force: f64) -> Self {
        if force > 0.0 { Self::Forward } else { Self::Backward }
    }
}

#[derive(Debug, Clone)]
pub(super) struct EffectState<'a> {
    effects: &'a Effects,
    contacts: Vec<Option<Contact>>,
    /// One a bead; none where friction is regularised or absent.
    slips: Vec<Slip>,
    precompression: f64,
    /// Force of the relaxation s at the state that forces are evaluated at, and at the start, at the end and within the step, N.
    relaxing: f64,
    instants: [f64; 3],
    /// Energy lost where contacts yielded, J.
    yielded: f64,
    within: Vec<[f64; 4]>,
    evaluations: u64,
    work: SolverWork,
}

impl<'a, const DAMPED: Terms, L: ElasticLaw> Equation<'a, DAMPED, L> {
    pub(super) fn begin_effects(&mut self) {
        let system = self.system;
        let Some(effects) = system.effects.as_ref().filter(|_| L::HAS_EFFECTS) else { return };
        let mut contacts = vec![None; system.beads + 1];
        for (contact, law) in effects.yielding.iter().enumerate() {
            let Some(law) = *law else { continue };
            let force = system.static_force[contact];
            let (elastic, elastic_to) = law.after(force);
            if force > law.yield_force() {
                (self.laws[contact], self.offset[contact]) = (Law::Hertz(elastic), elastic_to);
            }
            contacts[contact] = Some(Contact { law, elastic_to, yields_since: None });
        }
        let sticks = effects.rubs().is_some_and(|holder| holder.slip_velocity == 0.0);
        self.acting = Some(EffectState {
            effects,
            contacts,
            slips: vec![Slip::Stuck(0.0); if sticks { system.beads } else { 0 }],
            precompression: system.static_force[0],
            relaxing: 0.0,
            instants: [0.0; 3],
            yielded: 0.0,
            within: system.moment(),
            evaluations: 0,
            work: SolverWork::default(),
        });
    }

    /// Add q and q̇ of the horn to the piston's slots, which hold its free motion.
    #[inline(always)]
    pub(super) fn add_horn_motion(&self, state: &mut [f64]) {
        if L::HAS_EFFECTS {
            let tail = 2 * self.system.padded;
            state[0] += state[tail + place::HORN[0]];
            state[self.system.padded] += state[tail + place::HORN[1]];
        }
    }

    /// Take up the relaxation of a state whose forces are asked for.
    #[inline(always)]
    pub(super) fn relax(&mut self, state: &[f64], instant: Option<Instant>) {
        if let Some(acting) = self.acting.as_mut().filter(|_| L::HAS_EFFECTS) {
            let force = state[2 * self.system.padded + place::RELAXING];
            match instant {
                Some(instant) => acting.instants[instant as usize] = force,
                None => acting.relaxing = force,
            }
        }
    }

    /// Force of the relaxation within the step, N.
    pub(super) fn relax_within(&mut self, force: f64) {
        if let Some(acting) = &mut self.acting {
            acting.instants[Instant::Within as usize] = force;
        }
    }

    /// Force of the relaxation at an instant of the step, N: of the last contact only.
    #[inline(always)]
    pub(super) fn relaxation(&self, instant: Instant, contact: usize) -> f64 {
        match &self.acting {
            Some(acting) if L::HAS_EFFECTS && contact == self.system.beads => acting.instants[instant as usize],
            _ => 0.0,
        }
    }

    #[inline(always)]
    pub(super) fn relaxes(&self, contact: usize) -> bool {
        let relaxes = |acting: &EffectState<'_>| acting.effects.relaxation.is_some();
        L::HAS_EFFECTS && contact == self.system.beads && self.acting.as_ref().is_some_and(relaxes)
    }

    /// Whether a contact yields at present: its elastic law is off then.
    pub(super) fn yields(&self, contact: usize) -> bool {
        let yields = |acting: &EffectState<'_>| acting.contacts[contact].is_some_and(|own| own.yields_since.is_some());
        L::HAS_EFFECTS && self.acting.as_ref().is_some_and(yields)
    }

    /// Force of a contact without its dashpot, N.
    pub(super) fn pressing(&self, contact: usize, overlap: f64) -> f64 {
        match self.acting.as_ref().filter(|_| L::HAS_EFFECTS).and_then(|acting| acting.contacts[contact]) {
            Some(Contact { law, yields_since: Some((from, force)), .. }) => force + law.slope() * (overlap - from),
            _ => self.laws[contact].force(overlap),
        }
    }

    /// Add the forces of contacts that yield, and of the relaxation, to those evaluated.
    #[inline(always)]
    pub(super) fn add_effect_forces(&mut self, u: &[f64]) {
        let Some(acting) = &self.acting else { return };
        for (contact, own) in acting.contacts.iter().enumerate() {
            if let Some(Contact { law, yields_since: Some((from, force)), .. }) = own {
                let overlap = self.offset[contact] + u[contact] - u[contact + 1];
                self.force[contact] += force + law.slope() * (overlap - from);
            }
        }
        self.force[self.system.beads] += self.support_pressed * acting.relaxing;
    }

    pub(super) fn evaluate_with_effects(
        &mut self,
        weight: f64,
        piston: (f64, f64),
        state: &mut [f64],
        derivative: &mut [f64],
    ) {
        let (padded, beads) = (self.system.padded, self.system.beads);
        (state[0], state[padded]) = piston;
        self.add_horn_motion(state);
        self.relax(state, None);
        let (u, rest) = state.split_at(padded);
        let (v, tail) = rest.split_at(padded);
        let lost = self.evaluate_forces((u[0], v[0]), u, v);
        let (du, rest) = derivative.split_at_mut(padded);
        let (dv, work) = rest.split_at_mut(padded);
        let force = &self.force;
        let Some(acting) = self.acting.as_mut() else { return };
        acting.evaluations += 1;
        let (mut dragged, mut rubbed) = (0.0, 0.0);
        for i in 1..=beads {
            let mut net = force[i - 1] - force[i];
            if let Some(gravity) = acting.effects.gravity {
                net += gravity * self.system.mass[i];
            }
            let mut speed = v[i];
            if let Some(holder) = &acting.effects.holder {
                net -= holder.drag * speed;
                dragged += holder.drag * speed * speed;
                let against = match acting.slips.get(i - 1) {
                    Some(Slip::Stuck(_)) => {
                        (net, speed) = (0.0, 0.0);
                        0.0
                    }
                    Some(slip) => slip.sign() * acting.effects.friction(force, i),
                    None if holder.slip_velocity > 0.0 => {
                        acting.effects.friction(force, i) * (speed / holder.slip_velocity).tanh()
                    }
                    None => 0.0,
                };
                net -= against;
                rubbed += against * speed;
            }
            du[i] = weight * speed;
            dv[i] = weight * net * self.system.inverse_mass[i];
        }
        (du[0], dv[0]) = (weight * v[0], 0.0);
        du[beads + 1..].fill(0.0);
        dv[beads + 1..].fill(0.0);
        work.fill(0.0);
        work[0] = weight * force[0] * v[0];
        work[1] = weight * lost;
        work[place::DRAG] = weight * dragged;
        work[place::FRICTION] = weight * rubbed;
        if let Some(horn) = &acting.effects.horn {
            let [q, rate] = place::HORN.map(|place| tail[place]);
            let resistance = horn.resistance();
            let pushed = acting.precompression - force[0] - resistance * rate - horn.stiffness() * q;
            work[place::HORN[0]] = weight * rate;
            work[place::HORN[1]] = weight * pushed / horn.mass;
            work[place::HORN_LOST] = weight * resistance * rate * rate;
            work[place::SOURCE] = weight * force[0] * piston.1;
        }
        if let Some(relaxation) = &acting.effects.relaxation {
            let overlap = self.offset[beads] + u[beads] - u[beads + 1];
            let rate = v[beads] - v[beads + 1];
            let stiffness = if overlap > 0.0 { self.support.tangent_stiffness(overlap) } else { 0.0 };
            let force = tail[place::RELAXING];
            work[place::RELAXING] = weight * (relaxation.strength * stiffness * rate - force / relaxation.time);
            work[place::RELAXED] = weight * self.support_pressed * force * rate;
        }
    }

    /// Force of the contacts on the bead in a slot and the most that friction holds, N, as last evaluated.
    fn pushed(&self, slot: usize) -> (f64, f64) {
        let most = self.acting.as_ref().map_or(0.0, |acting| acting.effects.friction(&self.force, slot));
        let weight = self.system.effects.as_ref().and_then(|effects| effects.gravity);
        let weight = weight.map_or(0.0, |gravity| gravity * self.system.mass[slot]);
        (self.force[slot - 1] - self.force[slot] + weight, most)
    }

    /// Let go of beads that the contacts push harder than friction holds, in the state at the start of a step.
    pub(super) fn release_beads(&mut self, state: &[f64], resolution: &Resolution) {
        if self.acting.as_ref().is_none_or(|acting| !L::HAS_EFFECTS || acting.slips.is_empty()) {
            return;
        }
        self.evaluate_at(state);
        for bead in 0..self.system.beads {
            let (net, most) = self.pushed(bead + 1);
            let Some(acting) = &mut self.acting else { return };
            let moves = state[self.system.padded + bead + 1];
            let Slip::Stuck(more) = acting.slips[bead] else { continue };
            let most = most + more;
            if moves != 0.0 || net.abs() > most + resolution.force {
                acting.slips[bead] = Slip::along(if moves == 0.0 { net } else { moves });
                acting.work.friction_turns += 1;
            }
        }
    }

    fn evaluate_at(&mut self, state: &[f64]) {
        let padded = self.system.padded;
        self.relax(state, None);
        self.evaluate_forces((state[0], state[padded]), &state[..padded], &state[padded..2 * padded]);
    }

    /// Whether a contact may begin or cease to yield, or a bead to slide, within the finished step.
    pub(super) fn may_turn(&mut self, stepper: &Stepper, clock: &Clock, resolution: &Resolution) -> bool {
        let (start, end) = (stepper.state.as_flattened(), stepper.end_state.as_flattened());
        if !self.slips().is_empty() {
            self.evaluate_at(end);
        }
        (0..self.turns()).any(|turn| self.turn_within(turn, start, end, clock, resolution) != Crossing::None)
    }

    /// Numbers of what may turn: contacts that yield, then beads that slide.
    fn turns(&self) -> usize {
        self.system.beads + 1 + self.slips().len()
    }

    fn slips(&self) -> &[Slip] {
        self.acting.as_ref().map_or(&[], |acting| &acting.slips)
    }

    fn turn_within(&self, turn: usize, start: &[f64], end: &[f64], clock: &Clock, resolution: &Resolution) -> Crossing {
        let padded = self.system.padded;
        let sure = |holds: bool| if holds { Crossing::Sure } else { Crossing::None };
        let Some(bead) = turn.checked_sub(self.system.beads + 1) else {
            let contact = self.acting.as_ref().and_then(|acting| acting.contacts[turn]);
            let Some(own) = contact.filter(|_| self.modes[turn] == Mode::Pressed) else { return Crossing::None };
            let of = |state: &[f64]| {
                (
                    self.overlap(turn, state) - PRESSED_HARDER * own.elastic_to,
                    state[padded + turn] - state[padded + turn + 1],
                )
            };
            let (start, end) = (of(start), of(end));
            return match own.yields_since {
                Some(_) => sure(end.1 < 0.0),
                None if end.0 > 0.0 => Crossing::Sure,
                None if may_rise(start, end, clock) => Crossing::Perhaps,
                None => Crossing::None,
            };
        };
        let velocity = end[padded + bead + 1];
        match self.slips()[bead] {
            Slip::Stuck(more) => {
                let (net, most) = self.pushed(bead + 1);
                sure(net.abs() > most + more + resolution.force)
            }
            slip => sure(slip.sign() * velocity < -resolution.velocity),
        }
    }

    /// The first turn within the finished and extended step, if it comes before `first`; its number begins behind the switches of the contacts.
    pub(super) fn first_turn(
        &mut self,
        stepper: &Stepper,
        clock: &Clock,
        motion: &dyn PistonMotion,
        resolution: &Resolution,
        mut first: Option<Event>,
    ) -> Option<Event> {
        let (start, end) = (stepper.state.as_flattened(), stepper.end_state.as_flattened());
        for turn in 0..self.turns() {
            if !self.slips().is_empty() {
                self.evaluate_at(end);
            }
            let crossing = self.turn_within(turn, start, end, clock, resolution);
            if crossing == Crossing::None {
                continue;
            }
            let margin = |sigma: f64| self.margin(turn, stepper, clock, motion, resolution, sigma);
            // A bead that is hardly let go comes to rest again early in the step.
            let sigmas = [0.0, 0.001, 0.01].into_iter().chain((1..=12).map(|part| f64::from(part) / 12.0));
            if let Some(sigma) = first_fall(margin, crossing, sigmas)
                && first.is_none_or(|event| sigma < event.sigma)
            {
                first = Some(Event { switch: self.modes.len() + turn, sigma });
            }
        }
        first
    }

    /// Positive while what may turn stays as it is, at σ of the extended step; its rate, of a contact that may begin to yield.
    fn margin(
        &mut self,
        turn: usize,
        stepper: &Stepper,
        clock: &Clock,
        motion: &dyn PistonMotion,
        resolution: &Resolution,
        sigma: f64,
    ) -> (f64, f64) {
        let padded = self.system.padded;
        let Some(mut within) = self.acting.as_mut().map(|acting| std::mem::take(&mut acting.within)) else {
            return (1.0, 0.0);
        };
        stepper.values(sigma, &mut within);
        let state = within.as_flattened_mut();
        (state[0], state[padded]) = motion.at(clock.at(sigma));
        self.add_horn_motion(state);
        let rate = |state: &[f64]| state[padded + turn] - state[padded + turn + 1];
        let margin = match turn.checked_sub(self.system.beads + 1) {
            None => match self.acting.as_ref().and_then(|acting| acting.contacts[turn]) {
                Some(Contact { yields_since: Some(_), .. }) => (rate(state), 0.0),
                Some(Contact { elastic_to, .. }) => {
                    (PRESSED_HARDER * elastic_to - self.overlap(turn, state), -rate(state))
                }
                None => (1.0, 0.0),
            },
            Some(bead) => match self.slips()[bead] {
                Slip::Stuck(more) => {
                    self.evaluate_at(state);
                    let (net, most) = self.pushed(bead + 1);
                    (most + more + resolution.force - net.abs(), 0.0)
                }
                slip => (slip.sign() * state[padded + bead + 1], 0.0),
            },
        };
        if let Some(acting) = &mut self.acting {
            acting.within = within;
        }
        margin
    }

    /// Turn at a located event, the state being that of the event; `at_once`: what turns has not stayed as it was for any part of the step.
    pub(super) fn turn(&mut self, turn: usize, at_once: bool, state: &mut [f64], resolution: &Resolution) {
        let padded = self.system.padded;
        let Some(bead) = turn.checked_sub(self.system.beads + 1) else { return self.turn_contact(turn, state) };
        let sliding = !matches!(self.slips()[bead], Slip::Stuck(_));
        if sliding {
            state[padded + bead + 1] = 0.0;
        }
        self.evaluate_at(state);
        let (net, most) = self.pushed(bead + 1);
        let Some(acting) = &mut self.acting else { return };
        acting.slips[bead] = if sliding && net.abs() <= most + resolution.force {
            Slip::Stuck(0.0)
        } else if sliding && at_once {
            Slip::Stuck(net.abs() - most)
        } else {
            Slip::along(net)
        };
        acting.work.friction_turns += 1;
    }

    fn turn_contact(&mut self, contact: usize, state: &[f64]) {
        let overlap = self.overlap(contact, state);
        let mode = self.modes[contact];
        let Some(acting) = &mut self.acting else { return };
        let Some(own) = &mut acting.contacts[contact] else { return };
        match own.yields_since {
            None => {
                own.yields_since = Some((own.elastic_to, self.laws[contact].force(own.elastic_to)));
                acting.work.yields += 1;
            }
            Some(since) => {
                let (law, elastic_to, lost) = unload(&own.law, &self.laws[contact], since, overlap);
                acting.yielded += lost;
                *own = Contact { elastic_to, yields_since: None, ..*own };
                self.laws[contact] = law;
                self.offset[contact] += elastic_to - overlap;
            }
        }
        self.set_mode(contact, mode);
    }

    /// Elastic energy of every contact in a state, J; a contact that yields gives back what it would when unloaded. With gravity less what it has done from
    /// the start on, −Σ m g u.
    pub(super) fn stored_with_effects(&self, u: &[f64]) -> f64 {
        let gravity = self.system.effects.as_ref().and_then(|effects| effects.gravity);
        let fallen = |gravity| self.system.mass.iter().zip(u).map(|(mass, u)| gravity * mass * u).sum::<f64>();
        let pressed: f64 = (0..=self.system.beads)
            .map(|contact| {
                let overlap = self.overlap(contact, u);
                match self.acting.as_ref().and_then(|acting| acting.contacts[contact]) {
                    Some(Contact { law, yields_since: Some(since), .. }) => {
                        let (law, elastic_to, _) = unload(&law, &self.laws[contact], since, overlap);
                        law.energy(elastic_to)
                    }
                    _ => self.laws[contact].energy(overlap),
                }
            })
            .sum();
        pressed - gravity.map_or(0.0, fallen)
    }

    pub(super) fn channels(&self, state: &[f64]) -> Option<Channels> {
        let acting = self.acting.as_ref().filter(|_| L::HAS_EFFECTS)?;
        let tail = &state[2 * self.system.padded..];
        let yielding = (0..=self.system.beads).filter_map(|contact| {
            let own = acting.contacts[contact]?;
            Some(unload(&own.law, &self.laws[contact], own.yields_since?, self.overlap(contact, state)).2)
        });
        let [q, rate] = place::HORN.map(|place| tail[place]);
        let horn_j = acting.effects.horn.map_or(0.0, |horn| {
            0.5 * horn.mass * rate * rate + 0.5 * horn.stiffness() * q * q - acting.precompression * q
        });
        Some(Channels {
            drag_j: tail[place::DRAG],
            friction_j: tail[place::FRICTION],
            yielding_j: acting.yielded + yielding.sum::<f64>(),
            material_j: tail[place::RELAXED],
            source_work_j: tail[place::SOURCE],
            horn_j,
            horn_lost_j: tail[place::HORN_LOST],
        })
    }

    pub(super) fn counts(&self) -> SolverWork {
        let Some(acting) = self.acting.as_ref().filter(|_| L::HAS_EFFECTS) else { return SolverWork::default() };
        let effects = acting.effects;
        let count = |is_there: bool, each: usize| if is_there { acting.evaluations * each as u64 } else { 0 };
        SolverWork {
            horn_evaluations: count(effects.horn.is_some(), 1),
            holder_evaluations: count(effects.holder.is_some_and(|holder| holder.acts()), self.system.beads),
            gravity_evaluations: count(effects.gravity.is_some(), self.system.beads),
            relaxation_evaluations: count(effects.relaxation.is_some(), 1),
            ..acting.work
        }
    }
}

/// Of a contact that has yielded since the overlap (m) and force (N) `since` up to `overlap`: the elastic law to unload by, its overlap there, and the
/// energy lost, J.
fn unload(law: &Yielding, before: &Law, since: (f64, f64), overlap: f64) -> (Law, f64, f64) {
    let (from, force) = since;
    let further = overlap - from;
    let hardest = force + law.slope() * further;
    let (elastic, elastic_to) = law.after(hardest);
    let elastic = Law::Hertz(elastic);
    let lost = before.energy(from) + 0.5 * (force + hardest) * further - elastic.energy(elastic_to);
    (elastic, elastic_to, lost)
}
