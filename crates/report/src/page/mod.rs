//! A report as a list of blocks, written as one self-contained HTML page and as Markdown with its figures beside it.
//!
//! The page brings everything it needs: inline SVG, inline style, the figures' font, and scripts that only add: without them, and in print, every
//! figure and every table is there. It asks no network. All text is data and is escaped on the way out.

mod curves;
mod html;
mod markdown;
mod table;

use std::{borrow::Cow, path::PathBuf};

use rayon::prelude::*;
use thiserror::Error;

use super::{
    figure::{Figure, FigureError},
    motion::Motion,
};

use granchain_signal::feature::FeatureError;

pub use table::{Column, Table};

/// Files of a report: path relative to its folder, and bytes.
pub type Files = Vec<(PathBuf, Vec<u8>)>;

/// Why a report cannot be rendered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    #[error(transparent)]
    Figure(#[from] FigureError),
    #[error("report: expected `{field}` to be finite, found {found}; a failed run has no place among the results")]
    NotFinite { field: String, found: f64 },
    #[error("report: `{field}` is empty; give at least one")]
    Missing { field: &'static str },
    #[error(transparent)]
    Feature(#[from] FeatureError),
    #[error("report: the data could not be written as JSON")]
    Json(#[from] serde_json::Error),
    #[error("report: a table could not be written as CSV")]
    Csv(#[from] csv::Error),
}

pub fn csv_bytes(table: csv::Writer<Vec<u8>>) -> Result<Vec<u8>, ReportError> {
    table.into_inner().map_err(|error| ReportError::Csv(error.into_error().into()))
}

/// Names of a page's files that may hold times.
pub const PAGES: [&str; 2] = ["report.html", "report.md"];

/// Marks around what differs from run to run.
const TIMES: [&str; 2] = ["<!-- times -->", "<!-- end of times -->"];

/// The bytes of a page less its times: what equal runs have in common, and what digests are of.
#[must_use]
pub fn without_times(page: &[u8]) -> Cow<'_, [u8]> {
    let found = |part: &[u8], mark: &str| part.windows(mark.len()).position(|at| at == mark.as_bytes());
    let (mut kept, mut rest) = (Vec::new(), page);
    while let Some(begin) = found(rest, TIMES[0]) {
        let Some(end) = found(&rest[begin..], TIMES[1]) else { break };
        kept.extend_from_slice(&rest[..begin]);
        rest = &rest[begin + end + TIMES[1].len()..];
    }
    if kept.is_empty() { Cow::Borrowed(page) } else { Cow::Owned([&kept, rest].concat()) }
}

/// Where a page comes from: its facts, and the command line that makes it again.
pub fn provenance(facts: Vec<(String, String)>, command_line: &str) -> [Block; 3] {
    [Block::Heading("Provenance".into()), Block::Facts(facts), Block::Code(command_line.to_owned())]
}

/// How good the news is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tone {
    Good,
    /// To be read with care.
    Careful,
    Bad,
}

/// A figure with its file name and what a reader should see in it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plate {
    /// File name without extension, unique in the page.
    pub name: String,
    pub caption: String,
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
        text: String,
    },
    /// What must not be overlooked.
    Notice(Vec<String>),
    Heading(String),
    Paragraph(String),
    List(Vec<String>),
    Facts(Vec<(String, String)>),
    Table(Table),
    /// A table with times, which differ from run to run: [`without_times`] leaves it out.
    Timed(Table),
    /// Figures that belong together; one journal column wide each, they stand side by side where there is room.
    Plates(Vec<Plate>),
    Motion(Motion),
    /// Text to be copied, such as a command line.
    Code(String),
}

impl Block {
    /// A block under its heading.
    #[must_use]
    pub fn under(self, heading: &str) -> [Self; 2] {
        [Self::Heading(heading.to_owned()), self]
    }

