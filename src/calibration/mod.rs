//! Parameters, residuals and the search for them: the only user of argmin.

pub mod checkpoint;
pub mod fit;
pub mod forward;
pub mod likelihood;
pub mod observation;
pub mod parameter;
pub mod posterior;
pub mod search;
pub mod twin;
