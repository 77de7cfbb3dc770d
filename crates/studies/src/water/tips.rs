//! What of the printed pressure a horn's tip that gives way explains.

use serde::Serialize;

use super::{Cell, PRINTED_PRESSURE};

/// A tip that gives way, whose free motion is the printed drive, before the scene's own disc.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LoadedTip {
    /// Modal mass, kg.
    pub mass_kg: f64,
    /// Q of its resonance.
    pub quality: f64,
    /// The runs; where none could be made, why.
    pub cell: Cell,
}

/// How much of the factor between ours and the printed pressure a tip that gives way explains.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Explained {
    /// Median pressure under the tip that moves as prescribed, Pa.
    pub prescribed_pa: f64,
    /// The tip of the least median pressure: number among the tips, and that pressure, Pa.
    pub least: (usize, f64),
    /// ln(prescribed/least) over ln(prescribed/printed), 1; below 0 where every tip makes it louder.
    pub share: f64,
}

impl WaterOutcome {
    /// What a tip that gives way explains; none where none could be run.
    #[must_use]
    pub pub(super) fn explained(&self) -> Option<Explained> {
        let own = self.combinations.iter().find(|outcome| outcome.combination == OWN)?;
        explained(own.printed()?.pressure_pa?.median, &self.tips)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_explains_its_share_of_the_logarithm_of_the_factor() {
        let tip = |pressure: Option<f64>| LoadedTip {
            mass_kg: 1e-4,
            quality: 50.0,
            cell: Cell { pressure_pa: pressure.and_then(|own| Quantiles::of([own])), ..cell(PRINTED_DRIVE, 0.0, 0.0) },
        };
        // 14 kPa × 64 down to 14 kPa × 8: half of the logarithm; what was refused does not count.
        let tips = [tip(Some(30.0 * PRINTED_PRESSURE)), tip(None), tip(Some(8.0 * PRINTED_PRESSURE))];
        let found = explained(64.0 * PRINTED_PRESSURE, &tips).unwrap();
        assert!((found.share - 0.5).abs() < 1e-12 && found.least.0 == 2, "{found:?}");
        assert_eq!(explained(64.0 * PRINTED_PRESSURE, &[tip(None)]), None);
    }
}