    /// A list under its heading; nothing where it has no item.
    #[must_use]
    pub fn listed(heading: &str, items: Vec<String>) -> Vec<Self> {
        if items.is_empty() { Vec::new() } else { Self::List(items).under(heading).into() }
    }

    /// What must not be overlooked, where there is any.
    #[must_use]
    pub fn noticed(statements: &[String]) -> Option<Self> {
        (!statements.is_empty()).then(|| Self::Notice(statements.to_vec()))
    }
}

#[derive(Debug, Clone, PartialEq)]
pub struct Page {
    pub title: String,
    pub subtitle: String,
    pub blocks: Vec<Block>,
}

/// A plate drawn once, for all who show it.
struct Drawn<'a> {
    plate: &'a Plate,
    number: usize,
    svg: String,
}

impl Page {
    /// `report.html`, `report.md`, and every figure as `figures/NAME.svg` and `figures/NAME.png`.
    pub fn files(&self) -> Result<Files, ReportError> {
        let drawn = self.drawn()?;
        let mut files: Files = vec![
            (PathBuf::from(PAGES[0]), html::render(self, &drawn).into_bytes()),
            (PathBuf::from(PAGES[1]), markdown::render(self, &drawn).into_bytes()),
        ];
        files.extend(pictures(drawn, "figures")?);
        Ok(files)
    }

    /// `report.html` alone.
    pub(crate) fn html(&self) -> Result<String, ReportError> {
        Ok(html::render(self, &self.drawn()?))
    }

    /// `report.html`, and every figure as `NAME.svg` and `NAME.png` beside it.
    pub(crate) fn files_beside(&self) -> Result<Files, ReportError> {
        let drawn = self.drawn()?;
        let mut files: Files = vec![(PathBuf::from("report.html"), html::render(self, &drawn).into_bytes())];
        files.extend(pictures(drawn, "")?);
        Ok(files)
    }

    fn drawn(&self) -> Result<Vec<Drawn<'_>>, FigureError> {
        let plates: Vec<&Plate> = self
            .blocks
            .iter()
            .filter_map(|block| if let Block::Plates(plates) = block { Some(plates) } else { None })
            .flatten()
            .collect();
        plates
            .into_par_iter()
            .enumerate()
            .map(|(index, plate)| Ok(Drawn { plate, number: index + 1, svg: plate.figure.to_svg()? }))
            .collect()
    }
}

/// Every figure as SVG and PNG in a folder.
fn pictures(drawn: Vec<Drawn<'_>>, folder: &str) -> Result<Files, FigureError> {
    let both = |drawn: Drawn<'_>| {
        let file = |extension: &str| PathBuf::from(folder).join(format!("{}.{extension}", drawn.plate.name));
        let png = drawn.plate.figure.png_of(&drawn.svg)?;
        Ok([(file("svg"), drawn.svg.into_bytes()), (file("png"), png)])
    };
    let files: Vec<_> = drawn.into_par_iter().map(both).collect::<Result<_, FigureError>>()?;
    Ok(files.into_iter().flatten().collect())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;

    #[test]
    fn pages_differ_by_their_times_alone() {
        let page = |seconds: &str| {
            let table = Table {
                caption: "cost".into(),
                columns: vec![Column::words("Model"), Column::numbers("Time").unit("s")],
                rows: vec![vec!["chain".into(), seconds.into()]],
            };
            let blocks = vec![Block::Timed(table.clone()), Block::Paragraph("between".into()), Block::Timed(table)];
            Page { title: "page".into(), subtitle: String::new(), blocks }.files().unwrap()
        };
        for ((name, fast), (_, slow)) in page("1.5").iter().zip(page("15")) {
            assert_ne!(*fast, slow, "{}", name.display());
            let kept = without_times(fast);
            assert_eq!(kept, without_times(&slow), "{}", name.display());
            let text = String::from_utf8_lossy(&kept);
            assert!(text.contains("between") && !text.contains("chain"), "{text}");
        }
    }
}
