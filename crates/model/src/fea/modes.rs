//! Free modes of a body: K x = ω² M x with the contact faces unloaded.
//!
//! Lanczos on A⁻¹ M with A = K + σ M, orthogonal in the product of M, every new vector made orthogonal to all before it:
//!
//! ```text
//! A⁻¹ M x = θ x,   ω² = 1/θ − σ,   xᵀ M x = 1
//! ```
//!
//! σ = E / (ρ d²) with d the body's size, so that A is definite and the lowest modes lead. The rigid translation of a free body is known
//! and taken out beforehand. Massless nodes follow the others statically; one last product with A⁻¹ M puts them there.
//! How many modes there are below a frequency comes from the inertia of K − ω² M, independent of Lanczos: none is missed silently.
//!
//! Ericsson & Ruhe (1980), *Math. Comp.* 35, 1251 (shifted and inverted); Nour-Omid, Parlett, Ericsson & Jensen (1987), *Math. Comp.* 48, 663 (singular M).

mod lanczos;

use std::f64::consts::TAU;

use thiserror::Error;

use self::lanczos::Lanczos;
use super::{
    assembly::Columns,
    body::Body,
    factor::{Factor, FactorError, Half, eigenvalues_below},
};
use crate::tally;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ModesError {
    #[error(
        "{requested} modes: expected 1 to {available}, about half of the body's unknowns with mass; ask for fewer or refine the mesh"
    )]
    Count { requested: usize, available: usize },
    #[error("{converged} of {requested} modes within {tolerance:e} after {steps} Lanczos steps; ask for fewer modes")]
    NotConverged { requested: usize, converged: usize, steps: usize, tolerance: f64 },
    #[error(
        "below {frequency:.6e} Hz there are {counted} modes by inertia, but {found} were found; ask for more modes"
    )]
    Missed { frequency: f64, counted: usize, found: usize },
    #[error("modes: {0}")]
    Factor(#[from] FactorError),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SturmCount {
    /// Where it was counted, Hz.
    pub frequency: f64,
    /// Modes below it, the rigid one included.
    pub modes: usize,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// ω/2π, Hz, ascending; the first is 0 for a free body: its rigid translation.
    pub frequencies: Vec<f64>,
    /// Mode k by the body's unknowns, 1/√kg, normalised to xᵀ M x = 1; massless nodes follow statically.
    pub shapes: Vec<Vec<f64>>,
    /// ‖A⁻¹ M x − θ x‖/θ in the norm of M: bounds the relative error of ω² + σ.
    pub residuals: Vec<f64>,
    pub sturm: SturmCount,
    pub steps: usize,
}

const TOLERANCE: f64 = 1e-9;

/// Modes computed beyond those asked for, so that the Sturm count has a gap to stand in.
const BEYOND: usize = 3;

/// The `count` lowest free modes of a body, the rigid one included.
pub fn modes(body: &Body, count: usize) -> Result<Modes, ModesError> {
    let moving = body.dofs().free().iter().filter(|&&dof| body.node_mass()[(dof / 2) as usize] != 0.0).count();
    let available = (moving / 2).saturating_sub(BEYOND);
    if count == 0 || count > available {
        return Err(ModesError::Count { requested: count, available });
    }
    tally::add(|made| made.modes += count as u64);
    let shift = shift(body);
    let factor = Factor::new(body, 1.0, shift, &[])?;
    let mut lanczos = Lanczos::new(body, &factor);
    let rigid = usize::from(body.is_free());
    let wanted = count + BEYOND - rigid;
    let most = moving.min(6 * wanted + 120);
    let pairs = loop {
        let steps = (lanczos.steps() + 8.max(wanted / 4)).max(wanted + 16).min(most);
        let is_spent = lanczos.extend(steps);
        let pairs = lanczos.pairs(wanted);
        let converged = pairs.iter().take_while(|pair| pair.error < 1e-3 * TOLERANCE).count();
        if converged >= wanted {
            break pairs;
        }
        if is_spent || steps == most {
            let requested = count;
            return Err(ModesError::NotConverged { requested, converged, steps, tolerance: TOLERANCE });
        }
    };

    let mut shapes = Vec::with_capacity(count);
    let mut squares = vec![0.0; rigid];
    let mut residuals = vec![0.0; rigid];
    if rigid == 1 {
        let scale = 1.0 / body.total_mass().sqrt();
        shapes.push(body.rigid().iter().map(|value| scale * value).collect());
    }
    let mut polish = Polish::new(body, &factor, shift);
    for pair in &pairs {
        // Of those beyond, only where they lie is asked.
        if squares.len() >= count {
            squares.push(1.0 / pair.theta - shift);
            continue;
        }
        let (vector, square, residual) = polish.refine(&lanczos.vector(pair), pair.theta);
        shapes.push(vector);
        residuals.push(residual);
        squares.push(square);
    }
    let frequencies: Vec<f64> = squares.iter().map(|square| square.max(0.0).sqrt() / TAU).collect();
    // Where neighbours are furthest apart, counting from the last mode asked for.
    let gap = |k: &usize| frequencies[*k] - frequencies[*k - 1];
    let place = (count..frequencies.len()).max_by(|a, b| gap(a).total_cmp(&gap(b))).unwrap_or(count);
    let steps = lanczos.steps();
    // What found them takes more memory than what confirms them: not both at once.
    drop((lanczos, polish));
    drop(factor);
    let sturm = predict(body, &frequencies, 0.5 * (frequencies[place - 1] + frequencies[place]))?;
    Ok(Modes { frequencies: frequencies[..count].to_vec(), shapes, residuals, sturm, steps })
}

