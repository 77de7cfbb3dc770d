//! One run, step after step.

use super::{
    chain::{self, Unsolved},
    contact::{State, dot},
    damper::{self, Behind},
    mechanics::{Flexibility, LARGEST_PHASE, Mechanics},
    motion::Moving,
    record::Record,
    reduction::Reduction,
    rest::Rest,
};
use crate::{
    ModelError, Progress,
    contact_law::{Dashpot, dashpots},
    fea::{FeaError, control::Cause, energy::Ledger, resolution, trace::Sampling},
    need_drive,
    response::{ObservedPoint, Response, SolverWork},
    scene::{PistonMotion, Scene},
    tally,
    water::{behind::DiscBehind, front::WaterRecord},
};

/// One run of a scene.
#[derive(Debug)]
struct Run<'a> {
    reduction: &'a Reduction,
    mechanics: Mechanics,
    rest: Rest,
    /// Least gap of every contact at zero displacement, m.
    least: Vec<f64>,
    dashpots: Vec<Dashpot>,
    tension: bool,
    is_damped: bool,
    /// By slot: piston, beads, support.
    bodies: Vec<Option<Moving>>,
    states: Vec<State>,
    /// Whole and dashpot forces of the last step, N.
    before: Vec<[f64; 2]>,
    piston: f64,
    ledger: Ledger,
    wet: Option<Wet>,
}

/// The disc on the water behind the last contact.
#[derive(Debug)]
struct Wet {
    disc: DiscBehind,
    /// Least retreat of the contact's points without forces at the end of the step, m.
    least: f64,
    /// Force of the dashpot that the contact is solved with, N.
    damping: f64,
}

impl Wet {
    fn predict(&mut self) {
        self.disc.predict();
        self.least = self.disc.predicted().iter().copied().fold(f64::INFINITY, f64::min);
    }

    /// Energy of the disc and of what it gave to the water, J, less what the contact's own account ([`State::energy`]) has of it: ½ λᵀ C λ.
    fn energy(&mut self, forces: &[f64]) -> f64 {
        let rows = self.disc.compliance().chunks_exact(forces.len()).zip(forces);
        let counted: f64 = rows.map(|(row, force)| force * dot(row, forces)).sum();
        self.disc.energies().iter().sum::<f64>() - 0.5 * counted
    }
}

/// Passes after which the dashpot at the disc and the contact there have not settled, and the change of its force over the largest force at
/// which they have: the contact feels that change over a step by a thousandth of it at most.
const MOST_DASHPOT_PASSES: u32 = 60;
const DASHPOT_SETTLED: f64 = 1e-10;

impl Reduction {
    /// Run a scene with these bodies, the piston moving as `motion`.
    ///
    /// # Errors
    /// [`ModelError`] when a step had no solution, or the caller stopped the run.
    pub fn run_with(
        &self,
        scene: &Scene,
        motion: &dyn PistonMotion,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        need_drive(scene, "reduced")?;
        let poles = self.geometries.iter().filter(|geometry| !geometry.is_ring);
        resolution::check(scene, poles.map(|geometry| &geometry.gaps[..]))?;
        let sampling = Sampling::new(scene, scene.model.reduced.step);
        let mut run = Run::new(self, scene, sampling.step(), motion.at(0.0).0)?;
        let mut record = Record::new(sampling, self.beads.len());
        let mut heard = scene.water.as_ref().map(|water| WaterRecord::new(water, sampling.samples));
        let listen = |run: &Run<'_>, heard: &mut Option<WaterRecord>| {
            if let (Some(wet), Some(heard)) = (&run.wet, heard) {
                wet.disc.sample(heard);
            }
        };
        let energy = run.energy();
        run.ledger.begin(energy);
        record.follow(0, self, &run.mechanics, &run.bodies, &run.states);
        record.sample(run.piston, self, &run.states);
        listen(&run, &mut heard);
        let step = sampling.step();
        for taken in 1..=sampling.steps() {
            let time = taken as f64 * step;
            run.advance(motion.at(time)).map_err(|failure| failed(failure, time, step))?;
            record.follow(taken, self, &run.mechanics, &run.bodies, &run.states);
            if taken.is_multiple_of(sampling.steps_per_sample) {
                record.sample(run.piston, self, &run.states);
                listen(&run, &mut heard);
                let energy = run.energy();
                run.ledger.sample(energy);
                if !progress(time) {
                    return Err(ModelError::Stopped { time });
                }
            }
        }
        let bodies: u64 = run.bodies.iter().flatten().map(|body| 1 + body.modal.len() as u64).sum();
        run.ledger.work.unknowns = bodies;
        if let Some(wet) = &run.wet {
            wet.disc.count(&mut run.ledger.work);
        }
        let observed = ObservedPoint::of(self.support.is_none() && self.front.is_none());
        let mut response = record.response(observed, &run.ledger);
        if let (Some(heard), Some(front), Some(water), Some(wet)) = (heard, &self.front, &scene.water, &mut run.wet) {
            heard.enter(front, water, wet.disc.energies(), &mut response);
        }
        Ok(response)
    }
}

