//! The page of the study of the source paper: every printed statement beside ours, and the figures it rests on.

mod figures;
mod tables;
mod text;

use crate::paper::{Judgement, PaperOutcome};
use granchain_report::page::{Block, Files, Page, Plate, ReportError, provenance};
use granchain_signal::{Series, feature::AmplitudeSpectrum};

/// The velocity that the project reconstructed from printed numbers: never a measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// Velocity of the pole, m/s, on its own time axis.
    pub velocity: Series,
    /// Its spectrum where the drive is on.
    pub spectrum: AmplitudeSpectrum,
    /// Amplitude of its drive line, m/s.
    pub drive_line: f64,
}

/// The study and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct PaperReport {
    pub program: String,
    pub outcome: PaperOutcome,
    /// Every printed statement beside it.
    pub judgements: Vec<Judgement>,
    /// The reconstruction shown beside both laws.
    pub reconstruction: Reconstruction,
    pub drive_frequency: f64,
    pub command_line: String,
}

impl PaperReport {
    /// `report.html`, `report.md`, the figures, `paper.json`, `statements.csv`, `sweep.csv`, `readings.csv`.
    ///
    /// # Errors
    /// [`ReportError`] when there is no law or no statement, or a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        if self.outcome.laws.is_empty() {
            return Err(ReportError::Missing { field: "laws" });
        }
        if self.judgements.is_empty() {
            return Err(ReportError::Missing { field: "judgements" });
        }
        let mut files = self.page().files()?;
        let mut json = serde_json::to_vec_pretty(&serde_json::json!({
            "program": self.program, "outcome": self.outcome, "judgements": self.judgements,
        }))?;
        json.push(b'\n');
        files.push(("paper.json".into(), json));
        files.push(("statements.csv".into(), tables::statements_csv(&self.judgements).into_bytes()));
        files.push(("sweep.csv".into(), tables::sweep_csv(&self.outcome).into_bytes()));
        files.push(("readings.csv".into(), tables::readings_csv(&self.outcome).into_bytes()));
        Ok(files)
    }

    fn page(&self) -> Page {
        let mut blocks = vec![text::headline(&self.judgements), text::introduction(&self.outcome)];
        blocks.push(Block::Table(tables::statements(&self.judgements)));
        blocks.push(Block::Heading("What agrees, what does not".into()));
        blocks.push(Block::List(text::agreement(&self.outcome, &self.judgements)));
        blocks.push(Block::Heading("Waveforms and spectra (Fig. 6 of the paper)".into()));
        blocks.push(Block::Plates(vec![Plate::new("waveforms", figures::waveforms(self))]));
        blocks.push(Block::Table(tables::lines(&self.outcome)));
        blocks.push(Block::Heading("The amplitude scale α".into()));
        blocks.push(Block::Plates(vec![Plate::new("alpha-sweep", figures::sweep(&self.outcome))]));
        blocks.push(Block::Paragraph(text::sweep(&self.outcome)));
        blocks.push(Block::Heading("What the paper leaves open, ranked".into()));
        blocks.push(Block::Paragraph(text::readings(&self.outcome)));
        blocks.push(Block::Plates(figures::readings(&self.outcome)));
        blocks.extend(tables::readings(&self.outcome).into_iter().map(Block::Table));
        blocks.push(Block::Heading("Before the rigid wall (Fig. 5 of the paper)".into()));
        blocks.push(Block::Plates(vec![Plate::new("rigid", figures::rigid(&self.outcome))]));
        blocks.push(Block::Paragraph(text::rigid(&self.outcome)));
        if self.outcome.rigid.runs.len() > 1 {
            blocks.push(Block::Table(tables::rigid(&self.outcome)));
        }
        blocks.push(Block::Heading("What is reading, what is unknown".into()));
        blocks.push(Block::List(text::unknown(&self.outcome.plan)));
        blocks.extend(provenance(text::provenance(self), &self.command_line));
        Page {
            title: "The paper’s experiment".into(),
            subtitle: "Six steel beads driven at 73 kHz: every printed number beside ours, and what decides it".into(),
            blocks,
        }
    }
}

/// Velocity in mm/s without a sign of its own for positive ones.
fn millimetres(velocity: f64) -> String {
    granchain_report::number::fixed(1e3 * velocity, 0)
}
