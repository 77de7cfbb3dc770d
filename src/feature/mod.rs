//! Numbers worth comparing, the same functions for lab trace and simulated trace.
