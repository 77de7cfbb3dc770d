//! What the lab recorded.
