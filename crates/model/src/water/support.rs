//! A scene's disc and water, made ready once, and the scene's chain run against them.
//!
//! The disc is meshed, its modes and the water's kernels or factor found once; a run begins from a copy at rest. By the Rayleigh integral a run
//! is stepped: 8 coordinates and 53 instants of memory cost less than the sum over all past forces. By elements the answer to a unit
//! force is recorded once over the scene's duration ([`UnitResponse`]) and a run sums over it; a longer run is stepped.
//!
//! A dashpot at the disc makes the contact force jump when a bead touches. Such a jump has no upper frequency, and what it would excite in a disc
//! of fine shapes, above 5 MHz, is of the dashpot and of the mesh. The disc then moves in its modes below 2.5 MHz, at least four, and is
//! static above ([`DiscContact::modal`], [`DiscOnWater::in_modes`]).

use std::sync::OnceLock;

use super::{
    OnWater, UnitResponse, Water,
    chain::{ChainOnWaterError, Moment, integrate_on_disc},
    contact::DiscContact,
    disc::{Disc, DiscMesh, DiscModes, PATCH},
    elements::{DiscOnWater, DiscOnWaterSettings},
    error::WaterError,
    front::WaterRecord,
    rayleigh::{field::FieldPoint, motion::WetDisc},
};
use crate::{
    ModelError, Progress,
    attached::Attached,
    contact_law::dashpots,
    response::{EnergyBalance, ObservedPoint, Recorder, Response, SolverWork, push},
    scene::{
        Baffle, Bead, ContactLaw, DiscShape, Integrator, MaterialLoss, PistonMotion, Rim, Scene, WaterMethod,
        WaterSettings,
    },
};
use granchain_signal::{Dimension, Quantity};

/// Fewest and most modes of a disc on the water, and the frequency (Hz) up to which it has all.
const MODES: (usize, usize, f64) = (4, 64, 2.5e6);
/// Steps between reports to the caller.
const REPORT: usize = 4096;
/// Highest harmonic of the drive that a source of ultrasound is looked at for: 0.95 MHz at 73 kHz.
const BAND: f64 = 13.0;
/// Acoustic elements a wavelength and steps a period where pressure is off by about 0.6 %.
const RESOLVED: (f64, f64) = (15.0, 20.0);

/// A disc and what is behind it, ready for any number of runs of a chain in front.
#[derive(Debug)]
pub(crate) struct DiscSupport {
    disc: Disc,
    patch: f64,
    water: Option<WaterSettings>,
    step: f64,
    /// Steps of the scene it was made for.
    steps: usize,
    /// At rest, with all its shapes.
    full: OnceLock<Box<(Ready, DiscContact)>>,
    /// At rest, in its modes only, for a dashpot at the disc.
    modal: OnceLock<Box<(Ready, DiscContact)>>,
}

/// A disc at rest, ready to be run.
#[derive(Debug)]
enum Ready {
    Rayleigh(Box<WetDisc>),
    Elements { disc: Box<DiscOnWater>, recorded: UnitResponse },
}

fn clock(scene: &Scene) -> Result<f64, ModelError> {
    let unsupported = |reason: &str| ModelError::Unsupported { model: "chain", reason: reason.into() };
    if scene.contact_law == ContactLaw::FiniteBody {
        return Err(unsupported(
            "`contact.law = \"finite-body\"` in front of a disc: the fitted laws feel each other through the beads, which the fixed step does \
             not solve; use \"hertz\"",
        ));
    }
    match scene.model.integrator {
        Integrator::OnDisc { step } => Ok(step),
        Integrator::DormandPrince853 { .. } => {
            Err(unsupported("a disc has a clock of fixed step; set `model.integrator = \"symplectic\"`"))
        }
    }
}

impl DiscSupport {
    /// Mesh the disc of a scene and make it ready for runs as long as the scene's.
    pub(crate) fn new(scene: &Scene) -> Result<Self, ModelError> {
        let Some((shape, mesh_density)) = scene.support.disc() else {
            let reason = "the scene has no disc; set `support.kind = \"disc\"`".into();
            return Err(ModelError::Unsupported { model: "chain", reason });
        };
        let step = clock(scene)?;
        let disc = Disc::new(shape, &disc_mesh(shape, mesh_density)).map_err(WaterError::from)?;
        let patch = PATCH * shape.thickness;
        let (water, steps) = (scene.water.clone(), instants(scene, step));
        let made = Self { disc, patch, water, step, steps, full: OnceLock::new(), modal: OnceLock::new() };
        made.at_rest(scene)?;
        Ok(made)
    }

