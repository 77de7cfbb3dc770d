//! The disc on the water, one factor for both.

use super::{
    Baffle, ElementsError, Hemisphere, Water, WaterMesh,
    factor::QuasiDefinite,
    sparse::{Entries, Sparse},
    waves::Waves,
};
use crate::{
    fea::assembly::{Columns, Direction, DofMap},
    number::dot,
    response::SolverWork,
    scene::WaterSettings,
    water::{OnWater, contact::DASHPOT_MODES, disc::Disc, front::TouchedDisc, rayleigh::field::FieldPoint},
};

#[derive(Debug, Clone, PartialEq)]
pub struct DiscOnWaterSettings {
    pub water: Water,
    pub baffle: Baffle,
    pub mesh: WaterMesh,
    pub points: Vec<FieldPoint>,
    /// Radius of the patch over which the contact force is spread and the displacement of the front averaged, m; 0 is the pole's node. Either
    /// way the displacement holds an indentation that belongs to the contact law: C_s − [`Disc::flexibility`] of the patch puts it right.
    pub patch: f64,
    /// Step Δ, s.
    pub step: f64,
}

impl DiscOnWaterSettings {
    /// Of the water of a scene on that mesh, with its field points.
    pub(in crate::water) fn of(water: &WaterSettings, mesh: WaterMesh, patch: f64, step: f64) -> Self {
        let points = water.field_points.clone();
        Self { water: water.liquid, baffle: water.baffle, mesh, points, patch, step }
    }
}

#[derive(Debug, Clone)]
pub struct DiscOnWater {
    disc: Disc,
    waves: Waves,
    factor: QuasiDefinite,
    /// Rows by unknown u of the factor, columns ψ: A.
    coupling: Sparse,
    /// Where forces act: on the patch, or at the points of a contact.
    points: Vec<Point>,
    /// What a unit force at the end of a step moves there until then, row by row, m/N.
    compliance: Vec<f64>,
    /// Weights of the modal velocity, by the body's unknowns ([`Disc::modal_weights`]); none at the points of a contact.
    modal: Vec<f64>,
    step: f64,
    /// By free unknown, m.
    displacement: Vec<f64>,
    /// By the body's unknowns, m/s.
    velocity: Columns,
    image: Columns,
    /// The displacement by the body's unknowns, for its energy; fixed ones stay 0.
    spread: Columns,
    /// What is known of the disc's rows before a step but for the force, 2M u̇/Δ − K u, N.
    known: Vec<f64>,
    /// At the points at the last instant, N.
    forces: Vec<f64>,
    solution: Vec<f64>,
    work: f64,
    solves: u64,
}

/// A displacement along z that is measured, and along which a force acts.
#[derive(Debug, Clone)]
struct Point {
    terms: Vec<(u32, f64)>,
    /// Rates of all unknowns for a unit force.
    answer: Vec<f64>,
}

impl Point {
    fn along(&self, values: &[f64]) -> f64 {
        self.terms.iter().map(|&(place, weight)| weight * values[place as usize]).sum()
    }
}

impl DiscOnWater {
    /// Pushed in its `modes` lowest modes only, or in all its shapes.
    pub(in crate::water) fn made(
        disc: &Disc,
        settings: &DiscOnWaterSettings,
        modes: Option<usize>,
    ) -> Result<Self, ElementsError> {
        match modes {
            Some(count) => Self::in_modes(disc.clone(), settings, count),
            None => Self::new(disc.clone(), settings),
        }
    }

    pub fn new(disc: Disc, settings: &DiscOnWaterSettings) -> Result<Self, ElementsError> {
        let load = disc.patch_load(settings.patch);
        let terms = (0_u32..).zip(load).filter(|&(_, share)| share != 0.0).collect();
        let modal = disc.modal_weights(DASHPOT_MODES, settings.patch).map_err(Box::new)?;
        Ok(Self { modal, ..Self::touched(disc, settings, &[terms])? })
    }

    /// As [`DiscOnWater::new`], pushed in its `count` lowest modes only: the force is spread as M Σ φ_k φ_k(0), and the displacement of the pole is
    /// that in these modes. Whatever the force does within a step, the disc's fine shapes do not answer; the water may still move them.
    fn in_modes(disc: Disc, settings: &DiscOnWaterSettings, count: usize) -> Result<Self, ElementsError> {
        let modal = disc.modal_weights(count, settings.patch).map_err(Box::new)?;
        let terms = (0_u32..).zip(modal.iter().copied()).filter(|&(_, share)| share != 0.0).collect();
        Ok(Self { modal, ..Self::touched(disc, settings, &[terms])? })
    }

