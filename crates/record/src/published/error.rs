//! Why a file of published features cannot be used.

use std::path::PathBuf;

use thiserror::Error;

use crate::MeasurementError;
use granchain_signal::QuantityError;

/// Why a file of published features cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum PublishedError {
    /// The file cannot be had.
    #[error(transparent)]
    File(#[from] MeasurementError),
    /// Not TOML, or an unknown or missing key.
    #[error("{}:{line}:{column}: {message}; see `granchain inspect --help` for the form of such a file", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What TOML's reader said.
        message: String,
    },
    /// No feature at all.
    #[error("{}: expected at least one [[feature]], found none; add one such as `name = \"positive_peak\"`, `value = \"289 mm/s\"`", path.display())]
    NoFeature {
        /// The file.
        path: PathBuf,
    },
    /// A name nobody can compute.
    #[error(
        "{}:{line}: feature `{name}`: expected one of positive_peak, negative_peak, thd, amplitude_P/Q, ratio_P/Q, line_P/Q{}",
        path.display(), nearest.as_ref().map(|near| format!("; did you mean `{near}`?")).unwrap_or_default()
    )]
    UnknownFeature {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The name.
        name: String,
        /// The known name most like it.
        nearest: Option<String>,
    },
    /// The same name twice.
    #[error("{}:{line}: feature `{name}` is there twice; delete one", path.display())]
    Repeated {
        /// The file.
        path: PathBuf,
        /// Line of the second, from 1.
        line: usize,
        /// The name.
        name: String,
    },
    /// Not exactly one of value, present, ordering.
    #[error("{}:{line}: feature `{name}`: expected {expected}, found {found}", path.display())]
    Statement {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The feature.
        name: String,
        /// What belongs there.
        expected: &'static str,
        /// What stands there.
        found: String,
    },
    /// A value that is no quantity of the right kind.
    #[error("{}:{line}: feature `{name}`: {source}", path.display())]
    Quantity {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The feature, or the key.
        name: String,
        /// What the reader of quantities said.
        source: QuantityError,
    },
    /// A case that was not declared.
    #[error("{}:{line}: feature `{feature}`: no [[case]] is named `{case}`; declare it, or correct the name", path.display())]
    UnknownCase {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// The feature.
        feature: String,
        /// The case.
        case: String,
    },
}
