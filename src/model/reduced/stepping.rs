//! Kick, drift, kick.

use super::basis::Basis;
use crate::{
    model::{
        ModelError, Progress,
        contact_law::dashpots,
        fea::{
            FeaError,
            arrangement::Arrangement,
            contact::chain::{ContactState, Contacts, Mobility, RigidPrediction, Workspace, net_force},
            control::Cause,
            energy::Ledger,
            equilibrium::Rest,
            operator::{Interfaces, condensed},
            trace::{Sampling, Watched, central_velocity, contact_radius},
        },
    },
    response::Response,
    scene::{ContactNormal, PistonMotion, Scene, Support},
    signal::Series,
};

/// Largest ω h of a mode that is kept, rad.
pub const LARGEST_PHASE: f64 = 2.0;

/// One body in motion.
#[derive(Debug, Clone)]
struct Moving {
    kind: usize,
    rigid: f64,
    rigid_velocity: f64,
    modal: Vec<f64>,
    modal_velocity: Vec<f64>,
    /// Modal masses μ.
    masses: Vec<f64>,
    /// Forces on, and displacements of, the interface unknowns.
    forces: Vec<f64>,
    interface: Vec<f64>,
    /// Rigid displacement of the last drift, m.
    travelled: f64,
}

/// The bodies of a scene reduced to their interfaces and modes.
#[derive(Debug)]
pub struct Reduction {
    arrangement: Arrangement,
    interfaces: Interfaces,
    bases: Vec<Basis>,
    watched: Watched,
}

/// What one run adds to the bodies.
struct Stepper<'a> {
    arrangement: Arrangement,
    interfaces: &'a Interfaces,
    bases: Vec<Basis>,
    residuals: Vec<Vec<f64>>,
    contacts: Contacts,
    workspace: Workspace,
    sampling: Sampling,
    drive: &'a dyn PistonMotion,
    rest_gaps: Vec<Vec<f64>>,
    rest_overlaps: Vec<f64>,
    start: Vec<ContactState>,
    watched: &'a Watched,
}

impl Reduction {
    /// Mesh and reduce the bodies of a scene to at most `model.modes` elastic modes each.
    ///
    /// # Errors
    /// [`ModelError`]: no mesh, no factor, modes that could not be confirmed, or a support the model does not have.
    pub fn new(scene: &Scene) -> Result<Self, ModelError> {
        if let Support::Annulus { normal, .. } | Support::Body { normal, .. } = &scene.support
            && *normal == ContactNormal::Moving
        {
            let reason = "`support.normal = \"moving\"` needs contacts that turn: use \"fixed\", whose force is too large by \
                 0.19 % per um of travel, or `model.kind = \"fea\"`";
            return Err(ModelError::Unsupported { model: "reduced", reason: reason.into() });
        }
        let arrangement = Arrangement::new(scene)?;
        let watched = Watched::new(&arrangement);
        let last = arrangement.beads.len() - 1;
        let interfaces = Interfaces::including(&arrangement, |kind| {
            let mut unknowns = Vec::new();
            for (bead, _) in arrangement.beads.iter().enumerate().filter(|(_, own)| **own == kind) {
                unknowns.push(watched.centres[bead]);
                if bead == last {
                    unknowns.push(watched.pole);
                }
            }
            unknowns
        });
        let modes = scene.model.reduced.modes as usize;
        let bases = (0..arrangement.kinds.len())
            .map(|kind| Basis::new(&arrangement, kind, &interfaces.unknowns[kind], modes))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { arrangement, interfaces, bases, watched })
    }

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
        if let Some(file) = scene.pending_record() {
            let reason =
                format!("the drive record {} has not been read; hand it over with `with_drive_record`", file.display());
            return Err(ModelError::Unsupported { model: "reduced", reason });
        }
        Stepper::new(self, scene, motion)?.run(progress)
    }
}

