use serde::{Deserialize, Serialize};

use super::{Candidate, DissipationPlan};
use crate::{paper::allowance, published::Peaks};
use granchain_calibration::predict::ensemble::{Moments, Spread};

/// A point of a grid as it was run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GridPoint {
    /// Strength of each effect, SI.
    pub strengths: Vec<f64>,
    pub alpha: f64,
    /// Mean and scatter of [`WATCHED`](super::WATCHED).
    pub moments: [Option<Moments>; 4],
    pub failed: usize,
}

/// What came of a candidate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// ln of the evidence of the printed peaks, of a density in (m/s)⁻².
    pub log_evidence: f64,
    /// Its standard error from the few runs a point: the jackknife over the perturbations.
    pub log_evidence_error: Option<f64>,
    /// α where the printed peaks are likeliest.
    pub alpha: f64,
    pub strengths: Vec<f64>,
    /// [`WATCHED`](super::WATCHED) as it was run there again; none where too few runs could tell.
    pub there: [Option<Spread>; 4],
    /// α at which A(f0/3)/A(f0) is largest at the strengths nearest to these.
    pub largest_third_at: Option<f64>,
    /// A(f0/3)/A(f0) over α at those.
    pub third_over_alpha: Vec<(f64, Option<Moments>)>,
    /// The grid; not written with the rest.
    #[serde(skip)]
    pub points: Vec<GridPoint>,
    /// Runs made and runs failed.
    pub runs: (usize, usize),
    /// Why the first of them failed.
    pub failure: Option<String>,
}

impl Found {
    /// Distance of the peaks there from `printed`, m/s.
    #[must_use]
    pub fn distance(&self, printed: Peaks) -> Option<f64> {
        let [up, down, ..] = self.there;
        Some((up?.mean - printed.positive_m_per_s).hypot(down?.mean - printed.negative_m_per_s))
    }

    /// Whether both peaks agree there, as the study of the paper judges it.
    #[must_use]
    pub fn agrees(&self, printed: Peaks) -> bool {
        let own = self.there.iter().zip([printed.positive_m_per_s, printed.negative_m_per_s]);
        own.into_iter().all(|(peak, printed)| peak.is_some_and(|own| (own.mean - printed).abs() <= allowance(&own)))
    }

    /// A(f0/3)/A(f0) and A(2f0/3)/A(f0) there over those of `reference`.
    #[must_use]
    pub fn thirds_over(&self, reference: &[Option<Spread>; 4]) -> [Option<f64>; 2] {
        [2, 3].map(|index| Some(self.there[index]?.mean / reference[index]?.mean))
    }
}

/// A candidate and what came of it, or why it could not be run.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct CandidateOutcome {
    pub candidate: Candidate,
    pub found: Option<Found>,
    pub refused: Option<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct DissipationOutcome {
    pub plan: DissipationPlan,
    pub model: &'static str,
    /// Linear dampers at the paper's α, [`WATCHED`](super::WATCHED): against them thirds are more or less pronounced.
    pub reference: [Option<Spread>; 4],
    /// The candidates, most evidence first, those that could not be run last.
    pub candidates: Vec<CandidateOutcome>,
}

impl DissipationOutcome {
    /// Those that were run, with their difference of ln evidence from the best (≤ 0).
    pub fn ranked(&self) -> impl Iterator<Item = (&Candidate, &Found, f64)> {
        let found = self.candidates.iter().filter_map(|own| Some((&own.candidate, own.found.as_ref()?)));
        let best = self.candidates.first().and_then(|own| own.found.as_ref()).map_or(0.0, |found| found.log_evidence);
        found.map(move |(candidate, found)| (candidate, found, found.log_evidence - best))
    }

    /// Whether both thirds stand out more than with linear dampers.
    #[must_use]
    pub fn is_pronounced(&self, found: &Found) -> bool {
        found.thirds_over(&self.reference).iter().all(|ratio| ratio.is_some_and(|ratio| ratio > 1.0))
    }
}