    /// A disc at rest and its contact, made at the first call for this placement of the dashpots.
    fn at_rest(&self, scene: &Scene) -> Result<&(Ready, DiscContact), ModelError> {
        let is_damped = is_damped_at_disc(scene);
        let kept = if is_damped { &self.modal } else { &self.full };
        if let Some(found) = kept.get() {
            return Ok(found);
        }
        let count = modes_of(&self.disc)?;
        let modes =
            if is_damped { self.disc.modes_on_patch(count, self.patch) } else { self.disc.basis(count, self.patch) };
        let modes = modes.map_err(WaterError::from)?;
        let bead = &scene.chain.beads[scene.chain.beads.len() - 1];
        let contact = if is_damped {
            DiscContact::modal(bead, &self.disc, &modes)
        } else {
            DiscContact::new(bead, &self.disc, self.patch)
        };
        let contact = contact.map_err(WaterError::from)?;
        let ready = match self.water.as_ref().map(|water| (water, water.method)) {
            Some((water, WaterMethod::Elements(mesh))) => {
                let settings = DiscOnWaterSettings::of(water, mesh, self.patch, self.step);
                let disc = DiscOnWater::made(&self.disc, &settings, is_damped.then_some(count));
                let disc = disc.map_err(WaterError::from)?;
                let recorded = UnitResponse::record(disc.clone(), settings.points.len(), self.steps + 1);
                Ready::Elements { disc: Box::new(disc), recorded }
            }
            other => {
                let vacuum = Water { density: 0.0, ..Water::fresh() };
                let liquid = other.map_or(vacuum, |(water, _)| water.liquid);
                let radius = self.disc.shape().radius;
                let wet = WetDisc::new(radius, &modes, &liquid, self.points(), self.step);
                Ready::Rayleigh(Box::new(wet.map_err(WaterError::from)?))
            }
        };
        Ok(kept.get_or_init(|| Box::new((ready, contact))))
    }

    fn points(&self) -> &[FieldPoint] {
        self.water.as_ref().map_or(&[], |water| &water.field_points)
    }

    /// Run a scene with this disc and water.
    pub(crate) fn run(
        &self,
        scene: &Scene,
        motion: &dyn PistonMotion,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        refuse_losses(scene)?;
        let step = clock(scene)?;
        if step != self.step {
            return Err(ModelError::OtherBodies { part: "model.step" });
        }
        let preload = scene.chain.precompression;
        if preload > 0.0 && self.disc.shape().rim == Rim::Free {
            return Err(WaterError::from(ChainOnWaterError::FreeUnderForce { force: preload }).into());
        }
        let (ready, contact) = self.at_rest(scene)?;
        match ready {
            Ready::Rayleigh(wet) => self.respond(scene, motion, contact, &mut (**wet).clone(), true, progress),
            Ready::Elements { disc, recorded } if instants(scene, step) < recorded.pole.len() => {
                let mut response = self.respond(scene, motion, contact, &mut recorded.played(), false, progress)?;
                let (solid, liquid, _) = disc.size();
                response.work.unknowns += (solid + liquid) as u64;
                response.work.acoustic_unknowns = liquid as u64;
                Ok(response)
            }
            Ready::Elements { disc, .. } => self.respond(scene, motion, contact, &mut (**disc).clone(), true, progress),
        }
    }

    /// `knows_disc`: whether energy in the disc and work on the water are known apart.
    fn respond(
        &self,
        scene: &Scene,
        motion: &dyn PistonMotion,
        contact: &DiscContact,
        disc: &mut dyn OnWater,
        knows_disc: bool,
        progress: Progress<'_>,
    ) -> Result<Response, ModelError> {
        let count = scene.chain.beads.len();
        let steps = instants(scene, self.step);
        let every = ((scene.output_step / self.step).round() as usize).max(1);
        let samples = steps / every + 1;
        let mut columns = Recorder::new(samples, count, false);
        let mut water_record = WaterRecord::new(self.water.as_ref(), samples);
        let preload = scene.chain.precompression;
        let masses: Vec<f64> = scene.chain.beads.iter().map(Bead::mass).collect();
        let attached = Attached::of(scene, &masses, self.step);
        let totals = integrate_on_disc(scene, &attached, motion, contact, disc, steps, &mut |moment: &Moment<'_>| {
            if moment.instant.is_multiple_of(every) {
                columns.piston.push(moment.displacement[0]);
                push(&mut columns.displacement, moment.displacement[1..].iter().copied());
                push(&mut columns.velocity, moment.velocity[1..].iter().copied());
                push(&mut columns.force, moment.force.iter().copied());
                water_record.sample(moment.disc);
            }
            !moment.instant.is_multiple_of(REPORT) || progress(moment.time)
        })
        .map_err(WaterError::from)?;

