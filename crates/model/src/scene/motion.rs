//! The piston's motion as formulas: displacement and exact derivative.

use std::f64::consts::PI;

use super::{Drive, DriveKind, PistonMotion, drive::one_by_one};
use granchain_signal::spline::{Ends, Spline};

/// The motion of a piston, α·drive. At t < 0 the piston is at rest at 0.
///
/// - sine: sin ωt on 0…T, T = cycles/f0, then 0. The velocity jumps at 0 and T; the displacement does not if 2·cycles is whole.
/// - tone burst: sin ωt · (1 − e^(−t/τ))/(1 − e^(−T/τ)) on 0…T, then sin ωt · e^(−(t − T)/τ); with τ = 0 as the sine.
/// - Gaussian burst: sin ω(t − T/2) · exp(−½(2.5 x)²), x = (t − T/2)/(T/2), on 0…T. The envelope is 0.044 at its ends, so the velocity
///   jumps by that fraction of its peak; the displacement does not if `cycles` is whole.
/// - record: the quintic spline through the samples (C⁴), in the record's own time. Where the first or the last sample is 0 the motion begins or
///   ends there, with the velocity that the samples have, which may jump as a sine's does; elsewhere it returns to 0 within a few sampling steps.
/// - a record not read yet: at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    shape: Shape,
    /// α × amplitude, m.
    scale: f64,
    breaks: Vec<f64>,
    period: f64,
}

#[derive(Debug, Clone, PartialEq)]
enum Shape {
    Sine {
        angular: f64,
    },
    ToneBurst {
        angular: f64,
        end: f64,
        /// 1/τ, 1/s.
        rate: f64,
        /// 1/(1 − exp(−T/τ)).
        norm: f64,
    },
    Gaussian {
        angular: f64,
        middle: f64,
    },
    Record(Box<Spline>),
    Rest,
}

impl Motion {
    pub(super) fn new(drive: &Drive, amplitude_scale: f64) -> Self {
        let angular = 2.0 * PI * drive.frequency;
        let scale = amplitude_scale * drive.amplitude;
        let (shape, breaks) = match &drive.kind {
            DriveKind::SineCycles { cycles } => (Shape::Sine { angular }, vec![0.0, cycles / drive.frequency]),
            DriveKind::ToneBurst { cycles, ring_up } => {
                let end = cycles / drive.frequency;
                let shape = if *ring_up > 0.0 {
                    let norm = -1.0 / (-end / ring_up).exp_m1();
                    Shape::ToneBurst { angular, end, rate: 1.0 / ring_up, norm }
                } else {
                    Shape::Sine { angular }
                };
                (shape, vec![0.0, end])
            }
            DriveKind::GaussianBurst { cycles } => {
                let end = cycles / drive.frequency;
                (Shape::Gaussian { angular, middle: end / 2.0 }, vec![0.0, end])
            }
            DriveKind::Record { displacement, .. } => {
                let end = |value: Option<&f64>| if value == Some(&0.0) { Ends::Natural } else { Ends::Zero };
                let spline =
                    Spline::between(displacement, [end(displacement.values.first()), end(displacement.values.last())]);
                // The tails before the first sample are part of the smooth motion; what lies before t = 0 is cut.
                let first = spline.support().0.max(0.0);
                let last = spline.support().1.max(first);
                (Shape::Record(Box::new(spline)), vec![first, last])
            }
            DriveKind::UnreadRecord { .. } | DriveKind::Striker { .. } => (Shape::Rest, Vec::new()),
        };
        Self { shape, scale, breaks, period: 1.0 / drive.frequency }
    }
}

impl PistonMotion for Motion {
    #[inline]
    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64) {
        if piece == 0 {
            return (0.0, 0.0);
        }
        let (displacement, velocity) = match &self.shape {
            Shape::Sine { angular } if piece == 1 => {
                let (sin, cos) = (angular * t).sin_cos();
                (sin, angular * cos)
            }
            Shape::ToneBurst { angular, end, rate, norm } => {
                let (sin, cos) = (angular * t).sin_cos();
                let (envelope, slope) = if piece == 1 {
                    let lost = (-rate * t).exp_m1();
                    (-norm * lost, norm * rate * (1.0 + lost))
                } else {
                    let left = (-rate * (t - end)).exp();
                    (left, -rate * left)
                };
                (envelope * sin, slope * sin + envelope * angular * cos)
            }
            Shape::Gaussian { angular, middle } if piece == 1 => {
                let (sin, cos) = (angular * (t - middle)).sin_cos();
                let x = 2.5 * (t - middle) / middle;
                let envelope = (-0.5 * x * x).exp();
                let slope = -x * 2.5 / middle * envelope;
                (envelope * sin, slope * sin + envelope * angular * cos)
            }
            Shape::Record(spline) if piece == 1 => spline.at(t),
            _ => (0.0, 0.0),
        };
        (self.scale * displacement, self.scale * velocity)
    }

    fn breaks(&self) -> &[f64] {
        &self.breaks
    }

    fn longest_step(&self) -> f64 {
        self.period / 8.0
    }

    fn sample(&self, times: &[f64], displacements: &mut [f64], velocities: &mut [f64]) {
        match self.shape {
            Shape::Sine { angular } => {
                granchain_signal::vectors::of_four(Sine { motion: self, angular, times, displacements, velocities });
            }
            _ => one_by_one(self, times, displacements, velocities),
        }
    }
}

