//! What the files of a bench leave open: everything at once, with the flags that would say it.

use std::path::Path;

use crate::{
    cli::reading::DriveUnread,
    measurement::{MeasurementError, shell_word},
};

/// Why the records cannot be read, and the flags that would settle all of it, with placeholders for its values.
#[derive(Debug, thiserror::Error)]
#[error("{}", messages.join("\n  and "))]
pub struct Unread {
    messages: Vec<String>,
    /// As they are typed.
    pub flags: String,
}

/// Sensitivities of a vibrometer on a bead and on a horn, to be filled in.
const OF_A_BEAD: &str = "'<VALUE> mm/s/V'";
const OF_A_HORN: &str = "'<VALUE> um/V'";

/// Warnings of the horn's file, whose kind was open.
fn as_of_horn(text: String) -> String {
    if text.contains(OF_A_HORN) { text } else { text.replace(OF_A_BEAD, OF_A_HORN) }
}

impl Unread {
    /// Of a record and, in another file, the horn's; `settled` are flags to type besides. An error that no flag settles comes back as it is.
    pub fn of(
        bead: Option<MeasurementError>,
        horn: Option<MeasurementError>,
        settled: Option<String>,
    ) -> Result<Self, anyhow::Error> {
        let (mut messages, mut flags) = (Vec::new(), Vec::new());
        if let Some(error) = bead {
            let Some(remedy) = error.remedy() else { return Err(error.into()) };
            messages.push(error.to_string());
            flags.push(remedy);
        }
        if let Some(error) = horn {
            let Some(remedy) = error.remedy() else { return Err(DriveUnread(error).into()) };
            messages.push(as_of_horn(DriveUnread::of_drive(&error.to_string())));
            flags.push(as_of_horn(DriveUnread::flags_of_drive(&remedy)));
        }
        flags.extend(settled);
        Ok(Self { messages, flags: flags.join(" ") })
    }

    /// Of one file whose columns may hold both channels; `is_horn` says whether the first of two columns is rather the horn's.
    pub fn of_one(error: MeasurementError, is_horn: impl FnOnce([&str; 2]) -> bool) -> Result<Self, anyhow::Error> {
        let columns = two_columns(&error);
        let in_volts = error.remedy().is_some_and(|remedy| remedy.contains("--scale"));
        let mut unread = Self::of(Some(error), None, None)?;
        if let Some([first, second]) = columns {
            let first_is_horn = is_horn([&first, &second]);
            if first_is_horn {
                unread.flags = unread.flags.replace(&first, &second);
            }
            let other = if first_is_horn { first } else { second };
            let quoted = shell_word(&other);
            unread.messages.push(format!(
                "if `{other}` is the horn tip, name it with --drive-read channel={quoted}; otherwise omit this flag"
            ));
            unread.flags.push_str(&format!(" --drive-read channel={quoted}"));
            if in_volts {
                unread.flags.push_str(&format!(" --drive-read scale={OF_A_HORN}"));
            }
        }
        Ok(unread)
    }
}

/// Two columns of which one was to be chosen for the record.
fn two_columns(error: &MeasurementError) -> Option<[String; 2]> {
    match error {
        MeasurementError::Several(errors) => errors.iter().find_map(two_columns),
        MeasurementError::Ambiguous { flag: "--channel", candidates, .. } => match &candidates[..] {
            [first, second] if first != second => Some([first.clone(), second.clone()]),
            _ => None,
        },
        _ => None,
    }
}

/// Whether a file is the horn's by its name.
pub fn is_named_horn(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy().to_lowercase()).unwrap_or_default();
    ["horn", "tip", "drive", "sonotrode"].iter().any(|word| name.contains(word))
}
