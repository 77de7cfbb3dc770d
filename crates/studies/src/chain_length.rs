//! How the number of beads decides which fractional lines appear and how wide the spectrum is.

use serde::Serialize;

use super::{
    bodies::Bodies,
    failure::StudyError,
    members::Watch,
    paper::{LAWS, Law},
    portrait::Trait,
    trend::{Setting, TrendPlan, TrendPoint, along, rank_correlation},
};
use granchain_signal::feature::Ratio;

/// Numbers of beads: those of the companion experiment.
pub const BEADS: std::ops::RangeInclusive<usize> = 2..=10;

/// Subharmonics looked for.
pub const SUBHARMONICS: [Ratio; 3] = [Ratio::new(1, 2), Ratio::new(1, 3), Ratio::new(1, 4)];

/// One law over the number of beads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainLengths {
    /// The law.
    pub law: Law,
    /// One point a number of beads.
    pub points: Vec<TrendPoint>,
    /// Spearman's correlation of the −20 dB bandwidth with the number of beads.
    pub bandwidth_correlation: f64,
}

impl ChainLengths {
    /// Numbers of beads at which the line of `ratio` is present.
    #[must_use]
    pub fn with_line(&self, ratio: Ratio) -> Vec<usize> {
        self.chosen(|point| point.moments.has_line(ratio))
    }

    /// Numbers of beads at which the response is a train of impulses.
    #[must_use]
    pub fn impulsive(&self) -> Vec<usize> {
        self.chosen(|point| point.moments.is_impulsive())
    }

    fn chosen(&self, choose: impl Fn(&TrendPoint) -> bool) -> Vec<usize> {
        self.points.iter().filter(|point| choose(point)).map(|point| point.value as usize).collect()
    }
}

/// Runs in all.
#[must_use]
pub fn runs(plan: &TrendPlan) -> usize {
    LAWS.len() * BEADS.count() * plan.members
}

/// Both laws at the paper's α over the number of beads.
///
/// # Errors
/// [`StudyError`].
pub fn run(
    plan: &TrendPlan,
    overrides: &[String],
    bodies: &Bodies,
    watch: &dyn Watch,
) -> Result<Vec<ChainLengths>, StudyError> {
    let settings: Vec<Setting> =
        BEADS.map(|beads| Setting { value: beads as f64, overrides: vec![format!("chain.beads={beads}")] }).collect();
    let study = |law: &Law| {
        let points = along(law, overrides, &settings, plan, bodies, watch)?;
        let (beads, width): (Vec<f64>, Vec<f64>) =
            points.iter().filter_map(|point| Some((point.value, point.moments.get(Trait::Bandwidth)?.mean))).unzip();
        Ok(ChainLengths { law: *law, points, bandwidth_correlation: rank_correlation(&beads, &width) })
    };
    LAWS.iter().map(study).collect()
}
