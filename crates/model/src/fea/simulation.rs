//! The transient analysis, one step after another.
//!
//! A step predicts every body without the new contact forces (one forward substitution a kind of body, all bodies of the kind at once),
//! solves the contacts on the condensed compliances, and completes the displacements (one backward substitution). Nothing is factored or
//! allocated in it. A step without a solution, or one in which contacts make energy from nothing, leaves no trace: it is tried again as two
//! steps of half the size, whose factor is made when it is first needed and kept.

#[cfg(test)]
mod bar;
mod snapshot;
mod warnings;

pub use snapshot::Snapshot;

use std::fmt;

use super::{
    FeaError,
    arrangement::Arrangement,
    contact::chain::{ContactState, DashpotBase, Mobility, RigidPrediction, Workspace},
    control::{Cause, Complementarity, Control, Cut, PENETRATION},
    energy::EnergyTerms,
    equilibrium::Rest,
    loss::refuse_losses,
    motion::Motion,
    operator::{Interfaces, Operator},
    profile::{Laps, Profile},
    resolution,
    scheme::Coefficients,
    trace::{Sampling, Trace, Watched},
    yielding::yield_forces,
};
use crate::{
    attached::Attached,
    holder::Hold,
    horn::HornMotion,
    response::{Channels, Response, SolverWork},
    scene::{PistonMotion, Scene, Scheme, Sensor, WaterSettings},
    tally,
    water::{front::WaterRecord, loaded_disc::LoadedDisc},
};

/// Travel of the last bead into a ring up to which undeformed normals may be kept, m: the force is then 1 % too large.
pub(crate) const FIXED_NORMAL_TRAVEL: f64 = 5e-6;

/// Steps from one look at the energies of all bodies to the next: two matrix products are too much for every step.
const STEPS_PER_AUDIT: usize = 10;

pub struct Simulation<'a> {
    arrangement: Arrangement,
    interfaces: Interfaces,
    scheme: Scheme,
    tension: bool,
    step: f64,
    sampling: Sampling,
    control: Control,
    drive: Box<dyn PistonMotion + 'a>,
    /// Operators of the step halved 0, 1, 2 … times, made when first needed.
    operators: Vec<Option<Operator>>,
    motion: Motion,
    /// Gap of every contact's points (m) and rigid overlap of every contact (m) at zero displacement.
    rest_gaps: Vec<Vec<f64>>,
    rest_overlaps: Vec<f64>,
    contacts: Vec<ContactState>,
    before: Vec<ContactState>,
    predicted_gaps: Vec<Vec<f64>>,
    rigid: Vec<RigidPrediction>,
    workspace: Workspace,
    water: Option<WaterSettings>,
    wet: Option<Wet>,
    watched: Watched,
    taken: usize,
    piston: f64,
    /// Force at which every contact would yield, N, where that is known.
    yield_forces: Vec<Option<f64>>,
    sensor: Option<Sensor>,
    /// Where the drive alone puts the piston, m.
    driven: f64,
    horn: Option<HornMotion<f64>>,
    /// By the halvings of the step.
    attached: Vec<Attached<f64>>,
    /// Largest overlap of the last bead's rigid motion with its support, m.
    travel: f64,
    trace: Trace,
    balance: EnergyTerms,
    complementarity: Complementarity,
    cuts: Vec<Cut>,
    profile: Profile,
}

struct Wet {
    disc: LoadedDisc,
    record: WaterRecord,
    /// Energy of the disc and work on the water at the last look, J.
    energies: [f64; 2],
}

/// Let the piston's face be pushed where the horn is compliant.
fn release_piston(operator: &mut Operator, attached: &Attached<f64>) {
    if let Some(horn) = &attached.horn {
        operator.contacts.mobilities[0] = Mobility { displacement: 0.0, velocity: horn.mobility() };
    }
}

impl fmt::Debug for Simulation<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Simulation").field("taken", &self.taken).field("step", &self.step).finish_non_exhaustive()
    }
}