/// Why a step failed.
enum Failure {
    Contact(Cause, usize),
    NotFinite(usize),
}

fn failed(failure: Failure, time: f64, step: f64) -> ModelError {
    match failure {
        Failure::Contact(cause, contact) => {
            FeaError::StepGivenUp { time: time - step, step, contact: contact + 1, cause }.into()
        }
        Failure::NotFinite(bead) => ModelError::NonFinite { time, step, bead },
    }
}

impl<'a> Run<'a> {
    fn new(reduction: &'a Reduction, scene: &Scene, step: f64, piston: f64) -> Result<Self, FeaError> {
        let rest = Rest::new(reduction, scene)?;
        let mut work = SolverWork { equilibrium_sweeps: u64::from(rest.sweeps), ..SolverWork::default() };
        let dashpots = dashpots(&scene.damping, rest.forces.len());
        let wet = match (&reduction.front, &scene.water, &*dashpots, &*rest.forces) {
            (Some(front), Some(water), [.., dashpot], [.., forces]) => {
                let held = if scene.chain.precompression > 0.0 { &forces[..] } else { &[] };
                let made = || DiscBehind::new(front, water, step, !dashpot.is_absent(), held);
                let (disc, made) = tally::during(made);
                (work.factorisations, work.kernels) = (made.factorisations, made.kernels);
                let disc = disc.map_err(Box::new)?;
                Some(Wet { disc, least: 0.0, damping: 0.0 })
            }
            _ => None,
        };
        let further = wet.as_ref().map_or(&[][..], |wet| wet.disc.compliance());
        let mechanics = Mechanics::new(reduction, scene, Flexibility::Residual(LARGEST_PHASE / step), further)?;
        let bodies = (0..reduction.beads.len() + 2).map(|slot| {
            let kind = reduction.members[reduction.member(slot)?].kind;
            Some(Moving::new(&reduction.kinds[kind], &mechanics.squares[kind], step))
        });
        let states = mechanics.of_contact.iter().zip(&rest.forces).zip(&reduction.contacts);
        let states: Vec<State> = states
            .map(|((&own, forces), &geometry)| {
                let axial = &reduction.geometries[geometry].axial;
                State::pressed_by(&mechanics.condensed[own], forces, axial)
            })
            .collect();
        let mut run = Self {
            reduction,
            least: rest.gaps.iter().map(|gaps| gaps.iter().copied().fold(f64::INFINITY, f64::min)).collect(),
            is_damped: dashpots.iter().any(|dashpot| !dashpot.is_absent()),
            dashpots,
            tension: scene.damping.tension,
            bodies: bodies.collect(),
            before: vec![[0.0; 2]; states.len()],
            states,
            piston,
            ledger: Ledger::of(work),
            mechanics,
            rest,
            wet,
        };
        run.press();
        run.bodies.iter_mut().flatten().for_each(Moving::settle);
        for contact in 0..run.states.len() {
            let gaps = Gaps { run: &run, contact };
            let mut free = vec![0.0; run.states[contact].free.len()];
            gaps.measure(&mut free);
            run.states[contact].free = free;
        }
        Ok(run)
    }

    /// Forces on the modes, from those of the contacts.
    fn press(&mut self) {
        let Self { reduction, mechanics, bodies, states, .. } = self;
        for (slot, body) in bodies.iter_mut().enumerate() {
            let (Some(body), Some(member)) = (body, reduction.member(slot)) else { continue };
            let member = &reduction.members[member];
            body.forces.fill(0.0);
            let before = &states[slot - 1];
            mechanics.surfaces[member.front].press(&before.forces, before.pressed, &mut body.forces);
            if let (Some(back), Some(after)) = (member.back, states.get(slot)) {
                mechanics.surfaces[back].press(&after.forces, after.pressed, &mut body.forces);
            }
        }
    }

