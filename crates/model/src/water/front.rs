//! The front of a disc on the water, touched at the points of a contact that is solved on meshes.
//!
//! ```text
//! w = w⁰ + C λ,   g = q + w + W λ,   g ≥ 0, λ ≥ 0, λ g = 0            at the end of a step
//! ```
//!
//! - w: retreat of the points, their displacement into the water, m; w⁰ without forces at the end of the step
//! - λ: forces of the points, N;  q: their gaps by the bead's motion, m;  W: compliance of the bead, m/N
//! - C: compliance of disc and water over a step, m/N
//!
//! Disc and water are linear, so C is made once. No law of Hertz and no correction of the disc's flexibility come in: the disc's mesh is as fine
//! at the pole as the bead's, and holds the indentation itself. Its front carries no mass (`Disc::for_contact`), as bodies in contact do not
//! in [`crate::fea`].
//!
//! Two ways, as behind a chain: the disc in modes and static shapes with what they leave out of the points' flexibility as a static rest
//! (`ModalFront`, water by the Rayleigh integral), or its elements in one factor with those of the water.

use super::{
    OnWater, WaterError, absorption,
    contact::DASHPOT_MODES,
    disc::{Disc, DiscError, DiscInterface, PATCH},
    elements::{DiscOnWater, DiscOnWaterSettings},
    rayleigh::motion::WetDisc,
};
use crate::{
    fea::contact::face::Face,
    number::dot,
    response::{DiscResponse, Response, empty_columns, push},
    scene::{DiscShape, Rim, WaterMethod, WaterSettings},
};
use granchain_signal::Series;

const MODES: usize = 6;

