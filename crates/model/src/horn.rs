//! The motion that the push of the chain gives a loaded horn ([`Horn`]), step after step beside any model of the chain.
//!
//! ```text
//! M q̈ + (M ω/Q) q̇ + M ω² q = −(F₀ − F_s)
//! ```
//!
//! Half a kick of the force at the start of the step, an exact turn of the free oscillator over the step, half a kick of the force at its end:
//!
//! ```text
//! q̇ −= h (F₀ − F_s)/(2M);    (q, q̇) ← T(h) (q, q̇),  T(h) = exp(h [[0, 1], [−ω², −ω/Q]]);    q̇ −= h (F₀′ − F_s)/(2M)
//! ```
//!
//! Second order for any Q and ω h, and symplectic without loss, as the chain's own kick, drift and kick. q at the end of a step is known before the force
//! there is; the second kick belongs to the forces of that instant, so that a dashpot at the piston sees the velocity it changes itself.
//!
//! Energy: the horn holds ½ M q̇² + ½ M ω² q² − F_s q, counted from its rest under F_s; the turns alone lose any.

use serde::{Deserialize, Serialize};

use crate::{
    number::Number,
    scene::{Horn, Scene},
};

/// What a step of one length does to the horn, in one run or in several.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct HornStep<N> {
    /// T(h) row by row; s and 1/s off the diagonal.
    turn: [[N; 2]; 2],
    /// h/(2M), s/kg.
    kick: N,
    mass: N,
    /// M ω², N/m.
    stiffness: N,
    /// F_s, N.
    held: N,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(crate) struct HornMotion<N> {
    /// q, m.
    pub(crate) displacement: N,
    /// q̇, m/s.
    pub(crate) velocity: N,
    /// Energy lost so far, J.
    pub(crate) lost: N,
}

impl<N: Number> HornMotion<N> {
    pub(crate) fn at_rest() -> Self {
        Self { displacement: N::ZERO, velocity: N::ZERO, lost: N::ZERO }
    }
}

impl<N: Number> HornStep<N> {
    /// Of steps of `step` (s), with the horn and the static force (N) of each run.
    pub(crate) fn new(each: impl Fn(usize) -> (Horn, f64), step: f64) -> Self {
        let of = |value: &dyn Fn(Horn, f64) -> f64| {
            N::of(|place| {
                let (horn, held) = each(place);
                value(horn, held)
            })
        };
        let turn = [0, 1].map(|row| [0, 1].map(|column| of(&|horn, _| free_turn(&horn, step)[row][column])));
        Self {
            turn,
            kick: of(&|horn, _| 0.5 * step / horn.mass),
            mass: of(&|horn, _| horn.mass),
            stiffness: of(&|horn, _| horn.stiffness()),
            held: of(&|_, held| held),
        }
    }

    /// What a unit of force in the second kick takes from the velocity, m/(N·s).
    #[inline(always)]
    pub(crate) fn mobility(&self) -> N {
        self.kick
    }

    /// The first kick, by the force `pushed` (N) at the start of the step, and the turn: q at its end, and q̇ but for [`HornStep::kick`].
    #[inline(always)]
    pub(crate) fn turn(&self, motion: &mut HornMotion<N>, pushed: N) {
        self.kick(motion, pushed);
        let HornMotion { displacement: q, velocity: v, .. } = *motion;
        let [[a, b], [c, d]] = self.turn;
        let before = self.free_energy(motion);
        (motion.displacement, motion.velocity) = (a * q + b * v, c * q + d * v);
        motion.lost = motion.lost + (before - self.free_energy(motion));
    }

    /// [`HornStep::turn`], and the velocity (m/s) at the end of the step but for the force of the second kick, which is not known yet.
    #[inline(always)]
    pub(crate) fn begin(&self, motion: &mut HornMotion<N>, pushed: N) -> N {
        self.turn(motion, pushed);
        let mut free = *motion;
        self.kick(&mut free, N::ZERO);
        free.velocity
    }

    /// A kick by the force `pushed` (N).
    #[inline(always)]
    pub(crate) fn kick(&self, motion: &mut HornMotion<N>, pushed: N) {
        motion.velocity = motion.velocity - (pushed - self.held) * self.kick;
    }

    #[inline(always)]
    fn free_energy(&self, motion: &HornMotion<N>) -> N {
        let HornMotion { displacement: q, velocity: v, .. } = *motion;
        (self.mass * v * v + self.stiffness * q * q) * 0.5
    }

    /// Energy in the horn's own motion, J, over that at rest under the static force.
    pub(crate) fn energy(&self, motion: &HornMotion<N>) -> N {
        self.free_energy(motion) - self.held * motion.displacement
    }
}

impl HornStep<f64> {
    pub(crate) fn of(scene: &Scene, step: f64) -> Option<Self> {
        let horn = scene.horn?;
        Some(Self::new(|_| (horn, scene.chain.precompression), step))
    }
}