/// Angle from an instant up to which those behind it are turned from it, rad: a piston's longest step.
const NEAR: f64 = 0.25 * PI;

/// sin θ and cos θ of small angles, |θ| ≤ [`NEAR`], by their series up to θ¹⁵ and θ¹⁶: they leave 10⁻¹⁷ out.
#[inline(always)]
fn turned(angles: [f64; 4]) -> ([f64; 4], [f64; 4]) {
    let squares = angles.map(|angle| angle * angle);
    let series = |mut n: f64| {
        let mut sum = [1.0; 4];
        while n > 1.5 {
            for (sum, square) in sum.iter_mut().zip(squares) {
                *sum = 1.0 - *sum * (square * (1.0 / (n * (n - 1.0))));
            }
            n -= 2.0;
        }
        sum
    };
    let (sine, cosine) = (series(15.0), series(16.0));
    (std::array::from_fn(|k| angles[k] * sine[k]), cosine)
}

struct Sine<'a> {
    motion: &'a Motion,
    /// ω, rad/s.
    angular: f64,
    times: &'a [f64],
    displacements: &'a mut [f64],
    velocities: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Sine<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { motion, angular, times, displacements, velocities } = self;
        let (from, to) = (motion.breaks[0], motion.breaks[1]);
        let mut begin = 0;
        while let Some(&first) = times.get(begin) {
            let near = times[begin..].iter().take_while(|t| (angular * (**t - first)).abs() <= NEAR).count();
            let stretch = begin..begin + near.max(1);
            begin = stretch.end;
            let (sine, cosine) = (angular * first).sin_cos();
            let sets = displacements[stretch.clone()].chunks_mut(4).zip(velocities[stretch.clone()].chunks_mut(4));
            for (times, (displacements, velocities)) in times[stretch].chunks(4).zip(sets) {
                let at: [f64; 4] = std::array::from_fn(|k| times.get(k).copied().unwrap_or(to));
                let scale = at.map(|t| if t >= from && t < to { motion.scale } else { 0.0 });
                let (s, c) = turned(at.map(|t| angular * (t - first)));
                let displacement: [f64; 4] = std::array::from_fn(|k| scale[k] * (sine * c[k] + cosine * s[k]));
                let velocity: [f64; 4] = std::array::from_fn(|k| scale[k] * angular * (cosine * c[k] - sine * s[k]));
                displacements.copy_from_slice(&displacement[..times.len()]);
                velocities.copy_from_slice(&velocity[..times.len()]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_signal::Series;

    fn drive(kind: DriveKind) -> Drive {
        Drive { kind, amplitude: 1e-6, frequency: 73e3 }
    }

    fn all() -> Vec<Drive> {
        let record = Series::new(
            0.0,
            0.4e-6,
            (0..600)
                .map(|i| {
                    1e-6 * (PI * f64::from(i) / 599.0).sin().powi(2) * (2.0 * PI * 73e3 * 0.4e-6 * f64::from(i)).sin()
                })
                .collect(),
        );
        vec![
            drive(DriveKind::SineCycles { cycles: 5.0 }),
            drive(DriveKind::ToneBurst { cycles: 7.0, ring_up: 30e-6 }),
            drive(DriveKind::ToneBurst { cycles: 7.0, ring_up: 0.0 }),
            drive(DriveKind::GaussianBurst { cycles: 30.0 }),
            Drive {
                amplitude: 1.0,
                ..drive(DriveKind::Record {
                    recorded_until: record.end(),
                    displacement: record,
                    shakes: vec![],
                    file: None,
                })
            },
        ]
    }

    #[test]
    fn velocity_is_the_derivative_of_displacement_for_every_drive() {
        for drive in all() {
            let motion = drive.concrete_motion(0.7);
            let h = 1e-9;
            for index in 1..4000 {
                let t = f64::from(index) * 0.1003e-6;
                if motion.breaks().iter().any(|instant| (instant - t).abs() < 3.0 * h) {
                    continue;
                }
                let slope = (8.0 * (motion.at(t + h).0 - motion.at(t - h).0)
                    - (motion.at(t + 2.0 * h).0 - motion.at(t - 2.0 * h).0))
                    / (12.0 * h);
                // Rounding of the difference quotient: 1e-6 m × 2e-16 / 1e-9 s, some tens of it.
                assert!((slope - motion.at(t).1).abs() < 1e-8, "{drive:?} at {t}: {slope} {}", motion.at(t).1);
            }
        }
    }

    #[test]
    fn samples_are_what_the_motion_is_at_their_instants() {
        for drive in all() {
            let motion = drive.concrete_motion(0.7);
            for count in [0, 1, 4, 11, 150] {
                for first in (-20..700).map(|k| f64::from(k) * 0.5e-6) {
                    let times: Vec<f64> = (0..count).map(|k| first + f64::from(k) * 0.31e-7).collect();
                    let (mut u, mut v) = (vec![f64::NAN; times.len()], vec![f64::NAN; times.len()]);
                    motion.sample(&times, &mut u, &mut v);
                    for ((t, u), v) in times.iter().zip(u).zip(v) {
                        let (displacement, velocity) = motion.at(*t);
                        let apart = ((u - displacement) / 1e-6).hypot((v - velocity) / 0.46);
                        // Rounding of the angle and of some numbers near 1.
                        let rounding = (4.0 + 2.0 * PI * 73e3 * t.abs()) * f64::EPSILON;
                        assert!(apart < rounding, "{drive:?} at {t}: {apart:e} {rounding:e}");
                    }
                }
            }
        }
    }

    #[test]
    fn displacement_never_jumps_and_rests_at_zero_before_the_start() {
        for drive in all() {
            let motion = drive.motion(1.0);
            assert_eq!(motion.at(-1e-9), (0.0, 0.0));
            for (piece, instant) in motion.breaks().iter().enumerate() {
                let (left, right) = (motion.on_piece(piece, *instant).0, motion.on_piece(piece + 1, *instant).0);
                // sin 2πn in double precision.
                assert!((left - right).abs() < 1e-19, "{drive:?} at {instant}: {left} {right}");
            }
        }
    }

    #[test]
    fn sine_starts_with_a_velocity_jump_of_amplitude_times_angular_frequency() {
        let motion = drive(DriveKind::SineCycles { cycles: 5.0 }).motion(2.0);
        assert_eq!(motion.breaks(), [0.0, 5.0 / 73e3]);
        assert!((motion.at(0.0).1 - 2e-6 * 2.0 * PI * 73e3).abs() < 1e-15);
        assert_eq!(motion.at(5.0 / 73e3), (0.0, 0.0));
        // The formula up to its own end: the integrator's left limit.
        assert!((motion.on_piece(1, 5.0 / 73e3).1 - 2e-6 * 2.0 * PI * 73e3).abs() < 1e-14);
    }

    #[test]
    fn tone_burst_envelope_reaches_one_at_its_end_and_then_decays_with_its_time_constant() {
        let (tau, cycles) = (100e-6, 40.25);
        let motion = drive(DriveKind::ToneBurst { cycles, ring_up: tau }).motion(1.0);
        // Crests: sin = 1 at a quarter period beyond a whole number.
        let crest = |n: f64| (n + 0.25) / 73e3;
        assert!((motion.at(crest(40.0)).0 - 1e-6).abs() < 1e-18);
        let expected = (-(crest(52.0) - crest(40.0)) / tau).exp();
        assert!((motion.at(crest(52.0)).0 / 1e-6 - expected).abs() < 1e-9);
        let early = (1.0 - (-crest(3.0) / tau).exp()) / (1.0 - (-cycles / 73e3 / tau).exp());
        assert!((motion.at(crest(3.0)).0 / 1e-6 - early).abs() < 1e-9);
    }

    #[test]
    fn gaussian_burst_is_odd_about_its_middle_and_almost_as_high_as_its_amplitude() {
        let motion = drive(DriveKind::GaussianBurst { cycles: 30.0 }).motion(1.0);
        let middle = 15.0 / 73e3;
        assert!(motion.at(middle).0.abs() < 1e-20);
        let quarter = 0.25 / 73e3;
        // exp(−½(2.5/60)²): the crest next to the middle.
        let crest = 1e-6 * (-0.5f64 * (2.5f64 / 60.0).powi(2)).exp();
        assert!((motion.at(middle + quarter).0 - crest).abs() < 1e-18);
        assert!((motion.at(middle - quarter).0 + crest).abs() < 1e-18);
        // The envelope at the ends: exp(−3.125).
        assert!((motion.at(0.0).1.abs() - 1e-6 * 2.0 * PI * 73e3 * (-3.125f64).exp()).abs() < 1e-12);
    }

    #[test]
    fn record_is_replayed_through_its_samples_in_its_own_time() {
        let series = Series::new(3e-6, 0.5e-6, (0..80).map(|i| 1e-6 * (0.3 * f64::from(i)).sin()).collect());
        let (displacement, recorded_until) = (series.clone(), series.end());
        let kind = DriveKind::Record { displacement, recorded_until, shakes: vec![], file: None };
        let motion = Drive { amplitude: 1.0, ..drive(kind) }.motion(1.5);
        for index in 0..80 {
            assert!((motion.at(series.time(index)).0 - 1.5 * series.values[index]).abs() < 1e-19);
        }
        assert_eq!(motion.at(200e-6), (0.0, 0.0));
    }
}
