//! Closed forms with references.