    /// Disc and water at rest, forces at several points: displacements along z as sums over unknowns of the disc.
    pub(in crate::water) fn touched(
        disc: Disc,
        settings: &DiscOnWaterSettings,
        touched: &[Vec<(u32, f64)>],
    ) -> Result<Self, ElementsError> {
        let DiscOnWaterSettings { water, baffle, mesh, points, step, .. } = settings;
        let waves = Waves::new(disc.shape().radius, mesh, *water, *baffle, points, *step)?;
        let dofs = disc.body().dofs();
        let mut place = vec![super::assembly::NOWHERE; dofs.len()];
        for (number, &dof) in (0_u32..).zip(dofs.free()) {
            place[dof as usize] = number;
        }
        let solid = dofs.free().len();

        let half = 0.5 * step;
        let mut entries = Entries::new();
        for (column, &own) in place.iter().enumerate() {
            let (rows, values) = disc.body().stiffness().column(column);
            entries.extend(rows.iter().zip(values).map(|(&row, value)| (own, place[row as usize], half * value)));
            let (nodes, masses) = disc.body().mass().column(column / 2);
            let direction = column as u32 % 2;
            entries.extend(
                nodes.iter().zip(masses).map(|(node, mass)| (own, place[(2 * node + direction) as usize], mass / half)),
            );
        }
        entries.retain(|&(row, column, _)| row != super::assembly::NOWHERE && column != super::assembly::NOWHERE);
        for entry in &mut entries {
            (entry.0, entry.1) = (entry.0.min(entry.1), entry.0.max(entry.1));
        }
        let on_back = waves.acoustics.coupling(&disc.radii(disc.back()));
        let mut coupling = Entries::new();
        for (node, &number) in disc.back().iter().enumerate() {
            let own = place[DofMap::dof(number, Direction::Axial) as usize];
            if own != super::assembly::NOWHERE {
                let (columns, values) = on_back.row(node);
                coupling.extend(columns.iter().zip(values).map(|(&column, &value)| (own, column, value)));
            }
        }
        let coupling = Sparse::new(solid, coupling);
        entries.extend(coupling.block(1.0, 0, solid));
        entries.extend(waves.matrix(solid));
        let mut factor = QuasiDefinite::new(&Sparse::new(solid + waves.unknowns(), entries))?;

        let points: Vec<Point> = touched
            .iter()
            .map(|terms| {
                let own = terms.iter().map(|&(dof, weight)| (place[dof as usize], weight));
                let terms: Vec<(u32, f64)> = own.filter(|term| term.0 != super::assembly::NOWHERE).collect();
                let mut answer = vec![0.0; solid + waves.unknowns()];
                terms.iter().for_each(|&(place, weight)| answer[place as usize] += weight);
                factor.solve(&mut answer);
                Point { terms, answer }
            })
            .collect();
        // The force acts with half its value at the end of the step, and u grows by Δ V.
        let compliance = points
            .iter()
            .flat_map(|here| {
                points.iter().map(|there| 0.25 * step * (here.along(&there.answer) + there.along(&here.answer)))
            })
            .collect();
        let columns = disc.body().columns(1);
        Ok(Self {
            solution: vec![0.0; solid + waves.unknowns()],
            waves,
            factor,
            coupling,
            forces: vec![0.0; points.len()],
            points,
            compliance,
            modal: Vec::new(),
            step: *step,
            displacement: vec![0.0; solid],
            known: vec![0.0; solid],
            velocity: columns.clone(),
            spread: columns.clone(),
            image: columns,
            work: 0.0,
            solves: 0,
            disc,
        })
    }

    pub fn size(&self) -> (usize, usize, usize) {
        (self.known.len(), self.waves.unknowns(), self.factor.nonzeros())
    }

    pub fn mesh(&self) -> &Hemisphere {
        &self.waves.acoustics.mesh
    }

    /// Pressure at every node of the mesh, Pa; 0 on a soft baffle.
    pub fn nodal_pressure(&self) -> Vec<f64> {
        self.waves.nodal_pressure()
    }

    /// Energy of the disc, energy of the water in the hemisphere, energy that left through it, J.
    pub fn energies(&mut self) -> [f64; 3] {
        let body = self.disc.body();
        body.multiply_mass(&self.velocity, &mut self.image);
        let kinetic = dot(self.velocity.as_slice(), self.image.as_slice());
        for (&dof, value) in body.dofs().free().iter().zip(&self.displacement) {
            self.spread.as_mut_slice()[dof as usize] = *value;
        }
        body.multiply_stiffness(&self.spread, &mut self.image);
        let elastic = dot(self.spread.as_slice(), self.image.as_slice());
        [0.5 * (kinetic + elastic), self.waves.energy(), self.waves.radiated]
    }
}

