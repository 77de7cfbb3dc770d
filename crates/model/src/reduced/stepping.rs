//! Step after step, of one run or of several side by side.

use std::ops::Range;

use super::{
    backing::Backing,
    chain::{self, Unsolved},
    contact::{BLOCK, Measure, State, dot},
    damper,
    equilibrium::Equilibrium,
    losses::Creep,
    mechanics::{Mechanics, Surface},
    motion::Moving,
    reduction::Reduction,
};
use crate::{
    ModelError,
    attached::Attached,
    contact_law::Dashpot,
    fea::{FeaError, control::Cause},
    holder::Hold,
    horn::{HornMotion, HornStep},
    number::{Mask, Number},
    scene::DampingTerm,
};

/// Passes after which the dashpot behind the last contact and the contact there have not settled, and the change of its force over the largest
/// force at which they have: the contact feels that change over a step by a thousandth of it at most.
const MOST_DASHPOT_PASSES: u32 = 60;
const DASHPOT_SETTLED: f64 = 1e-10;

#[derive(Debug)]
pub(super) struct Motion<'a, N: Number, B> {
    pub(super) reduction: &'a Reduction,
    pub(super) mechanics: Mechanics,
    /// Gaps of the points of every contact at zero displacement, the least of them in every block, and the overlap of the rigid motions
    /// there, m.
    gaps: Vec<Vec<N>>,
    least: Vec<Vec<N>>,
    overlaps: Vec<N>,
    dashpots: Vec<[N; DampingTerm::ALL.len()]>,
    tension: bool,
    is_damped: bool,
    pub(super) bodies: Vec<Option<Moving<N>>>,
    pub(super) states: Vec<State<N>>,
    /// Displacement of the piston, m.
    pub(super) piston: N,
    pub(super) backing: B,
    /// The compliant horn, and the place of its motion.
    pub(super) horn: Option<(HornStep<N>, HornMotion<N>)>,
    hold: Option<Hold<N>>,
    pub(super) creep: Option<Creep<N>>,
    /// Whether any body loses in material or holder.
    loses: bool,
    /// Runs that go on, and why others do not.
    pub(super) live: N::Mask,
    pub(super) failed: Vec<(usize, Failure)>,
    unsolved: Vec<(usize, Unsolved)>,
    pub(super) work: Work,
}

#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Work {
    pub(super) contact_sweeps: u64,
    pub(super) most_contact_sweeps: u64,
    pub(super) active_sets: u64,
    pub(super) dashpot_evaluations: u64,
    pub(super) horn_evaluations: u64,
    pub(super) holder_evaluations: u64,
    pub(super) relaxation_evaluations: u64,
    pub(super) loss_evaluations: u64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Failure {
    Contact(Cause, usize),
    NotFinite(usize),
}

