//! What the studies of the paper look at in one velocity of the pole: peaks, crest, lines and how far they stand out, bandwidth.
//!
//! A line **is present** where its amplitude reaches [`PRESENT_LEVEL`] of the drive line and [`PRESENT_PROMINENCE`] times the floor around it
//! ([`local_floor`](granchain_signal::feature::AmplitudeSpectrum::local_floor)): the first is what can be seen in a normalised spectrum, the second tells a line from the broad
//! ground of a chaotic response.
//!
//! A response is a **train of impulses** where its crest factor reaches [`IMPULSIVE_CREST`]; a sine has √2.

use serde::{Deserialize, Serialize};

use granchain_calibration::predict::ensemble::Moments;
use granchain_signal::{
    Series,
    feature::{FeatureError, FeatureSettings, Ratio, amplitude_spectrum, measure},
};

/// Least amplitude of a line that counts as present, over the drive line's (−30 dB).
pub const PRESENT_LEVEL: f64 = 0.03;

/// Least amplitude of a line that counts as present, over the floor around it.
pub const PRESENT_PROMINENCE: f64 = 3.0;

/// Least crest factor of a train of impulses, twice that of a sine.
pub const IMPULSIVE_CREST: f64 = 2.0 * std::f64::consts::SQRT_2;

/// The lines looked at, over the drive frequency.
pub const LINES: [Ratio; 9] = [
    Ratio::new(1, 4),
    Ratio::new(1, 3),
    Ratio::new(1, 2),
    Ratio::new(2, 3),
    Ratio::new(3, 4),
    Ratio::new(4, 3),
    Ratio::new(3, 2),
    Ratio::new(5, 3),
    Ratio::new(2, 1),
];

/// One number of a portrait.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trait {
    PositivePeak,
    NegativePeak,
    /// Larger of both peaks over the rms, 1.
    Crest,
    /// Amplitude of the drive line, m/s.
    DriveLine,
    /// Highest frequency at −20 dB re the drive line, Hz.
    Bandwidth,
    /// Rms of the drive's harmonics over the total rms, 1.
    Distortion,
    /// Amplitude of a line of [`LINES`] over the drive line's, 1.
    Level(Ratio),
    /// Amplitude of a line of [`LINES`] over the floor around it, 1.
    Prominence(Ratio),
}

impl Trait {
    /// All of them, in the order of a [`Portrait`].
    #[must_use]
    pub fn all() -> Vec<Self> {
        let mut all = vec![
            Self::PositivePeak,
            Self::NegativePeak,
            Self::Crest,
            Self::DriveLine,
            Self::Bandwidth,
            Self::Distortion,
        ];
        all.extend(LINES.map(Self::Level));
        all.extend(LINES.map(Self::Prominence));
        all
    }

    /// Key with its unit, as in tables, such as `positive_peak_m_per_s`.
    #[must_use]
    pub fn key(self) -> String {
        match self {
            Self::PositivePeak => "positive_peak_m_per_s".into(),
            Self::NegativePeak => "negative_peak_m_per_s".into(),
            Self::Crest => "crest_factor".into(),
            Self::DriveLine => "line_1_m_per_s".into(),
            Self::Bandwidth => "bandwidth_20db_hz".into(),
            Self::Distortion => "thd".into(),
            Self::Level(ratio) => format!("ratio_{ratio}"),
            Self::Prominence(ratio) => format!("prominence_{ratio}"),
        }
    }

    fn index(self) -> Option<usize> {
        let line = |ratio| LINES.iter().position(|line| *line == ratio);
        match self {
            Self::PositivePeak => Some(0),
            Self::NegativePeak => Some(1),
            Self::Crest => Some(2),
            Self::DriveLine => Some(3),
            Self::Bandwidth => Some(4),
            Self::Distortion => Some(5),
            Self::Level(ratio) => line(ratio).map(|place| 6 + place),
            Self::Prominence(ratio) => line(ratio).map(|place| 6 + LINES.len() + place),
        }
    }
}

/// The numbers of one run in the order of [`Trait::all`], SI; `None` where the window cannot tell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct Portrait(pub Vec<Option<f64>>);

impl Portrait {
    /// Of a velocity (m/s).
    ///
    /// # Errors
    /// [`FeatureError`] when it cannot be measured.
    pub fn of(velocity: &Series, settings: &FeatureSettings) -> Result<Self, FeatureError> {
        let features = measure(velocity, settings)?;
        let spectrum = amplitude_spectrum(velocity, features.window)?;
        let largest = features.peaks.positive.max(-features.peaks.negative);
        let mut values = vec![
            Some(features.peaks.positive),
            Some(features.peaks.negative),
            Some(largest / features.rms),
            features.line(Ratio::ONE).map(|line| line.amplitude),
            features.bandwidth_20db_hz,
            Some(features.thd),
        ];
        values.extend(LINES.map(|ratio| features.line(ratio).map(|line| line.relative)));
        values.extend(LINES.map(|ratio| {
            let line = features.line(ratio)?;
            let floor = spectrum.local_floor(line.frequency_hz, features.drive_frequency_hz)?;
            (floor > 0.0).then(|| line.amplitude / floor)
        }));
        Ok(Self(values.into_iter().map(|value| value.filter(|value| value.is_finite())).collect()))
    }

