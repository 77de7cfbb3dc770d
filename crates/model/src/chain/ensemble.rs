//! Many runs of one scene at a fixed step, eight side by side: the engine of searches.
//!
//! The classical Runge–Kutta method of order 4 for a system of second order, with the step T0/160 by default. Contacts are not
//! located: a step across an opening or closing is of lower order. The drive is sampled once at all steps and half steps and shared;
//! each run scales it. The runs of a group lie in arrays of eight, and every operation is element by element, so the result
//! of a run has the same bits whatever its neighbours, its place, and the number of threads that callers spread chunks over.
//!
//! Measured against the adaptive integrator (largest error of the pole's velocity over its peak): see `tests/model/chain_steppers.rs`. Behind
//! a rigid wall with linear dashpots, whose force jumps at touch, it is 3e-4 in the first 30 µs and 1e-3 to 4e-2 by 70 µs, depending on where
//! in a step each touch falls (`docs/contact-laws.md`). Where the motion is chaotic, two runs of any two integrators part anyway.

#[cfg(test)]
mod tests;

use std::sync::Arc;

pub use super::variation::{EffectVariation, Variation};
use super::{
    ChainModel, InitialState, coupling::Coupling, effects::Effects, finite_body::FiniteBodyLaws, lane::AnnulusLane,
    on_spring::OnSpring, system::System,
};
use crate::{
    Estimate, ModelError,
    contact_law::{
        ALL_TERMS, Annulus, ElasticLaw, FiniteHertz, Hertz, HertzOnSpring, Law, Spring, Terms, effective_modulus,
        for_terms, terms_of,
    },
    number::{Lane, Mask, Number, WIDTH},
    scene::{DampingPlacement, DampingTerm, Drive, DriveKind, FlatContact, Integrator, PistonMotion, Scene, Support},
};
use granchain_signal::{
    Series,
    spline::{Ends, Spline},
};

#[derive(Debug, Clone)]
pub struct Ensemble {
    scene: Scene,
    laws: Vec<Law>,
    /// How contacts of finite bodies feel one another; none with the law of Hertz.
    coupling: Option<Coupling>,
    inverse_mass: Vec<f64>,
    /// Displacement (m) and velocity (m/s) of the piston at α = 1, every half step.
    drive: Arc<Vec<(f64, f64)>>,
    /// The same of the realisations of what is not known of it, eight side by side.
    shakes: Arc<Vec<Vec<(Lane, Lane)>>>,
    steps: usize,
    step: f64,
    /// Whether the scene has effects that no lane has: its runs are the adaptive integrator's, one by one.
    is_single: bool,
    /// 1/v_s, s/m, where a bead guide with the regularised friction is all that acts beside contacts and dashpots.
    inverse_slip: Option<f64>,
    fitted: Option<FiniteBodyLaws>,
}

/// Law of the last contact.
#[derive(Clone, Copy, PartialEq)]
enum Last {
    Hertz,
    Annulus,
    Spring,
    HertzOnSpring,
}

/// Times the forces of coupled contacts are inserted into one another: leaves 2e-6 of the force where each insertion contracts to a
/// hundredth (1 mm steel beads, 1 µm), far below the step's own error.
const INSERTIONS: usize = 2;

impl Ensemble {
    pub const STEPS_PER_PERIOD: u32 = 160;

    /// Prepare the scene: fixed step T0/`steps_per_period`, drive sampled once for all runs.
    pub fn new(scene: &Scene, steps_per_period: u32) -> Result<Self, ModelError> {
        Self::on(scene, None, steps_per_period)
    }

    /// The same with the laws of the scene's bodies known already: see [`FiniteBodyLaws`].
    pub fn with_laws(scene: &Scene, fitted: &FiniteBodyLaws, steps_per_period: u32) -> Result<Self, ModelError> {
        Self::on(scene, Some(fitted), steps_per_period)
    }