impl<'a> Stepper<'a> {
    fn new(reduction: &'a Reduction, scene: &Scene, drive: &'a dyn PistonMotion) -> Result<Self, FeaError> {
        let Reduction { interfaces, watched, .. } = reduction;
        let mut arrangement = reduction.arrangement.clone();
        arrangement.spring = if let Support::Spring { stiffness } = scene.support { stiffness } else { f64::INFINITY };
        arrangement.dashpots = dashpots(&scene.damping, arrangement.contacts.len());
        let sampling = Sampling::new(scene, scene.model.reduced.step);
        let step = sampling.step();
        let bases: Vec<Basis> = reduction.bases.iter().map(|basis| basis.below(LARGEST_PHASE / step)).collect();
        let residuals: Vec<Vec<f64>> = bases.iter().map(Basis::residual).collect();
        let (links, compliances, couplings) = condensed(&arrangement, interfaces, &residuals, 1.0)?;
        let mobilities = (0..arrangement.beads.len() + 2)
            .map(|slot| match arrangement.kind(slot).map(|kind| &bases[kind]) {
                Some(basis) if basis.is_free => Mobility { displacement: 0.0, velocity: 0.5 * step / basis.mass },
                _ => Mobility::default(),
            })
            .collect();
        let contacts = Contacts { links, compliances, couplings, mobilities, tension: scene.damping.tension };
        let Rest { contacts: start, gaps: rest_gaps, overlaps: rest_overlaps, .. } =
            Rest::new(&arrangement, interfaces, &scene.chain)?;
        Ok(Self {
            workspace: Workspace::new(&contacts),
            drive,
            arrangement,
            interfaces,
            bases,
            residuals,
            contacts,
            sampling,
            rest_gaps,
            rest_overlaps,
            start,
            watched,
        })
    }

    /// Slot and row among its interface unknowns of every bead's centre, and of the far pole.
    fn watched_rows(&self) -> Vec<(usize, usize)> {
        let row = |slot: usize, unknown: u32| {
            let kind = self.arrangement.kind(slot).unwrap_or(0);
            (slot, self.interfaces.unknowns[kind].binary_search(&unknown).unwrap_or(0))
        };
        let mut rows: Vec<_> = self.watched.centres.iter().enumerate().map(|(bead, &u)| row(bead + 1, u)).collect();
        rows.push(row(self.watched.centres.len(), self.watched.pole));
        rows
    }