fn free_turn(horn: &Horn, step: f64) -> [[f64; 2]; 2] {
    let square = horn.stiffness() / horn.mass;
    let decay = 0.5 * horn.resistance() / horn.mass;
    let discriminant = square - decay * decay;
    // e^(−γh) times cos and sin/ω_d below the critical damping, cosh and sinh/κ above it.
    let (even, odd) = if discriminant > 0.0 {
        let angular = discriminant.sqrt();
        let (sine, cosine) = (angular * step).sin_cos();
        let left = (-decay * step).exp();
        (left * cosine, left * sine / angular)
    } else if discriminant < 0.0 {
        let rate = (-discriminant).sqrt();
        // γ − κ without cancellation.
        let (slow, fast) = ((-square / (decay + rate) * step).exp(), (-(decay + rate) * step).exp());
        (0.5 * (slow + fast), 0.5 * (slow - fast) / rate)
    } else {
        let left = (-decay * step).exp();
        (left, left * step)
    };
    [[even + decay * odd, odd], [-square * odd, even - decay * odd]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn horn(mass: f64, quality: f64) -> Horn {
        Horn { mass, frequency: 73e3, quality }
    }

    fn step_of(horn: Horn, held: f64, step: f64) -> HornStep<f64> {
        HornStep::new(|_| (horn, held), step)
    }

    #[test]
    fn a_free_horn_rings_and_decays_as_its_closed_form_at_any_quality_and_step() {
        for quality in [0.3, 0.5, 0.8, 1.0, 30.0, 1e6, f64::INFINITY] {
            let own = horn(2e-3, quality);
            let square = own.stiffness() / own.mass;
            let decay = 0.5 * own.resistance() / own.mass;
            for step in [5e-8, 3e-6] {
                let forward = step_of(own, 0.0, step);
                let mut motion = HornMotion { displacement: 1e-6, velocity: 0.0, lost: 0.0 };
                for taken in 1..=400 {
                    forward.turn(&mut motion, 0.0);
                    forward.kick(&mut motion, 0.0);
                    let time = f64::from(taken) * step;
                    let d = square - decay * decay;
                    let (even, odd) = if d.abs() < 1e-9 * square {
                        (1.0, time)
                    } else if d > 0.0 {
                        ((d.sqrt() * time).cos(), (d.sqrt() * time).sin() / d.sqrt())
                    } else {
                        (((-d).sqrt() * time).cosh(), ((-d).sqrt() * time).sinh() / (-d).sqrt())
                    };
                    if decay * time > 300.0 {
                        break;
                    }
                    let expected = 1e-6 * (-decay * time).exp() * (even + decay * odd);
                    // Rounding of 400 turns.
                    assert!((motion.displacement - expected).abs() < 1e-17, "{quality} {step} {taken}");
                }
                let left = forward.energy(&motion);
                let all = 0.5 * own.stiffness() * 1e-12;
                assert!((left + motion.lost - all).abs() < 1e-12 * all, "{quality}");
            }
        }
    }

    #[test]
    fn at_resonance_a_force_in_step_with_it_draws_half_its_square_over_the_resistance() {
        // q̇ = −F̂ sin ωt/D once it has rung up; mean power F̂²/(2D).
        let own = horn(1e-3, 5.0);
        let step = 2e-8;
        let forward = step_of(own, 0.0, step);
        let mut motion = HornMotion::at_rest();
        let period = 1.0 / own.frequency;
        let force = |taken: u32| 3.0 * (2.0 * std::f64::consts::PI * own.frequency * f64::from(taken) * step).sin();
        let steps = (60.0 * period / step) as u32;
        let (mut work, mut from, mut lost) = (0.0, 0.0, 0.0);
        for taken in 1..=steps {
            let before = motion.displacement;
            forward.turn(&mut motion, force(taken - 1));
            forward.kick(&mut motion, force(taken));
            work -= 0.5 * (force(taken - 1) + force(taken)) * (motion.displacement - before);
            if taken == steps / 2 {
                (from, lost) = (work, motion.lost);
            }
        }
        let time = f64::from(steps - steps / 2) * step;
        let expected = 9.0 / (2.0 * own.resistance());
        for mean in [(work - from) / time, (motion.lost - lost) / time] {
            // (ωh)²/12 of the kicks = 7e-6, and the ring-up's rest e^(−30π/5) = 6.5e-9.
            assert!((mean / expected - 1.0).abs() < 2e-5, "{mean} {expected}");
        }
    }

    #[test]
    fn under_its_static_force_it_stays_and_moving_from_there_is_work() {
        let own = horn(1e-3, 40.0);
        let forward = step_of(own, 2.0, 5e-8);
        let mut motion = HornMotion::at_rest();
        for _ in 0..100 {
            forward.turn(&mut motion, 2.0);
            forward.kick(&mut motion, 2.0);
        }
        assert_eq!(motion, HornMotion::at_rest());
        // The chain lets go: 2 N drive it, and the energy balance of `Channels::horn_residual` closes.
        let (mut given, mut pushed) = (0.0, 2.0);
        for _ in 0..4000 {
            let before = motion.displacement;
            forward.turn(&mut motion, pushed);
            forward.kick(&mut motion, 0.5);
            given += 0.5 * (pushed + 0.5) * (motion.displacement - before);
            pushed = 0.5;
        }
        let all = forward.energy(&motion) + motion.lost;
        // Kicks of half a step: (ωh)²/4 = 1.3e-4 of what 1.5 N put into the spring.
        let scale = 1.5 * 1.5 / own.stiffness();
        assert!(motion.lost > 0.3 * scale && (all + given).abs() < 1.4e-4 * scale, "{all:e} {given:e}");
    }
}
