//! The discrete chain: one unknown a bead.
