//! The page of the study before water: what each reading of the mount, the baffle and the dampers gives against the printed pressure and content.

mod figures;
mod tables;
mod text;

use crate::water::WaterOutcome;
use granchain_report::page::{Block, Files, Page, Plate, ReportError, provenance};

/// The study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct WaterReport {
    pub program: String,
    pub model: &'static str,
    pub outcome: WaterOutcome,
    pub command_line: String,
}

impl WaterReport {
    /// `report.html`, `report.md`, the figures, `water.json`, `combinations.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no combination or no drawn run, or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        let WaterOutcome { combinations, waveforms, companion, plan, tips } = &self.outcome;
        if combinations.is_empty() {
            return Err(ReportError::Missing { field: "combinations" });
        }
        if waveforms.is_empty() {
            return Err(ReportError::Missing { field: "waveforms" });
        }
        let mut files = self.page().files()?;
        // The drawn runs are in the figures; their series would be most of the file.
        let mut json = serde_json::to_vec_pretty(&serde_json::json!({
            "program": self.program, "model": self.model, "plan": plan, "combinations": combinations, "companion": companion, "tips": tips,
        }))?;
        json.push(b'\n');
        files.push(("water.json".into(), json));
        files.push(("combinations.csv".into(), tables::csv(&self.outcome).into_bytes()));
        Ok(files)
    }

    fn page(&self) -> Page {
        let outcome = &self.outcome;
        let mut blocks = vec![text::headline(outcome), Block::Paragraph(text::introduction(&outcome.plan, self.model))];
        blocks.push(Block::List(text::findings(outcome)));
        blocks.push(Block::Table(tables::crossings(outcome)));
        blocks.push(Block::Plates(vec![Plate::new("drives", figures::drives(outcome))]));
        blocks.push(Block::Heading("Every combination at every drive".into()));
        blocks.extend(tables::combinations(outcome).into_iter().map(Block::Table));
        blocks.push(Block::Heading("Drive, velocity and pressure (Fig. 7 and 8 of the paper)".into()));
        blocks.push(Block::Plates(figures::waveforms(&outcome.waveforms)));
        blocks.push(Block::Heading("A compliant tip".into()));
        blocks.push(Block::Paragraph(text::tips(outcome)));
        blocks.push(Block::Table(tables::tips(outcome)));
        blocks.push(Block::Heading("Six aluminium beads (companion work)".into()));
        blocks.push(Block::Paragraph(text::companion(&outcome.companion)));
        blocks.push(Block::Table(tables::companion(&outcome.companion)));
        blocks.push(Block::Heading("What is reading, what is unknown".into()));
        blocks.push(Block::List(text::unknown(&outcome.plan)));
        let facts = vec![
            ("version".into(), self.program.clone()),
            ("model".into(), self.model.into()),
            ("seed".into(), "none: the runs of a cell spread evenly over ± 2 % of drive".into()),
        ];
        blocks.extend(provenance(facts, &self.command_line));
        Page {
            title: "Sound in water behind the chain".into(),
            subtitle: "Six beads on a disc of vitreous carbon before water: which mount, baffle and dampers give the printed pressure".into(),
            blocks,
        }
    }
}