    /// Run to the scene's duration.
    ///
    /// # Errors
    /// [`ModelError`] when a step had no solution, or the caller stopped the run.
    fn run(&mut self, progress: Progress<'_>) -> Result<Response, ModelError> {
        let watched = self.watched_rows();
        let Self { arrangement, interfaces, bases, residuals, contacts, workspace, .. } = self;
        let (h, count) = (self.sampling.step(), arrangement.beads.len());
        let mut bodies: Vec<Option<Moving>> = (0..count + 2)
            .map(|slot| arrangement.kind(slot).map(|kind| Moving::at_rest(kind, &bases[kind], h)))
            .collect();
        let mut states = self.start.clone();
        let mut before = states.clone();
        let mut gaps = self.rest_gaps.clone();
        let mut rigid = vec![RigidPrediction::default(); count + 2];
        let mut ledger = Ledger::new(0.0);
        let columns = |count: usize| vec![Vec::with_capacity(self.sampling.samples); count];
        let mut trace = Record {
            piston: Vec::with_capacity(self.sampling.samples),
            centre: vec![Vec::with_capacity(self.sampling.steps() + 1); count + 1],
            watched,
            force: columns(count + 1),
            radius: columns(count + 1),
        };
        for (slot, body) in bodies.iter_mut().enumerate() {
            if let Some(body) = body {
                body.press(slot, interfaces, &states);
                body.settle(&bases[body.kind]);
            }
        }
        let mut piston = self.drive.at(0.0).0;
        ledger.begin(energy(&bodies, bases, residuals, arrangement, &states));
        trace.follow(&bodies, residuals);
        trace.sample(piston, arrangement, &states);
        for taken in 1..=self.sampling.steps() {
            let time = taken as f64 * h;
            before.clone_from(&states);
            for (slot, body) in bodies.iter_mut().enumerate() {
                let Some(body) = body else { continue };
                let basis = &bases[body.kind];
                body.kick(basis, net_force(&states, slot, ContactState::total), h);
                body.drift(h);
                rigid[slot] = RigidPrediction { displacement: body.rigid, velocity: body.rigid_velocity };
                basis.displace(body.rigid, &body.modal, &mut body.interface);
            }
            let (position, velocity) = self.drive.at(time);
            rigid[0] = RigidPrediction { displacement: position, velocity };
            let value = |slot: usize, row: usize| bodies[slot].as_ref().map(|body| body.interface[row]);
            interfaces.gaps(&self.rest_gaps, &contacts.links, position, value, &mut gaps);
            let effort = contacts
                .solve(&gaps, &rigid, &self.rest_overlaps, &mut states, workspace)
                .map_err(Cause::of)
                .map_err(|(cause, at)| FeaError::StepGivenUp { time: time - h, step: h, contact: at + 1, cause })?;
            ledger.work.contact_sweeps += u64::from(effort.sweeps);
            ledger.work.active_sets += u64::from(effort.sets);
            let mut dissipated = 0.0;
            for (slot, body) in bodies.iter_mut().enumerate() {
                let Some(body) = body else { continue };
                body.press(slot, interfaces, &states);
                body.kick(&bases[body.kind], net_force(&states, slot, ContactState::total), h);
                if !body.rigid.is_finite() {
                    return Err(ModelError::NonFinite { time, step: h, bead: slot });
                }
            }
            let moved = |slot: usize| match slot {
                0 => position - piston,
                slot => bodies[slot].as_ref().map_or(0.0, |body| body.travelled),
            };
            for contact in 0..=count {
                let force = states[contact].damping + before[contact].damping;
                if force != 0.0 {
                    dissipated += 0.5 * force * (moved(contact) - moved(contact + 1));
                }
            }
            ledger.step(0.5 * (states[0].total() + before[0].total()) * (position - piston), dissipated, 0.0);
            ledger.work.steps += 1;
            piston = position;
            trace.follow(&bodies, residuals);
            if taken % self.sampling.steps_per_sample == 0 {
                trace.sample(piston, arrangement, &states);
                ledger.sample(energy(&bodies, bases, residuals, arrangement, &states));
                if !progress(time) {
                    return Err(ModelError::Stopped { time });
                }
            }
        }
        ledger.work.unknowns = bodies.iter().flatten().map(|body| 1 + body.modal.len() as u64).sum();
        Ok(trace.response(&self.sampling, &ledger))
    }
}

impl Moving {
    fn at_rest(kind: usize, basis: &Basis, step: f64) -> Self {
        let modes = basis.stiffness.len();
        let masses = basis.stiffness.iter().map(|square| {
            let half = 0.5 * square.sqrt() * step;
            (half / half.sin()).powi(2)
        });
        Self {
            kind,
            rigid: 0.0,
            rigid_velocity: 0.0,
            modal: vec![0.0; modes],
            modal_velocity: vec![0.0; modes],
            masses: masses.collect(),
            forces: vec![0.0; basis.axial.len()],
            interface: vec![0.0; basis.axial.len()],
            travelled: 0.0,
        }
    }

    /// Take the forces of the contacts around its slot.
    fn press(&mut self, slot: usize, interfaces: &Interfaces, states: &[ContactState]) {
        interfaces.press(slot, |contact| Some(&states.get(contact)?.forces), &mut self.forces);
    }

    /// Bend the modes to the forces at rest.
    fn settle(&mut self, basis: &Basis) {
        for ((q, shape), square) in self.modal.iter_mut().zip(&basis.shapes).zip(&basis.stiffness) {
            *q = dot(shape, &self.forces) / square;
        }
        basis.displace(self.rigid, &self.modal, &mut self.interface);
    }

