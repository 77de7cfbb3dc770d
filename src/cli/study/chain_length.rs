//! `granchain study chain-length`: two to ten beads.

use std::fmt::Write as _;

use super::trend::{self, Head};
use crate::{
    report::{
        chain_length::ChainLengthReport,
        page::{Files, ReportError},
    },
    study::{
        Bodies,
        chain_length::{ChainLengths, SUBHARMONICS, run, runs},
        failure::StudyError,
        members::Watch,
        trend::TrendPlan,
    },
};

/// Two to ten beads.
pub(super) struct Study;

impl trend::Study for Study {
    const NAME: &str = "chain-length";
    type Law = ChainLengths;

    fn runs(plan: &TrendPlan) -> usize {
        runs(plan)
    }

    fn run(
        plan: &TrendPlan,
        overrides: &[String],
        bodies: &Bodies,
        watch: &dyn Watch,
    ) -> Result<Vec<ChainLengths>, StudyError> {
        run(plan, overrides, bodies, watch)
    }

    fn files(head: Head, laws: &[ChainLengths]) -> Result<Files, ReportError> {
        let Head { program, scene, plan, command_line } = head;
        let (model, drive_frequency) = (scene.model.kind.name(), scene.drive.frequency);
        ChainLengthReport { program, model, plan, laws: laws.to_vec(), drive_frequency, command_line }.files()
    }

    fn text(laws: &[ChainLengths]) -> String {
        let mut text = String::new();
        let list = |beads: Vec<usize>| {
            if beads.is_empty() {
                "none".into()
            } else {
                beads.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
            }
        };
        for law in laws {
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{} dampers, alpha {}", law.law.name, law.law.alpha);
            for line in SUBHARMONICS {
                let _ = writeln!(text, "  line at {line}: N = {}", list(law.with_line(line)));
            }
            let _ = writeln!(text, "  train of impulses: N = {}", list(law.impulsive()));
            let _ = writeln!(text, "  bandwidth with N, rank correlation: {:+.2}", law.bandwidth_correlation);
        }
        text
    }
}
