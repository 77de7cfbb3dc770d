//! Universal files (UFF): time responses in data sets 58 (text) and 58b (binary).
//!
//! A universal file is a sequence of data sets between lines `    -1`. Data set 58, *Function at Nodal DOF*, has eleven lines
//! of header: five of identification, then
//!
//! | record | content |
//! |---|---|
//! | 6 | function type (1: time response), response and reference |
//! | 7 | ordinate type (2, 4: real, single and double precision), number of values, even or uneven, first abscissa, step |
//! | 8 | abscissa: quantity (17: time), exponents of length, force and temperature, label, unit |
//! | 9 | ordinate: quantity (8: displacement, 11: velocity, 15: pressure with its unit as label), likewise |
//! | 10, 11 | denominator, third axis |
//!
//! and then its values in lines of E13.5 or E20.12, or, in 58b, in the bytes behind the header: as many as values, no more.
//! Data set 164 states the units of what has no label.
//!
//! SDRC, *Universal file data set 58* and *164*; Structural Dynamics Research Laboratory, University of Cincinnati, for 58b.

mod block;
mod number;
mod read;
mod write;

use super::Place;

pub(super) use read::{UniversalText, is_universal, read};
pub use write::{ByteOrder, Precision, Samples, TimeResponse, UniversalForm};

/// Why a universal file cannot be used.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UniversalError {
    #[error(
        "{place}: expected one function to read, found {}{}; choose one with --read dataset=N:{}", functions.len(),
        wanted.map(|wanted| format!(" and no number {wanted}")).unwrap_or_default(),
        functions.iter().map(|text| format!("\n  {text}")).collect::<String>()
    )]
    Several {
        place: Place,
        /// The functions, numbered, in words.
        functions: Vec<String>,
        wanted: Option<usize>,
    },
    #[error(
        "{place}: expected a record in time, found {count} functions of which none is one, such as {first}; export the time data"
    )]
    Spectra { place: Place, count: usize, first: String },
    #[error("{place}: expected a function (data set 58), found {found}; export the time data as function")]
    NoFunction { place: Place, found: String },
    #[error("{place}: expected a real time response, found {found}; export the time data{}", if *several { ", or choose another with --read dataset=N" } else { "" })]
    NotInTime {
        place: Place,
        found: String,
        /// Whether there are other functions in the file.
        several: bool,
    },
    #[error("{place}: expected {expected}, found `{found}`; export the file again")]
    Header { place: Place, expected: &'static str, found: String },
    #[error(
        "{place}: expected {expected} {what} as record 7 announces, found {found} before {end}; the file was cut short: copy \
         or export it again"
    )]
    Truncated {
        place: Place,
        expected: usize,
        found: usize,
        /// `values` or `bytes`.
        what: &'static str,
        end: &'static str,
    },
    #[error(
        "{place}: expected `-1` behind {expected} bytes of values, found other bytes; the file was changed on its way (as text \
         rather than as binary): transfer it again"
    )]
    Layout { place: Place, expected: usize },
    #[error("{place}: expected a finite number, found `{found}`; export the file again")]
    Value { place: Place, found: String },
    #[error(
        "{place}: expected IEEE 754 numbers in a known byte order (58b, 1 or 2, 2), found `{found}`; export as text (data set 58)"
    )]
    Format { place: Place, found: String },
    #[error("{place}: expected one unit, found {first} and {second}; say which is right with --unit")]
    MixedUnits { place: Place, first: String, second: String },
}
