//! What is compared of two runs.

use super::ladder::short;
use granchain_calibration::predict::observation::{self, Observation, PressureMetrics};
use granchain_model::{response::Response, scene::Scene};
use granchain_signal::{LowPass, Series, feature::FeatureError};

/// Interval of the mean velocities that are compared, s: the undamped centres ring at 2.65 MHz and above, which no laser sees.
const INTERVAL: f64 = 0.4e-6;
/// Interval of the pressures that are compared, s.
const PRESSURE_INTERVAL: f64 = 0.2e-6;
/// Longest output step of a pressure, s.
const PRESSURE_OUTPUT: f64 = 50e-9;
/// Pressures are compared below this frequency, Hz: above some 3 MHz a hit rings the disc through its thickness, which no way to the water
/// resolves.
const PRESSURE_BAND: f64 = 1.5e6;

/// The quantity of a scene whose waveforms are compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watched {
    /// Mean velocities of the last bead's centre over successive intervals of 0.4 µs, m/s. They are the differences of its displacement, so
    /// that no step and no interpolation enters.
    Velocity,
    /// Pressure at the first field point below 1.5 MHz, every 0.2 µs, Pa.
    Pressure,
}

impl Watched {
    /// What is compared in a scene.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        if scene.water.is_some() { Self::Pressure } else { Self::Velocity }
    }

    /// As a reader calls it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Velocity => "velocity of the last bead, means over 0.4 µs",
            Self::Pressure => "pressure at the first field point, below 1.5 MHz",
        }
    }

    #[must_use]
    pub const fn unit(self) -> &'static str {
        match self {
            Self::Velocity => "m/s",
            Self::Pressure => "Pa",
        }
    }

    /// Interval of the values, s.
    #[must_use]
    pub const fn interval(self) -> f64 {
        match self {
            Self::Velocity => INTERVAL,
            Self::Pressure => PRESSURE_INTERVAL,
        }
    }

    /// Output step that a run of this step (s; none where it adapts) needs, as an override; steps that are compared divide it.
    ///
    /// A pressure is sampled at every step: meshed bodies and the disc ring far above the band that is compared, and sampled more coarsely
    /// that ringing would fold into it.
    #[must_use]
    pub fn output_step(self, step: Option<f64>) -> String {
        let nanoseconds = match (self, step) {
            (Self::Pressure, Some(step)) if step < PRESSURE_OUTPUT => 1e9 * step,
            (Self::Pressure, _) => 1e9 * PRESSURE_OUTPUT,
            (Self::Velocity, _) => 100.0,
        };
        format!("output_step={} ns", short(nanoseconds))
    }

    /// Time beyond the window that its last value needs, s.
    #[must_use]
    pub const fn margin(self) -> f64 {
        match self {
            Self::Velocity => INTERVAL,
            Self::Pressure => 10e-6,
        }
    }

    /// The values up to a time (s).
    #[must_use]
    pub fn values(self, response: &Response, window: f64) -> Vec<f64> {
        let count = (window / self.interval()).floor() as usize;
        match self {
            Self::Velocity => response.bead_displacement.last().map_or(Vec::new(), |displacement| {
                let stride = (INTERVAL / displacement.step).round() as usize;
                let ends: Vec<f64> = displacement.values.iter().step_by(stride).take(count + 1).copied().collect();
                ends.windows(2).map(|pair| (pair[1] - pair[0]) / INTERVAL).collect()
            }),
            Self::Pressure => {
                let pressure = response.disc.as_ref().and_then(|disc| disc.pressure.first());
                pressure.map_or(Vec::new(), |pressure| below(pressure, PRESSURE_BAND, count))
            }
        }
    }

    /// What means something beyond the window: key, unit, value; a number that the run does not have is none.
    ///
    /// # Errors
    /// [`FeatureError`] when the response cannot be measured.
    pub fn features(self, scene: &Scene, response: &Response) -> Result<Vec<Feature>, FeatureError> {
        let settings = observation::settings(scene)?;
        let feature = |key: &str, unit, value| Feature { key: key.to_owned(), unit, value };
        match self {
            Self::Velocity => {
                let observed =
                    Observation::measure(&observation::seen(scene, response.observed_velocity()), &settings)?;
                let keys = [("positive_peak", "m/s"), ("negative_peak", "m/s"), ("line_1", "m/s"), ("ratio_1/3", "1")];
                Ok(keys.map(|(key, unit)| feature(key, unit, observed.get(key))).to_vec())
            }
            Self::Pressure => {
                let metrics = PressureMetrics::measure(response, &settings)?;
                Ok(vec![
                    feature("positive_peak", "Pa", metrics.map(|metrics| metrics.positive_peak_pa)),
                    feature("negative_peak", "Pa", metrics.map(|metrics| metrics.negative_peak_pa)),
                    feature("level_at_950_kHz", "dB", metrics.and_then(|metrics| metrics.level_at_950_khz_db)),
                ])
            }
        }
    }
}

