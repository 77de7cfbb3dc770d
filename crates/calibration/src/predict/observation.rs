//! Features of repeated runs: both peaks, the lines and the distortion of the observed velocity.

use serde::{Deserialize, Serialize};

use crate::drive::displacement;
use granchain_model::{response::Response, scene::Scene};
use granchain_signal::{
    Series,
    feature::{
        FeatureError, FeatureSettings, Features, Measurand, PressureFeatures, PressureSettings, Ratio, Window, measure,
        measure_pressure,
    },
    low_pass,
};

/// Reported lines, over the drive frequency.
pub(crate) const WATCHED_LINES: [Ratio; 11] = [
    Ratio::new(1, 4),
    Ratio::new(1, 3),
    Ratio::new(1, 2),
    Ratio::new(2, 3),
    Ratio::new(3, 4),
    Ratio::new(1, 1),
    Ratio::new(4, 3),
    Ratio::new(3, 2),
    Ratio::new(5, 3),
    Ratio::new(2, 1),
    Ratio::new(3, 1),
];

/// Subharmonics whose ratio to the drive line is reported too.
pub(crate) const WATCHED_RATIOS: [Ratio; 3] = [Ratio::new(1, 3), Ratio::new(1, 2), Ratio::new(2, 3)];

/// A reported feature: key in tables and JSON, and unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Watched {
    /// Key without unit, such as `line_1/3`.
    pub key: String,
    /// Typeset unit; empty for pure numbers.
    pub unit: &'static str,
    /// Suffix of the key where it stands alone, such as `_m_per_s`; empty for pure numbers.
    pub suffix: &'static str,
}

/// Features of one run, in the order of [`watched`]; `None` where the window does not allow a value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Observation(pub Vec<Option<f64>>);

/// Reported features of a velocity, in order.
pub fn watched() -> Vec<Watched> {
    let velocity = |key: String| Watched { key, unit: "m/s", suffix: "_m_per_s" };
    let pure = |key: String| Watched { key, unit: "", suffix: "" };
    let mut all = vec![velocity("positive_peak".into()), velocity("negative_peak".into())];
    all.extend(WATCHED_LINES.map(|ratio| velocity(format!("line_{ratio}"))));
    all.extend(WATCHED_RATIOS.map(|ratio| pure(format!("ratio_{ratio}"))));
    all.push(pure("thd".into()));
    all
}

/// Reported features of a measurand, in order; for a pressure under a drive of that frequency (Hz) the harmonics up to
/// 1 MHz.
pub fn watched_of(measurand: Measurand, drive_frequency: f64) -> Vec<Watched> {
    if measurand == Measurand::Velocity {
        return watched();
    }
    let pressure = |key: String| Watched { key, unit: "Pa", suffix: "_pa" };
    let mut all = vec![pressure("positive_peak".into()), pressure("negative_peak".into())];
    all.extend((1..=harmonics(drive_frequency)).map(|order| pressure(format!("line_{order}"))));
    all.push(Watched { key: "thd".into(), unit: "", suffix: "" });
    all
}

/// Number of harmonics up to 1 MHz.
fn harmonics(drive_frequency: f64) -> u32 {
    (HIGHEST_HARMONIC / drive_frequency).floor().max(1.0) as u32
}

/// Highest reported harmonic of the pressure, Hz.
const HIGHEST_HARMONIC: f64 = 1e6;

impl Observation {
    /// The watched numbers of a measured pressure.
    pub(crate) fn of_pressure(features: &PressureFeatures) -> Self {
        let mut values = vec![Some(features.peaks.positive), Some(features.peaks.negative)];
        let line = |order| features.harmonics.iter().find(|harmonic| harmonic.order == order);
        values.extend((1..=harmonics(features.drive_frequency_hz)).map(|order| Some(line(order)?.amplitude_pa)));
        values.push(Some(features.thd));
        Self(values.into_iter().map(|value| value.filter(|value| value.is_finite())).collect())
    }

    /// The watched numbers of a trace of a measurand.
    pub fn of_trace(measurand: Measurand, trace: &Series, settings: &FeatureSettings) -> Result<Self, FeatureError> {
        match measurand {
            Measurand::Velocity => Self::measure(trace, settings),
            Measurand::Pressure => {
                let window = settings.window.unwrap_or_else(|| Window::whole(trace));
                let settings = PressureSettings::new(settings.drive_frequency, window);
                Ok(Self::of_pressure(&measure_pressure(trace, &settings)?))
            }
        }
    }

