//! What a laboratory does between the bench and the file.

use serde::{Deserialize, Serialize};

/// What stands between bench and file. Times in s; amplitudes over the peak of what is recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Laboratory {
    pub sample_rate_hz: f64,
    /// Recorded before the burst, cycles.
    pub before: f64,
    /// End of both records, cycles from the beginning of the burst.
    pub end: f64,
    /// σ of the vibrometer's noise.
    pub noise: f64,
    pub horn_noise: f64,
    /// Where the burst begins in the horn's file, s.
    pub start_s: f64,
    /// By how much later it begins in the vibrometer's, s.
    pub shift_s: f64,
    pub offset: f64,
    pub horn_offset: f64,
    /// Bits of both channels and their full scale; absent where the resolution does not matter.
    pub bits: Option<(u32, f64)>,
    /// Level at which the velocity is clipped.
    pub clip: Option<f64>,
    pub gain: f64,
    /// Frequency (Hz), amplitude and phase (rad) of the hum on the vibrometer.
    pub hum: Option<[f64; 3]>,
    /// The same on the horn.
    pub horn_hum: Option<[f64; 3]>,
    /// Drift of the vibrometer by the end of the record.
    pub drift: f64,
    pub horn_drift: f64,
    /// Cutoff of the AC coupling of both, Hz.
    pub coupling_hz: Option<f64>,
    /// −6 dB bandwidth (Hz) of the vibrometer of both, and its delay (s) beside that of its filter; stated.
    pub decoder: Option<[f64; 2]>,
    /// How much faster the vibrometer's clock runs, 1e-6.
    pub clock_ppm: f64,
    /// Whether the horn was recorded as a velocity.
    pub horn_velocity: bool,
    /// Cycles of the burst before the first sample.
    pub lost: Option<f64>,
    /// The same of the vibrometer's record alone.
    #[serde(default)]
    pub vibrometer_lost: Option<f64>,
    /// Cycles of the burst after which the horn's record ends.
    pub horn_end: Option<f64>,
    /// Cycles of the burst after which the vibrometer's ends.
    pub vibrometer_end: Option<f64>,
    /// Whether the vibrometer records nothing but noise.
    pub silent: bool,
    /// Factor on the horn's record, 1: −1 turns its sign.
    pub horn_gain: f64,
    /// Whether each file has the other's name.
    #[serde(default)]
    pub swapped: bool,
    /// Losses of the vibrometer's signal, and as many spikes.
    #[serde(default)]
    pub drop_outs: usize,
    /// Shots that the record is the mean of; further ones have gaps of their own and this jitter, s.
    #[serde(default)]
    pub averages: Option<(usize, f64)>,
    /// Shape and −6 dB bandwidth (Hz) of a causal filter in the vibrometer's channel; the bandwidth is stated, its flat delay removed.
    #[serde(default)]
    pub causal: Option<(CausalFilter, f64)>,
    /// Share of the drive in the vibrometer's channel, its phase (rad), and the spike that follows the trigger.
    #[serde(default)]
    pub crosstalk: Option<[f64; 3]>,
    /// Second and third harmonic of the horn's motion over its fundamental.
    #[serde(default)]
    pub harmonics: [f64; 2],
    /// σ of 1/f noise on the horn and on the vibrometer.
    #[serde(default)]
    pub pink: [f64; 2],
    /// Rest before a second burst, cycles.
    #[serde(default)]
    pub second_burst: Option<f64>,
    /// Amplitude modulation, and drift of the frequency over the burst.
    #[serde(default)]
    pub modulation: [f64; 2],
    /// σ of noise over the velocity of the instant, and of the noise of four stretches over the peak.
    #[serde(default)]
    pub speckle: Option<[f64; 2]>,
    /// Time in which an overload fades by a factor of e, s.
    #[serde(default)]
    pub recovery_s: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum CausalFilter {
    /// Butterworth of an order from 1 to 4.
    Butterworth(u8),
    Bessel,
}
