//! `granchain-reproduction chain-length`: two to ten beads.

use std::fmt::Write as _;

use super::{Head, trend::Law};
use crate::{
    chain_length::{ChainLengths, SUBHARMONICS},
    page::chain_length::ChainLengthReport,
    trend::Study,
};
use granchain_report::page::Files;

impl Law for ChainLengths {
    const NAME: &str = "chain-length";

    fn files(head: Head, study: &Study<Self>, laws: Vec<Self>) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        let (model, drive_frequency) = (study.scene().model.kind.name(), study.scene().drive.frequency);
        Ok(ChainLengthReport { program, model, plan: *study.plan(), laws, drive_frequency, command_line }.files()?)
    }

    fn text(laws: &[Self]) -> String {
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
