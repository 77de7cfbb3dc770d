//! Parameters, residuals and the search for them: the only user of argmin.

pub mod agreement;
pub mod checkpoint;
pub mod comparison;
pub mod correction;
mod descent;
pub mod diagnosis;
pub mod discrepancy;
pub mod engine;
pub mod fingerprints;
pub mod fit;
pub mod forward;
pub mod frame;
pub mod joint;
pub mod likelihood;
pub mod observation;
pub mod outcome;
pub mod parameter;
pub mod plan;
pub mod posterior;
pub mod printed;
pub mod rung;
pub mod search;
pub mod statement;
pub mod twin;
