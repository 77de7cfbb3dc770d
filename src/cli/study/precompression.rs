//! `granchain study precompression`: a static force along the chain.

use std::fmt::Write as _;

use super::trend::{self, Head};
use crate::{
    report::{
        page::{Files, ReportError},
        precompression::PrecompressionReport,
    },
    study::{
        Bodies,
        failure::StudyError,
        members::Watch,
        portrait::Trait,
        precompression::{Precompressions, overrides, run, runs},
        trend::TrendPlan,
    },
};

/// A static force along the chain.
pub(super) struct Study;

impl trend::Study for Study {
    const NAME: &str = "precompression";
    type Law = Precompressions;

    fn overrides(given: Vec<String>) -> Result<Vec<String>, StudyError> {
        overrides(&given)
    }

    fn runs(plan: &TrendPlan) -> usize {
        runs(plan)
    }

    fn run(
        plan: &TrendPlan,
        given: &[String],
        bodies: &Bodies,
        watch: &dyn Watch,
    ) -> Result<Vec<Precompressions>, StudyError> {
        run(plan, given, bodies, watch)
    }

    fn files(head: Head, laws: &[Precompressions]) -> Result<Files, ReportError> {
        let Head { program, scene, plan, command_line } = head;
        let model = scene.model.kind.name();
        PrecompressionReport { program, model, plan, laws: laws.to_vec(), command_line }.files()
    }

    fn text(laws: &[Precompressions]) -> String {
        let mut text = String::new();
        for law in laws {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} dampers, alpha {}", law.law.name, law.law.alpha);
            for point in &law.points {
                let mean = |what| point.moments.get(what).map_or(f64::NAN, |moments| moments.mean);
                let _ = writeln!(
                    text,
                    "  {:>8} N: crest factor {:.2}, peaks {:+.0} and {:+.0} mm/s, bandwidth {:.0} kHz{}",
                    point.value,
                    mean(Trait::Crest),
                    1e3 * mean(Trait::PositivePeak),
                    1e3 * mean(Trait::NegativePeak),
                    1e-3 * mean(Trait::Bandwidth),
                    if point.moments.is_impulsive() { ", impulses" } else { "" }
                );
            }
        }
        text
    }
}