    fn on(scene: &Scene, fitted: Option<&FiniteBodyLaws>, steps_per_period: u32) -> Result<Self, ModelError> {
        let step = 1.0 / (scene.drive.frequency * f64::from(steps_per_period));
        if !(step > 0.0 && step.is_finite()) {
            let (quantity, expected) =
                ("drive.frequency".into(), "a positive frequency, Hz, and at least one step a period");
            return Err(ModelError::Unphysical { quantity, expected, found: scene.drive.frequency });
        }
        let work = scene.chain.beads.len() as f64 * scene.duration / step;
        // The drive and each of its realisations at half steps: two numbers.
        let memory = 32.0 * scene.duration / step * (1 + scene.drive.shakes().len()) as f64;
        Estimate { work, memory }.check(&scene.model.limits)?;
        let system = System::new(scene, fitted)?;
        let steps = (scene.duration / step * (1.0 + 1e-12)).floor() as usize;
        let drive = Arc::new(sampled(&scene.drive, steps, step));
        let shakes = Arc::new(realisations(&scene.drive, steps, step));
        let inverse_mass = system.inverse_mass[1..=system.beads].to_vec();
        let System { laws, coupling, effects, .. } = system;
        let inverse_slip = effects.as_ref().and_then(Effects::regularised_friction).map(f64::recip);
        let is_single = effects.is_some() && inverse_slip.is_none()
            || scene.is_struck()
            || matches!(scene.support, Support::Foundation { .. });
        let (scene, fitted) = (scene.clone(), fitted.cloned());
        Ok(Self { scene, laws, coupling, inverse_mass, drive, shakes, steps, step, is_single, inverse_slip, fitted })
    }

    /// The same with other realisations (m) of what is not known of its drive: [`Variation::shaken`] says how much of each.
    #[must_use]
    pub fn with_shakes(&self, shakes: &[Series]) -> Self {
        let mut with = self.clone();
        if let DriveKind::Record { shakes: own, .. } = &mut with.scene.drive.kind {
            *own = shakes.to_vec();
        }
        with.shakes = Arc::new(realisations(&with.scene.drive, self.steps, self.step));
        with
    }

    /// Factor on the stiffness of a contact where the beads have `factor` times their modulus: a face of another material keeps its own.
    fn of_modulus(&self, contact: usize, factor: f64) -> f64 {
        let (bead, face) = (&self.scene.chain.beads[0], self.scene.piston_material.as_ref());
        let Some(face) = face.filter(|_| contact == 0 && self.scene.piston == FlatContact::HalfSpace) else {
            return factor;
        };
        // E* at that factor over E* at 1.
        let [own, other] = [&bead.material, face].map(|of| effective_modulus(of, None).recip());
        (own + other) / (own / factor + other)
    }

    /// Interval between two samples of the result, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    pub fn samples(&self) -> usize {
        self.steps + 1
    }

    /// Run every variation; the velocity of the last bead's pole (m/s) at every step from time zero, or why that run failed.
    pub fn run(&self, variations: &[Variation]) -> Vec<Result<Series, ModelError>> {
        let mut results: Vec<Result<Series, ModelError>> = Vec::with_capacity(variations.len());
        let mut groups: [Vec<usize>; ALL_TERMS as usize + 1] = Default::default();
        for (index, variation) in variations.iter().enumerate() {
            results.push(variation.check(&self.scene).map(|()| Series::new(0.0, self.step, Vec::new())));
            if self.is_single || !self.goes_in_lanes(variation) {
                if results[index].is_ok() {
                    results[index] = self.single(variation);
                }
            } else if results[index].is_ok() {
                // Runs with the same effects go together, so that none pays for another's or is computed otherwise for it.
                groups[usize::from(terms_of(&variation.damping))].push(index);
            }
        }
        let mut work = Work::new(self);
        for (terms, group) in (0..=ALL_TERMS).zip(&groups) {
            for chunk in group.chunks(WIDTH) {
                work.load(self, variations, chunk);
                for_terms!(terms, DAMPED => work.advance::<DAMPED>(self));
                for (place, index) in chunk.iter().enumerate() {
                    results[*index] = work.unload(self, place);
                }
            }
        }
        results
    }

    /// Whether a lane has what a variation changes beside contacts and dashpots: nothing, or a friction that turns within steps.
    fn goes_in_lanes(&self, variation: &Variation) -> bool {
        let EffectVariation { horn_mass, drag, friction_force } = variation.effects;
        let Some(inverse_slip) = self.inverse_slip else { return variation.effects == EffectVariation::default() };
        let lightest = self.inverse_mass.iter().copied().fold(0.0, f64::max);
        let friction = friction_force.unwrap_or_else(|| self.friction());
        (horn_mass, drag) == (None, None) && friction * lightest * inverse_slip * self.step < FASTEST_TURN
    }

    /// Friction of the bead guide, N.
    fn friction(&self) -> f64 {
        self.scene.holder.map_or(0.0, |holder| holder.friction_force)
    }

    /// A run with effects that no lane has, by the adaptive integrator; a gap that an offset would close further is closed.
    fn single(&self, variation: &Variation) -> Result<Series, ModelError> {
        let mut scene = variation.written_into(&self.scene, |gap| gap.max(0.0));
        scene.output_step = self.step;
        scene.model.integrator = Integrator::DormandPrince853 { tolerance: SINGLE_TOLERANCE };
        let (motion, still) =
            (scene.drive.motion(scene.amplitude_scale), InitialState::at_rest(scene.chain.beads.len()));
        let run = ChainModel.run_with_laws(&scene, self.fitted.as_ref(), motion.as_ref(), &still, &mut |_| true);
        let mut trace = run?.pole_velocity;
        trace.values.resize(self.samples(), trace.values.last().copied().unwrap_or(0.0));
        Ok(trace)
    }
}