impl<'a> Simulation<'a> {
    pub fn new(scene: &Scene, control: Control) -> Result<Self, FeaError> {
        Self::with_motion(scene, scene.drive.motion(scene.amplitude_scale), control)
    }

    pub fn with_motion(scene: &Scene, drive: Box<dyn PistonMotion + 'a>, control: Control) -> Result<Self, FeaError> {
        let lap = Profile::default().start();
        refuse_losses(scene)?;
        if let Some((_, what)) = scene.beyond_model() {
            return Err(FeaError::BeyondModel { what });
        }
        let arrangement = Arrangement::new(scene)?;
        Self::of(arrangement, scene, drive, control, lap)
    }

    /// Of bodies that are meshed already, since `lap` began.
    fn of(
        arrangement: Arrangement,
        scene: &Scene,
        drive: Box<dyn PistonMotion + 'a>,
        control: Control,
        mut lap: Laps,
    ) -> Result<Self, FeaError> {
        let mut profile = Profile::default();
        resolution::check(
            scene,
            arrangement.pairs.iter().filter(|pair| !pair.is_on_ring()).map(|pair| &pair.gaps[..]),
        )?;
        let interfaces = Interfaces::new(&arrangement);
        profile.assembly += lap.lap();
        let settings = &scene.model.fea;
        let sampling = Sampling::new(scene, settings.step);
        let (step, samples) = (sampling.step(), sampling.samples);
        let Rest { contacts, gaps: rest_gaps, overlaps: rest_overlaps, displacements, sweeps } =
            Rest::new(&arrangement, &interfaces, scene)?;
        let motion = Motion::at_rest(&arrangement, &interfaces, &displacements);
        let (scheme, tension) = (settings.scheme, scene.damping.tension);
        let mut operator = Operator::new(&arrangement, &interfaces, Coefficients::new(scheme, step), tension)?;
        let mut work = SolverWork { equilibrium_sweeps: u64::from(sweeps), ..SolverWork::default() };
        let wet = match (&arrangement.front, &scene.water) {
            (Some(front), Some(water)) => {
                let is_damped = arrangement.dashpots.last().is_some_and(|dashpot| !dashpot.is_absent());
                let held = contacts.last().filter(|_| scene.chain.precompression > 0.0);
                let held = held.map_or(&[][..], |contact| &contact.forces);
                let (disc, made) = tally::during(|| LoadedDisc::new(front, water, step, is_damped, held));
                (work.factorisations, work.kernels) = (made.factorisations, made.kernels);
                let disc = disc.map_err(Box::new)?;
                operator.soften_last(&arrangement, disc.compliance())?;
                operator.contacts.dashpot_base =
                    DashpotBase { coupling: disc.coupling().to_vec(), mobility: disc.mobility() };
                Some(Wet { disc, record: WaterRecord::new(Some(water), samples), energies: [0.0; 2] })
            }
            _ => None,
        };
        // Disc and water have one factor: their clock has one step.
        let control = if wet.is_some() { Control { halvings: 0, ..control } } else { control };
        let masses: Vec<f64> = arrangement.beads.iter().map(|&kind| arrangement.kinds[kind].total_mass()).collect();
        let attached: Vec<Attached<f64>> = (0..=control.halvings)
            .map(|level| {
                let step = step / f64::from(1_u32 << level);
                let Attached { horn, hold } = Attached::of(scene, &masses, step);
                // Drag is in the operator.
                Attached { horn, hold: hold.filter(Hold::rubs) }
            })
            .collect();
        release_piston(&mut operator, &attached[0]);
        let workspace = Workspace::new(&operator.contacts);
        let mut operators = vec![None; control.halvings as usize + 1];
        operators[0] = Some(operator);
        profile.factorisation += lap.lap();
        let times: Vec<f64> = (0..samples).map(|sample| sample as f64 * scene.output_step).collect();
        let (mut positions, mut speeds) = (vec![0.0; samples], vec![0.0; samples]);
        drive.sample(&times, &mut positions, &mut speeds);
        let speed = speeds.iter().fold(0.0, |most: f64, speed| most.max(speed.abs()));
        work.unknowns = arrangement.unknowns() as u64;
        work.factorisations += arrangement.kinds.len() as u64;
        let least_scale = 0.5 * arrangement.kinds[arrangement.beads[0]].total_mass() * speed * speed;
        let mut balance = EnergyTerms::new(least_scale, work);
        let has_channels =
            scene.horn.is_some() || attached[0].hold.is_some() || arrangement.losses.iter().any(Option::is_some);
        balance.balance.channels = has_channels.then(Channels::default);
        let piston = drive.at(0.0).0;
        let mut simulation = Self {
            water: scene.water.clone(),
            wet,
            trace: Trace::new(&arrangement, sampling),
            watched: Watched::new(&arrangement),
            predicted_gaps: rest_gaps.clone(),
            before: contacts.clone(),
            rigid: vec![RigidPrediction::default(); arrangement.beads.len() + 2],
            complementarity: Complementarity::default(),
            cuts: Vec::new(),
            travel: 0.0,
            taken: 0,
            arrangement,
            interfaces,
            scheme,
            tension,
            step,
            sampling,
            control,
            drive,
            operators,
            motion,
            rest_gaps,
            rest_overlaps,
            contacts,
            workspace,
            piston,
            driven: piston,
            horn: scene.horn.map(|_| HornMotion::at_rest()),
            attached,
            sensor: scene.chain.sensor,
            yield_forces: yield_forces(scene),
            balance,
            profile,
        };
        simulation.measure_contacts();
        simulation.before.clone_from(&simulation.contacts);
        let energy = simulation.energy();
        simulation.balance.begin(energy);
        simulation.record();
        Ok(simulation)
    }

