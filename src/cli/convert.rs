//! `granchain convert FILE OUT.uff|OUT.csv`: a record in any form that is read, written in one that everybody reads.

use std::{
    fmt::{self, Write as _},
    path::PathBuf,
};

use clap::Args;
use serde::Serialize;

use crate::measurement::{
    Baseline, ByteOrder, Masking, Precision, ReadOptions, Record, RecordKind, RecordedQuantity, Samples, TimeResponse,
    UniversalForm,
};

use super::{
    Outcome,
    arguments::{Session, drive_frequency, one_of, usage},
    inspect::{self, KINDS},
    output::{refuse_existing, write_new},
    reading::ReadArguments,
};

/// Arguments of `granchain convert`.
///
/// The recorded quantity is written as it stands in the file, in SI and on the file's own time axis: no sign is turned, no
/// baseline, delay or trigger taken off, nothing masked.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain convert vib.csv vib.uff")]
pub struct Arguments {
    /// A record in any form that is read
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// What to write: `.uff` or `.unv` for a universal file, `.csv` for a table; it must not exist
    #[arg(value_name = "OUT")]
    pub out: PathBuf,
    /// Kind of record [default: from the file's name and units]
    #[arg(long, value_parser = one_of(&KINDS))]
    pub kind: Option<RecordKind>,
    /// Drive frequency with its unit, such as 73kHz, if the file does not state it
    #[arg(long, value_name = "QUANTITY", value_parser = drive_frequency)]
    pub drive_frequency: Option<f64>,
    /// Write the universal file as text (data set 58, 13 digits) instead of binary (58b, exact)
    #[arg(long)]
    pub text: bool,
    #[command(flatten)]
    pub reading: ReadArguments,
}

pub fn execute(arguments: Arguments, session: &Session) -> anyhow::Result<Outcome> {
    let Arguments { file, out, .. } = &arguments;
    let extension = out.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default();
    if !["uff", "unv", "csv"].contains(&extension.as_str()) {
        return Err(usage(format!("{}: expected a name that ends in .uff, .unv or .csv", out.display())));
    }
    refuse_existing(out, "")?;
    let kind = arguments.kind;
    let given = arguments.reading.options_of_any(kind, arguments.drive_frequency)?;
    let mask = given.mask.clone();
    let options = ReadOptions { baseline: Baseline::None, mask: Masking::None, ..given };
    let record = inspect::read(file, kind, &options)?;
    let bytes = if extension == "csv" { table(&record).into_bytes() } else { universal(&record, arguments.text) };
    write_new(out, &bytes, "the record ", "")?;
    inspect::warn(&record, session);
    let written = Written {
        file: file.display().to_string(),
        sha256: record.sha256.clone(),
        form: record.form.clone(),
        out: out.display().to_string(),
        samples: record.raw.len(),
        unit: record.recorded.unit(),
        would_mask: record.would_mask(&mask),
        assumptions: record.assumptions.clone(),
    };
    session.result(&written, &written)?;
    Ok(Outcome::Done)
}

/// The shortest decimals that read back as the very numbers.
fn table(record: &Record) -> String {
    let name = match record.recorded {
        RecordedQuantity::Displacement => "displacement_m",
        RecordedQuantity::Velocity => "velocity_m_per_s",
        RecordedQuantity::Pressure => "pressure_pa",
    };
    let mut text = format!("# converted from: {} (SHA-256 {})\n", record.path.display(), record.sha256);
    // Writing to a String cannot fail.
    let mut state = |name: &str, value: Option<f64>, unit: &str| {
        if let Some(value) = value {
            let _ = writeln!(text, "# {name}: {value:e} {unit}");
        }
    };
    state("drive frequency", record.stated_drive_frequency, "Hz");
    state("bandwidth", record.bandwidth, "Hz");
    state("delay", Some(record.delay).filter(|delay| *delay != 0.0), "s");
    state("trigger", Some(record.trigger).filter(|trigger| *trigger != 0.0), "s");
    text.push_str("time_s,");
    text.push_str(name);
    text.push('\n');
    for (i, value) in record.raw.values.iter().enumerate() {
        let _ = writeln!(text, "{:e},{value:e}", record.raw.time(i));
    }
    text
}

fn universal(record: &Record, text: bool) -> Vec<u8> {
    let title = record.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let response = TimeResponse { title: &title, quantity: record.recorded, samples: Samples::Even(&record.raw) };
    let binary = if text { None } else { Some(ByteOrder::Little) };
    response.to_bytes(UniversalForm { precision: Precision::Double, binary })
}

/// What was read and written.
#[derive(Debug, Serialize)]
struct Written {
    file: String,
    sha256: String,
    form: String,
    out: String,
    samples: usize,
    unit: &'static str,
    /// What a calibration would mask of the values written.
    #[serde(skip_serializing_if = "Option::is_none")]
    would_mask: Option<String>,
    assumptions: Vec<String>,
}

impl fmt::Display for Written {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} samples of {} ({}), in {}", self.out, self.samples, self.file, self.form, self.unit)?;
        if let Some(masked) = &self.would_mask {
            writeln!(f, "  written as in the file; a calibration would mask {masked}")?;
        }
        self.assumptions.iter().try_for_each(|line| writeln!(f, "  - {line}"))
    }
}