/// Displacement (m) and velocity (m/s) of a piston at α = 1, every half step.
fn sampled(drive: &Drive, steps: usize, step: f64) -> Vec<(f64, f64)> {
    let motion = drive.concrete_motion(1.0);
    (0..=2 * steps).map(|half| motion.at(0.5 * half as f64 * step)).collect()
}

/// Displacement (m) and velocity (m/s) of the realisations of a recorded drive, every half step.
fn realisations(drive: &Drive, steps: usize, step: f64) -> Vec<Vec<(Lane, Lane)>> {
    let of = |shakes: &[Series]| {
        let value = |place: usize, i: usize| {
            shakes.get(place).and_then(|shake| shake.values.get(i)).map_or(0.0, |x| drive.amplitude * x)
        };
        let values = (0..shakes[0].len()).map(|i| Lane::of(|place| value(place, i))).collect();
        let grid = (shakes[0].start, shakes[0].step);
        granchain_signal::vectors::widest(Sampling { grid, values, half_step: 0.5 * step, last: 2 * steps })
    };
    drive.shakes().chunks(WIDTH).map(of).collect()
}

/// Realisations, eight side by side, by the spline of [`crate::scene::Motion`].
struct Sampling {
    /// First instant and interval, s.
    grid: (f64, f64),
    values: Vec<Lane>,
    half_step: f64,
    last: usize,
}

impl pulp::NullaryFnOnce for Sampling {
    type Output = Vec<(Lane, Lane)>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let ends = [self.values.first(), self.values.last()]
            .map(|end| if end.is_none_or(|end| *end == Lane::ZERO) { Ends::Natural } else { Ends::Zero });
        let spline = Spline::through(self.grid, &self.values, ends);
        let mut sampled = Vec::with_capacity(self.last + 1);
        for half in 0..=self.last {
            sampled.push(spline.at(half as f64 * self.half_step));
        }
        sampled
    }
}

/// Largest rate of a slipping bead's friction, F_c/(m v_s), over that of steps, at which a step of Runge–Kutta is stable (2.8).
const FASTEST_TURN: f64 = 2.0;

/// tanh by its continued fraction, to 2e-3.
#[inline(always)]
fn hyperbolic_tangent(x: Lane) -> Lane {
    let x = x.at_least(-3.65).at_most(3.65);
    let q = x * x;
    x * ((q + 105.0) * q + 945.0) / ((q * 15.0 + 420.0) * q + 945.0)
}

/// Relative tolerance of runs that go alone: below the error of a lane's fixed step.
const SINGLE_TOLERANCE: f64 = 1e-7;

