//! The state of the water and its share of a step.

use super::{
    Baffle, ElementsError, Water, WaterMesh,
    assembly::Acoustics,
    mesh::Hemisphere,
    sparse::{Entries, Sparse},
};
use crate::model::water::rayleigh::field::FieldPoint;

/// Waves in the hemisphere.
#[derive(Debug, Clone)]
pub(super) struct Waves {
    pub acoustics: Acoustics,
    /// H + M_Γ/(ρR), m⁴/kg.
    stiffness: Sparse,
    step: f64,
    /// ψ, Pa·s; ψ̇ = p, Pa; η, Pa·s·m.
    pub potential: Vec<f64>,
    pub pressure: Vec<f64>,
    auxiliary: Vec<f64>,
    listeners: Vec<Vec<(u32, f64)>>,
    /// Energy that left through the hemisphere, J.
    pub radiated: f64,
    scratch: Vec<f64>,
}

impl Waves {
    pub fn new(
        disc: f64,
        mesh: &WaterMesh,
        water: Water,
        baffle: Baffle,
        points: &[FieldPoint],
        step: f64,
    ) -> Result<Self, ElementsError> {
        if !(step > 0.0 && step.is_finite()) {
            return Err(ElementsError::Step { found: step });
        }
        let acoustics = Acoustics::new(Hemisphere::new(disc, mesh)?, water, baffle);
        let entries: Entries = acoustics
            .inertance
            .block(1.0, 0, 0)
            .chain(acoustics.arc.block(1.0 / (water.density * mesh.radius), 0, 0))
            .collect();
        let stiffness = Sparse::new(acoustics.unknowns, entries);
        let listeners = points
            .iter()
            .map(|point| {
                let found = acoustics.mesh.locate([point.radius, point.distance]).ok_or(ElementsError::FieldPoint {
                    radius: point.radius,
                    distance: point.distance,
                    hemisphere: mesh.radius,
                })?;
                let heard = found.into_iter().map(|(node, weight)| (acoustics.unknown[node as usize], weight));
                Ok(heard.filter(|&(place, _)| place != super::assembly::NOWHERE).collect())
            })
            .collect::<Result<Vec<_>, ElementsError>>()?;
        Ok(Self {
            potential: vec![0.0; acoustics.unknowns],
            pressure: vec![0.0; acoustics.unknowns],
            auxiliary: vec![0.0; acoustics.auxiliary],
            scratch: vec![0.0; acoustics.unknowns],
            acoustics,
            stiffness,
            step,
            listeners,
            radiated: 0.0,
        })
    }

    /// Unknowns of a step, X and E.
    pub fn unknowns(&self) -> usize {
        self.acoustics.unknowns + self.acoustics.auxiliary
    }

    /// The water's block of the step matrix from place `first` on, X before E, upper triangle.
    pub fn matrix(&self, first: usize) -> Entries {
        let Acoustics { water, unknowns, compliance, arc, tangential, tangential_own, mesh, .. } = &self.acoustics;
        let half = 0.5 * self.step;
        let second = first + unknowns;
        let mass = compliance.block(-1.0 / half, first, first);
        let radiation = arc.block(-1.0 / (water.density * water.sound_speed), first, first);
        let spring = self.stiffness.block(-half, first, first);
        // η in rows, ψ in columns: turned over for the upper triangle.
        let cross = tangential.block(-half, second, first).map(|(row, column, value)| (column, row, value));
        let own = tangential_own.block(half / mesh.radius + 1.0 / water.sound_speed, second, second);
        mass.chain(radiation).chain(spring).chain(cross).chain(own).filter(|(row, column, _)| row <= column).collect()
    }

    /// What is known of the water's rows, X then E.
    pub fn load(&self, out: &mut [f64]) {
        let (fluid, arc) = out.split_at_mut(self.acoustics.unknowns);
        fluid.fill(0.0);
        arc.fill(0.0);
        self.acoustics.compliance.add_product(-2.0 / self.step, &self.pressure, fluid);
        self.stiffness.add_product(1.0, &self.potential, fluid);
        self.acoustics.tangential.add_transposed(1.0, &self.auxiliary, fluid);
        self.acoustics.tangential.add_product(1.0, &self.potential, arc);
        self.acoustics.tangential_own.add_product(-1.0 / self.acoustics.mesh.radius, &self.auxiliary, arc);
    }

    /// Go one step with the mean rates X, E.
    pub fn advance(&mut self, solution: &[f64]) {
        let (mean, auxiliary) = solution.split_at(self.acoustics.unknowns);
        let half = 0.5 * self.step;
        // What the hemisphere takes up: ψ and η at the middle of the step.
        let Acoustics { water, arc, tangential, mesh, .. } = &self.acoustics;
        let between = |value: &f64, rate: &f64| value + half * rate;
        self.scratch.iter_mut().zip(self.potential.iter().zip(mean)).for_each(|(out, (v, r))| *out = between(v, r));
        let flux = arc.form(mean, mean) / (water.density * water.sound_speed)
            + arc.form(mean, &self.scratch) / (water.density * mesh.radius);
        let mut bend = 0.0;
        for (row, (value, rate)) in self.auxiliary.iter().zip(auxiliary).enumerate() {
            let (columns, values) = tangential.row(row);
            let along: f64 = columns.iter().zip(values).map(|(&column, value)| value * mean[column as usize]).sum();
            bend += between(value, rate) * along;
        }
        self.radiated += self.step * (flux + bend);
        for ((potential, pressure), mean) in self.potential.iter_mut().zip(&mut self.pressure).zip(mean) {
            *potential += self.step * mean;
            *pressure = 2.0 * mean - *pressure;
        }
        for (value, rate) in self.auxiliary.iter_mut().zip(auxiliary) {
            *value += self.step * rate;
        }
    }

    pub fn heard(&self, point: usize) -> f64 {
        self.listeners[point].iter().map(|&(place, weight)| weight * self.pressure[place as usize]).sum()
    }

    /// p at every node of the mesh, Pa.
    pub fn nodal_pressure(&self) -> Vec<f64> {
        self.acoustics.unknown.iter().map(|&place| self.pressure.get(place as usize).copied().unwrap_or(0.0)).collect()
    }

    /// ½ p Q p + ½ ψ H ψ: compression and motion, J.
    pub fn energy(&self) -> f64 {
        let Acoustics { compliance, inertance, .. } = &self.acoustics;
        0.5 * (compliance.form(&self.pressure, &self.pressure) + inertance.form(&self.potential, &self.potential))
    }
}
