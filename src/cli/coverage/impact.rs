//! Coverage of hits on the impact bench: `--scenario impact`.

use std::{ops::Range, path::Path};

use serde_json::{Value, json};

use super::{Arguments, COUNT, SUMMARY};
use crate::{
    cli::{
        Outcome,
        arguments::{OutputArguments, Session, usage},
        interrupt::{self, Interrupted},
        output::OutputFolder,
        parts::{self, Divisible, Parts},
        progress, summary,
    },
    report::number::significant,
    validate::impact::{HITS, ImpactCount, ImpactSynthetic, TRUTHS, impact_synthetic},
};

pub const NAME: &str = "impact";

/// Columns that several hits strike, to be made, fitted and counted.
pub struct Study {
    count: u64,
    output: OutputArguments,
    session: Session,
}

impl Study {
    pub fn new(arguments: Arguments, session: Session) -> anyhow::Result<Self> {
        let Arguments { scenario, count, evaluations, model, mesh_density, amplitudes, keep_records, output, .. } =
            arguments;
        let other = evaluations.is_some() || model.is_some() || mesh_density.is_some() || amplitudes || keep_records;
        if scenario.len() > 1 || other {
            return Err(usage(format!(
                "--scenario {NAME} takes no other scenario and of the flags only --count, --part, --out, --force"
            )));
        }
        Ok(Self { count: count.unwrap_or(COUNT), output, session })
    }

    fn records(&self, part: Range<usize>) -> anyhow::Result<Vec<ImpactSynthetic>> {
        let bar = progress::bar(&self.session, part.len() as u64, "columns");
        let numbers = part.start as u64..part.end as u64;
        let records = impact_synthetic(numbers, self.session.seed(), &|| bar.inc(1), &interrupt::requested);
        bar.finish_and_clear();
        if interrupt::requested() {
            return Err(Interrupted.into());
        }
        records.map_err(anyhow::Error::msg)
    }

    pub fn run_here(self) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&[SUMMARY])?;
        let records = self.records(0..self.points())?;
        self.conclude(&records, folder)
    }

    fn conclude(&self, records: &[ImpactSynthetic], folder: Option<OutputFolder>) -> anyhow::Result<Outcome> {
        let count = ImpactCount::of(records);
        let summary = json!({
            "program": summary::program(), "scenario": NAME, "seed": self.session.seed(), "count": count, "records": records
        });
        let mut text = format!("{} columns, {HITS} hits each; 90 % intervals\n", count.count);
        for (d, (name, _)) in TRUTHS.into_iter().enumerate() {
            let (width, error) = (significant(count.widths[d], 2), significant(count.errors[d], 2));
            text += &format!(
                "{name}: {} of {} contain the true value; median width {width}, median error {error} (ln)\n",
                count.held[d], count.count
            );
        }
        text += &format!("outside scatter: {}; p < 0.05: {}\n", count.outside, count.below_five_percent);
        if let Some(folder) = folder {
            folder.write(SUMMARY, summary::json(&summary)?)?;
            self.session.note(format_args!("written to {}", folder.finish()?.display()));
        }
        self.session.result(text, &summary)?;
        Ok(Outcome::Done)
    }
}

impl Divisible for Study {
    fn points(&self) -> usize {
        self.count as usize
    }

    fn out(&self) -> Option<&Path> {
        self.output.out.as_deref()
    }

    fn plan(&self) -> anyhow::Result<Vec<u8>> {
        let coverage = json!({ "scenario": NAME, "count": self.count, "seed": self.session.seed() });
        summary::json(&json!({ "program": summary::program(), "coverage": coverage }))
    }

    fn run(&self, part: Range<usize>) -> anyhow::Result<Vec<Value>> {
        parts::values(&self.records(part)?)
    }

    fn finish(self: Box<Self>, parts: &Parts) -> anyhow::Result<Outcome> {
        let folder = self.output.stage(&[SUMMARY])?;
        self.conclude(&parts.all()?, folder)
    }
}