struct Work {
    beads: usize,
    amplitude_scale: Lane,
    /// Factor of every realisation.
    shaken: Vec<Lane>,
    /// Whether the realisation of every run is the one in its place.
    in_place: bool,
    /// N + 1 contacts each.
    offset: Vec<Lane>,
    /// k of a Hertz contact, K of a spring, the factor of the annulus.
    stiffness: Vec<Lane>,
    damping: [Vec<Lane>; DampingTerm::ALL.len()],
    /// The annulus' law with a factor of 1.
    annulus: AnnulusLane,
    on_spring: OnSpring,
    coupled: CoupledWork,
    /// Least force a pressed contact may have, N: 0, or −∞ where dashpots may pull.
    least_force: f64,
    inverse_mass: Vec<f64>,
    /// 1/v_s, s/m, and F_c, N, where any run rubs.
    rubbing: Option<(f64, Lane)>,
    displacement: Vec<Lane>,
    velocity: Vec<Lane>,
    stage_displacement: Vec<Lane>,
    stage_velocity: Vec<Lane>,
    acceleration: [Vec<Lane>; 3],
    /// The last bead's velocity at the last instants.
    trace: [Lane; HELD],
    /// The same of every run at all instants before.
    pole: [Vec<f64>; WIDTH],
}

const HELD: usize = 16;

impl Work {
    fn new(ensemble: &Ensemble) -> Self {
        let beads = ensemble.inverse_mass.len();
        let contacts = || vec![Lane::ZERO; beads + 1];
        let of_beads = || vec![Lane::ZERO; beads];
        Self {
            beads,
            amplitude_scale: Lane::ZERO,
            shaken: Vec::new(),
            in_place: false,
            offset: contacts(),
            stiffness: contacts(),
            damping: std::array::from_fn(|_| contacts()),
            annulus: AnnulusLane::new(match ensemble.laws[beads] {
                Law::Annulus(law) => law,
                _ => Annulus::new(1.0),
            }),
            on_spring: OnSpring::new(&ensemble.laws[beads]),
            coupled: CoupledWork {
                rigid: contacts(),
                overlap: contacts(),
                force: contacts(),
                coupling: ensemble.coupling.clone().unwrap_or_default(),
            },
            least_force: if ensemble.scene.damping.tension { f64::NEG_INFINITY } else { 0.0 },
            inverse_mass: ensemble.inverse_mass.clone(),
            rubbing: None,
            displacement: of_beads(),
            velocity: of_beads(),
            stage_displacement: of_beads(),
            stage_velocity: of_beads(),
            acceleration: std::array::from_fn(|_| of_beads()),
            trace: [Lane::ZERO; HELD],
            pole: Default::default(),
        }
    }