/// Check that `found` (Hz) holds every mode below `frequency` (Hz), by the inertia of K − ω² M.
pub fn predict(body: &Body, found: &[f64], frequency: f64) -> Result<SturmCount, ModesError> {
    let counted = eigenvalues_below(body, (TAU * frequency).powi(2))?;
    let found = found.iter().filter(|&&mode| mode < frequency).count();
    if counted == found {
        Ok(SturmCount { frequency, modes: counted })
    } else {
        Err(ModesError::Missed { frequency, counted, found })
    }
}

/// E / (ρ d²) of the slowest material, d the diagonal of the body's bounding box, 1/s².
fn shift(body: &Body) -> f64 {
    let [mut low, mut high] = [[f64::MAX; 2], [f64::MIN; 2]];
    for place in &body.mesh().nodes {
        for axis in 0..2 {
            low[axis] = low[axis].min(place[axis]);
            high[axis] = high[axis].max(place[axis]);
        }
    }
    let size = (high[0] - low[0]).powi(2) + (high[1] - low[1]).powi(2);
    body.material().youngs_modulus / body.material().density / size
}

struct Polish<'a> {
    body: &'a Body,
    factor: &'a Factor,
    shift: f64,
    x: Columns,
    image: Columns,
    work: Half,
}

impl<'a> Polish<'a> {
    fn new(body: &'a Body, factor: &'a Factor, shift: f64) -> Self {
        Self { body, factor, shift, x: body.columns(1), image: body.columns(1), work: factor.half(1) }
    }

    /// image = A⁻¹ M x.
    fn apply(&mut self) {
        let mut force = std::mem::replace(&mut self.image, Columns::new(0, 1));
        self.body.multiply_mass(&self.x, &mut force);
        let mut out = self.body.columns(1);
        self.factor.solve(&force, &mut self.work, &mut out);
        self.image = out;
    }

    /// Mode, ω² and residual from a Ritz vector.
    fn refine(&mut self, ritz: &[f64], theta: f64) -> (Vec<f64>, f64, f64) {
        self.x.set_column(0, ritz);
        self.apply();
        let mut vector: Vec<f64> = self.image.as_slice().iter().map(|value| value / theta).collect();
        let norm = lanczos::mass_product(self.body, &vector, &vector).sqrt();
        vector.iter_mut().for_each(|value| *value /= norm);
        self.x.set_column(0, &vector);
        self.apply();
        // Rayleigh's quotient of A⁻¹ M: its error is the square of the vector's.
        let theta = lanczos::mass_product(self.body, &vector, self.image.as_slice());
        let rest: Vec<f64> = self.image.as_slice().iter().zip(&vector).map(|(image, x)| image - theta * x).collect();
        let residual = lanczos::mass_product(self.body, &rest, &rest).max(0.0).sqrt() / theta;
        (vector, 1.0 / theta - self.shift, residual)
    }
}
