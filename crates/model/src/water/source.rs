//! The disc of a scene as the source of its field, after a run.
//!
//! A run hears the pressure at its field points only. Disc and water are linear, so that its force on the disc, on the disc's own clock, gives
//! the field everywhere else at the cost of one more pass without beads: by the Rayleigh integral where the scene's water is computed so, by
//! acoustic elements (interpolated in the elements of their mesh) where it is not.

use std::f64::consts::FRAC_1_SQRT_2;

use faer::c64;
use thiserror::Error;

use super::{
    OnWater,
    disc::{Disc, DiscError, DiscModes, PATCH},
    elements::{DiscOnWater, DiscOnWaterSettings, ElementsError},
    field::{FaceMotion, FacePressure, FieldGrid},
    rayleigh::{
        field::{FieldPoint, FieldPointError},
        motion::WetDisc,
        radiation::Radiator,
    },
    support::{disc_mesh, is_damped_at_disc, modes_of},
};
use crate::{
    ModelError,
    scene::{Baffle, DEFAULT_WATER_STEP, Scene, WaterMesh, WaterMethod, WaterSettings},
};
use granchain_signal::Series;

#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FieldSourceError {
    #[error(
        "a pressure field: expected a scene with `support.kind = \"disc\"` and water behind it, found none; try --scene water"
    )]
    NoWater,
    #[error(
        "force on the disc every {found:e} s: expected every {expected:e} s, the step of disc and water; set `output_step` to `model.step`"
    )]
    Clock { expected: f64, found: f64 },
    #[error("pressure map at {time:e} s: expected an instant within the run, 0 to {end:e} s")]
    Instant { time: f64, end: f64 },
    #[error(transparent)]
    Disc(#[from] DiscError),
    #[error(transparent)]
    Elements(#[from] ElementsError),
    #[error(transparent)]
    Point(#[from] FieldPointError),
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// A force less what it is at the start, when disc and water rest under it, N.
fn above_rest(force: &Series) -> Vec<f64> {
    let rest = force.values.first().copied().unwrap_or(0.0);
    force.values.iter().map(|force| force - rest).collect()
}

type Place = [(u32, f64); 4];

fn places(disc: &DiscOnWater, grid: &FieldGrid) -> Result<Vec<Place>, ElementsError> {
    let place = |point: FieldPoint| {
        disc.mesh().locate([point.radius, point.distance]).ok_or(ElementsError::FieldPoint {
            radius: point.radius,
            distance: point.distance,
            hemisphere: disc.mesh().radius,
        })
    };
    grid.points().map(place).collect()
}

fn at(place: &Place, pressure: &[f64]) -> f64 {
    place.iter().map(|&(node, weight)| weight * pressure[node as usize]).sum()
}

/// A scene's disc and water, its beads left away.
#[derive(Debug)]
pub struct FieldSource {
    disc: Disc,
    modes: DiscModes,
    water: WaterSettings,
    mesh: Option<WaterMesh>,
    step: f64,
}

impl FieldSource {
    pub fn new(scene: &Scene) -> Result<Self, FieldSourceError> {
        let (Some((shape, mesh_density)), Some(water)) = (scene.support.disc(), &scene.water) else {
            return Err(FieldSourceError::NoWater);
        };
        let disc = Disc::new(shape, &disc_mesh(shape, mesh_density))?;
        let (count, patch) = (modes_of(&disc)?, PATCH * shape.thickness);
        // The shapes in which the run itself has it.
        let modes =
            if is_damped_at_disc(scene) { disc.modes_on_patch(count, patch)? } else { disc.basis(count, patch)? };
        let mesh = match water.method {
            WaterMethod::Rayleigh => None,
            WaterMethod::Elements(mesh) => Some(mesh),
        };
        Ok(Self { disc, modes, water: water.clone(), mesh, step: scene.model.step().unwrap_or(DEFAULT_WATER_STEP) })
    }

    /// Step of the clock on which it takes forces, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    pub fn method(&self) -> &'static str {
        if self.mesh.is_some() { "acoustic elements" } else { "Rayleigh integral" }
    }

    pub fn radiator(&self) -> Radiator<'_> {
        Radiator::of_modes(self.disc.shape().radius, &self.modes.back)
    }

    /// A grid from the axis to 2.5 radii and as deep, 50 points a side; of elements only where their mesh reaches.
    pub fn grid(&self) -> FieldGrid {
        let radius = self.disc.shape().radius;
        let wanted = 2.5 * radius;
        let reach = self.mesh.map_or(wanted, |mesh| wanted.min(FRAC_1_SQRT_2 * mesh.radius * 0.999));
        FieldGrid::even(reach, reach, reach / 50.0)
    }

    /// Whether the plane around the disc is free of pressure, so that the face's pressure and not its velocity is the source of the field.
    pub fn is_soft(&self) -> bool {
        self.water.baffle == Baffle::Soft
    }

    /// Motion of the back under the force on the disc (N) on its clock, on water behind a rigid baffle.
    pub fn motion(&self, force: &Series) -> Result<FaceMotion, FieldSourceError> {
        self.on_clock(force)?;
        let disc = WetDisc::new(self.disc.shape().radius, &self.modes, &self.water.liquid, &[], self.step)?;
        Ok(FaceMotion::under(disc, &above_rest(force)))
    }

    /// Pressure (Pa) over a grid at each of `times` (s) under the force on the disc (N) on its clock: one list of the grid's points each.
    pub fn maps(&self, force: &Series, grid: &FieldGrid, times: &[f64]) -> Result<Vec<Vec<f64>>, FieldSourceError> {
        self.on_clock(force)?;
        let end = force.end();
        if let Some(&time) = times.iter().find(|time| !(0.0..=end).contains(*time)) {
            return Err(FieldSourceError::Instant { time, end });
        }
        match self.mesh {
            None => {
                let motion = self.motion(force)?;
                Ok(motion.map(&self.radiator(), &self.water.liquid, grid, times)?)
            }
            Some(mesh) => {
                let instants: Vec<usize> = times.iter().map(|time| (time / self.step).round() as usize).collect();
                let last = instants.iter().copied().max().unwrap_or(0);
                let disc = self.meshed(mesh)?;
                let places = places(&disc, grid)?;
                let mut maps = vec![Vec::new(); times.len()];
                self.pass(disc, force, last, |instant, pressure| {
                    for (map, _) in maps.iter_mut().zip(&instants).filter(|(_, wanted)| **wanted == instant) {
                        *map = places.iter().map(|place| at(place, pressure)).collect();
                    }
                });
                Ok(maps)
            }
        }
    }

    /// Σ wᵢ p(x, tᵢ) over a grid for several lists of complex weights, one a sample of the force on the disc (N) on its clock: with those of a line,
    /// its complex amplitude. By elements; none where the scene's water is not computed so.
    pub fn weighted_maps(
        &self,
        force: &Series,
        grid: &FieldGrid,
        weights: &[Vec<c64>],
    ) -> Result<Option<Vec<Vec<c64>>>, FieldSourceError> {
        self.on_clock(force)?;
        let Some(mesh) = self.mesh else { return Ok(None) };
        let disc = self.meshed(mesh)?;
        let places = places(&disc, grid)?;
        let mut maps = vec![vec![c64::new(0.0, 0.0); places.len()]; weights.len()];
        self.pass(disc, force, force.len().saturating_sub(1), |instant, pressure| {
            for (map, weights) in maps.iter_mut().zip(weights) {
                let Some(weight) = weights.get(instant).filter(|weight| weight.norm() > 0.0) else { continue };
                map.iter_mut().zip(&places).for_each(|(sum, place)| *sum += weight * at(place, pressure));
            }
        });
        Ok(Some(maps))
    }

    /// Pressure on the disc's back under the force on the disc (N) on its clock, by elements; none where the scene's water is not computed so.
    pub fn face_pressure(&self, force: &Series) -> Result<Option<FacePressure>, FieldSourceError> {
        self.on_clock(force)?;
        let Some(mesh) = self.mesh else { return Ok(None) };
        let disc = self.meshed(mesh)?;
        let nodes = disc.mesh().plane[..disc.mesh().on_disc].to_vec();
        let radii = nodes.iter().map(|&node| disc.mesh().nodes[node as usize][0]).collect();
        let mut pressure = vec![Vec::with_capacity(force.len()); nodes.len()];
        self.pass(disc, force, force.len().saturating_sub(1), |_, now| {
            pressure.iter_mut().zip(&nodes).for_each(|(trace, &node)| trace.push(now[node as usize]));
        });
        let pressure = pressure.into_iter().map(|values| Series::new(0.0, self.step, values)).collect();
        Ok(Some(FacePressure::new(radii, pressure)))
    }

    /// The disc on its meshed water, at rest.
    fn meshed(&self, mesh: WaterMesh) -> Result<DiscOnWater, FieldSourceError> {
        let settings = DiscOnWaterSettings::of(&self.water, mesh, PATCH * self.disc.shape().thickness, self.step);
        let settings = DiscOnWaterSettings { points: Vec::new(), ..settings };
        let in_modes = self.modes.modes == self.modes.frequencies.len();
        Ok(DiscOnWater::made(&self.disc, &settings, in_modes.then_some(self.modes.modes))?)
    }

    /// Drive it by the force through instant `last`; `observe` sees the pressure (Pa) at the nodes at every instant, the first included.
    fn pass(&self, mut disc: DiscOnWater, force: &Series, last: usize, mut observe: impl FnMut(usize, &[f64])) {
        for (instant, force) in above_rest(force).into_iter().enumerate().take(last + 1) {
            if instant > 0 {
                disc.predict();
                disc.push(force);
            }
            observe(instant, &disc.nodal_pressure());
        }
    }

    fn on_clock(&self, force: &Series) -> Result<(), FieldSourceError> {
        if (force.step / self.step - 1.0).abs() > 1e-9 {
            return Err(FieldSourceError::Clock { expected: self.step, found: force.step });
        }
        Ok(())
    }
}