/// A disc on the water that is touched at several points of its front, on a clock of constant step. Between instants forces are straight lines.
pub(crate) trait TouchedDisc {
    /// C row by row, m/N.
    fn compliance(&self) -> &[f64];
    /// Where the points would be at the end of the next step without forces there: w⁰, m.
    fn predict(&mut self, retreat: &mut [f64]);
    /// Finish the step that [`TouchedDisc::predict`] began, with the forces λ (N) at its end.
    fn push(&mut self, forces: &[f64]);
    /// w, m.
    fn retreat(&self, out: &mut [f64]);
    /// Energy of the disc, kinetic and elastic, J.
    fn stored(&mut self) -> f64;
    /// The disc, as behind one force.
    fn on_water(&self) -> &dyn OnWater;
    /// Work the disc has done on the water so far, J.
    fn work_on_water(&self) -> f64 {
        self.on_water().work_on_water()
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Handles {
    Points,
    /// There, and last in its [`DASHPOT_MODES`] lowest modes together, each by its share at the pole.
    PointsAndModes,
}

/// What forces that are held long on the points of a disc's front move, m/N.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Held {
    pub points: Vec<f64>,
    /// The lowest modes at the pole, by the force on every point.
    pub modes: Vec<f64>,
}

impl Held {
    /// Displacement of every point and of the lowest modes under forces of the points (N), m.
    pub(crate) fn under(&self, forces: &[f64]) -> (Vec<f64>, f64) {
        let points = self.points.chunks_exact(forces.len().max(1)).map(|row| dot(row, forces));
        (points.collect(), dot(&self.modes, forces))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Front {
    disc: Disc,
    /// The retreat of every point as a sum over unknowns of the disc.
    points: Vec<Vec<(u32, f64)>>,
    interface: Option<DiscInterface>,
}

impl Front {
    /// Of a disc touched at the points of a face, for water computed as the scene states.
    pub(crate) fn new(disc: Disc, face: &Face, water: &WaterSettings) -> Result<Self, DiscError> {
        // Outward is out of the water.
        let terms = |i| face.terms(i).map(|(unknown, coefficient)| (unknown as u32, -coefficient)).collect();
        let points: Vec<Vec<(u32, f64)>> = (0..face.len()).map(terms).collect();
        let interface = match water.method {
            WaterMethod::Rayleigh => Some(disc.interface(MODES, PATCH * disc.shape().thickness, &points)?),
            WaterMethod::Elements(_) => None,
        };
        Ok(Self { disc, points, interface })
    }

    pub(crate) fn points(&self) -> usize {
        self.points.len()
    }

    /// The disc under forces that are held; none where nothing holds the disc.
    pub(crate) fn held(&self) -> Result<Option<Held>, DiscError> {
        if self.disc.shape().rim == Rim::Free {
            return Ok(None);
        }
        let mut handles = self.points.clone();
        handles.push(self.modes_handle()?);
        let all = self.disc.point_flexibility(&handles)?;
        let (points, count) = (self.points(), handles.len());
        let rows = |first, rows| all[first * count..].chunks_exact(count).take(rows).flat_map(|row| &row[..points]);
        Ok(Some(Held { points: rows(0, points).copied().collect(), modes: rows(points, 1).copied().collect() }))
    }

    /// The lowest modes together as one displacement, each by its share at the pole.
    fn modes_handle(&self) -> Result<Vec<(u32, f64)>, DiscError> {
        let weights = self.disc.modal_weights(DASHPOT_MODES, PATCH * self.disc.shape().thickness)?;
        Ok((0_u32..).zip(weights).filter(|&(_, weight)| weight != 0.0).collect())
    }

    /// The disc at rest on the water, on a clock of that step (s).
    pub(crate) fn on_water(
        &self,
        water: &WaterSettings,
        step: f64,
        handles: Handles,
    ) -> Result<Box<dyn TouchedDisc>, WaterError> {
        let patch = PATCH * self.disc.shape().thickness;
        if let WaterMethod::Elements(mesh) = water.method {
            let settings = DiscOnWaterSettings::of(water, mesh, patch, step);
            let mut touched = self.points.clone();
            if handles == Handles::PointsAndModes {
                touched.push(self.modes_handle()?);
            }
            return Ok(Box::new(DiscOnWater::touched(self.disc.clone(), &settings, &touched)?));
        }
        let made;
        let interface = match &self.interface {
            Some(interface) => interface,
            None => {
                made = self.disc.interface(MODES, patch, &self.points)?;
                &made
            }
        };
        let radius = self.disc.shape().radius;
        let disc = WetDisc::new(radius, &interface.modes, &water.liquid, &water.field_points, step)?;
        let interface = match handles {
            Handles::Points => interface,
            Handles::PointsAndModes => &interface.with_modes(DASHPOT_MODES),
        };
        Ok(Box::new(ModalFront::new(disc, interface)))
    }
}

/// Pressure at the field points, sample after sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct WaterRecord {
    /// Pressure at each field point, Pa.
    pub pressure: Vec<Vec<f64>>,
    /// Velocity of the middle of the disc's back, m/s, positive into the water.
    pub back_velocity: Vec<f64>,
}

impl WaterRecord {
    /// Empty, for so many samples at the field points of `water`.
    pub(crate) fn new(water: Option<&WaterSettings>, samples: usize) -> Self {
        let pressure = empty_columns(water.map_or(0, |water| water.field_points.len()), samples);
        Self { pressure, back_velocity: Vec::with_capacity(samples) }
    }

    pub(crate) fn sample(&mut self, disc: &dyn OnWater) {
        push(&mut self.pressure, (0..).map(|point| disc.pressure(point)));
        self.back_velocity.push(disc.back_velocity());
    }

    /// Adds the pressure behind a disc of that shape, as it arrives there.
    pub(crate) fn enter(self, shape: &DiscShape, water: Option<&WaterSettings>, response: &mut Response) {
        let step = response.piston_displacement.step;
        let series = |values: Vec<f64>| Series::new(0.0, step, values);
        let work = &mut response.work;
        work.pressure_samples = self.pressure.iter().map(|trace| trace.len() as u64).sum();
        let law = water.and_then(|water| water.absorption);
        let points = water.map_or(&[][..], |water| &water.field_points);
        let arriving = self.pressure.into_iter().zip(points).map(|(trace, &point)| {
            let Some(law) = law else { return series(trace) };
            work.absorbed_records += 1;
            series(absorption::attenuated(law, shape.radius, point, &trace, step))
        });
        let pressure = arriving.collect();
        response.disc = Some(DiscResponse { velocity: series(self.back_velocity), pressure });
    }