    /// The watched numbers of measured features.
    pub(crate) fn of(features: &Features) -> Self {
        let mut values = vec![Some(features.peaks.positive), Some(features.peaks.negative)];
        values.extend(WATCHED_LINES.map(|ratio| features.line(ratio).map(|line| line.amplitude)));
        values.extend(WATCHED_RATIOS.map(|ratio| features.line(ratio).map(|line| line.relative)));
        values.push(Some(features.thd));
        Self(values.into_iter().map(|value| value.filter(|value| value.is_finite())).collect())
    }

    /// The watched numbers of a velocity (m/s).
    pub fn measure(velocity: &Series, settings: &FeatureSettings) -> Result<Self, FeatureError> {
        Ok(Self::of(&measure(velocity, settings)?))
    }

    /// The number with this key of [`watched`].
    pub fn get(&self, key: &str) -> Option<f64> {
        let index = watched().iter().position(|watched| watched.key == key)?;
        self.0.get(index).copied().flatten()
    }
}

/// Pressure metrics of a run at the scene's first field point.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PressureMetrics {
    pub positive_peak_pa: f64,
    pub negative_peak_pa: f64,
    /// Largest level within half the drive frequency of 0.95 MHz, dB re the fundamental; `None` if the sample rate is
    /// too low.
    pub level_at_950_khz_db: Option<f64>,
}

impl PressureMetrics {
    /// Pressure metrics over the window of the settings; `None` without water, or without pressure.
    pub fn measure(response: &Response, settings: &FeatureSettings) -> Result<Option<Self>, FeatureError> {
        let pressure = response.disc.as_ref().and_then(|disc| disc.pressure.first());
        let Some(pressure) = pressure.filter(|pressure| pressure.peak() > 0.0) else { return Ok(None) };
        let window = settings.window.unwrap_or_else(|| Window::whole(pressure));
        let features = measure_pressure(pressure, &PressureSettings::new(settings.drive_frequency, window))?;
        Ok(Some(Self {
            positive_peak_pa: features.peaks.positive,
            negative_peak_pa: features.peaks.negative,
            level_at_950_khz_db: features.probe_level_db,
        }))
    }
}

/// An observed velocity ([`Response::observed_velocity`], m/s) after the scene's vibrometer filter: bodies of the
/// finer models ring at 2.6 MHz and above, far beyond the bandwidth of a vibrometer, and would dominate the peaks.
pub fn seen(scene: &Scene, velocity: &Series) -> Series {
    low_pass(velocity, scene.vibrometer_bandwidth)
}

/// Features of the velocity after the vibrometer filter ([`seen`]). A bead that has left a disc flies at constant
/// velocity and has no features in the window; then the whole record is measured.
pub fn measure_response(
    scene: &Scene,
    response: &Response,
    settings: &FeatureSettings,
) -> Result<Features, FeatureError> {
    let velocity = seen(scene, response.observed_velocity());
    match measure(&velocity, settings) {
        Err(FeatureError::Constant { .. }) if response.disc.is_some() => {
            measure(&velocity, &FeatureSettings { window: Some(Window::whole(&velocity)), ..settings.clone() })
        }
        outcome => outcome,
    }
}

/// Settings under which a scene's own response is measured: no noise, and the window where the envelope of its drive
/// exceeds half its peak.
pub fn settings(scene: &Scene) -> Result<FeatureSettings, FeatureError> {
    let window = match scene.drive.kind.striker() {
        // Its impulses go on until the end.
        Some(_) => Window::new(0.0, scene.duration),
        None => Window::of_drive(&displacement(scene), scene.drive.frequency)?,
    };
    Ok(FeatureSettings::velocity(scene.drive.frequency, window))
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::{self as model, scene};

    #[test]
    fn a_ringing_bead_is_measured_below_the_vibrometer_s_bandwidth() {
        let peak = |bandwidth: &[String]| {
            let scene = scene::load("chain", bandwidth).unwrap();
            let mut response = model::run(&scene, &mut |_| true).unwrap();
            let tone = |frequency: f64, time: f64| libm::sin(std::f64::consts::TAU * frequency * time);
            let seen = &mut response.pole_velocity;
            seen.values =
                (0..seen.len()).map(|i| seen.time(i)).map(|t| tone(73e3, t) + 0.2 * tone(2.646e6, t)).collect();
            response.observed = granchain_model::response::ObservedPoint::Pole;
            let window = Window::new(50e-6, 100e-6);
            let settings = FeatureSettings::velocity(73e3, window);
            measure_response(&scene, &response, &settings).unwrap().peaks.positive
        };
        assert!((peak(&[]) - 1.0).abs() < 2e-3, "{}", peak(&[]));
        let raw = peak(&["vibrometer.bandwidth=1 GHz".into()]);
        assert!(raw > 1.15, "{raw}");
    }
}