impl DiscOnWater {
    fn begin(&mut self) {
        let (own, rest) = self.solution.split_at_mut(self.known.len());
        own.copy_from_slice(&self.known);
        for (point, force) in self.points.iter().zip(&self.forces).filter(|(_, force)| **force != 0.0) {
            point.terms.iter().for_each(|&(place, weight)| own[place as usize] += 0.5 * force * weight);
        }
        rest.copy_from_slice(self.waves.known());
        self.factor.solve(&mut self.solution);
        self.solves += 1;
    }

    /// Displacement of a point at the end of the step that was begun, m.
    fn begun(&self, point: &Point) -> f64 {
        point.along(&self.displacement) + self.step * point.along(&self.solution)
    }

    fn finish(&mut self, new: &[f64]) {
        let Self {
            disc, waves, coupling, points, step, displacement, velocity, image, known, solution, forces, ..
        } = self;
        for (point, force) in points.iter().zip(new).filter(|(_, force)| **force != 0.0) {
            solution.iter_mut().zip(&point.answer).for_each(|(rate, unit)| *rate += 0.5 * force * unit);
        }
        let (mean, rest) = solution.split_at(known.len());
        let free = disc.body().dofs().free();
        for ((&dof, mean), displacement) in free.iter().zip(mean).zip(displacement.iter_mut()) {
            *displacement += *step * mean;
            let velocity = &mut velocity.as_mut_slice()[dof as usize];
            *velocity = 2.0 * mean - *velocity;
        }
        // As the water's known side ([`Waves::advance`]): b ← −b + 4 M u̇/Δ − 2 (F − A X) with the new u̇.
        disc.body().multiply_mass(velocity, image);
        for (known, &dof) in known.iter_mut().zip(free) {
            *known = 4.0 / *step * image.as_slice()[dof as usize] - *known;
        }
        for (point, (old, new)) in points.iter().zip(forces.iter_mut().zip(new)) {
            let pushed = *old + new;
            *old = *new;
            if pushed != 0.0 {
                point.terms.iter().for_each(|&(place, weight)| known[place as usize] -= pushed * weight);
            }
        }
        let pressure = &rest[..waves.acoustics.unknowns];
        let mut power = 0.0;
        for row in coupling.filled() {
            let (columns, values) = coupling.row(row);
            let on_back: f64 =
                columns.iter().zip(values).map(|(&column, value)| value * pressure[column as usize]).sum();
            known[row] += 2.0 * on_back;
            power += mean[row] * on_back;
        }
        self.work += *step * power;
        waves.advance(rest, |load| coupling.add_transposed(2.0, mean, load));
    }
}

impl TouchedDisc for DiscOnWater {
    fn compliance(&self) -> &[f64] {
        &self.compliance
    }

    fn predict(&mut self, retreat: &mut [f64]) {
        self.begin();
        for (out, point) in retreat.iter_mut().zip(&self.points) {
            *out = self.begun(point);
        }
    }

    fn push(&mut self, forces: &[f64]) {
        self.finish(forces);
    }

    fn retreat(&self, out: &mut [f64]) {
        out.iter_mut().zip(&self.points).for_each(|(out, point)| *out = point.along(&self.displacement));
    }

    fn stored(&mut self) -> f64 {
        self.energies()[0]
    }

    fn on_water(&self) -> &dyn OnWater {
        self
    }
}

impl OnWater for DiscOnWater {
    fn step(&self) -> f64 {
        self.step
    }

    fn compliance(&self) -> f64 {
        self.compliance[0]
    }

    fn predict(&mut self) -> f64 {
        self.begin();
        self.begun(&self.points[0])
    }

    fn push(&mut self, force: f64) {
        self.finish(&[force]);
    }

    fn predicted_modal_velocity(&self) -> f64 {
        let free = self.disc.body().dofs().free().iter().zip(&self.solution);
        free.map(|(&dof, mean)| self.modal[dof as usize] * (2.0 * mean - self.velocity.as_slice()[dof as usize])).sum()
    }

    fn modal_compliance(&self) -> f64 {
        self.disc
            .body()
            .dofs()
            .free()
            .iter()
            .zip(&self.points[0].answer)
            .map(|(&dof, rate)| self.modal[dof as usize] * rate)
            .sum()
    }

    fn back_velocity(&self) -> f64 {
        self.velocity.as_slice()[DofMap::dof(self.disc.back()[0], Direction::Axial) as usize]
    }

    fn pole_displacement(&self) -> f64 {
        self.points[0].along(&self.displacement)
    }

    fn pressure(&self, point: usize) -> f64 {
        self.waves.pressure_at(point)
    }

    fn energy(&mut self) -> f64 {
        self.energies()[0]
    }

    fn work_on_water(&self) -> f64 {
        self.work
    }

    fn count(&self, work: &mut SolverWork) {
        work.unknowns += self.solution.len() as u64;
        work.acoustic_unknowns += self.waves.unknowns() as u64;
        work.solves += self.solves;
    }
}