    /// Axial force on the body in a slot, N.
    fn net(states: &[State], slot: usize) -> f64 {
        states[slot - 1].total() - states.get(slot).map_or(0.0, State::total)
    }

    /// One step: the piston's displacement (m) and velocity (m/s) at its end.
    fn advance(&mut self, (position, velocity): (f64, f64)) -> Result<(), Failure> {
        for (slot, body) in self.bodies.iter_mut().enumerate() {
            if let Some(body) = body {
                body.kick(Self::net(&self.states, slot));
                body.drift();
            }
        }
        if let Some(wet) = &mut self.wet {
            wet.predict();
        }
        let pushed = position - self.piston;
        self.piston = position;
        for (before, state) in self.before.iter_mut().zip(&self.states) {
            *before = [state.total(), state.damping];
        }
        if self.is_damped {
            for contact in 0..self.states.len() {
                let overlap = self.rest.overlaps[contact] + self.rigid(contact) - self.rigid(contact + 1);
                self.states[contact].coefficient = self.dashpots[contact].force(overlap, 1.0);
            }
        }
        self.solve_forces(velocity)?;
        self.press();
        if let (Some(wet), Some(last)) = (&mut self.wet, self.states.last()) {
            wet.disc.push(&last.forces, last.damping);
        }
        for (slot, body) in self.bodies.iter_mut().enumerate() {
            let Some(body) = body else { continue };
            body.kick(Self::net(&self.states, slot));
            if !body.rigid.is_finite() {
                return Err(Failure::NotFinite(slot));
            }
        }
        self.book(pushed);
        Ok(())
    }

    /// Forces of contacts and dashpots, the piston moving at `velocity` (m/s). A dashpot at the disc moves the points of the contact there,
    /// very little: both are found in turn.
    fn solve_forces(&mut self, velocity: f64) -> Result<(), Failure> {
        let unsettled = |contact| Failure::Contact(Cause::NotSettled, contact);
        let last = self.states.len() - 1;
        for _ in 0..MOST_DASHPOT_PASSES {
            if let Some(wet) = &mut self.wet {
                wet.damping = self.states[last].damping;
            }
            self.solve_contacts()?;
            if !self.is_damped {
                return Ok(());
            }
            let behind = self.wet.as_ref().map(|wet| {
                let [_, mobility] = wet.disc.mobility();
                let [_, velocity] = wet.disc.modes_under(&self.states[last].forces);
                Behind { velocity, mobility }
            });
            let solved = damper::solve(&mut self.states, &self.bodies, velocity, behind, self.tension);
            self.ledger.work.dashpot_evaluations += solved.map_err(unsettled)?;
            let Some(wet) = self.wet.as_ref().filter(|wet| !wet.disc.coupling().is_empty()) else { return Ok(()) };
            let state = &self.states[last];
            let scale = state.pressing.max(state.damping.abs());
            if (state.damping - wet.damping).abs() <= DASHPOT_SETTLED * scale {
                return Ok(());
            }
        }
        Err(unsettled(last))
    }

    /// Rigid displacement of the body in a slot, m; of a disc on water that of the modes its dashpot sees, as predicted.
    fn rigid(&self, slot: usize) -> f64 {
        match (slot, &self.wet) {
            (0, _) => self.piston,
            (slot, Some(wet)) if slot == self.states.len() => {
                let [place, _] = wet.disc.modes_under(&self.states[slot - 1].forces);
                place
            }
            (slot, _) => self.bodies[slot].as_ref().map_or(0.0, |body| body.rigid),
        }
    }

    fn solve_contacts(&mut self) -> Result<(), Failure> {
        for contact in 0..self.states.len() {
            let least = Gaps { run: self, contact }.least();
            let state = &mut self.states[contact];
            (state.least, state.is_measured) = (least, false);
        }
        let mut states = std::mem::take(&mut self.states);
        let mechanics = &self.mechanics;
        let measure = |contact: usize, free: &mut [f64]| Gaps { run: self, contact }.measure(free);
        let solved = chain::solve(&mechanics.condensed, &mechanics.of_contact, &mut states, measure);
        self.states = states;
        let effort = solved.map_err(|unsolved| match unsolved {
            Unsolved::NoActiveSet(contact) => Failure::Contact(Cause::NoActiveSet, contact),
            Unsolved::NotSettled(contact) => Failure::Contact(Cause::NotSettled, contact),
        })?;
        self.ledger.work.contact_sweeps += u64::from(effort.passes);
        self.ledger.work.active_sets += u64::from(effort.sets);
        for (contact, state) in self.states.iter_mut().enumerate() {
            let geometry = &self.reduction.geometries[self.reduction.contacts[contact]];
            let [first, end] = state.pressed;
            state.pressing = state.forces[first..end]
                .iter()
                .zip(&geometry.axial[first..end])
                .map(|(force, axial)| force * axial)
                .sum();
            let exceeds = end == state.forces.len() && !geometry.is_flat;
            if exceeds || geometry.is_ring && end > 0 && first == 0 {
                return Err(Failure::Contact(Cause::PatchExceeded, contact));
            }
        }
        Ok(())
    }

