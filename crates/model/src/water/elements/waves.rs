//! The state of the water and its share of a step.

use super::{
    Baffle, ElementsError, Water, WaterMesh,
    assembly::Acoustics,
    mesh::Hemisphere,
    sparse::{Entries, Sparse},
};
use crate::{tally, water::rayleigh::field::FieldPoint};

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
    known: Vec<f64>,
    scratch: Vec<f64>,
}

impl Waves {
    pub(crate) fn new(
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
        tally::add(|made| made.water_meshes += 1);
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
                let interpolated = found.into_iter().map(|(node, weight)| (acoustics.unknown[node as usize], weight));
                Ok(interpolated.filter(|&(place, _)| place != super::assembly::NOWHERE).collect())
            })
            .collect::<Result<Vec<_>, ElementsError>>()?;
        Ok(Self {
            potential: vec![0.0; acoustics.unknowns],
            pressure: vec![0.0; acoustics.unknowns],
            auxiliary: vec![0.0; acoustics.auxiliary],
            known: vec![0.0; acoustics.unknowns + acoustics.auxiliary],
            scratch: vec![0.0; acoustics.unknowns],
            acoustics,
            stiffness,
            step,
            listeners,
            radiated: 0.0,
        })
    }

    /// Unknowns of a step, X and E.
    pub(crate) fn unknowns(&self) -> usize {
        self.acoustics.unknowns + self.acoustics.auxiliary
    }

    /// The water's block of the step matrix from place `first` on, X before E, upper triangle.
    pub(crate) fn matrix(&self, first: usize) -> Entries {
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

    /// What is known of the water's rows before a step, X then E: −2Q p/Δ + (H + M_Γ/(ρR)) ψ + Tᵀη, then T (ψ − η/R).
    pub(crate) fn known(&self) -> &[f64] {
        &self.known
    }

    /// Go one step with the mean rates X, E; `coupling` adds 2 AᵀV, what the face does to the water's rows.
    ///
    /// The equations just solved say what stiffness did in this step, so the next known side follows from the last one, b, without it:
    ///
    /// b ← −b − 4Q p/Δ + 2 (AᵀV − M_Γ X/(ρc))  with the new p,   b ← −b + 2 T E/c  on the arc.
    pub(crate) fn advance(&mut self, solution: &[f64], coupling: impl FnOnce(&mut [f64])) {
        let Self { acoustics, potential, pressure, auxiliary, known, scratch, .. } = self;
        let Acoustics { water, unknowns, compliance, arc, tangential, tangential_own, mesh, .. } = acoustics;
        let (mean, rate) = solution.split_at(*unknowns);
        let half = 0.5 * self.step;
        // What the hemisphere takes up: ψ and η at the middle of the step.
        scratch.fill(0.0);
        arc.add_product(1.0, mean, scratch);
        let (mut still, mut moving) = (0.0, 0.0);
        for place in arc.filled() {
            moving += mean[place] * scratch[place];
            still += (potential[place] + half * mean[place]) * scratch[place];
        }
        let mut bend = 0.0;
        for (row, (value, rate)) in auxiliary.iter().zip(rate).enumerate() {
            let (columns, values) = tangential.row(row);
            let along: f64 = columns.iter().zip(values).map(|(&column, value)| value * mean[column as usize]).sum();
            bend += (value + half * rate) * along;
        }
        let impedance = water.density * water.sound_speed;
        self.radiated += self.step * (moving / impedance + still / (water.density * mesh.radius) + bend);

        for ((potential, pressure), mean) in potential.iter_mut().zip(pressure.iter_mut()).zip(mean) {
            *potential += self.step * mean;
            *pressure = 2.0 * mean - *pressure;
        }
        for (value, rate) in auxiliary.iter_mut().zip(rate) {
            *value += self.step * rate;
        }
        known.iter_mut().for_each(|known| *known = -*known);
        let (fluid, bent) = known.split_at_mut(*unknowns);
        compliance.add_product(-4.0 / self.step, pressure, fluid);
        for place in arc.filled() {
            fluid[place] -= 2.0 / impedance * scratch[place];
        }
        coupling(fluid);
        tangential_own.add_product(2.0 / water.sound_speed, rate, bent);
    }

    pub(crate) fn pressure_at(&self, point: usize) -> f64 {
        self.listeners[point].iter().map(|&(place, weight)| weight * self.pressure[place as usize]).sum()
    }

    /// p at every node of the mesh, Pa.
    pub(crate) fn nodal_pressure(&self) -> Vec<f64> {
        self.acoustics.unknown.iter().map(|&place| self.pressure.get(place as usize).copied().unwrap_or(0.0)).collect()
    }

    /// ½ p Q p + ½ ψ H ψ: compression and motion, J.
    pub(crate) fn energy(&self) -> f64 {
        let Acoustics { compliance, inertance, .. } = &self.acoustics;
        0.5 * (compliance.form(&self.pressure, &self.pressure) + inertance.form(&self.potential, &self.potential))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::water::elements::factor::QuasiDefinite;

    /// Largest residual of the water's and of the arc's equations at the middles of steps, over the largest term of each: they are written out
    /// here in ψ and η before and after a step, without what a step itself carries along.
    fn residuals(baffle: Baffle) -> [f64; 2] {
        let (step, radius) = (200e-9, 1.5e-3);
        let mesh = WaterMesh { radius, side: 0.1e-3 };
        let mut waves = Waves::new(1e-3, &mesh, Water::fresh(), baffle, &[], step).unwrap();
        let face = waves.acoustics.face_load(|r| 1.0 - 0.4 * (r / 1e-3).powi(2));
        let mut factor = QuasiDefinite::new(&Sparse::new(waves.unknowns(), waves.matrix(0))).unwrap();
        let (c, density) = (1500.0, 1000.0);
        let mut worst = [0.0_f64; 2];
        for n in 1..=60 {
            let velocity = (0.11 * f64::from(n)).sin() + 0.3 * (0.9 * f64::from(n)).cos();
            let mut solution = waves.known().to_vec();
            solution.iter_mut().zip(&face).for_each(|(load, face)| *load -= face * velocity);
            factor.solve(&mut solution);
            let before = waves.clone();
            waves.advance(&solution, |load| {
                load.iter_mut().zip(&face).for_each(|(load, f)| *load += 2.0 * velocity * f)
            });
            let mean = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| 0.5 * (a + b)).collect::<Vec<f64>>();
            let rate = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (b - a) / step).collect::<Vec<f64>>();
            let (psi, eta) = (mean(&before.potential, &waves.potential), mean(&before.auxiliary, &waves.auxiliary));
            let (p, eta_rate) = (rate(&before.potential, &waves.potential), rate(&before.auxiliary, &waves.auxiliary));
            let p_rate = rate(&before.pressure, &waves.pressure);
            let Acoustics { compliance, inertance, arc, tangential, tangential_own, .. } = &waves.acoustics;
            let product = |matrix: &Sparse, scale: f64, x: &[f64]| {
                let mut out = vec![0.0; matrix.rows()];
                matrix.add_product(scale, x, &mut out);
                out
            };
            let mut bend_on_water = vec![0.0; psi.len()];
            tangential.add_transposed(1.0, &eta, &mut bend_on_water);
            let water = vec![
                product(compliance, 1.0, &p_rate),
                product(arc, 1.0 / (density * c), &p),
                product(inertance, 1.0, &psi),
                product(arc, 1.0 / (density * radius), &psi),
                bend_on_water,
                face.iter().map(|face| -velocity * face).collect(),
            ];
            let bend = vec![
                product(tangential, 1.0, &psi),
                product(tangential_own, -1.0 / radius, &eta),
                product(tangential_own, -1.0 / c, &eta_rate),
            ];
            for (worst, terms) in worst.iter_mut().zip([water, bend]) {
                let largest = terms.iter().flatten().fold(0.0_f64, |most, value| most.max(value.abs()));
                let sum = |row: usize| terms.iter().map(|term| term[row]).sum::<f64>().abs();
                *worst = worst.max((0..terms[0].len()).map(sum).fold(0.0, f64::max) / largest);
            }
        }
        worst
    }

    #[test]
    fn a_step_satisfies_both_equations_at_its_middle() {
        for baffle in [Baffle::Rigid, Baffle::Soft] {
            let [water, arc] = residuals(baffle);
            // Rounding, magnified by Q/Δ² against the rest and by sixty steps.
            assert!(water < 1e-10 && arc < 1e-10, "{baffle:?}: {water:e} {arc:e}");
        }
    }
}
