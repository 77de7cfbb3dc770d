//! Runs of scenes with bodies reduced once.

use super::{
    backing::{Backing, Wet},
    contact::State,
    equilibrium::Equilibrium,
    mechanics::{Flexibility, Mechanics},
    motion::Moving,
    record::{Follower, Record},
    reduction::Reduction,
    stepping::{Beginning, Motion},
};
use crate::{
    ModelError, Progress,
    attached::Attached,
    contact_law::dashpots,
    fea::{resolution, trace::Sampling},
    holder::Hold,
    horn::HornStep,
    need_drive,
    number::{Lane, Mask, Number},
    response::{Channels, EnergySums, ObservedPoint, Response, SolverWork},
    scene::{PistonMotion, Scene},
    tally,
    water::{front::WaterRecord, loaded_disc::LoadedDisc},
};
use granchain_signal::Series;

/// Fewest runs that are faster side by side than one after another.
pub(crate) const FEWEST_TOGETHER: usize = 3;

/// Runs that are made side by side.
pub(crate) const MOST_TOGETHER: usize = Lane::WIDTH;

pub(crate) fn can_run_together(one: &Scene, other: &Scene) -> bool {
    let kept = |scene: &Scene| (scene.damping.tension, scene.output_step.to_bits());
    // What a run has of horn and holder may be each its own, whether it has any is of all.
    let has = |scene: &Scene| (scene.horn.is_some(), scene.holder.is_some());
    one.water.is_none()
        && other.water.is_none()
        && one.drive.kind.striker().or(other.drive.kind.striker()).is_none()
        && one.support == other.support
        && one.loss == other.loss
        && (kept(one), has(one)) == (kept(other), has(other))
}

