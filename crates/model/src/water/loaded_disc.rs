//! The disc on the water behind the last contact of meshed beads, with the dashpot that stands there and the static force it rests under.
//!
//! ```text
//! w = w⁰ + C (λ − λ_r) + C_m D              at the points
//! ẇ_m = ẇ_m⁰ + (2/Δ) (C_mᵀ (λ − λ_r) + C_mm D)     in the disc's few lowest modes, which a dashpot sees
//! ```
//!
//! - λ_r: forces of the points at rest, N; the disc's motion is counted from there
//! - D: force of the dashpot, N. It pushes the few lowest modes alone, by their share at the pole (`DASHPOT_MODES`): a linear dashpot
//!   jumps at first touch, and a jump on the disc's finer shapes would ring at 7 to 12 MHz until the contact opens again
//! - C_m, C_mm: what D moves at the points and in these modes over a step Δ, m/N

use std::fmt;

use super::{
    WaterError,
    front::{Front, Handles, TouchedDisc, WaterRecord},
};
use crate::{response::SolverWork, scene::WaterSettings};

pub(crate) struct LoadedDisc {
    disc: Box<dyn TouchedDisc>,
    points: usize,
    step: f64,
    /// C between the points, row by row, m/N.
    compliance: Vec<f64>,
    dashpot: Option<Dashpot>,
    /// λ_r, N, and C λ_r, m; empty without a static force.
    rest: [Vec<f64>; 2],
    /// Displacement of the points and, with a dashpot, of the modes it sees, m: without forces at the end of the step, and as it is.
    predicted: Vec<f64>,
    retreat: Vec<f64>,
    forces: Vec<f64>,
}

#[derive(Debug)]
struct Dashpot {
    /// C_m, m/N.
    coupling: Vec<f64>,
    /// C_mm, m/N.
    own: f64,
    /// Displacement (m), its change in the last step, and velocity (m/s) of the modes at the last instant.
    place: f64,
    moved: f64,
    velocity: f64,
}

impl fmt::Debug for LoadedDisc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("LoadedDisc").field("retreat", &self.retreat).finish_non_exhaustive()
    }
}

impl LoadedDisc {
    /// At rest.
    ///
    /// - `step`: Δ, s
    /// - `is_damped`: whether a dashpot stands at the disc; without one its modes are not followed apart
    /// - `rest`: λ_r, N; empty for none
    pub(crate) fn new(
        front: &Front,
        water: &WaterSettings,
        step: f64,
        is_damped: bool,
        rest: &[f64],
    ) -> Result<Self, WaterError> {
        let handles = if is_damped { Handles::PointsAndModes } else { Handles::Points };
        Ok(Self::of(front.on_water(water, step, handles)?, front.points(), step, is_damped, rest))
    }

    fn of(disc: Box<dyn TouchedDisc>, points: usize, step: f64, is_damped: bool, rest: &[f64]) -> Self {
        let count = points + usize::from(is_damped);
        let all = disc.compliance();
        let compliance: Vec<f64> =
            all.chunks_exact(count).take(points).flat_map(|row| &row[..points]).copied().collect();
        let dashpot = is_damped.then(|| Dashpot {
            coupling: all[points * count..][..points].to_vec(),
            own: all[count * count - 1],
            place: 0.0,
            moved: 0.0,
            velocity: 0.0,
        });
        let held_displacement = |row: &[f64]| row.iter().zip(rest).map(|(c, force)| c * force).sum::<f64>();
        let rest = [rest.to_vec(), all.chunks_exact(count).map(held_displacement).collect()];
        let predicted = rest[1].iter().map(|held_displacement| -held_displacement).collect();
        let (retreat, forces) = (vec![0.0; count], vec![0.0; count]);
        Self { disc, points, step, compliance, dashpot, rest, predicted, retreat, forces }
    }

    /// C between the points, row by row, m/N.
    pub(crate) fn compliance(&self) -> &[f64] {
        &self.compliance
    }

    /// C_m, m/N; empty without a dashpot.
    pub(crate) fn coupling(&self) -> &[f64] {
        self.dashpot.as_ref().map_or(&[], |dashpot| &dashpot.coupling)
    }

    /// What the dashpot's own force adds to the modes it sees at the end of a step: C_mm (m/N) and 2 C_mm/Δ (m/s/N).
    pub(crate) fn mobility(&self) -> [f64; 2] {
        self.dashpot.as_ref().map_or([0.0; 2], |dashpot| [dashpot.own, 2.0 * dashpot.own / self.step])
    }

    pub(crate) fn predict(&mut self) {
        self.disc.predict(&mut self.predicted);
        if !self.rest[0].is_empty() {
            self.predicted
                .iter_mut()
                .zip(&self.rest[1])
                .for_each(|(retreat, held_displacement)| *retreat -= held_displacement);
        }
    }

    /// Displacement of the points into the water at the end of the step that [`LoadedDisc::predict`] began, without forces there, m.
    pub(crate) fn predicted(&self) -> &[f64] {
        &self.predicted[..self.points]
    }

    /// Displacement of the points into the water, m.
    pub(crate) fn retreat(&self) -> &[f64] {
        &self.retreat[..self.points]
    }

    /// Displacement (m) and velocity (m/s) of the modes the dashpot sees, predicted for the end of the step without any force there.
    pub(crate) fn predicted_modes(&self) -> [f64; 2] {
        self.dashpot.as_ref().map_or([0.0; 2], |dashpot| {
            let end = self.predicted[self.points];
            [end, 2.0 * (end - dashpot.place) / self.step - dashpot.velocity]
        })
    }

