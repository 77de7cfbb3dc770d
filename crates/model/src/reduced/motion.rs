//! Rigid and modal motion of one body, by kick, drift and kick.
//!
//! ```text
//! v += h F/(2 m),  q̇_k += h (f_k − ω_k² q_k)/(2 μ_k);   u += h v,  q_k += h q̇_k;   the same kick with the new forces
//! ```
//!
//! μ_k = (x/sin x)² with x = ω_k h/2 is the modal mass with which a free mode turns at exactly ω_k.

use super::{
    losses::{ModalLoss, StepLaw},
    reduction::Kind,
};
use crate::{
    holder::{Hold, HoldLoss},
    number::Number,
};

#[derive(Debug, Clone)]
pub(super) struct Moving<N> {
    /// 1/m, 1/kg; 0 of a clamped body.
    inverse_mass: f64,
    /// Displacement of the mass mean along z, m.
    pub(super) rigid: N,
    pub(super) rigid_velocity: N,
    /// Its displacement in the last drift, m.
    pub(super) travelled: N,
    /// q of every mode, m·√kg.
    pub(super) modal: Vec<N>,
    modal_velocity: Vec<N>,
    /// Forces on the modes, N/√kg.
    pub(super) forces: Vec<N>,
    squares: Vec<f64>,
    masses: Vec<f64>,
    /// h/(2 μ), s.
    halves: Vec<f64>,
    step: f64,
    /// What its material loses; none of an elastic one.
    pub(super) loss: Option<ModalLoss<N>>,
    /// Energy lost in material and bead guide so far, J.
    pub(super) material: N,
    pub(super) held: HoldLoss<N>,
}

impl<N: Number> Moving<N> {
    pub(super) fn new(kind: &Kind, squares: &[f64], law: Option<&StepLaw>, step: f64) -> Self {
        // The modal masses are those of fast motion, which is what a step must follow.
        let fast = law.map_or(1.0, StepLaw::fast);
        let mass = |square: &f64| {
            let half = 0.5 * (fast * square).sqrt() * step;
            (half / half.sin()).powi(2)
        };
        let masses: Vec<f64> = squares.iter().map(mass).collect();
        let zeros = vec![N::ZERO; squares.len()];
        Self {
            inverse_mass: if kind.is_free { 1.0 / kind.mass } else { 0.0 },
            rigid: N::ZERO,
            rigid_velocity: N::ZERO,
            travelled: N::ZERO,
            modal: zeros.clone(),
            modal_velocity: zeros.clone(),
            forces: zeros,
            squares: squares.to_vec(),
            halves: masses.iter().map(|mass| 0.5 * step / mass).collect(),
            masses,
            step,
            loss: law.map(|law| ModalLoss::new(law, squares)),
            material: N::ZERO,
            held: HoldLoss::none(),
        }
    }

    /// Velocity of the mass mean per force held through the second kick, m/(N·s).
    pub(super) fn mobility(&self) -> f64 {
        0.5 * self.step * self.inverse_mass
    }

    pub(super) fn settle(&mut self) {
        for ((q, force), square) in self.modal.iter_mut().zip(&self.forces).zip(&self.squares) {
            *q = *force / *square;
        }
    }

    /// Half a step of velocity under the axial force `net` (N).
    #[inline(always)]
    pub(super) fn kick(&mut self, net: N) {
        self.rigid_velocity = self.rigid_velocity + net * (0.5 * self.step * self.inverse_mass);
        let modes = self.modal.iter().zip(&self.forces).zip(self.squares.iter().zip(&self.halves));
        for (velocity, ((q, force), (square, half))) in self.modal_velocity.iter_mut().zip(modes) {
            *velocity = *velocity + (*force - *q * *square) * *half;
            N::pass();
        }
        if let Some((strength, behind)) = self.loss.as_ref().and_then(ModalLoss::stiffening) {
            let parts = behind.iter().zip(self.squares.iter().zip(&self.halves));
            for (velocity, (behind, (square, half))) in self.modal_velocity.iter_mut().zip(parts) {
                *velocity = *velocity - *behind * (strength * square * half);
            }
        }
    }

    #[inline(always)]
    pub(super) fn drift(&mut self) {
        self.travelled = self.rigid_velocity * self.step;
        self.rigid = self.rigid + self.travelled;
        let step = self.step;
        self.modal.iter_mut().zip(&self.modal_velocity).for_each(|(q, velocity)| *q = *q + *velocity * step);
    }

