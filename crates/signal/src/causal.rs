//! Causal low-pass filters, as analogue instruments have them.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::Series;

/// Shape of a causal low-pass.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CausalShape {
    /// Butterworth of an order from 1 to 4.
    Butterworth(u8),
    Bessel,
}

/// Poles with Im ≥ 0 of the Bessel filter of fourth order with a delay of 1 at zero frequency: roots of s⁴ + 10 s³ + 45 s² + 105 s + 105.
const BESSEL: [[f64; 2]; 2] = [[-2.896_210_602_8, 0.867_234_128_9], [-2.103_789_397_2, 2.657_418_041_9]];

impl CausalShape {
    /// Poles with Im ≥ 0, rad/s over the angular frequency at which the gain is `gain`.
    fn poles(self, gain: f64) -> Vec<[f64; 2]> {
        let (poles, at): (Vec<[f64; 2]>, f64) = match self {
            Self::Butterworth(order) => {
                let angle = |k: u8| PI * (0.5 + f64::from(2 * k + 1) / f64::from(2 * order));
                let poles = (0..order.div_ceil(2)).map(|k| [angle(k).cos(), angle(k).sin().max(0.0)]);
                // |H|² = 1/(1 + ω^2n).
                (poles.collect(), (gain.powi(-2) - 1.0).powf(0.5 / f64::from(order)))
            }
            Self::Bessel => (BESSEL.to_vec(), bessel_frequency(gain)),
        };
        poles.into_iter().map(|[re, im]| [re / at, im / at]).collect()
    }

    /// Filters `series`. The delay at zero frequency is removed, as in instruments that state their delay.
    ///
    /// - `frequency`: where its gain is `gain`, Hz
    pub fn apply(self, series: &Series, frequency: f64, gain: f64) -> Series {
        let mut values = series.values.clone();
        let mut delay = 0.0;
        let k = 2.0 / series.step;
        for [re, im] in self.poles(gain).into_iter().map(|pole| pole.map(|part| TAU * frequency * part)) {
            // As if the series had been at its first value for ever.
            let [mut before, mut out] = [[values.first().copied().unwrap_or(0.0); 2]; 2];
            if im < 1e-9 * re.abs() {
                // −p/(s − p) by the bilinear transform.
                delay += -1.0 / re;
                for value in &mut values {
                    let new = (-re * (*value + before[0]) + (k + re) * out[0]) / (k - re);
                    (before[0], out[0]) = (*value, new);
                    *value = new;
                }
            } else {
                // p p̄/(s² − 2 Re p s + p p̄), likewise.
                let (a, b) = (-2.0 * re, re * re + im * im);
                delay += a / b;
                let d = [k * k + a * k + b, 2.0 * (b - k * k), k * k - a * k + b];
                for value in &mut values {
                    let new = (b * (*value + 2.0 * before[0] + before[1]) - d[1] * out[0] - d[2] * out[1]) / d[0];
                    (before, out) = ([*value, before[0]], [new, out[0]]);
                    *value = new;
                }
            }
        }
        Series::new(series.start - delay, series.step, values)
    }
}

/// Angular frequency at which the Bessel filter has the gain `gain`.
fn bessel_frequency(gain: f64) -> f64 {
    let of = |w: f64| 105.0 / (w.powi(4) - 45.0 * w * w + 105.0).hypot(105.0 * w - 10.0 * w.powi(3));
    let (mut low, mut high) = (0.0, 50.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if of(middle) > gain { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gain_is_as_stated_and_slow_motion_stays_in_place() {
        let step = 1.0 / (73e3 * 160.0);
        let tone = |frequency: f64| {
            let value = |i: usize| (TAU * frequency * i as f64 * step).sin();
            Series::new(0.0, step, (0..30_000).map(value).collect())
        };
        for shape in [1, 2, 3, 4].map(CausalShape::Butterworth).into_iter().chain([CausalShape::Bessel]) {
            for gain in [0.5, 0.5f64.sqrt()] {
                let late = |series: &Series| series.values[20_000..].iter().fold(0.0f64, |most, x| most.max(x.abs()));
                // 1 %: the warp of the bilinear transform.
                let passed = late(&shape.apply(&tone(0.4e6), 0.4e6, gain));
                assert!((passed - gain).abs() < 0.01, "{shape:?} {gain}: {passed}");
                let slow = shape.apply(&tone(5e3), 0.4e6, gain);
                for (index, value) in slow.values.iter().enumerate().skip(20_000) {
                    assert!((value - (TAU * 5e3 * slow.time(index)).sin()).abs() < 1e-3, "{shape:?} {gain}");
                }
            }
        }
    }
}