impl Reduction {
    /// Run a scene with these bodies, the piston moving as `motion`.
    pub(crate) fn run_with(
        &self,
        scene: &Scene,
        motion: &dyn PistonMotion,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        let sampling = self.sampling(scene)?;
        let step = sampling.step();
        let mut run = Single::new(self, scene, step, motion.at(0.0).0)?;
        if let (Some(velocity), Some(striker)) = (scene.striker_velocity(), run.motion.bodies[1].as_mut()) {
            striker.rigid_velocity = velocity;
        }
        let mut record = Record::new(sampling, self.beads.len());
        let mut water_record = scene.water.as_ref().map(|water| WaterRecord::new(Some(water), sampling.samples));
        let sample_water = |run: &Single<'_>, water_record: &mut Option<WaterRecord>| {
            if let (Some(wet), Some(water_record)) = (&run.motion.backing, water_record) {
                wet.disc.sample(water_record);
            }
        };
        run.balance = EnergySums::starting(run.energy(), run.balance.channels);
        record.follower.follow(0, &run.motion);
        record.sample(&run.motion);
        sample_water(&run, &mut water_record);
        for taken in 1..=sampling.steps() {
            let time = taken as f64 * step;
            run.advance(motion.at(time));
            if let Some((_, failure)) = run.motion.failed.first() {
                return Err(failure.at(time, step));
            }
            record.follower.follow(taken, &run.motion);
            if taken.is_multiple_of(sampling.steps_per_sample) {
                record.sample(&run.motion);
                sample_water(&run, &mut water_record);
                let energy = run.energy();
                run.balance.hold(energy);
                run.balance.largest = run.balance.largest.max(energy.0 + energy.1);
                if !progress(time) {
                    return Err(ModelError::Stopped { time });
                }
            }
        }
        let Single { motion, balance, mut work, .. } = run;
        let done = motion.work;
        (work.horn_evaluations, work.holder_evaluations) = (done.horn_evaluations, done.holder_evaluations);
        (work.relaxation_evaluations, work.loss_evaluations) = (done.relaxation_evaluations, done.loss_evaluations);
        (work.contact_sweeps, work.active_sets) = (done.contact_sweeps, done.active_sets);
        work.most_contact_sweeps = done.most_contact_sweeps;
        work.dashpot_evaluations = done.dashpot_evaluations;
        work.unknowns = motion.bodies.iter().flatten().map(|body| 1 + body.modal.len() as u64).sum();
        if let Some(wet) = &motion.backing {
            wet.disc.count(&mut work);
        }
        let mut response = record.response(self.observed(scene), &balance, work);
        if let (Some(water_record), Some(front), Some(water), Some(mut wet)) =
            (water_record, &self.front, &scene.water, motion.backing)
        {
            water_record.enter_behind(front, water, wet.disc.energies(), &mut response);
        }
        Ok(response)
    }

    /// Velocity (m/s) of the last bead where a laser sees it ([`Response::observed_velocity`]) in every scene, eight side by side: the same
    /// bits as of each alone. The scenes differ in drive, α, damping, gaps, precompression and duration at most, and have no water.
    /// Nothing else is recorded, and no energy is accounted for.
    pub(crate) fn traces(&self, scenes: &[Scene], go_on: &dyn Fn() -> bool) -> Vec<Result<Series, ModelError>> {
        scenes.chunks(Lane::WIDTH).flat_map(|scenes| self.side_by_side(scenes, go_on)).collect()
    }

    fn side_by_side(&self, scenes: &[Scene], go_on: &dyn Fn() -> bool) -> Vec<Result<Series, ModelError>> {
        let (mut outcomes, mut runs) = (Vec::new(), Vec::new());
        for (index, scene) in scenes.iter().enumerate() {
            let sampling = self.sampling(scene);
            let run = sampling.and_then(|sampling| {
                let motion = scene.drive.motion(scene.amplitude_scale);
                let equilibrium = Equilibrium::new(self, scene)?;
                let dashpots = dashpots(&scene.damping, equilibrium.forces.len());
                Ok((index, sampling, Beginning { equilibrium, dashpots, piston: motion.at(0.0).0 }, motion))
            });
            outcomes.push(match run {
                Ok(run) => {
                    runs.push(run);
                    Ok(Series::new(0.0, scene.output_step, Vec::new()))
                }
                Err(error) => Err(error),
            });
        }
        let Some(longest) = runs.iter().map(|(_, sampling, ..)| *sampling).max_by_key(|sampling| sampling.samples)
        else {
            return outcomes;
        };
        let step = longest.step();
        let mechanics = match Mechanics::new(self, &scenes[0], Flexibility::Residual(step), &[]) {
            Ok(mechanics) => mechanics,
            Err(error) => return scenes.iter().map(|_| Err(error.clone().into())).collect(),
        };
        let beginnings: Vec<Beginning> = runs.iter().map(|(_, _, beginning, _)| beginning.clone()).collect();
        let live = (runs.len()..Lane::WIDTH).fold(Mask::all(true), |live, place| live & Mask::but(place));
        let of = |place: usize| &scenes[runs[place.min(runs.len() - 1)].0];
        let horn = of(0).horn.map(|first| {
            HornStep::new(|place| (of(place).horn.unwrap_or(first), of(place).chain.precompression), step)
        });
        let hold = of(0).holder.filter(|_| (0..runs.len()).any(|place| of(place).holder.is_some_and(|own| own.acts())));
        let hold = hold
            .map(|first| Hold::new(|place| of(place).holder.unwrap_or(first), &scenes[0], &self.bead_masses(), step));
        let attached = Attached { horn, hold };
        let mut motion: Motion<'_, Lane, ()> =
            Motion::new(self, mechanics, &beginnings, scenes[0].damping.tension, live, step, (), attached);
        let place = self.beads.len() - usize::from(self.observed(&scenes[0]) == ObservedPoint::Centre);
        let mut follower = Follower::new(longest, place, self.beads.len());
        follower.follow(0, &motion);
        let mut ends = vec![0.0; runs.len()];
        for taken in 1..=longest.steps() {
            let time = taken as f64 * step;
            let drives: [(f64, f64); Lane::WIDTH] =
                std::array::from_fn(|place| runs[place.min(runs.len() - 1)].3.at(time));
            advance(&mut motion, Lane::of(|place| drives[place].0), Lane::of(|place| drives[place].1));
            follower.follow(taken, &motion);
            for (place, failure) in motion.failed.drain(..) {
                outcomes[runs[place].0] = Err(failure.at(time, step));
            }
            if taken.is_multiple_of(longest.steps_per_sample) {
                for (place, (_, sampling, ..)) in runs.iter().enumerate() {
                    if taken == sampling.steps() {
                        ends[place] = follower.at_the_end().get(place);
                        motion.live = motion.live & Mask::but(place);
                    }
                }
                if !motion.live.any() {
                    break;
                }
                if !go_on() {
                    let stopped = |place: &usize| motion.live.get(*place);
                    for place in (0..runs.len()).filter(stopped) {
                        outcomes[runs[place].0] = Err(ModelError::Stopped { time });
                    }
                    break;
                }
            }
        }
        for (place, (index, sampling, ..)) in runs.iter().enumerate() {
            if let Ok(series) = &mut outcomes[*index] {
                let inner = follower.velocity[0].iter().take(sampling.samples - 1).map(|values| values.get(place));
                series.values = inner.chain([ends[place]]).collect();
            }
        }
        outcomes
    }

    /// Masses of the beads, kg.
    fn bead_masses(&self) -> Vec<f64> {
        self.beads.iter().map(|&member| self.kinds[self.members[member].kind].mass).collect()
    }

    fn sampling(&self, scene: &Scene) -> Result<Sampling, ModelError> {
        need_drive(scene, "reduced")?;
        let poles = self.geometries.iter().filter(|geometry| !geometry.is_ring);
        resolution::check(scene, poles.map(|geometry| &geometry.gaps[..]))?;
        Ok(Sampling::new(scene, scene.model.reduced.step))
    }

    /// Where a laser sees the last bead.
    fn observed(&self, scene: &Scene) -> ObservedPoint {
        ObservedPoint::of(self.support.is_none() && self.front.is_none() && !scene.support.is_free())
    }
}

