//! What a reader of an analysis must know.

use super::{FIXED_NORMAL_TRAVEL, Simulation};
use crate::fea::yielding;

impl Simulation<'_> {
    /// What a reader of the results must know: limits of the model that the run came near or passed.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let is_ring = self.arrangement.contacts.last().is_some_and(|&pair| self.arrangement.pairs[pair].is_on_ring());
        if is_ring && self.travel > FIXED_NORMAL_TRAVEL {
            warnings.push(format!(
                "the last bead travelled {:.1} um into its support; past 5 um its force is 1 % and more too large (0.19 % per um: contact normals are \
                 those of the undeformed surfaces)",
                1e6 * self.travel
            ));
        }
        if !self.cuts.is_empty() {
            let first = self.cuts[0];
            warnings.push(format!(
                "{} steps were taken back and tried smaller, first at {:.4} us, contact {}: {}",
                self.cuts.len(),
                1e6 * first.time_s,
                first.contact,
                first.cause
            ));
        }
        if self.complementarity.violations > 0 {
            warnings.push(format!(
                "{} steps violated the contact conditions, by up to {:.2e} m and {:.2e} N",
                self.complementarity.violations, self.complementarity.penetration_m, self.complementarity.adhesion_n
            ));
        }
        warnings.extend(yielding::warning(&self.yield_forces, &self.trace.forces()));
        warnings
    }
}
