//! Contact force laws.
