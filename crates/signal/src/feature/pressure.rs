//! Features of a pressure record: peaks, levels of the harmonics, upper frequency of the content.

use serde::{Deserialize, Serialize};

use super::{
    AmplitudeSpectrum, FeatureError, PeakSettings, Peaks, Window, amplitude_spectrum, bandwidth, line_amplitude, peaks,
    total_harmonic_distortion,
};
use crate::Series;

/// Settings for a pressure record.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressureSettings {
    pub drive_frequency: f64,
    /// Span of the spectra; the peaks are those of the whole record.
    pub window: Window,
    /// Highest harmonic evaluated, Hz.
    pub highest: f64,
    /// Lowest level that counts as content, dB re the fundamental.
    pub content_level_db: f64,
    /// Frequency around which the level is measured, Hz.
    pub probe: f64,
}

impl PressureSettings {
    /// Harmonics up to 1 MHz, content down to −21 dB, level around 0.95 MHz: as stated in the source paper.
    pub fn new(drive_frequency: f64, window: Window) -> Self {
        Self { drive_frequency, window, highest: 1e6, content_level_db: -21.0, probe: 0.95e6 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Harmonic {
    /// n of n f0, from 1.
    pub order: u32,
    /// n f0, Hz.
    pub frequency_hz: f64,
    /// A(n f0), Pa.
    pub amplitude_pa: f64,
    /// 20 lg A(n f0)/A(f0), dB; floored at −400.
    pub level_db: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PressureFeatures {
    pub drive_frequency_hz: f64,
    /// Span of the spectra, s.
    pub window: Window,
    /// Extremes of the whole record, Pa.
    pub peaks: Peaks,
    /// Harmonics n ≥ 1 up to the highest requested, at most 0.8 of the Nyquist frequency.
    pub harmonics: Vec<Harmonic>,
    /// Rms of the harmonics n ≥ 2 up to there over the total rms, 1 ([`total_harmonic_distortion`]).
    pub thd: f64,
    /// Highest frequency at −6 dB re the fundamental, Hz ([`bandwidth`]).
    pub bandwidth_hz: Option<f64>,
    /// −6 dB width of the strongest band, Hz (`band_width`).
    pub band_width_hz: Option<f64>,
    /// Level of `content_hz`, dB re the fundamental.
    pub content_level_db: f64,
    /// Highest frequency at that level re the fundamental, Hz ([`bandwidth`]).
    pub content_hz: Option<f64>,
    /// Frequency of `probe_level_db`, Hz.
    pub probe_hz: f64,
    /// Largest level within f0/2 of `probe_hz`, dB re the fundamental, whether of a line or of a broad maximum. `None`
    /// above 0.8 of the Nyquist frequency.
    pub probe_level_db: Option<f64>,
}

impl PressureFeatures {
    /// The larger magnitude of the two peaks, Pa.
    pub fn largest(&self) -> f64 {
        self.peaks.positive.max(-self.peaks.negative)
    }
}

/// Measure a pressure record (Pa).
///
/// The record's own spectrum is taken through Hann's window over `settings.window` ([`amplitude_spectrum`]); the harmonics stand at n f0
/// exactly ([`line_amplitude`]).
pub fn measure_pressure(pressure: &Series, settings: &PressureSettings) -> Result<PressureFeatures, FeatureError> {
    let PressureSettings { drive_frequency, highest, content_level_db, probe, .. } = *settings;
    super::line::check(pressure, drive_frequency)?;
    let window = settings.window.on(pressure)?;
    let spectrum = amplitude_spectrum(pressure, window)?;
    let fundamental = line_amplitude(pressure, window, drive_frequency);
    let usable = super::line::usable_limit(pressure);
    let limit = highest.min(usable);
    let harmonics = (1_u32..)
        .map(|order| (order, f64::from(order) * drive_frequency))
        .take_while(|(_, frequency)| *frequency <= limit)
        .map(|(order, frequency_hz)| {
            let amplitude_pa = line_amplitude(pressure, window, frequency_hz);
            Harmonic { order, frequency_hz, amplitude_pa, level_db: level(amplitude_pa, fundamental) }
        })
        .collect();
    Ok(PressureFeatures {
        drive_frequency_hz: drive_frequency,
        window,
        peaks: peaks(pressure, Window::whole(pressure), &PeakSettings::default())?,
        harmonics,
        thd: total_harmonic_distortion(pressure, window, drive_frequency, Some(highest))?,
        bandwidth_hz: bandwidth(&spectrum, fundamental, -6.0),
        band_width_hz: band_width(&spectrum, -6.0),
        content_level_db,
        content_hz: bandwidth(&spectrum, fundamental, content_level_db),
        probe_hz: probe,
        probe_level_db: (probe <= usable).then(|| {
            let near = (0..spectrum.amplitudes.len())
                .filter(|&index| (spectrum.frequency(index) - probe).abs() <= 0.5 * drive_frequency);
            level(near.map(|index| spectrum.amplitudes[index]).fold(0.0, f64::max), fundamental)
        }),
    })
}

/// 20 lg a/b, dB; −400 where it would be less.
fn level(amplitude: f64, reference: f64) -> f64 {
    20.0 * (amplitude / reference).max(1e-20).log10()
}

/// Width of the band in which an amplitude spectrum stays within `level_db` (such as −6) of its maximum, Hz: from the
/// lowest to the highest frequency at that level. For a single impulse this is the usual bandwidth of a transducer.
/// The gaps between the lines of an impulse train count as part of the band.
///
/// Both crossings are interpolated between the spectrum's points; a band that reaches 0 Hz or the end of the spectrum ends there. `None` for a
/// spectrum without a positive value.
pub(crate) fn band_width(spectrum: &AmplitudeSpectrum, level_db: f64) -> Option<f64> {
    let amplitudes = &spectrum.amplitudes;
    let largest = amplitudes.iter().copied().fold(0.0, f64::max);
    let level = largest * 10.0_f64.powf(0.05 * level_db);
    if level <= 0.0 {
        return None;
    }
    let first = amplitudes.iter().position(|&amplitude| amplitude >= level)?;
    let last = amplitudes.iter().rposition(|&amplitude| amplitude >= level)?;
    // Share of a step from an inner point to the crossing towards an outer one.
    let share = |inner: usize, outer: Option<&f64>| {
        outer.map_or(0.0, |outer| (amplitudes[inner] - level) / (amplitudes[inner] - outer))
    };
    let below = share(first, first.checked_sub(1).and_then(|index| amplitudes.get(index)));
    let above = share(last, amplitudes.get(last + 1));
    Some((last as f64 + above - (first as f64 - below)) * spectrum.step_hz)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{PI, TAU};

    use super::*;

    const F0: f64 = 73e3;

    /// Σ Aₙ sin(2π n f0 t), whole periods of f0.
    fn tones(parts: &[(u32, f64)]) -> Series {
        let step = 1.0 / (F0 * 400.0);
        let value =
            |i: usize| parts.iter().map(|(n, a)| a * (TAU * f64::from(*n) * i as f64 / 400.0).sin()).sum::<f64>();
        Series::new(0.0, step, (0..40 * 400).map(value).collect())
    }

    #[test]
    fn harmonics_of_known_levels_are_read_back() {
        let parts = [(1, 14e3), (2, 7e3), (5, 1.4e3), (13, 14e3 * 10f64.powf(-21.0 / 20.0))];
        let record = tones(&parts);
        let found = measure_pressure(&record, &PressureSettings::new(F0, Window::whole(&record))).unwrap();
        // 1 MHz over 73 kHz.
        assert_eq!(found.harmonics.len(), 13);
        for (order, amplitude) in parts {
            let line = found.harmonics[order as usize - 1];
            assert_eq!(line.order, order);
            // Side lobes of the neighbours at 40 bins and more, 1/(π k³).
            assert!((line.amplitude_pa / amplitude - 1.0).abs() < 1e-4, "{order}: {}", line.amplitude_pa);
        }
        assert!((found.harmonics[12].level_db + 21.0).abs() < 1e-3, "{}", found.harmonics[12].level_db);
        assert!((found.harmonics[1].level_db - 20.0 * 0.5f64.log10()).abs() < 1e-3);
        // An eighth of a bin of scalloping.
        assert!((found.probe_level_db.unwrap() + 21.0).abs() < 0.1, "{:?}", found.probe_level_db);
        assert!(found.harmonics[2].level_db < -80.0, "{}", found.harmonics[2].level_db);
        let harmonics: f64 = parts[1..].iter().map(|(_, a)| a * a).sum();
        let thd = (harmonics / (harmonics + 14e3 * 14e3)).sqrt();
        assert!((found.thd - thd).abs() < 1e-5, "{} {thd}", found.thd);
    }

    #[test]
    fn content_ends_at_the_last_line_above_the_level() {
        let at = |level: f64| 10f64.powf(level / 20.0);
        let record = tones(&[(1, 1.0), (4, at(-5.0)), (9, at(-20.0)), (12, at(-22.0))]);
        let window = Window::whole(&record);
        let settings = PressureSettings::new(F0, window);
        let found = measure_pressure(&record, &settings).unwrap();
        // A line reaches half the main lobe's 2/T beyond its own frequency at most.
        let near = |found: f64, order: f64| found > order * F0 && found < order * F0 + 2.0 / window.duration();
        assert!(near(found.content_hz.unwrap(), 9.0), "{:?}", found.content_hz);
        assert!(near(found.bandwidth_hz.unwrap(), 4.0), "{:?}", found.bandwidth_hz);
        // Between the lines at 9 and 12 there is a tail only, and none at all beyond the usable band.
        let probe = |probe| measure_pressure(&record, &PressureSettings { probe, ..settings }).unwrap().probe_level_db;
        assert!(probe(10.5 * F0).unwrap() < -60.0 && (probe(9.3 * F0).unwrap() + 20.0).abs() < 0.1);
        assert_eq!(probe(170.0 * F0), None);
        let lower = measure_pressure(&record, &PressureSettings { content_level_db: -23.0, ..settings }).unwrap();
        assert!(near(lower.content_hz.unwrap(), 12.0), "{:?}", lower.content_hz);
    }

    #[test]
    fn peaks_are_those_of_the_whole_record_not_of_the_spectra_s_window() {
        let mut record = tones(&[(1, 1e3)]);
        record.values[200] = -9e3;
        let window = Window::new(100e-6, 400e-6);
        let found = measure_pressure(&record, &PressureSettings::new(F0, window)).unwrap();
        assert!((found.peaks.raw_negative + 9e3).abs() < 1e-9 && found.largest() >= 9e3, "{:?}", found.peaks);
        assert!((found.harmonics[0].amplitude_pa - 1e3).abs() < 1.0);
    }

    #[test]
    fn the_band_of_a_modulated_gaussian_has_its_closed_width() {
        // exp(−t²/(2σ²)) cos(2πft) has the spectrum exp(−(2πσ)²(ν − f)²/2): −6 dB at ±√(2 ln 10^0.3)/(2πσ).
        let (sigma, frequency, step) = (2e-6, 0.8e6, 1e-8);
        let middle = 40e-6;
        let value = |i: usize| {
            let t = i as f64 * step - middle;
            (-0.5 * (t / sigma).powi(2)).exp() * (TAU * frequency * t).cos()
        };
        let record = Series::new(0.0, step, (0..8001).map(value).collect());
        let spectrum = amplitude_spectrum(&record, Window::whole(&record)).unwrap();
        let exact = 2.0 * (2.0 * 10f64.powf(0.3).ln()).sqrt() / (TAU * sigma);
        let found = band_width(&spectrum, -6.0).unwrap();
        // Hann's taper over 80 µs narrows the impulse by (πσ/T)²·…: 0.6 % of the width.
        assert!((found / exact - 1.0).abs() < 0.01, "{found} {exact}");
        assert!(exact > PI * 1e4);
    }

    #[test]
    fn a_spectrum_of_zeros_has_no_band() {
        let spectrum = AmplitudeSpectrum { step_hz: 1e3, resolution_hz: 4e3, amplitudes: vec![0.0; 9] };
        assert_eq!(band_width(&spectrum, -6.0), None);
        let flat = AmplitudeSpectrum { step_hz: 1e3, resolution_hz: 4e3, amplitudes: vec![2.0; 9] };
        assert_eq!(band_width(&flat, -6.0), Some(8e3));
    }
}