    /// Put runs into the lanes; places left over repeat the first.
    fn load(&mut self, ensemble: &Ensemble, variations: &[Variation], chunk: &[usize]) {
        let last = self.beads;
        // Where no run of the group shakes, none pays for it.
        let shaken = chunk.iter().any(|index| !variations[*index].shaken.is_empty());
        self.shaken.resize(if shaken { ensemble.scene.drive.shakes().len() } else { 0 }, Lane::ZERO);
        for place in 0..WIDTH {
            let variation = &variations[*chunk.get(place).unwrap_or(&chunk[0])];
            self.amplitude_scale.0[place] = variation.amplitude_scale;
            for (number, shaken) in self.shaken.iter_mut().enumerate() {
                shaken.0[place] = variation.shaken.get(number).copied().unwrap_or(0.0);
            }
            for (contact, gap) in ensemble.scene.gaps().enumerate() {
                let of_support = if contact == last { variation.support_stiffness_factor } else { 1.0 };
                let factor = of_support * ensemble.of_modulus(contact, variation.modulus_factor);
                let law = match ensemble.laws[contact] {
                    Law::Hertz(hertz) => Law::Hertz(Hertz { stiffness: factor * hertz.stiffness }),
                    Law::FiniteHertz(law) => Law::FiniteHertz(FiniteHertz { stiffness: factor * law.stiffness, ..law }),
                    Law::Annulus(annulus) => Law::Annulus(annulus.times(of_support)),
                    Law::Spring(spring) => Law::Spring(Spring { stiffness: of_support * spring.stiffness }),
                    Law::HertzOnSpring(law) => Law::HertzOnSpring(HertzOnSpring {
                        contact: FiniteHertz { stiffness: factor / of_support * law.contact.stiffness, ..law.contact },
                        spring: of_support * law.spring,
                    }),
                };
                self.on_spring.put(place, &law);
                let gap = gap + variation.gap_offsets[contact];
                let force = variation.precompression;
                let coupled = ensemble.coupling.as_ref().map_or(0.0, |coupling| coupling.under(contact, force));
                self.offset[contact].0[place] = law.overlap(force) + coupled - gap;
                self.stiffness[contact].0[place] = match law {
                    Law::Hertz(hertz) => hertz.stiffness,
                    Law::FiniteHertz(law) => law.stiffness,
                    Law::Spring(spring) => spring.stiffness,
                    Law::HertzOnSpring(law) => law.contact.stiffness,
                    Law::Annulus(annulus) => annulus.stiffness_factor(),
                };
                let end = contact == 0 || contact == last;
                let damped = !end || ensemble.scene.damping.placement == DampingPlacement::All;
                for term in DampingTerm::ALL {
                    self.damping[term as usize][contact].0[place] = if damped { variation.damping[term] } else { 0.0 };
                }
            }
        }
        let own = |(number, shaken): (usize, &Lane)| *shaken == Lane::of(|place| f64::from(u8::from(place == number)));
        self.in_place = self.shaken.len() == WIDTH && self.shaken.iter().enumerate().all(own);
        self.rubbing = ensemble.inverse_slip.map(|inverse_slip| {
            let of = |place: usize| variations[*chunk.get(place).unwrap_or(&chunk[0])].effects.friction_force;
            (inverse_slip, Lane::of(|place| of(place).unwrap_or_else(|| ensemble.friction())))
        });
        self.displacement.fill(Lane::ZERO);
        self.velocity.fill(Lane::ZERO);
        self.pole = std::array::from_fn(|_| Vec::with_capacity(ensemble.steps + 1));
    }

    fn unload(&mut self, ensemble: &Ensemble, place: usize) -> Result<Series, ModelError> {
        let broken = |bead: &usize| {
            !(self.displacement[*bead].0[place].is_finite() && self.velocity[*bead].0[place].is_finite())
        };
        if let Some(bead) = (0..self.beads).find(broken) {
            let index = self.pole[place].iter().position(|pole| !pole.is_finite()).unwrap_or(ensemble.steps);
            let time = index as f64 * ensemble.step;
            return Err(ModelError::NonFinite { time, step: ensemble.step, bead: bead + 1 });
        }
        Ok(Series::new(0.0, ensemble.step, std::mem::take(&mut self.pole[place])))
    }

    fn advance<const DAMPED: Terms>(&mut self, ensemble: &Ensemble) {
        let last = match ensemble.laws[self.beads] {
            Law::Hertz(_) | Law::FiniteHertz(_) => Last::Hertz,
            Law::HertzOnSpring(_) => Last::HertzOnSpring,
            Law::Annulus(_) => Last::Annulus,
            Law::Spring(_) => Last::Spring,
        };
        if ensemble.coupling.is_some() {
            granchain_signal::vectors::widest(AllSteps::<DAMPED, true> { work: self, ensemble, last });
        } else {
            granchain_signal::vectors::widest(AllSteps::<DAMPED, false> { work: self, ensemble, last });
        }
    }

    #[inline(always)]
    fn step_through<const DAMPED: Terms, const COUPLED: bool>(&mut self, ensemble: &Ensemble, last: Last) {
        self.trace[0] = self.velocity[self.beads - 1];
        for step in 0..ensemble.steps {
            let drive = [0, 1, 2].map(|half| self.piston(ensemble, 2 * step + half));
            self.stage::<DAMPED, COUPLED, 0>(last, drive[0], ensemble.step);
            self.stage::<DAMPED, COUPLED, 1>(last, drive[1], ensemble.step);
            self.stage::<DAMPED, COUPLED, 2>(last, drive[1], ensemble.step);
            self.stage::<DAMPED, COUPLED, 3>(last, drive[2], ensemble.step);
            self.trace[(step + 1) % HELD] = self.velocity[self.beads - 1];
            if (step + 1) % HELD == HELD - 1 {
                self.unload_trace(HELD);
            }
        }
        self.unload_trace((ensemble.steps + 1) % HELD);
    }