/// A number of a whole run.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Feature {
    pub key: String,
    pub unit: &'static str,
    /// Its value; none where the run cannot tell.
    pub value: Option<f64>,
}

fn below(pressure: &Series, band: f64, count: usize) -> Vec<f64> {
    let filtered = LowPass::new(pressure.step, pressure.len(), band).apply(&pressure.values);
    let stride = (PRESSURE_INTERVAL / pressure.step).round() as usize;
    filtered.into_iter().step_by(stride).take(count).collect()
}

/// √(Σ (v − v̂)²/Σ v̂²) over the values both have.
#[must_use]
pub fn relative_error(values: &[f64], reference: &[f64]) -> f64 {
    let distance: f64 = values.iter().zip(reference).map(|(value, expected)| (value - expected).powi(2)).sum();
    let power: f64 = reference.iter().take(values.len()).map(|value| value * value).sum();
    if power > 0.0 { (distance / power).sqrt() } else { distance.sqrt() }
}

/// Slope p of ln e = p ln h + c by least squares; none for fewer than three points.
///
/// ```
/// use granchain_validate::accuracy::observed_slope;
/// let points: Vec<(f64, f64)> = [0.1, 0.05, 0.025].map(|h: f64| (h, 3.0 * h.powi(2))).to_vec();
/// assert!((observed_slope(&points).unwrap() - 2.0).abs() < 1e-12);
/// assert!(observed_slope(&points[..2]).is_none());
/// ```
#[must_use]
pub fn observed_slope(points: &[(f64, f64)]) -> Option<f64> {
    if points.len() < 3 {
        return None;
    }
    let logarithms: Vec<(f64, f64)> = points.iter().map(|(size, error)| (size.ln(), error.ln())).collect();
    let count = logarithms.len() as f64;
    let (x, y) = logarithms.iter().fold((0.0, 0.0), |(x, y), point| (x + point.0 / count, y + point.1 / count));
    let (mut above, mut below) = (0.0, 0.0);
    for point in &logarithms {
        above += (point.0 - x) * (point.1 - y);
        below += (point.0 - x).powi(2);
    }
    (below > 0.0).then(|| above / below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_velocities_are_differences_of_the_displacement_whatever_the_output_step() {
        let response = |step: f64| {
            let count = (4e-6 / step).round() as usize + 1;
            let displacement = Series::new(0.0, step, (0..count).map(|i| (i as f64 * step).powi(3)).collect());
            Response { bead_displacement: vec![displacement], ..still() }
        };
        let (coarse, fine) = (response(1e-7), response(5e-8));
        let values = Watched::Velocity.values(&coarse, 4e-6);
        assert_eq!(values.len(), 10);
        // Mean of 3t² over the second interval.
        let mean = ((0.8e-6_f64).powi(3) - (0.4e-6_f64).powi(3)) / 0.4e-6;
        assert!((values[1] / mean - 1.0).abs() < 1e-12);
        assert!(relative_error(&values, &Watched::Velocity.values(&fine, 4e-6)) < 1e-12);
    }

    #[test]
    fn an_error_is_relative_to_the_reference_where_both_are() {
        assert!((relative_error(&[1.01, 2.02], &[1.0, 2.0, 50.0]) - 0.01).abs() < 1e-12);
    }

    fn still() -> Response {
        let nothing = Series::new(0.0, 1e-7, Vec::new());
        Response {
            piston_displacement: nothing.clone(),
            bead_displacement: Vec::new(),
            bead_velocity: Vec::new(),
            pole_velocity: nothing,
            observed: granchain_model::response::ObservedPoint::Pole,
            contact_force: Vec::new(),
            sensor_force: None,
            contact_radius: None,
            disc: None,
            energy: granchain_model::response::EnergyBalance::default(),
            work: granchain_model::response::SolverWork::default(),
        }
    }
}