/// One step, compiled for the widest vectors this machine has.
fn advance<N: Number, B: Backing<N>>(motion: &mut Motion<'_, N, B>, position: N, velocity: N) {
    struct Step<'a, 'b, N: Number, B>(&'a mut Motion<'b, N, B>, N, N);
    impl<N: Number, B: Backing<N>> pulp::NullaryFnOnce for Step<'_, '_, N, B> {
        type Output = ();

        #[inline(always)]
        fn call(self) {
            self.0.advance(self.1, self.2);
        }
    }
    granchain_signal::vectors::widest(Step(motion, position, velocity));
}

#[derive(Debug)]
struct Single<'a> {
    motion: Motion<'a, f64, Option<Wet>>,
    balance: EnergySums,
    work: SolverWork,
    /// Whole and dashpot forces of the last step, N.
    before: Vec<[f64; 2]>,
    /// Where the drive alone puts the piston, m.
    driven: f64,
    /// Energy lost in creep and work of the horn as a source, J.
    crept: f64,
    source_work: f64,
    has_channels: bool,
}

impl<'a> Single<'a> {
    fn new(reduction: &'a Reduction, scene: &Scene, step: f64, piston: f64) -> Result<Self, ModelError> {
        let equilibrium = Equilibrium::new(reduction, scene)?;
        let mut work = SolverWork { equilibrium_sweeps: u64::from(equilibrium.sweeps), ..SolverWork::default() };
        let dashpots = dashpots(&scene.damping, equilibrium.forces.len());
        let wet = match (&reduction.front, &scene.water, &*dashpots, &*equilibrium.forces) {
            (Some(front), Some(water), [.., dashpot], [.., forces]) => {
                let held = if scene.chain.precompression > 0.0 { &forces[..] } else { &[] };
                let made = || LoadedDisc::new(front, water, step, !dashpot.is_absent(), held);
                let (disc, made) = tally::during(made);
                (work.factorisations, work.kernels) = (made.factorisations, made.kernels);
                Some(Wet::new(disc.map_err(|error| crate::fea::FeaError::from(Box::new(error)))?))
            }
            _ => None,
        };
        let further = wet.as_ref().map_or(&[][..], |wet| wet.disc.compliance());
        let mechanics = Mechanics::new(reduction, scene, Flexibility::Residual(step), further)?;
        let before = vec![[0.0; 2]; equilibrium.forces.len()];
        let beginning = Beginning { equilibrium, dashpots, piston };
        let attached = Attached::of(scene, &reduction.bead_masses(), step);
        let has_channels =
            attached.horn.is_some() || attached.hold.is_some() || mechanics.laws.iter().any(Option::is_some);
        let motion = Motion::new(reduction, mechanics, &[beginning], scene.damping.tension, true, step, wet, attached);
        let balance = EnergySums::default();
        Ok(Self { motion, balance, work, before, driven: piston, crept: 0.0, source_work: 0.0, has_channels })
    }