    pub fn arrangement(&self) -> &Arrangement {
        &self.arrangement
    }

    pub fn motion(&self) -> &Motion {
        &self.motion
    }

    pub fn contacts(&self) -> &[ContactState] {
        &self.contacts
    }

    /// Displacement of the piston, m.
    pub fn piston(&self) -> f64 {
        self.piston
    }

    pub fn time(&self) -> f64 {
        self.taken as f64 * self.step
    }

    /// Whether the last sample is taken.
    pub fn is_done(&self) -> bool {
        self.taken >= self.sampling.steps()
    }

    pub fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    pub fn complementarity(&self) -> Complementarity {
        self.complementarity
    }

    pub fn balance(&self) -> &EnergyTerms {
        &self.balance
    }

    pub fn profile(&self) -> &Profile {
        &self.profile
    }

    /// Non-zeros of the factors of the nominal step, each counted once a kind of body.
    pub fn factor_nonzeros(&self) -> usize {
        self.operators[0].iter().flat_map(|operator| &operator.factors).map(super::factor::Factor::nonzeros).sum()
    }

    pub fn response(&self) -> Response {
        let mut response = self.trace.response(&self.watched, &self.balance);
        if let (Some(wet), Some(front), Some(water)) = (&self.wet, &self.arrangement.front, &self.water) {
            wet.disc.count(&mut response.work);
            wet.record.clone().enter_behind(front, water, wet.energies, &mut response);
        }
        response.counted(false, |forces| self.sensor.map(|sensor| sensor.reads(forces)))
    }