    /// Work of the piston and of the dashpots in this step, by the mean of old and new forces.
    fn book(&mut self, pushed: f64) {
        let moved = |slot: usize| match (slot, &self.wet) {
            (0, _) => pushed,
            (slot, Some(wet)) if slot == self.states.len() => wet.disc.moved(),
            (slot, _) => self.bodies[slot].as_ref().map_or(0.0, |body| body.travelled),
        };
        let mut dissipated = 0.0;
        for (contact, (state, [_, damping])) in self.states.iter().zip(&self.before).enumerate() {
            let force = state.damping + damping;
            if force != 0.0 {
                dissipated += 0.5 * force * (moved(contact) - moved(contact + 1));
            }
        }
        let work = 0.5 * (self.states[0].total() + self.before[0][0]) * pushed;
        self.ledger.step(work, dissipated, 0.0);
        self.ledger.work.steps += 1;
    }

    /// Kinetic and stored energy, J; a spring behind the support is part of its contact's flexibility.
    fn energy(&mut self) -> (f64, f64) {
        let mut contacts: f64 = self.states.iter().map(State::energy).sum();
        if let (Some(wet), Some(last)) = (&mut self.wet, self.states.last()) {
            contacts += wet.energy(&last.forces);
        }
        self.bodies
            .iter()
            .flatten()
            .map(Moving::energy)
            .fold((0.0, contacts), |sum, own| (sum.0 + own.0, sum.1 + own.1))
    }
}

/// The gaps of one contact without its forces.
struct Gaps<'a, 'b> {
    run: &'a Run<'b>,
    contact: usize,
}

impl<'a> Gaps<'a, '_> {
    /// The bodies around it with the surfaces they touch it with.
    fn sides(&self) -> impl Iterator<Item = (&'a Moving, &'a super::mechanics::Surface)> {
        let (run, contact) = (self.run, self.contact);
        [contact, contact + 1].into_iter().filter_map(move |slot| {
            let member = &run.reduction.members[run.reduction.member(slot)?];
            let face = if slot == contact { member.back? } else { member.front };
            Some((run.bodies[slot].as_ref()?, &run.mechanics.surfaces[face]))
        })
    }

    /// The disc on water, at the last contact.
    fn wet(&self) -> Option<&'a Wet> {
        self.run.wet.as_ref().filter(|_| self.contact + 1 == self.run.least.len())
    }

    fn measure(&self, free: &mut [f64]) {
        free.copy_from_slice(&self.run.rest.gaps[self.contact]);
        if self.contact == 0 {
            let axial = &self.run.reduction.geometries[self.run.reduction.contacts[0]].axial;
            free.iter_mut().zip(axial).for_each(|(gap, axial)| *gap -= axial * self.run.piston);
        }
        for (body, surface) in self.sides() {
            surface.close(body.rigid, &body.modal, free);
        }
        if let Some(wet) = self.wet() {
            free.iter_mut().zip(wet.disc.predicted()).for_each(|(gap, retreat)| *gap += retreat);
            free.iter_mut().zip(wet.disc.coupling()).for_each(|(gap, share)| *gap += share * wet.damping);
        }
    }

    /// A lower bound of all of them, m.
    fn least(&self) -> f64 {
        // The axial part of a normal is at most one.
        let piston = if self.contact == 0 { self.run.piston.max(0.0) } else { 0.0 };
        let bodies: f64 = self.sides().map(|(body, surface)| surface.least(body.rigid, &body.modal)).sum();
        let wet = self.wet().map_or(0.0, |wet| {
            let share = wet.disc.coupling().iter().fold(0.0, |least: f64, share| least.min(share * wet.damping));
            wet.least + share
        });
        self.run.least[self.contact] - piston + bodies + wet
    }
}
