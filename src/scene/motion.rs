//! The piston's motion as formulas: displacement and exact derivative.

use std::f64::consts::PI;

use super::{Drive, DriveKind, PistonMotion};
use crate::signal::spline::{Ends, Spline};

/// The motion of a piston, α·drive. At t < 0 the piston is at rest at 0.
///
/// - sine: sin ωt on 0…T, T = cycles/f0, then 0. The velocity jumps at 0 and T; the displacement does not if 2·cycles is whole.
/// - tone burst: sin ωt · (1 − e^(−t/τ))/(1 − e^(−T/τ)) on 0…T, then sin ωt · e^(−(t − T)/τ); with τ = 0 as the sine.
/// - Gaussian burst: sin ω(t − T/2) · exp(−½(2.5 x)²), x = (t − T/2)/(T/2), on 0…T. The envelope is 0.044 at its ends, so the velocity
///   jumps by that fraction of its peak; the displacement does not if `cycles` is whole.
/// - record: the quintic spline through the samples (C⁴), in the record's own time. Beyond the samples it returns to 0 within a few
///   sampling steps; that is smooth and small if the record begins and ends near 0, which the reader of the record sees to.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    shape: Shape,
    /// α × amplitude, m.
    scale: f64,
    breaks: Vec<f64>,
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
            DriveKind::Record { displacement } => {
                let spline = Spline::new(displacement, Ends::Zero);
                // The tails before the first sample are part of the smooth motion; what lies before t = 0 is cut.
                let first = spline.support().0.max(0.0);
                let last = spline.support().1.max(first);
                (Shape::Record(Box::new(spline)), vec![first, last])
            }
        };
        Self { shape, scale, breaks }
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
}