    /// Take one nominal step.
    ///
    /// # Errors
    /// [`FeaError::StepGivenUp`] when even the smallest part of it had no solution; [`FeaError::EnergyMade`].
    pub fn advance(&mut self) -> Result<(), FeaError> {
        self.advance_part(0, 0)?;
        self.taken += 1;
        let mut lap = self.profile.start();
        self.trace.follow(&self.watched, &self.motion);
        if self.taken.is_multiple_of(self.sampling.steps_per_sample) {
            self.record();
        }
        if self.taken.is_multiple_of(STEPS_PER_AUDIT) || self.is_done() {
            let energy = self.energy();
            self.balance.sample(energy);
            if let Some((made_j, given_j)) = self.balance.made() {
                let time = self.taken as f64 * self.step;
                return Err(FeaError::EnergyMade { time, step: self.step, made_j, given_j });
            }
        }
        self.profile.record += lap.lap();
        Ok(())
    }

    /// Advance by the nominal step halved `level` times, from the tick `begin` of the current nominal step (of 2^halvings ticks).
    fn advance_part(&mut self, level: u32, begin: u64) -> Result<(), FeaError> {
        self.factor(level)?;
        let halvings = self.control.halvings;
        let ticks = 1_u64 << (halvings - level);
        let at = |ticks: u64| (self.taken as f64 + ticks as f64 / (1_u64 << halvings) as f64) * self.step;
        let (start, end) = (at(begin), at(begin + ticks));
        let Err((cause, contact)) = self.attempt(level, end) else { return Ok(()) };
        let (time, step, contact) = (start, self.step / f64::from(1_u32 << level), contact + 1);
        self.cuts.push(Cut { time_s: time, step_s: step, contact, cause });
        self.balance.work.rejected_steps += 1;
        self.contacts.iter_mut().zip(&self.before).for_each(|(contact, before)| contact.copy_from(before));
        self.motion.forget_prediction();
        if level == halvings {
            return Err(FeaError::StepGivenUp { time, step, contact, cause });
        }
        self.advance_part(level + 1, begin)?;
        self.advance_part(level + 1, begin + ticks / 2)
    }

    fn factor(&mut self, level: u32) -> Result<(), FeaError> {
        let place = &mut self.operators[level as usize];
        if place.is_none() {
            let mut lap = self.profile.start();
            let coefficients = Coefficients::new(self.scheme, self.step / f64::from(1_u32 << level));
            let mut operator = Operator::new(&self.arrangement, &self.interfaces, coefficients, self.tension)?;
            release_piston(&mut operator, &self.attached[level as usize]);
            *place = Some(operator);
            self.balance.work.factorisations += self.arrangement.kinds.len() as u64;
            self.profile.factorisation += lap.lap();
        }
        Ok(())
    }

