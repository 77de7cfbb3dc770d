//! Numbers worth comparing, the same functions for lab trace and simulated trace.
//!
//! Everything here is a function of a [`Series`](crate::Series), an analysis [`Window`] and the drive
//! frequency. Nothing here knows whether the series was recorded or simulated: pass a simulated trace through the
//! lab's chain (bandwidth, delay, sign, sample instants) first, then measure both with the same settings.
//!
//! | feature | definition | where |
//! |---|---|---|
//! | window | where the drive's envelope exceeds half its peak | [`Window::of_drive`] |
//! | peaks | extreme of the band-limited signal between its samples, noise bias removed | [`peaks`] |
//! | lines | Hann-windowed Fourier sum at the line itself, coherent gain removed | [`line_amplitude`], [`lines`] |
//! | spectrum | the same on the grid of an FFT | [`AmplitudeSpectrum`] |
//! | distortion | rms of the drive's harmonics over the Hann-weighted rms of the signal | [`total_harmonic_distortion`] |
//! | bandwidth | highest frequency at −6 dB, −20 dB of the drive line | [`bandwidth`] |
//! | repetition | mean interval of the impulses above half the positive peak | [`repetition`] |
//! | impulses | samples and centroid of each | [`impulse_spans`] |
//! | similarity | normalised cross-correlation over lag and drive-period shifts | [`similarity`] |
//! | likeness of impulses | peak of the normalised cross-correlation over every lag | [`correlation_peak`] |
//! | pressure | peaks, levels of the harmonics, how far up the content reaches | [`measure_pressure`] |
//!
//! [`measure`] collects them in one [`Features`]. A series that is empty, constant or not finite, a drive frequency outside the usable band
//! and a window outside the series are refused ([`FeatureError`]).

pub mod alignment;
mod correlation;
mod distortion;
mod error;
pub mod fingerprint;
mod frequency;
mod interpolation;
mod line;
mod measurand;
mod measure;
#[cfg(test)]
mod noise;
mod peak;
mod pressure;
mod ratio;
mod repetition;
mod similarity;
mod spectrum;
mod window;

pub use correlation::correlation_peak;

pub use distortion::{bandwidth, total_harmonic_distortion};
pub use error::FeatureError;
pub use frequency::{refine_frequency, strongest_frequency};
pub use interpolation::maximum_near;
pub use line::{
    AbsentLine, Line, MINIMUM_LINE_PERIODS, USABLE_NYQUIST_FRACTION, line_amplitude, line_phasor, line_weights, lines,
};
pub use measurand::Measurand;
pub use measure::{FeatureSettings, Features, measure};
pub use peak::{PeakSettings, Peaks, peaks};
pub use pressure::{Harmonic, PressureFeatures, PressureSettings, measure_pressure};
pub use ratio::{FRACTIONAL_LINES, Ratio};
pub use repetition::{Repetition, impulse_spans, repetition};
pub use similarity::{Similarity, similarity};
pub use spectrum::{AmplitudeSpectrum, amplitude_spectrum};
pub use window::{Window, envelope};
