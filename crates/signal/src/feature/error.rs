//! Why a feature cannot be measured.

use thiserror::Error;

#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FeatureError {
    #[error("expected at least {needed} samples to measure, found {found}; record longer or widen the window")]
    TooFewSamples { needed: usize, found: usize },
    #[error("sample {index}: expected a finite number, found {value}")]
    NotFinite {
        /// Index of the sample, from 0.
        index: usize,
        value: f64,
    },
    #[error("the series is constant in {from_s:.6e}…{to_s:.6e} s: nothing to measure")]
    Constant {
        /// Start of the span looked at, s.
        from_s: f64,
        /// End of the span looked at, s.
        to_s: f64,
    },
    #[error(
        "analysis window from {:.2} to {:.2} µs: expected a span inside the record's {:.2} … {:.2} µs; set --from before \
         --to, both inside it",
        1e6 * from_s, 1e6 * to_s, 1e6 * start_s, 1e6 * end_s
    )]
    WindowOutside {
        /// Start of the window, s.
        from_s: f64,
        /// End of the window, s.
        to_s: f64,
        /// Start of the series, s.
        start_s: f64,
        /// End of the series, s.
        end_s: f64,
    },
    #[error(
        "drive frequency {frequency_hz} Hz: expected a value above 0 and below {limit_hz} Hz (0.8 of the Nyquist \
         frequency); check the sample interval's unit"
    )]
    DriveFrequency { frequency_hz: f64, limit_hz: f64 },
    #[error(
        "no spectral line within {span_hz:.0} Hz of {guess_hz:.0} Hz: state the drive frequency with --drive-frequency"
    )]
    NoLineNearGuess {
        /// Where it was looked for, Hz.
        guess_hz: f64,
        /// Half-width of the search, Hz.
        span_hz: f64,
    },
    #[error(
        "sample steps {reference_s:.6e} s and {candidate_s:.6e} s: expected the same step in both; resample one to the other's"
    )]
    Steps { reference_s: f64, candidate_s: f64 },
}