    /// One step that either succeeds or leaves bodies and energies as they were. On failure the cause and the contact.
    fn attempt(&mut self, level: u32, end: f64) -> Result<(), (Cause, usize)> {
        let Self { arrangement, interfaces, operators, motion, contacts, before, profile, balance, .. } = self;
        let Some(operator) = &mut operators[level as usize] else { return Err((Cause::NotFinite, 0)) };
        let (driven, driven_velocity) = self.drive.at(end);
        let (mut piston, mut piston_velocity) = (driven, driven_velocity);
        let Attached { horn: horn_step, hold } = &self.attached[level as usize];
        let mut horn = self.horn;
        if let (Some(step), Some(horn)) = (horn_step, &mut horn) {
            piston_velocity += step.begin(horn, contacts[0].total());
            piston += horn.displacement;
            balance.work.horn_evaluations += 1;
        }
        before.iter_mut().zip(contacts.iter()).for_each(|(before, contact)| before.copy_from(contact));
        balance.work.solves += arrangement.kinds.len() as u64;
        motion.predict(arrangement, interfaces, operator, before, profile);

        let mut lap = profile.start();
        motion.predict_rigid(arrangement, operator, before, &mut self.rigid);
        self.rigid[0] = RigidPrediction { displacement: piston, velocity: piston_velocity };
        if let (Some(Wet { disc, .. }), Some(base)) = (&mut self.wet, self.rigid.last_mut()) {
            disc.predict();
            let [displacement, velocity] = disc.predicted_modes();
            *base = RigidPrediction { displacement, velocity };
        }
        let value = |slot, row| motion.free_interface(slot).map(|(free, column)| free.get(row, column));
        let (rest, links) = (&self.rest_gaps, &operator.contacts.links);
        interfaces.gaps(rest, links, piston, value, &mut self.predicted_gaps);
        if let (Some(wet), Some(gaps)) = (&self.wet, self.predicted_gaps.last_mut()) {
            gaps.iter_mut().zip(wet.disc.predicted()).for_each(|(gap, retreat)| *gap += retreat);
        }
        let effort = operator
            .contacts
            .solve(&self.predicted_gaps, &self.rigid, &self.rest_overlaps, contacts, &mut self.workspace)
            .map_err(Cause::of)?;
        balance.work.contact_sweeps += u64::from(effort.sweeps);
        balance.work.active_sets += u64::from(effort.sets);
        balance.work.dashpot_evaluations += u64::from(effort.dashpots);
        let mut contact_energy = 0.0;
        for (contact, (new, old)) in contacts.iter().zip(before.iter()).enumerate() {
            let pair = &arrangement.pairs[arrangement.contacts[contact]];
            let ends = |i: usize| new.forces[i] > 0.0;
            if ends(pair.len() - 1) && !pair.is_flat() || (pair.is_on_ring() && ends(0)) {
                return Err((Cause::PatchExceeded, contact));
            }
            let made = 0.5
                * new
                    .forces
                    .iter()
                    .zip(&old.forces)
                    .zip(new.gaps.iter().zip(&old.gaps))
                    .fold(0.0, |sum, ((new_force, old_force), (new_gap, old_gap))| {
                        sum + old_force * new_gap - new_force * old_gap
                    });
            if made.abs() > self.control.contact_energy * balance.scale() {
                return Err((Cause::ContactEnergy, contact));
            }
            contact_energy += made;
        }
        profile.contact += lap.lap();

        motion.complete(arrangement, interfaces, operator, contacts, profile);
        let mut lap = profile.start();
        if let Some(slot) = motion.not_finite() {
            return Err((Cause::NotFinite, slot - 1));
        }
        profile.record += lap.lap();
        let moved = |motion: &Motion, slot: usize| motion.rigid_displacement(slot);
        let mut dissipated = 0.0;
        for contact in 0..contacts.len() {
            let force = contacts[contact].damping + before[contact].damping;
            if force != 0.0 {
                dissipated -= 0.5 * force * (moved(motion, contact) - moved(motion, contact + 1));
            }
        }
        if let (Some(wet), Some(last)) = (&mut self.wet, contacts.last()) {
            wet.disc.push(&last.forces, last.damping);
            dissipated -= 0.5 * (last.damping + before[contacts.len() - 1].damping) * wet.disc.moved();
        }
        let old_piston = self.piston;
        motion.accept(arrangement, operator, contacts, before, profile);
        motion.move_piston(piston);
        let mut lap = profile.start();
        for contact in 0..contacts.len() {
            let force = contacts[contact].damping + before[contact].damping;
            if force != 0.0 {
                dissipated += 0.5 * force * (moved(motion, contact) - moved(motion, contact + 1));
            }
        }
        let work = 0.5 * (contacts[0].total() + before[0].total()) * (piston - old_piston);
        balance.step(work, dissipated, contact_energy);
        balance.work.steps += 1;
        self.piston = piston;
        if let Some(channels) = &mut balance.balance.channels {
            let [drag, material] = motion.lose(arrangement, operator);
            (channels.drag_j, channels.material_j) = (channels.drag_j + drag, channels.material_j + material);
            for slot in 1..contacts.len() + 1 {
                let Some(loss) = arrangement.kind(slot).and_then(|kind| operator.losses[kind]) else { continue };
                balance.work.holder_evaluations += u64::from(loss.own.drag > 0.0 && hold.is_none());
                balance.work.loss_evaluations += u64::from(loss.own.retardation > 0.0);
                balance.work.relaxation_evaluations += u64::from(loss.own.relaxation.is_some());
            }
            if let (Some(step), Some(horn)) = (horn_step, &mut horn) {
                step.kick(horn, contacts[0].total());
                channels.source_work_j += 0.5 * (contacts[0].total() + before[0].total()) * (driven - self.driven);
                (channels.horn_j, channels.horn_lost_j) = (step.energy(horn), horn.lost);
            }
            if let Some(hold) = hold {
                for slot in 1..contacts.len() {
                    let velocity = motion.rigid_velocity(slot);
                    let left = hold.rubbed(slot - 1, velocity, [contacts[slot - 1].total(), contacts[slot].total()]);
                    let mass = arrangement.kind(slot).map_or(0.0, |kind| arrangement.kinds[kind].total_mass());
                    motion.push(operator, slot, left - velocity);
                    channels.friction_j += 0.5 * mass * (velocity * velocity - left * left);
                    balance.work.holder_evaluations += 1;
                }
            }
        }
        (self.driven, self.horn) = (driven, horn);
        let last = contacts.len() - 1;
        self.travel = self.travel.max(motion.rigid_displacement(last) + self.rest_overlaps[last]);
        self.measure_contacts();
        self.profile.record += lap.lap();
        Ok(())
    }