    /// One step: the displacement (m) and velocity (m/s) that drive the piston at its end.
    fn advance(&mut self, (position, velocity): (f64, f64)) {
        for (before, state) in self.before.iter_mut().zip(&self.motion.states) {
            *before = [state.total(), state.damping];
        }
        let from = self.motion.piston;
        advance(&mut self.motion, position, velocity);
        self.add_work(self.motion.piston - from);
        if self.motion.horn.is_some() {
            let force = self.motion.states[0].total() + self.before[0][0];
            self.source_work += 0.5 * force * (position - self.driven);
            self.driven = position;
        }
        if let Some(creep) = &self.motion.creep {
            self.crept += creep.lost(&self.motion.mechanics);
        }
    }

    /// Work of the piston and of the dashpots in this step, by the mean of old and new forces.
    fn add_work(&mut self, pushed: f64) {
        let Motion { states, bodies, backing, .. } = &self.motion;
        let moved = |slot: usize| match (slot, backing) {
            (0, _) => pushed,
            (slot, Some(wet)) if slot == states.len() => wet.disc.moved(),
            (slot, _) => bodies[slot].as_ref().map_or(0.0, |body| body.travelled),
        };
        let mut dissipated = 0.0;
        for (contact, (state, [_, damping])) in states.iter().zip(&self.before).enumerate() {
            let force = state.damping + damping;
            if force != 0.0 {
                dissipated += 0.5 * force * (moved(contact) - moved(contact + 1));
            }
        }
        let work = 0.5 * (states[0].total() + self.before[0][0]) * pushed;
        self.balance.step(work, dissipated);
        self.work.steps += 1;
    }

    /// Kinetic and stored energy, J; a spring behind the support is part of its contact's flexibility.
    fn energy(&mut self) -> (f64, f64) {
        self.enter_channels();
        let Motion { states, bodies, backing, creep, mechanics, .. } = &mut self.motion;
        let mut contacts: f64 = states.iter().map(State::energy).sum();
        if let Some(creep) = creep {
            contacts += creep.energy(mechanics, |contact| &states[contact].forces);
        }
        if let (Some(wet), Some(last)) = (backing, states.last()) {
            contacts += wet.energy(&last.forces);
        }
        bodies.iter().flatten().map(Moving::energy).fold((0.0, contacts), |sum, own| (sum.0 + own.0, sum.1 + own.1))
    }

    fn enter_channels(&mut self) {
        if !self.has_channels {
            return;
        }
        let mut channels = Channels { material_j: self.crept, source_work_j: self.source_work, ..Channels::default() };
        for body in self.motion.bodies.iter().flatten() {
            channels.drag_j += body.held.drag;
            channels.friction_j += body.held.friction;
            channels.material_j += body.material;
        }
        if let Some((horn, motion)) = &self.motion.horn {
            (channels.horn_j, channels.horn_lost_j) = (horn.energy(motion), motion.lost);
        }
        self.balance.channels = Some(channels);
    }
}