        let mut work = SolverWork {
            unknowns: 2 * count as u64,
            steps: steps as u64,
            events: totals.events,
            dashpot_evaluations: totals.dashpots,
            horn_evaluations: totals.horn,
            holder_evaluations: totals.holder,
            ..SolverWork::default()
        };
        disc.count(&mut work);
        // What a static force and the motion since do together.
        let disc_j = disc.energy() + preload * disc.pole_displacement();
        let (disc_j, water_j) = match knows_disc {
            true => (Some(disc_j), disc.work_on_water()),
            false => (None, disc.work_on_water() + preload * disc.pole_displacement()),
        };
        let balance = totals.balance;
        let chain_j = balance.kinetic + balance.stored + balance.dissipated;
        let held = chain_j + disc_j.unwrap_or(0.0) + water_j + balance.lost();
        let residual_j = balance.initial + balance.piston_work - held;
        let energy = EnergyBalance { disc_j, water_j: Some(water_j), residual_j, ..balance.balance() };
        let mut response = columns.response(scene.output_step, None, ObservedPoint::Pole, energy, work);
        water_record.enter(self.disc.shape(), self.water.as_ref(), &mut response);
        Ok(response)
    }

    pub(crate) fn warnings(&self, scene_frequency: f64, response: &Response) -> Vec<String> {
        let mut out = Vec::new();
        let time = |value: f64| Quantity::new((value * 1e10).round() / 1e10, Dimension::TIME);
        if let Some(force) = response.contact_force.last()
            && self.disc.shape().rim == Rim::Free
            && let Some(touched) = force.values.iter().rposition(|force| *force > 0.0)
            && touched + 1 < force.len()
        {
            out.push(format!(
                "the free disc has drifted off: the last bead touched it for the last time at {} of {}; `disc.rim` holds it",
                time(force.time(touched)),
                time(force.end())
            ));
        }
        let frequency = |value: f64| Quantity::new((value * 1e-3).round() * 1e3, Dimension::FREQUENCY);
        let band = BAND * scene_frequency;
        let mut resolve = |limit: f64, what: &str, key: &str| {
            if limit < band {
                out.push(format!(
                    "{what} resolves sound up to {} within about 0.6 %, short of {BAND} times the drive, {}; lower `{key}`",
                    frequency(limit),
                    frequency(band)
                ));
            }
        };
        resolve(1.0 / (RESOLVED.1 * self.step), "the step", "model.step");
        let Some(water) = &self.water else { return out };
        if let WaterMethod::Elements(mesh) = water.method {
            resolve(water.liquid.sound_speed / (RESOLVED.0 * mesh.side), "the mesh of the water", "water.mesh_side");
            if water.baffle == Baffle::Soft {
                let edge = |point: &&FieldPoint| point.distance.hypot(point.radius - self.disc.shape().radius);
                for point in water.field_points.iter().filter(|point| edge(point) < 4.0 * mesh.side) {
                    out.push(format!(
                        "the field point {point} lies within four elements of the disc's edge, where the pressure beside a soft baffle is \
                         singular; refine `water.mesh_side` or go farther"
                    ));
                }
            }
        }
        out
    }
}

fn refuse_losses(scene: &Scene) -> Result<(), ModelError> {
    let key = match scene.loss {
        MaterialLoss { relaxation: Some(_), .. } => "loss.relaxation",
        MaterialLoss { support, .. } if support > 0.0 => "loss.support",
        MaterialLoss { beads, .. } if beads > 0.0 => "loss.beads",
        _ if scene.yield_strength.is_some() => "contact.yield_strength",
        _ => return Ok(()),
    };
    let remedy = if key == "contact.yield_strength" {
        "its contacts before a disc are elastic; leave it out, or take another support"
    } else if key == "loss.beads" {
        "its beads are rigid; take `model.kind = \"reduced\"` or \"fea\""
    } else {
        "a disc has no such loss; leave it out"
    };
    Err(ModelError::Unsupported { model: "chain", reason: format!("`{key}`: {remedy}") })
}

fn instants(scene: &Scene, step: f64) -> usize {
    let every = (scene.output_step / step).round().max(1.0) as usize;
    (scene.samples() - 1) * every
}

pub(super) fn is_damped_at_disc(scene: &Scene) -> bool {
    dashpots(&scene.damping, scene.chain.beads.len() + 1).last().is_some_and(|dashpot| !dashpot.is_absent())
}

pub(super) fn disc_mesh(shape: &DiscShape, density: u32) -> DiscMesh {
    let radial = (4.0 / 3.0 * f64::from(density) * shape.radius / shape.thickness - 1e-9).ceil().max(1.0);
    DiscMesh { radial: radial as usize, through: density as usize, pole_side: None }
}

/// How many modes reach the frequency that the disc is to have all of.
pub(super) fn modes_of(disc: &Disc) -> Result<usize, ModelError> {
    let (fewest, most, reached) = MODES;
    let mut count = fewest;
    while count < most {
        let modes: DiscModes = disc.modes(count).map_err(WaterError::from)?;
        if modes.frequencies.last().is_some_and(|highest| *highest >= reached) {
            break;
        }
        count = (2 * count).min(most);
    }
    Ok(count)
}
