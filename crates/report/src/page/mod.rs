//! A report as a list of blocks, written as one self-contained HTML page and as Markdown with its figures beside it.
//!
//! The page brings everything it needs: inline SVG, inline style, the figures' font. It runs no script, asks no network, and
//! prints. All text is data and is escaped on the way out.

mod html;
mod markdown;
mod table;

use std::path::PathBuf;

use rayon::prelude::*;
use thiserror::Error;

use super::figure::{Figure, FigureError};

pub use table::{Column, Table};

/// Files of a report: path relative to its folder, and bytes.
pub type Files = Vec<(PathBuf, Vec<u8>)>;

/// Why a report cannot be rendered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A figure cannot be drawn.
    #[error(transparent)]
    Figure(#[from] FigureError),
    /// A number that should be finite is not.
    #[error("report: expected `{field}` to be finite, found {found}; a failed run has no place among the results")]
    NotFinite {
        /// Which number.
        field: String,
        /// What was found.
        found: f64,
    },
    /// Something the report cannot do without is missing.
    #[error("report: `{field}` is empty; give at least one")]
    Missing {
        /// What is missing.
        field: &'static str,
    },
    /// The data could not be written as JSON.
    #[error("report: the data could not be written as JSON")]
    Json(#[from] serde_json::Error),
    /// A table could not be written as CSV.
    #[error("report: a table could not be written as CSV")]
    Csv(#[from] csv::Error),
}

/// Where a page comes from: its facts, and the command line that makes it again.
pub(super) fn provenance(facts: Vec<(String, String)>, command_line: &str) -> [Block; 3] {
    [Block::Heading("Provenance".into()), Block::Facts(facts), Block::Code(command_line.to_owned())]
}

/// How good the news is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    /// As hoped.
    Good,
    /// To be read with care.
    Careful,
    /// Not as hoped.
    Bad,
}

/// A figure with its file name and what a reader should see in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plate {
    /// File name without extension, unique in the page.
    pub name: String,
    /// Caption, a few sentences.
    pub caption: String,
    /// The figure.
    pub figure: Figure,
}

impl Plate {
    /// A plate whose caption is the figure's title.
    #[must_use]
    pub fn new(name: impl Into<String>, figure: Figure) -> Self {
        Self { name: name.into(), caption: figure.title.clone(), figure }
    }
}

/// One block of a page.
#[derive(Debug, Clone, PartialEq)]
pub enum Block {
    /// The answer, in one or two sentences, with a few words of verdict before it.
    Headline {
        /// How good the news is.
        tone: Tone,
        /// The verdict in a few words.
        verdict: String,
        /// The answer.
        text: String,
    },
    /// What must not be overlooked.
    Notice(Vec<String>),
    /// Heading of a section.
    Heading(String),
    /// A paragraph.
    Paragraph(String),
    /// A list of statements.
    List(Vec<String>),
    /// Names and values.
    Facts(Vec<(String, String)>),
    /// A table.
    Table(Table),
    /// Figures that belong together; one journal column wide each, they stand side by side where there is room.
    Plates(Vec<Plate>),
    /// Text to be copied, such as a command line.
    Code(String),
}

/// A whole report.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Page {
    /// Title.
    pub title: String,
    /// A line below it.
    pub subtitle: String,
    /// Content, in reading order.
    pub blocks: Vec<Block>,
}

/// A plate drawn once, for all who show it.
struct Drawn<'a> {
    plate: &'a Plate,
    number: usize,
    svg: String,
    png: Vec<u8>,
}

impl Page {
    /// `report.html`, `report.md`, and every figure as `figures/NAME.svg` and `figures/NAME.png`.
    ///
    /// # Errors
    /// [`ReportError::Figure`] when a figure cannot be drawn.
    pub fn files(&self) -> Result<Files, ReportError> {
        let plates: Vec<&Plate> = self
            .blocks
            .iter()
            .filter_map(|block| if let Block::Plates(plates) = block { Some(plates) } else { None })
            .flatten()
            .collect();
        let drawn = plates
            .par_iter()
            .enumerate()
            .map(|(index, plate)| {
                let (svg, png) = (plate.figure.to_svg()?, plate.figure.to_png()?);
                Ok(Drawn { plate, number: index + 1, svg, png })
            })
            .collect::<Result<Vec<_>, FigureError>>()?;
        let mut files: Files = vec![
            (PathBuf::from("report.html"), html::render(self, &drawn).into_bytes()),
            (PathBuf::from("report.md"), markdown::render(self, &drawn).into_bytes()),
        ];
        for plate in drawn {
            let file = |extension: &str| PathBuf::from(format!("figures/{}.{extension}", plate.plate.name));
            files.push((file("svg"), plate.svg.into_bytes()));
            files.push((file("png"), plate.png));
        }
        Ok(files)
    }
}
