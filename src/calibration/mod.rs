//! Parameters, residuals and the search for them.