    /// Half a step of velocity.
    fn kick(&mut self, basis: &Basis, net: f64, step: f64) {
        if basis.is_free {
            self.rigid_velocity += 0.5 * step * net / basis.mass;
        }
        for (k, velocity) in self.modal_velocity.iter_mut().enumerate() {
            let force = dot(&basis.shapes[k], &self.forces) - basis.stiffness[k] * self.modal[k];
            *velocity += 0.5 * step * force / self.masses[k];
        }
    }

    /// A step of displacement.
    fn drift(&mut self, step: f64) {
        self.travelled = step * self.rigid_velocity;
        self.rigid += self.travelled;
        self.modal.iter_mut().zip(&self.modal_velocity).for_each(|(q, velocity)| *q += step * velocity);
    }
}

/// Kinetic and stored energy, J.
fn energy(
    bodies: &[Option<Moving>],
    bases: &[Basis],
    residuals: &[Vec<f64>],
    arrangement: &Arrangement,
    states: &[ContactState],
) -> (f64, f64) {
    let (mut kinetic, mut stored) = (0.0, 0.0);
    for body in bodies.iter().flatten() {
        let basis = &bases[body.kind];
        if basis.is_free {
            kinetic += 0.5 * basis.mass * body.rigid_velocity.powi(2);
        }
        for (k, velocity) in body.modal_velocity.iter().enumerate() {
            kinetic += 0.5 * body.masses[k] * velocity * velocity;
            stored += 0.5 * basis.stiffness[k] * body.modal[k].powi(2);
        }
        let size = body.forces.len();
        stored += 0.5
            * residuals[body.kind]
                .chunks_exact(size)
                .zip(&body.forces)
                .map(|(row, f)| f * dot(row, &body.forces))
                .sum::<f64>();
    }
    let force = states.last().map_or(0.0, |state| state.pressing);
    (kinetic, stored + arrangement.spring_energy(force))
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// What is recorded.
struct Record {
    piston: Vec<f64>,
    /// Displacement of every bead's centre and of the far pole at every step, m.
    centre: Vec<Vec<f64>>,
    watched: Vec<(usize, usize)>,
    force: Vec<Vec<f64>>,
    radius: Vec<Vec<f64>>,
}

impl Record {
    fn follow(&mut self, bodies: &[Option<Moving>], residuals: &[Vec<f64>]) {
        for (column, &(slot, row)) in self.centre.iter_mut().zip(&self.watched) {
            if let Some(body) = &bodies[slot] {
                let size = body.forces.len();
                let bent = dot(&residuals[body.kind][row * size..(row + 1) * size], &body.forces);
                column.push(body.interface[row] + bent);
            }
        }
    }

    fn sample(&mut self, piston: f64, arrangement: &Arrangement, states: &[ContactState]) {
        self.piston.push(piston);
        for (contact, state) in states.iter().enumerate() {
            self.force[contact].push(state.total());
            self.radius[contact].push(contact_radius(&arrangement.pairs[arrangement.contacts[contact]], state));
        }
    }

    /// The response; velocities are central differences of the displacements over two steps.
    fn response(&self, sampling: &Sampling, ledger: &Ledger) -> Response {
        let series = |values: Vec<f64>| Series::new(0.0, sampling.output_step, values);
        let samples = self.piston.len();
        let velocity = |steps: &Vec<f64>| series(central_velocity(steps, sampling, samples));
        let beads = self.centre.len() - 1;
        Response {
            piston_displacement: series(self.piston.clone()),
            bead_displacement: self.centre[..beads]
                .iter()
                .map(|steps| series(steps.iter().step_by(sampling.steps_per_sample).copied().collect()))
                .collect(),
            bead_velocity: self.centre[..beads].iter().map(velocity).collect(),
            pole_velocity: velocity(&self.centre[beads]),
            contact_force: self.force.iter().map(|values| series(values.clone())).collect(),
            contact_radius: Some(self.radius.iter().map(|values| series(values.clone())).collect()),
            energy: ledger.books(),
            work: ledger.work,
        }
    }
}
