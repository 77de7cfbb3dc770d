//! `granchain-reproduction precompression`: a static force along the chain.

use std::fmt::Write as _;

use super::{Head, trend::Law};
use crate::portrait::Trait;
use crate::{page::precompression::PrecompressionReport, precompression::Precompressions, trend::Study};
use granchain_report::page::Files;

impl Law for Precompressions {
    const NAME: &str = "precompression";

    fn files(head: Head, study: &Study<Self>, laws: Vec<Self>) -> anyhow::Result<Files> {
        let Head { program, command_line } = head;
        let model = study.scene().model.kind.name();
        Ok(PrecompressionReport { program, model, plan: *study.plan(), laws, command_line }.files()?)
    }

    fn text(laws: &[Self]) -> String {
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