    /// The same with what bead guide and material take from the velocities, half-way: `hold` has the bead this is and the forces of the contacts
    /// before and after it (N).
    #[inline(always)]
    pub(super) fn drift_losing(&mut self, hold: Option<(&Hold<N>, usize, [N; 2])>) {
        let step = self.step;
        let velocity = self.rigid_velocity;
        let mut drag = None;
        if let Some((hold, bead, forces)) = hold {
            let left = hold.slowed(bead, velocity, forces);
            hold.add_loss(bead, velocity, left, &mut self.held);
            self.rigid_velocity = left[2];
            let half = hold.drag_half(bead);
            drag = hold.drags().then(|| half * half);
        }
        self.travelled = (velocity + self.rigid_velocity) * (0.5 * step);
        self.rigid = self.rigid + self.travelled;
        for k in 0..self.modal.len() {
            let before = self.modal_velocity[k];
            let half_mass = 0.5 * self.masses[k];
            let mut after = before;
            if let Some(loss) = &self.loss {
                after = after * loss.damping[k];
                self.material = self.material + (before * before - after * after) * half_mass;
            }
            if let Some(drag) = drag {
                let dragged = after * drag;
                self.held.drag = self.held.drag + (after * after - dragged * dragged) * half_mass;
                after = dragged;
            }
            self.modal_velocity[k] = after;
            let moved = (before + after) * (0.5 * step);
            self.modal[k] = self.modal[k] + moved;
            if let Some(loss) = &mut self.loss {
                self.material = self.material + loss.relax(k, moved, self.squares[k]);
            }
        }
    }
}

impl Moving<f64> {
    /// Kinetic energy, and that stored in the modes, J.
    pub(super) fn energy(&self) -> (f64, f64) {
        let rigid = if self.inverse_mass > 0.0 { self.rigid_velocity.powi(2) / self.inverse_mass } else { 0.0 };
        let moving = self.masses.iter().zip(&self.modal_velocity).map(|(mass, v)| mass * v * v).sum::<f64>();
        let bent = self.squares.iter().zip(&self.modal).map(|(square, q)| square * q * q).sum::<f64>();
        let relaxing = self.loss.as_ref().map_or(0.0, |loss| loss.energy(&self.squares));
        (0.5 * (rigid + moving), 0.5 * bent + relaxing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kind() -> Kind {
        Kind { mass: 4e-6, is_free: true, squares: Vec::new() }
    }

    #[test]
    fn a_free_mode_turns_at_its_own_frequency_at_any_step() {
        for phase in [0.1, 1.0, 2.0_f64] {
            let step = 5e-8;
            let mut body = Moving::<f64>::new(&kind(), &[(phase / step).powi(2)], None, step);
            body.modal[0] = 1.0;
            for taken in 1..=1000 {
                body.kick(0.0);
                body.drift();
                body.kick(0.0);
                let expected = (phase * f64::from(taken)).cos();
                assert!((body.modal[0] - expected).abs() < 1e-10, "{phase} {taken}: {} {expected}", body.modal[0]);
            }
        }
    }

    #[test]
    fn a_held_force_bends_a_mode_about_its_static_answer_at_any_step() {
        let step = 5e-8;
        let square = (1.7 / step) * (1.7 / step);
        let mut body = Moving::<f64>::new(&kind(), &[square], None, step);
        body.forces[0] = 3.0;
        let mut sum = 0.0;
        // 1.7 rad a step: the mean over many turns.
        for _ in 0..100_000 {
            body.kick(0.0);
            body.drift();
            body.kick(0.0);
            sum += body.modal[0];
        }
        assert!((sum / 1e5 * square / 3.0 - 1.0).abs() < 1e-4, "{}", sum / 1e5 * square / 3.0);
        body.settle();
        assert_eq!(body.modal[0], 3.0 / square);
    }

    #[test]
    fn backwards_in_time_it_returns() {
        let mut body = Moving::<f64>::new(&kind(), &[1e13, 3e14], None, 5e-8);
        body.modal.copy_from_slice(&[1e-9, -2e-9]);
        body.rigid_velocity = 0.2;
        let steps = |body: &mut Moving<f64>| {
            for _ in 0..500 {
                body.kick(0.3);
                body.drift();
                body.kick(0.3);
            }
        };
        steps(&mut body);
        body.rigid_velocity = -body.rigid_velocity;
        body.modal_velocity.iter_mut().for_each(|v| *v = -*v);
        steps(&mut body);
        assert!(body.rigid.abs() < 1e-18 && (body.rigid_velocity + 0.2).abs() < 1e-14);
        assert!((body.modal[0] - 1e-9).abs() < 1e-21 && (body.modal[1] + 2e-9).abs() < 1e-21);
    }
}