    /// The same where the energy balance has the energy of the disc and the work on the water (J) among the stored energies.
    pub(crate) fn enter_behind(
        self,
        front: &Front,
        water: &WaterSettings,
        [disc_j, water_j]: [f64; 2],
        response: &mut Response,
    ) {
        self.enter(front.disc.shape(), Some(water), response);
        let energy = &mut response.energy;
        energy.stored_j -= disc_j + water_j;
        (energy.disc_j, energy.water_j) = (Some(disc_j), Some(water_j));
    }
}

/// A disc in its modes on the water, touched at several points.
///
/// w = Σ φ_k q_k + R λ with the shapes φ_k of [`DiscInterface`] and R what they leave out of the static flexibility.
#[derive(Debug, Clone)]
pub(crate) struct ModalFront {
    disc: WetDisc,
    /// φ_k of the points, shape by shape, 1/√kg.
    shapes: Vec<f64>,
    /// R row by row, m/N.
    residual: Vec<f64>,
    compliance: Vec<f64>,
    forces: Vec<f64>,
    modal: Vec<f64>,
}

impl ModalFront {
    pub(crate) fn new(disc: WetDisc, interface: &DiscInterface) -> Self {
        let points = interface.points();
        let shapes = interface.shapes.clone();
        let count = shapes.len() / points.max(1);
        let own = disc.shape_compliance();
        let mut compliance = interface.residual.clone();
        for (j, there) in shapes.chunks_exact(points).enumerate() {
            for (k, here) in shapes.chunks_exact(points).enumerate() {
                let share = own[j * count + k];
                for (row, a) in compliance.chunks_exact_mut(points).zip(there) {
                    row.iter_mut().zip(here).for_each(|(sum, b)| *sum += share * a * b);
                }
            }
        }
        let (residual, forces) = (interface.residual.clone(), vec![0.0; points]);
        Self { disc, shapes, residual, compliance, forces, modal: vec![0.0; count] }
    }

    fn add_shapes(&self, amounts: impl Iterator<Item = f64>, out: &mut [f64]) {
        out.fill(0.0);
        for (amount, shape) in amounts.zip(self.shapes.chunks_exact(out.len())) {
            out.iter_mut().zip(shape).for_each(|(out, shape)| *out += amount * shape);
        }
    }
}

impl TouchedDisc for ModalFront {
    fn compliance(&self) -> &[f64] {
        &self.compliance
    }

    fn predict(&mut self, retreat: &mut [f64]) {
        self.disc.predict();
        self.add_shapes(self.disc.free_displacement(), retreat);
    }

    fn push(&mut self, forces: &[f64]) {
        self.forces.copy_from_slice(forces);
        for (modal, shape) in self.modal.iter_mut().zip(self.shapes.chunks_exact(forces.len())) {
            *modal = dot(shape, forces);
        }
        self.disc.push_modal(&self.modal);
    }

    fn retreat(&self, out: &mut [f64]) {
        self.add_shapes(self.disc.modal_displacement().iter().copied(), out);
        for (out, row) in out.iter_mut().zip(self.residual.chunks_exact(self.forces.len())) {
            *out += dot(row, &self.forces);
        }
    }

    fn stored(&mut self) -> f64 {
        let rows = self.residual.chunks_exact(self.forces.len()).zip(&self.forces);
        self.disc.energy() + 0.5 * rows.map(|(row, force)| force * dot(row, &self.forces)).sum::<f64>()
    }

    fn on_water(&self) -> &dyn OnWater {
        &self.disc
    }
}