    #[inline(always)]
    fn unload_trace(&mut self, held: usize) {
        for (place, pole) in self.pole.iter_mut().enumerate() {
            pole.extend(self.trace[..held].iter().map(|velocity| velocity.0[place]));
        }
    }

    /// Displacement (m) and velocity (m/s) of the pistons at a half step.
    #[inline(always)]
    fn piston(&self, ensemble: &Ensemble, half: usize) -> (Lane, Lane) {
        let (displacement, velocity) = ensemble.drive[half];
        let mut piston = (self.amplitude_scale * displacement, self.amplitude_scale * velocity);
        if self.in_place {
            let (displacement, velocity) = ensemble.shakes[0][half];
            return (piston.0 + self.amplitude_scale * displacement, piston.1 + self.amplitude_scale * velocity);
        }
        for (shaken, shakes) in self.shaken.chunks(WIDTH).zip(ensemble.shakes.iter()) {
            let (displacement, velocity) = shakes[half];
            for (place, shaken) in shaken.iter().enumerate() {
                let part = self.amplitude_scale * *shaken;
                piston.0 = piston.0 + part * displacement.0[place];
                piston.1 = piston.1 + part * velocity.0[place];
            }
        }
        piston
    }

    /// Accelerations a of stage `STAGE` with the piston at `piston`, at the step's own state or that of the stage, and where they lead from u and v: to the
    /// state of the next stage, u + c v + d a_{STAGE−1} and v + c a_STAGE, or to the end of the step.
    #[inline(always)]
    fn stage<const DAMPED: Terms, const COUPLED: bool, const STAGE: usize>(
        &mut self,
        last: Last,
        piston: (Lane, Lane),
        h: f64,
    ) {
        let beads = self.beads;
        let (u, v) = (&mut self.displacement[..beads], &mut self.velocity[..beads]);
        let (stage_u, stage_v) = (&mut self.stage_displacement[..beads], &mut self.stage_velocity[..beads]);
        let (offset, stiffness) = (&self.offset[..=beads], &self.stiffness[..=beads]);
        let damping: [_; DampingTerm::ALL.len()] = std::array::from_fn(|term| &self.damping[term][..=beads]);
        let [a1, a2, a3] = self.acceleration.each_mut().map(|of_stage| &mut of_stage[..beads]);
        let inverse_mass = &self.inverse_mass[..beads];
        let rubbing = self.rubbing;
        let mut before = piston;
        let mut before_force = Lane::ZERO;
        if COUPLED {
            let u = if STAGE == 0 { &*u } else { &*stage_u };
            self.coupled.settle(last, before.0, u, offset, stiffness, (&self.annulus, &self.on_spring));
        }
        for i in 0..=beads {
            let after = match i {
                _ if i == beads => (Lane::ZERO, Lane::ZERO),
                _ if STAGE == 0 => (u[i], v[i]),
                _ => (stage_u[i], stage_v[i]),
            };
            let overlap = offset[i] + before.0 - after.0;
            let pressed = overlap.at_least(0.0);
            let is_open = !COUPLED && !overlap.above(Lane::ZERO).any();
            let mut force = if is_open {
                Lane::ZERO
            } else if COUPLED {
                self.coupled.force[i]
            } else if i == beads && last == Last::Annulus {
                stiffness[i] * self.annulus.force(pressed)
            } else if i == beads && last == Last::Spring {
                stiffness[i] * pressed
            } else if i == beads && last == Last::HertzOnSpring {
                stiffness[i] * self.on_spring.force(pressed)
            } else {
                stiffness[i] * pressed * pressed.root()
            };
            if DAMPED != 0 && !is_open {
                let rate = before.1 - after.1;
                for term in DampingTerm::ALL {
                    if DAMPED & term.alone() != 0 {
                        force = force + term.resistance(damping[term as usize][i], pressed.root()) * rate;
                    }
                }
                // Overlaps of coupled contacts are below those of the rigid motions wherever both matter.
                force = force.at_least(self.least_force).or_where_not(overlap.above(Lane::ZERO), Lane::ZERO);
            }
            if i > 0 {
                let i = i - 1;
                let mut a = (before_force - force) * inverse_mass[i];
                if let Some((inverse_slip, friction)) = rubbing {
                    a = a - friction * hyperbolic_tangent(before.1 * inverse_slip) * inverse_mass[i];
                }
                match STAGE {
                    0 => (a1[i], stage_u[i], stage_v[i]) = (a, u[i] + v[i] * (0.5 * h), v[i] + a * (0.5 * h)),
                    1 => {
                        stage_u[i] = u[i] + v[i] * (0.5 * h) + a1[i] * (0.25 * h * h);
                        (a2[i], stage_v[i]) = (a, v[i] + a * (0.5 * h));
                    }
                    2 => (a3[i], stage_u[i], stage_v[i]) = (a, u[i] + v[i] * h + a2[i] * (0.5 * h * h), v[i] + a * h),
                    _ => {
                        let middle = a2[i] + a3[i];
                        u[i] = u[i] + v[i] * h + (a1[i] + middle) * (h * h / 6.0);
                        v[i] = v[i] + (a1[i] + middle * 2.0 + a) * (h / 6.0);
                    }
                }
            }
            before_force = force;
            before = after;
        }
    }
}

