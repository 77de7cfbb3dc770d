//! Why a file of published features cannot be used.

use std::path::PathBuf;

use thiserror::Error;

use crate::MeasurementError;
use granchain_signal::QuantityError;

/// Why a file of published features cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PublishedError {
    #[error(transparent)]
    File(#[from] MeasurementError),
    #[error("{}:{line}:{column}: {message}; see `granchain inspect --help` for the form of such a file", path.display())]
    Form { path: PathBuf, line: usize, column: usize, message: String },
    #[error("{}: expected at least one [[feature]], found none; add one such as `name = \"positive_peak\"`, `value = \"289 mm/s\"`", path.display())]
    NoFeature { path: PathBuf },
    #[error(
        "{}:{line}: feature `{name}`: expected one of positive_peak, negative_peak, thd, amplitude_P/Q, ratio_P/Q, line_P/Q{}",
        path.display(), nearest.as_ref().map(|near| format!("; did you mean `{near}`?")).unwrap_or_default()
    )]
    UnknownFeature { path: PathBuf, line: usize, name: String, nearest: Option<String> },
    #[error("{}:{line}: feature `{name}` is there twice; delete one", path.display())]
    Repeated {
        path: PathBuf,
        /// Line of the second occurrence, from 1.
        line: usize,
        name: String,
    },
    #[error("{}:{line}: feature `{name}`: expected {expected}, found {found}", path.display())]
    Statement { path: PathBuf, line: usize, name: String, expected: &'static str, found: String },
    #[error("{}:{line}: feature `{name}`: {source}", path.display())]
    Quantity {
        path: PathBuf,
        line: usize,
        /// Name of the feature, or of the key.
        name: String,
        source: QuantityError,
    },
    #[error("{}:{line}: feature `{feature}`: no [[case]] is named `{case}`; declare it, or correct the name", path.display())]
    UnknownCase { path: PathBuf, line: usize, feature: String, case: String },
}