    /// One of its numbers, SI.
    #[must_use]
    pub fn get(&self, what: Trait) -> Option<f64> {
        self.0.get(what.index()?).copied().flatten()
    }
}

/// Mean and scatter of every number over runs, in the order of [`Trait::all`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PortraitMoments(pub Vec<Option<Moments>>);

impl PortraitMoments {
    /// Over `portraits`; a number that some run lacks, or fewer than two runs have, is `None`.
    #[must_use]
    pub fn over(portraits: &[&Portrait]) -> Self {
        let moments = |what: Trait| Moments::of(portraits.iter().map(|portrait| portrait.get(what)));
        Self(Trait::all().into_iter().map(moments).collect())
    }

    /// Over what was seen of runs, those that failed left out.
    #[must_use]
    pub fn of(runs: &[Result<Portrait, String>]) -> Self {
        Self::over(&runs.iter().flatten().collect::<Vec<_>>())
    }

    #[must_use]
    pub fn get(&self, what: Trait) -> Option<Moments> {
        self.0.get(what.index()?).copied().flatten()
    }

    /// Whether the line of `ratio` is present, by the means of level and prominence.
    #[must_use]
    pub fn has_line(&self, ratio: Ratio) -> bool {
        let reaches = |what, least| self.get(what).is_some_and(|moments| moments.mean >= least);
        reaches(Trait::Level(ratio), PRESENT_LEVEL) && reaches(Trait::Prominence(ratio), PRESENT_PROMINENCE)
    }

    /// Whether the response is a train of impulses, by the mean of the crest factor.
    #[must_use]
    pub fn is_impulsive(&self) -> bool {
        self.get(Trait::Crest).is_some_and(|crest| crest.mean >= IMPULSIVE_CREST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_signal::feature::Window;

    const F0: f64 = 73e3;

    /// 45 drive periods of Σ A cos(2π r f0 t) under a rise over 10 periods.
    fn made(lines: &[(f64, f64)]) -> (Series, FeatureSettings) {
        let step = 1e-7;
        let count = (45.0 / F0 / step) as usize;
        let value = |index: usize| {
            let t = index as f64 * step;
            let rise = 1.0 - (-t * F0 / 4.0).exp();
            lines.iter().map(|(ratio, a)| rise * a * (std::f64::consts::TAU * ratio * F0 * t).cos()).sum::<f64>()
        };
        let series = Series::new(0.0, step, (0..count).map(value).collect());
        let window = Window { from: 5.0 / F0, to: 44.0 / F0 };
        (series, FeatureSettings::velocity(F0, window))
    }

    fn moments(lines: &[(f64, f64)]) -> PortraitMoments {
        let (series, settings) = made(lines);
        let portrait = Portrait::of(&series, &settings).unwrap();
        PortraitMoments::over(&[&portrait, &portrait])
    }

    #[test]
    fn a_response_of_period_two_has_a_half_line_and_no_thirds() {
        let found = moments(&[(1.0, 0.1), (0.5, 0.02), (1.5, 0.01), (2.0, 0.03)]);
        assert!(
            found.has_line(Ratio::new(1, 2)) && found.has_line(Ratio::new(3, 2)) && found.has_line(Ratio::new(2, 1))
        );
        for absent in [(1, 3), (2, 3), (1, 4), (3, 4), (4, 3)] {
            assert!(!found.has_line(Ratio::new(absent.0, absent.1)), "{absent:?}");
        }
        assert!((found.get(Trait::Level(Ratio::new(1, 2))).unwrap().mean - 0.2).abs() < 2e-3);
    }

    #[test]
    fn a_line_too_weak_to_be_seen_or_lost_in_its_floor_is_not_present() {
        assert!(!moments(&[(1.0, 0.1), (0.5, 0.002)]).has_line(Ratio::new(1, 2)));
        // A comb as dense as the window resolves, all as high as the half line.
        let comb: Vec<(f64, f64)> = (4..90).map(|k| (f64::from(k) / 40.0, 0.01)).chain([(1.0, 0.1)]).collect();
        assert!(!moments(&comb).has_line(Ratio::new(1, 2)));
    }

    #[test]
    fn a_sine_is_no_train_of_impulses_and_a_pulse_every_period_is() {
        let sine = moments(&[(1.0, 0.1), (2.0, 0.001)]);
        // 39 periods of a still rising sine: its largest over its rms.
        assert!((1.41..1.6).contains(&sine.get(Trait::Crest).unwrap().mean), "{:?}", sine.get(Trait::Crest));
        assert!(!sine.is_impulsive());
        let comb: Vec<(f64, f64)> = (1..20).map(|k| (f64::from(k), 0.01)).collect();
        assert!(moments(&comb).is_impulsive());
    }

    #[test]
    fn every_trait_finds_its_own_number() {
        let portrait = Portrait((0..Trait::all().len()).map(|index| Some(index as f64)).collect());
        for (index, what) in Trait::all().into_iter().enumerate() {
            assert_eq!(portrait.get(what), Some(index as f64), "{}", what.key());
        }
        assert_eq!(portrait.get(Trait::Level(Ratio::new(7, 1))), None);
    }
}