    /// The same with the forces λ (N) at the end of the step, the dashpot's left out.
    pub(crate) fn modes_under(&self, forces: &[f64]) -> [f64; 2] {
        let [place, velocity] = self.predicted_modes();
        let moved: f64 = self.coupling().iter().zip(forces).map(|(c, force)| c * force).sum();
        [place + moved, velocity + 2.0 * moved / self.step]
    }

    /// Finish the step that [`LoadedDisc::predict`] began, with the forces λ of the points and D of the dashpot (N) at its end.
    pub(crate) fn push(&mut self, forces: &[f64], damping: f64) {
        self.forces[..self.points].copy_from_slice(forces);
        if !self.rest[0].is_empty() {
            self.forces.iter_mut().zip(&self.rest[0]).for_each(|(force, rest)| *force -= rest);
        }
        if self.dashpot.is_some() {
            self.forces[self.points] = damping;
        }
        self.disc.push(&self.forces);
        self.disc.retreat(&mut self.retreat);
        if let Some(dashpot) = &mut self.dashpot {
            let place = self.retreat[self.points];
            dashpot.moved = place - dashpot.place;
            dashpot.velocity = 2.0 * dashpot.moved / self.step - dashpot.velocity;
            dashpot.place = place;
        }
    }

    /// How far the modes that the dashpot sees moved in the last step, m.
    pub(crate) fn moved(&self) -> f64 {
        self.dashpot.as_ref().map_or(0.0, |dashpot| dashpot.moved)
    }

    /// Energy of the disc over that at rest, and work on the water, J.
    pub(crate) fn energies(&mut self) -> [f64; 2] {
        let lifted: f64 = self.rest[0].iter().zip(&self.retreat).map(|(force, retreat)| force * retreat).sum();
        [self.disc.stored() + lifted, self.disc.work_on_water()]
    }

    /// Add its unknowns, and what it did so far, to the counts of a run.
    pub(crate) fn count(&self, work: &mut SolverWork) {
        self.disc.on_water().count(work);
    }

    pub(crate) fn sample(&self, record: &mut WaterRecord) {
        record.sample(self.disc.on_water());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass without a spring, by the trapezoidal rule, touched at two points and by a dashpot.
    struct Mass {
        mass: f64,
        step: f64,
        place: f64,
        velocity: f64,
        force: f64,
        compliance: Vec<f64>,
    }

    impl TouchedDisc for Mass {
        fn compliance(&self) -> &[f64] {
            &self.compliance
        }

        fn predict(&mut self, retreat: &mut [f64]) {
            retreat.fill(self.place + self.step * (self.velocity + 0.25 * self.step * self.force / self.mass));
        }

        fn push(&mut self, forces: &[f64]) {
            let force: f64 = forces.iter().sum();
            let velocity = self.velocity + 0.5 * self.step * (self.force + force) / self.mass;
            self.place += 0.5 * self.step * (self.velocity + velocity);
            (self.velocity, self.force) = (velocity, force);
        }

        fn retreat(&self, out: &mut [f64]) {
            out.fill(self.place);
        }

        fn stored(&mut self) -> f64 {
            0.5 * self.mass * self.velocity.powi(2)
        }

        fn on_water(&self) -> &dyn crate::water::OnWater {
            unreachable!("no test listens to it")
        }

        fn work_on_water(&self) -> f64 {
            0.0
        }
    }

    const MASS: f64 = 2e-6;

    fn behind(rest: &[f64]) -> LoadedDisc {
        let (mass, step) = (MASS, 25e-9);
        let own = 0.25 * step * step / mass;
        let disc = Mass { mass, step, place: 0.0, velocity: 0.0, force: 0.0, compliance: vec![own; 9] };
        LoadedDisc::of(Box::new(disc), 2, step, true, rest)
    }

    #[test]
    fn place_and_velocity_of_what_a_dashpot_sees_are_those_the_forces_make() {
        let mut disc = behind(&[]);
        let [displacement, velocity] = disc.mobility();
        for instant in 0..200 {
            let (forces, damping) = ([0.3 * f64::from(instant), 0.1], 0.2 - 0.01 * f64::from(instant % 7));
            disc.predict();
            let [place, speed] = disc.modes_under(&forces);
            let retreat = disc.predicted()[1] + disc.coupling()[1] * damping;
            disc.push(&forces, damping);
            let found = disc.retreat()[0];
            assert!((place + displacement * damping - found).abs() <= 1e-12 * found.abs().max(1e-12), "{instant}");
            // Both points give way to each other's forces too.
            let whole = retreat + disc.compliance()[2] * forces[0] + disc.compliance()[3] * forces[1];
            assert!((whole - found).abs() <= 1e-12 * found.abs().max(1e-12), "{instant}");
            // All forces push it forwards: ½ m v² has the sign too.
            let now = (2.0 * disc.disc.stored() / MASS).sqrt();
            assert!((speed + velocity * damping - now).abs() <= 1e-9 * now.abs().max(1e-9), "{instant}: {speed} {now}");
        }
    }

    #[test]
    fn under_its_static_force_it_stays_and_moving_it_is_work() {
        let rest = [0.3, 0.2];
        let mut disc = behind(&rest);
        for _ in 0..50 {
            disc.predict();
            // What the points' own compliance gives back.
            assert!((disc.predicted()[0] + disc.compliance()[0] * 0.5).abs() < 1e-24);
            disc.push(&rest, 0.0);
            assert_eq!(disc.retreat(), &[0.0; 2]);
            assert_eq!(disc.energies(), [0.0; 2]);
        }
        disc.predict();
        disc.push(&[0.4, 0.2], 0.0);
        let place = disc.retreat()[0];
        let kinetic = disc.disc.stored();
        assert!(place > 0.0 && (disc.energies()[0] - kinetic - 0.5 * place).abs() < 1e-12 * kinetic);
    }
}
