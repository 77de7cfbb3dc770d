//! How the number of beads decides which fractional lines appear and how wide the spectrum is.

use serde::Serialize;

use crate::portrait::Trait;
use crate::{
    paper::Law,
    trend::{self, Setting, TrendPoint, Varied, rank_correlation},
};
use granchain_signal::feature::Ratio;

/// Numbers of beads: those of the companion experiment.
pub const BEADS: std::ops::RangeInclusive<usize> = 2..=10;

pub const SUBHARMONICS: [Ratio; 3] = [Ratio::new(1, 2), Ratio::new(1, 3), Ratio::new(1, 4)];

/// One law over the number of beads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ChainLengths {
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

/// Both laws at the paper's α over the number of beads.
pub type Study = trend::Study<ChainLengths>;

impl Varied for ChainLengths {
    fn settings() -> Vec<Setting> {
        let setting = |beads: usize| Setting { value: beads as f64, overrides: vec![format!("chain.beads={beads}")] };
        BEADS.map(setting).collect()
    }

    fn of(law: Law, points: Vec<TrendPoint>) -> Self {
        let (beads, width): (Vec<f64>, Vec<f64>) =
            points.iter().filter_map(|point| Some((point.value, point.moments.get(Trait::Bandwidth)?.mean))).unzip();
        Self { law, points, bandwidth_correlation: rank_correlation(&beads, &width) }
    }
}