struct CoupledWork {
    rigid: Vec<Lane>,
    overlap: Vec<Lane>,
    force: Vec<Lane>,
    coupling: Coupling,
}

impl CoupledWork {
    /// Elastic forces with the piston at `piston` and the beads at `u`, as [`Coupling::settle`] has them.
    #[inline(always)]
    fn settle(
        &mut self,
        last: Last,
        piston: Lane,
        u: &[Lane],
        offset: &[Lane],
        stiffness: &[Lane],
        (annulus, on_spring): (&AnnulusLane, &OnSpring),
    ) {
        let beads = u.len();
        let (rigid, overlap) = (&mut self.rigid[..=beads], &mut self.overlap[..=beads]);
        let (force, offset, stiffness) = (&mut self.force[..=beads], &offset[..=beads], &stiffness[..=beads]);
        let (first, second) = (&self.coupling.first[..=beads], &self.coupling.second[..=beads]);
        let (to_before, to_after) = (&self.coupling.before[..=beads], &self.coupling.after[..=beads]);
        let mut before = piston;
        for i in 0..=beads {
            let after = if i < beads { u[i] } else { Lane::ZERO };
            rigid[i] = offset[i] + before - after;
            overlap[i] = rigid[i];
            before = after;
        }
        for insertion in 0..=INSERTIONS {
            for i in 0..=beads {
                let pressed = overlap[i].at_least(0.0);
                force[i] = if i == beads && last == Last::Annulus {
                    stiffness[i] * annulus.force(pressed)
                } else if i == beads && last == Last::Spring {
                    stiffness[i] * pressed
                } else if i == beads && last == Last::HertzOnSpring {
                    stiffness[i] * on_spring.force(pressed)
                } else {
                    let root = pressed.root();
                    stiffness[i] * pressed * root * (root * first[i] + pressed * second[i] + 1.0)
                };
            }
            if insertion == INSERTIONS {
                break;
            }
            let mut behind = Lane::ZERO;
            for i in 0..=beads {
                let next = if i < beads { force[i + 1] } else { Lane::ZERO };
                overlap[i] = rigid[i] - behind * to_before[i] - next * to_after[i];
                behind = force[i];
            }
        }
    }
}

struct AllSteps<'a, const DAMPED: Terms, const COUPLED: bool> {
    work: &'a mut Work,
    ensemble: &'a Ensemble,
    last: Last,
}

impl<const DAMPED: Terms, const COUPLED: bool> pulp::NullaryFnOnce for AllSteps<'_, DAMPED, COUPLED> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.work.step_through::<DAMPED, COUPLED>(self.ensemble, self.last);
    }
}
