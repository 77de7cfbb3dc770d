//! `granchain inspect DIR`: a line for each record, and once for all files of a kind what they lack.

use std::{
    collections::BTreeMap,
    fmt,
    path::{Path, PathBuf},
};

use anyhow::Context;
use serde::Serialize;

use super::{Arguments, Summary, other_file, read, shown};
use crate::{measurement::MeasurementError, signal::Dimension};

/// A file of a folder: what it is, or why it is no record.
#[derive(Debug, Serialize)]
pub struct Row {
    name: String,
    #[serde(flatten)]
    record: Option<Summary>,
    #[serde(skip_serializing_if = "Option::is_none")]
    refused: Option<String>,
    /// Flags that would settle it.
    #[serde(skip_serializing_if = "Option::is_none")]
    missing: Option<String>,
}

impl Row {
    fn refused(name: String, reason: String, missing: Option<String>) -> Self {
        Self { name, record: None, refused: Some(reason), missing }
    }
}

/// The files of a folder by name, without those that begin with a dot.
pub fn rows(arguments: &Arguments) -> anyhow::Result<Vec<Row>> {
    let folder = &arguments.file;
    let unread = || format!("{}: the folder cannot be read", folder.display());
    let mut files: Vec<PathBuf> = Vec::new();
    for entry in std::fs::read_dir(folder).with_context(unread)? {
        files.push(entry.with_context(unread)?.path());
    }
    files
        .retain(|path| path.is_file() && !path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.')));
    files.sort();
    let kind = arguments.kind;
    let options = arguments.reading.options_of_any(kind, arguments.drive_frequency)?;
    let row = |path: PathBuf| {
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        if let Some(other) = other_file(&path) {
            return Row::refused(name, other, None);
        }
        match read(&path, kind, &options) {
            Ok(record) => Row { name, record: Some(Summary::of(&record, None)), refused: None, missing: None },
            Err(error) => Row::refused(name, reason(&path, &error), error.remedy()),
        }
    };
    Ok(files.into_iter().map(row).collect())
}

/// The text of an error without the place that differs from file to file.
fn reason(path: &Path, error: &MeasurementError) -> String {
    let file = format!("{}:", path.display());
    let of_line = |line: &str| {
        let (lead, text) = line.strip_prefix("  and ").map_or(("", line), |text| ("  and ", text));
        let text = text.strip_prefix(&file).unwrap_or(text);
        let text = text.trim_start_matches(|letter: char| letter.is_ascii_digit());
        let text = text.strip_prefix(':').unwrap_or(text).trim_start();
        let text = text.strip_prefix("column `").and_then(|text| text.split_once("`: ")).map_or(text, |(_, text)| text);
        format!("{lead}{text}")
    };
    error.to_string().lines().map(of_line).collect::<Vec<_>>().join("\n")
}

pub struct Text<'a> {
    pub folder: &'a Path,
    pub rows: &'a [Row],
}

impl fmt::Display for Text<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let records: Vec<(&str, &Summary)> =
            self.rows.iter().filter_map(|row| Some((row.name.as_str(), row.record.as_ref()?))).collect();
        writeln!(f, "{}: {} of {} files are records", self.folder.display(), records.len(), self.rows.len())?;
        let width = records.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0).clamp(4, 40);
        if !records.is_empty() {
            writeln!(
                f,
                "  {:<width$}  {:<11}{:>10}{:>13}{:>13}{:>14}  from",
                "file", "kind", "samples", "rate", "duration", "peak"
            )?;
        }
        for (name, record) in records {
            let peak = record.positive_peak.max(-record.negative_peak);
            let warnings = match record.warnings.len() {
                0 => String::new(),
                count => format!(", {count} warnings"),
            };
            writeln!(
                f,
                "  {name:<width$}  {:<11}{:>10}{:>13}{:>13}{:>14}  {}{warnings}",
                record.kind.name(),
                record.samples,
                shown(record.sample_rate_hz, Dimension::FREQUENCY),
                shown(record.duration_s, Dimension::TIME),
                shown(peak, record.kind.dimension()),
                record.form,
            )?;
        }
        // Files that need the same flags stand together, the others by their reason.
        let mut kinds: BTreeMap<(bool, &str), (&str, Vec<&str>)> = BTreeMap::new();
        for row in self.rows {
            let Some(reason) = row.refused.as_deref().and_then(|text| text.lines().next()) else { continue };
            let kind = (row.missing.is_none(), row.missing.as_deref().unwrap_or(reason));
            kinds.entry(kind).or_insert_with(|| (reason, Vec::new())).1.push(&row.name);
        }
        for ((unsettled, flags), (reason, names)) in kinds {
            writeln!(f)?;
            if !unsettled {
                writeln!(f, "  missing: {flags}")?;
            }
            writeln!(f, "  – {reason}")?;
            writeln!(f, "    {}", names.join(", "))?;
        }
        Ok(())
    }
}
