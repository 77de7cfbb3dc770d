//! `granchain inspect DIR`: a line for each record, and once for all files of a kind what they lack.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::Context;
use serde::Serialize;

use super::{Arguments, Summary, other_file, read, shown};
use crate::{
    cli::output::aligned,
    measurement::MeasurementError,
    report::page::{Column, Table},
    signal::Dimension,
};

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

pub fn text(folder: &Path, rows: &[Row]) -> String {
    let row = |row: &Row| {
        let record = row.record.as_ref()?;
        let warnings = match record.warnings.len() {
            0 => String::new(),
            count => format!(", {count} warnings"),
        };
        Some(vec![
            row.name.clone(),
            record.kind.name().to_owned(),
            record.samples.to_string(),
            shown(record.sample_rate_hz, Dimension::FREQUENCY),
            shown(record.duration_s, Dimension::TIME),
            shown(record.positive_peak.max(-record.negative_peak), record.kind.dimension()),
            format!("{}{warnings}", record.form),
        ])
    };
    let records: Vec<_> = rows.iter().filter_map(row).collect();
    let mut text = format!("{}: {} of {} files are records\n", folder.display(), records.len(), rows.len());
    if !records.is_empty() {
        let words = ["file", "kind"].map(Column::words).into_iter();
        let numbers = ["samples", "rate", "duration", "peak"].map(Column::numbers);
        let columns = words.chain(numbers).chain([Column::words("from")]).collect();
        text += &aligned(&Table { caption: String::new(), columns, rows: records });
    }
    // Files that need the same flags stand together, the others by their reason.
    let mut kinds: BTreeMap<(bool, &str), (&str, Vec<&str>)> = BTreeMap::new();
    for row in rows {
        let Some(reason) = row.refused.as_deref().and_then(|text| text.lines().next()) else { continue };
        let kind = (row.missing.is_none(), row.missing.as_deref().unwrap_or(reason));
        kinds.entry(kind).or_insert_with(|| (reason, Vec::new())).1.push(&row.name);
    }
    for ((unsettled, flags), (reason, names)) in kinds {
        let missing = if unsettled { String::new() } else { format!("  missing: {flags}\n") };
        text += &format!("\n{missing}  – {reason}\n    {}\n", names.join(", "));
    }
    text
}