impl Failure {
    /// In the step of length `step` that ends at `time`, s.
    pub(super) fn at(self, time: f64, step: f64) -> ModelError {
        match self {
            Self::Contact(cause, contact) => {
                FeaError::StepGivenUp { time: time - step, step, contact: contact + 1, cause }.into()
            }
            Self::NotFinite(bead) => ModelError::NonFinite { time, step, bead },
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Beginning {
    pub(super) equilibrium: Equilibrium,
    pub(super) dashpots: Vec<Dashpot>,
    /// Displacement of the piston, m.
    pub(super) piston: f64,
}

impl<'a, N: Number, B> Motion<'a, N, B> {
    #[cold]
    fn fail(&mut self, lost: N::Mask, failure: Failure) {
        let lost = self.live & lost;
        self.failed.extend(lost.places().map(|place| (place, failure)));
        self.live = self.live & !lost;
    }
}

impl<'a, N: Number, B: Backing<N>> Motion<'a, N, B> {
    /// At the beginning of the runs in the places `live`, with one beginning a place, the last for those that are left over.
    #[allow(clippy::too_many_arguments, reason = "what stands on the bench, part by part")]
    pub(super) fn new(
        reduction: &'a Reduction,
        mechanics: Mechanics,
        beginnings: &[Beginning],
        tension: bool,
        live: N::Mask,
        step: f64,
        backing: B,
        Attached { horn, hold }: Attached<N>,
    ) -> Self {
        let each =
            |value: &dyn Fn(&Beginning) -> f64| N::of(|place| value(&beginnings[place.min(beginnings.len() - 1)]));
        let contacts = 0..reduction.contacts.len();
        let points = |contact: usize| 0..reduction.geometries[reduction.contacts[contact]].gaps.len();
        let gaps: Vec<Vec<N>> = contacts
            .clone()
            .map(|contact| points(contact).map(|i| each(&|own| own.equilibrium.gaps[contact][i])).collect())
            .collect();
        let states = contacts.clone().map(|contact| {
            let forces = points(contact).map(|i| each(&|own| own.equilibrium.forces[contact][i])).collect();
            let axial = &reduction.geometries[reduction.contacts[contact]].axial;
            State::pressed_by(&mechanics.condensed[mechanics.of_contact[contact]], forces, axial)
        });
        let bodies = (0..reduction.beads.len() + 2).map(|slot| {
            let kind = reduction.members[reduction.member(slot)?].kind;
            Some(Moving::new(&reduction.kinds[kind], &mechanics.squares[kind], mechanics.laws[kind].as_ref(), step))
        });
        let dashpot =
            |contact: usize| DampingTerm::ALL.map(|term| each(&|own| own.dashpots[contact].coefficients[term]));
        let least = |gaps: &[N]| gaps.iter().copied().fold(N::all(f64::INFINITY), N::smaller);
        let mut motion = Self {
            reduction,
            least: gaps.iter().map(|gaps| gaps.chunks(BLOCK).map(least).collect()).collect(),
            gaps,
            overlaps: contacts.clone().map(|contact| each(&|own| own.equilibrium.overlaps[contact])).collect(),
            is_damped: beginnings.iter().flat_map(|own| &own.dashpots).any(|dashpot| !dashpot.is_absent()),
            dashpots: contacts.clone().map(dashpot).collect(),
            tension,
            bodies: bodies.collect(),
            states: states.collect(),
            piston: each(&|own| own.piston),
            horn: horn.map(|horn| (horn, HornMotion::at_rest())),
            loses: hold.is_some() || mechanics.laws.iter().any(Option::is_some),
            hold,
            creep: None,
            mechanics,
            backing,
            live,
            failed: Vec::new(),
            unsolved: Vec::new(),
            work: Work::default(),
        };
        let Self { reduction, mechanics, states, .. } = &motion;
        let forces = |contact: usize| &states[contact].forces[..];
        let mut creep = Creep::new(reduction, &mechanics.laws, forces, BLOCK);
        if let Some(creep) = &mut creep {
            creep.begin(mechanics, forces, BLOCK);
        }
        motion.creep = creep;
        motion.press();
        motion.bodies.iter_mut().flatten().for_each(Moving::settle);
        for contact in contacts {
            let mut free = std::mem::take(&mut motion.states[contact].free);
            Measured { motion: &motion, damping: N::ZERO }.gaps(contact, 0..free.len(), &mut free);
            motion.states[contact].free = free;
        }
        motion
    }

    #[inline(always)]
    fn press(&mut self) {
        let Self { reduction, mechanics, bodies, states, .. } = self;
        for (slot, body) in bodies.iter_mut().enumerate() {
            let (Some(body), Some(member)) = (body, reduction.member(slot)) else { continue };
            let member = &reduction.members[member];
            body.forces.fill(N::ZERO);
            let before = &states[slot - 1];
            mechanics.surfaces[member.front].press(&before.forces, before.pressed, &mut body.forces);
            if let (Some(back), Some(after)) = (member.back, states.get(slot)) {
                mechanics.surfaces[back].press(&after.forces, after.pressed, &mut body.forces);
            }
        }
    }

    /// Axial force on the body in a slot, N.
    #[inline(always)]
    fn net(states: &[State<N>], slot: usize) -> N {
        states[slot - 1].total() - states.get(slot).map_or(N::ZERO, State::total)
    }

    #[inline(always)]
    fn drift_losing(&mut self) {
        let Self { bodies, states, hold, mechanics, reduction, work, .. } = self;
        for (slot, body) in bodies.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            let held = hold.as_ref().filter(|_| slot <= reduction.beads.len()).map(|hold| {
                work.holder_evaluations += 1;
                let after = states.get(slot).map_or(N::ZERO, State::total);
                (hold, slot - 1, [states[slot - 1].total(), after])
            });
            if let Some(member) = reduction.member(slot)
                && let Some(law) = &mechanics.laws[reduction.members[member].kind]
            {
                let [damps, relaxes] = law.parts();
                work.loss_evaluations += u64::from(damps);
                work.relaxation_evaluations += u64::from(relaxes);
            }
            body.drift_losing(held);
        }
        if let Some(creep) = &mut self.creep {
            creep.begin(mechanics, |contact| &states[contact].forces, BLOCK);
        }
    }

    /// One step: the displacement (m) and velocity (m/s) that drive the piston at its end. Runs that fail are entered in `failed` and live no more.
    #[inline(always)]
    pub(super) fn advance(&mut self, position: N, velocity: N) {
        for (slot, body) in self.bodies.iter_mut().enumerate() {
            if let Some(body) = body {
                body.kick(Self::net(&self.states, slot));
                if !self.loses {
                    body.drift();
                }
            }
        }
        if self.loses {
            self.drift_losing();
        }
        self.backing.predict();
        self.piston = position;
        let mut face = damper::Face { velocity, mobility: None };
        if let Some((horn, motion)) = &mut self.horn {
            let own = horn.begin(motion, self.states[0].total());
            self.work.horn_evaluations += 1;
            self.piston = position + motion.displacement;
            face = damper::Face { velocity: velocity + own, mobility: Some(horn.mobility()) };
        }
        if self.is_damped {
            for contact in 0..self.states.len() {
                let overlap = self.overlaps[contact] + self.rigid(contact) - self.rigid(contact + 1);
                let root = overlap.root();
                let terms = DampingTerm::ALL.into_iter();
                let sum =
                    terms.fold(N::ZERO, |sum, term| sum + term.resistance(self.dashpots[contact][term as usize], root));
                self.states[contact].coefficient = sum.or_where_not(overlap.above(N::ZERO), N::ZERO);
            }
        }
        self.solve_forces(face);
        if let Some((horn, motion)) = &mut self.horn {
            horn.kick(motion, self.states[0].total());
        }
        if let Some(creep) = &mut self.creep {
            let states = &self.states;
            creep.end(&self.mechanics, |contact| &states[contact].forces);
        }
        self.press();
        if let Some(last) = self.states.last() {
            self.backing.push(&last.forces, last.damping);
        }
        for slot in 0..self.bodies.len() {
            let Some(body) = &mut self.bodies[slot] else { continue };
            body.kick(Self::net(&self.states, slot));
            let lost = !body.rigid.finite();
            if (self.live & lost).any() {
                self.fail(lost, Failure::NotFinite(slot));
            }
        }
    }

    /// Forces of contacts and dashpots, the piston's face moving as `face`. A dashpot that moves the points of the last contact does so very
    /// little: both are found in turn.
    #[inline(always)]
    fn solve_forces(&mut self, face: damper::Face<N>) {
        let last = self.states.len() - 1;
        for _ in 0..MOST_DASHPOT_PASSES {
            let solved_with = self.states[last].damping;
            self.solve_contacts(solved_with);
            if !self.is_damped {
                return;
            }
            let base = self.backing.base(&self.states[last].forces);
            let Self { states, bodies, unsolved, tension, live, .. } = self;
            let unsettled = |place, contact| unsolved.push((place, Unsolved::NotSettled(contact)));
            let evaluations = damper::solve(states, bodies, face, base, *tension, *live, unsettled);
            self.work.dashpot_evaluations += evaluations;
            self.record_failures();
            if !self.backing.feels_dashpot() {
                return;
            }
            let state = &self.states[last];
            let scale = state.pressing.larger(state.damping.magnitude());
            let change = (state.damping - solved_with).magnitude();
            if !(self.live & !change.within(scale * DASHPOT_SETTLED)).any() {
                return;
            }
        }
        self.fail(N::Mask::all(true), Failure::Contact(Cause::NotSettled, last));
    }

    /// Rigid displacement of the body in a slot, m; behind the last contact that of what its dashpot stands on, as predicted.
    #[inline(always)]
    fn rigid(&self, slot: usize) -> N {
        match &self.bodies[slot] {
            Some(body) => body.rigid,
            None if slot == 0 => self.piston,
            None => self.backing.place(&self.states[slot - 1].forces).unwrap_or(N::ZERO),
        }
    }

    /// Forces of the contacts, the last dashpot acting with `damping` (N).
    #[inline(always)]
    fn solve_contacts(&mut self, damping: N) {
        for contact in 0..self.states.len() {
            let mut least = std::mem::take(&mut self.states[contact].least);
            Measured { motion: self, damping }.least(contact, &mut least);
            let state = &mut self.states[contact];
            (state.least, state.measured) = (least, 0);
        }
        let (mut states, mut unsolved) = (std::mem::take(&mut self.states), std::mem::take(&mut self.unsolved));
        let Mechanics { condensed, of_contact, .. } = &self.mechanics;
        let measure = Measured { motion: self, damping };
        let effort =
            chain::solve(chain::LINEAR_PASSES, condensed, of_contact, &mut states, self.live, &mut unsolved, &measure);
        (self.states, self.unsolved) = (states, unsolved);
        self.work.contact_sweeps += u64::from(effort.passes);
        self.work.most_contact_sweeps = self.work.most_contact_sweeps.max(u64::from(effort.passes));
        self.work.active_sets += u64::from(effort.sets);
        self.record_failures();
        for contact in 0..self.states.len() {
            let state = &mut self.states[contact];
            let geometry = &self.reduction.geometries[self.reduction.contacts[contact]];
            let [first, end] = state.pressed;
            state.pressing = dot(&state.forces[first..end], &geometry.axial[first..end]);
            let exceeds = end == state.forces.len() && !geometry.is_flat;
            if exceeds || geometry.is_ring && end > 0 && first == 0 {
                let at = |point: usize| state.forces[point].above(N::ZERO);
                let last = if geometry.is_flat { N::Mask::all(false) } else { at(state.forces.len() - 1) };
                let first = if geometry.is_ring { at(0) } else { N::Mask::all(false) };
                let lost = first | last;
                self.fail(lost, Failure::Contact(Cause::PatchExceeded, contact));
            }
        }
    }

    #[inline(always)]
    fn record_failures(&mut self) {
        while let Some((place, unsolved)) = self.unsolved.pop() {
            let failure = match unsolved {
                Unsolved::NoActiveSet(contact) => Failure::Contact(Cause::NoActiveSet, contact),
                Unsolved::NotSettled(contact) => Failure::Contact(Cause::NotSettled, contact),
            };
            self.fail(!N::Mask::but(place), failure);
        }
    }
}

/// The contacts without their forces, the last dashpot acting with `damping` (N).
struct Measured<'a, 'b, N: Number, B> {
    motion: &'a Motion<'b, N, B>,
    damping: N,
}

impl<'a, N: Number, B: Backing<N>> Measured<'a, '_, N, B> {
    /// The bodies around a contact with the surfaces they touch it with.
    #[inline(always)]
    fn sides(&self, contact: usize) -> impl Iterator<Item = (&'a Moving<N>, &'a Surface)> {
        let motion = self.motion;
        [contact, contact + 1].into_iter().filter_map(move |slot| {
            let member = &motion.reduction.members[motion.reduction.member(slot)?];
            let face = if slot == contact { member.back? } else { member.front };
            Some((motion.bodies[slot].as_ref()?, &motion.mechanics.surfaces[face]))
        })
    }

    #[inline(always)]
    fn is_last(&self, contact: usize) -> bool {
        contact + 1 == self.motion.least.len()
    }

    /// Lower bounds of the gaps of a contact, block by block, m.
    #[inline(always)]
    fn least(&self, contact: usize, least: &mut [N]) {
        let motion = self.motion;
        least.copy_from_slice(&motion.least[contact]);
        for (body, surface) in self.sides(contact) {
            surface.least(body.rigid, &body.modal, least);
        }
        let add = |least: &mut [N], more: N| least.iter_mut().for_each(|least| *least = *least + more);
        if contact == 0 {
            // The axial part of a normal is at most one.
            add(least, N::ZERO - motion.piston.larger(N::ZERO));
        }
        if let Some(retreat) = motion.backing.least(self.damping).filter(|_| self.is_last(contact)) {
            add(least, retreat);
        }
        if let Some(creep) = &motion.creep {
            least.iter_mut().zip(&creep.least[contact]).for_each(|(least, more)| *least = *least + *more);
        }
    }
}

impl<N: Number, B: Backing<N>> Measure<N> for Measured<'_, '_, N, B> {
    #[inline(always)]
    fn gaps(&self, contact: usize, points: Range<usize>, free: &mut [N]) {
        let motion = self.motion;
        free.copy_from_slice(&motion.gaps[contact][points.clone()]);
        if contact == 0 {
            let axial = &motion.reduction.geometries[motion.reduction.contacts[0]].axial;
            N::subtract(free, [motion.piston], [&axial[points.clone()]]);
        }
        for (body, surface) in self.sides(contact) {
            surface.close(body.rigid, &body.modal, points.clone(), free);
        }
        if let Some(creep) = &motion.creep {
            let known = &creep.gaps[contact][points.clone()];
            free.iter_mut().zip(known).for_each(|(free, known)| *free = *free + *known);
        }
        if self.is_last(contact) {
            motion.backing.retreat(points, free, self.damping);
        }
    }
}
