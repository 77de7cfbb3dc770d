//! Before a fit: what it costs, and what it can say.

pub mod variations;