    /// Measure all gaps again from the displacements, and check them against the contact conditions.
    fn measure_contacts(&mut self) {
        let (mut penetration, mut adhesion, mut product): (f64, f64, f64) = (0.0, 0.0, 0.0);
        let last = self.contacts.len() - 1;
        for (contact, state) in self.contacts.iter_mut().enumerate() {
            let pair = &self.arrangement.pairs[self.arrangement.contacts[contact]];
            let [before, after] = &self.interfaces.faces[contact];
            for i in 0..pair.len() {
                let near = if contact == 0 {
                    pair.axial_before[i] * self.piston
                } else {
                    self.motion.normal_displacement(&self.interfaces, contact, before, i)
                };
                let far = self.motion.normal_displacement(&self.interfaces, contact + 1, after, i);
                let retreat = match &self.wet {
                    Some(wet) if contact == last => wet.disc.retreat()[i],
                    _ => 0.0,
                };
                let flat = if pair.after.is_empty() {
                    pair.axial_after[i] * state.pressing / self.arrangement.spring
                } else {
                    0.0
                };
                let gap = self.rest_gaps[contact][i] - near - far - flat + retreat;
                penetration = penetration.max(-gap);
                adhesion = adhesion.max(-state.forces[i]);
                product = product.max((state.forces[i] * gap).abs());
            }
        }
        let all = &mut self.complementarity;
        all.penetration_m = all.penetration_m.max(penetration);
        all.adhesion_n = all.adhesion_n.max(adhesion);
        all.product_j = all.product_j.max(product);
        let violated = penetration > PENETRATION || adhesion > 0.0;
        all.violations += u64::from(violated);
        debug_assert!(
            !violated,
            "contact conditions at {:e} s: {penetration:e} m deep, {adhesion:e} N pulling",
            self.time()
        );
    }

    fn energy(&mut self) -> (f64, f64) {
        let (kinetic, stored) = self.motion.energy(&self.arrangement);
        let force = self.contacts.last().map_or(0.0, |contact| contact.pressing);
        let wet = self.wet.as_mut().map_or(0.0, |wet| {
            wet.energies = wet.disc.energies();
            wet.energies.iter().sum()
        });
        (kinetic, stored + self.arrangement.spring_energy(force) + wet)
    }

    fn record(&mut self) {
        if self.taken == 0 {
            self.trace.follow(&self.watched, &self.motion);
        }
        self.trace.sample(&self.arrangement, &self.watched, &self.motion, self.piston, &self.contacts);
        if let Some(Wet { disc, record, .. }) = &mut self.wet {
            disc.sample(record);
        }
    }
}
