//! Rohde & Schwarz RTO and RTP: `NAME.bin` is a description in XML, `NAME.Wfm.bin` beside it the samples.
//!
//! Either may be named. The samples begin with their format and their number, 32 bits each; settling samples come first and are left out.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

/// Longest description, bytes.
const LONGEST: u64 = 4 << 20;
const LARGEST: u64 = 8 << 30;

const SAMPLES: &str = ".Wfm.bin";

fn name_of(path: &Path) -> String {
    path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default()
}

/// Description and samples of an export, of which one is named.
fn pair(path: &Path) -> Option<[PathBuf; 2]> {
    let name = name_of(path);
    let stem = name.strip_suffix(SAMPLES).or_else(|| name.strip_suffix(".bin"))?;
    Some([path.with_file_name(format!("{stem}.bin")), path.with_file_name(format!("{stem}{SAMPLES}"))])
}

pub(super) fn is_export(path: &Path, head: &[u8]) -> bool {
    let described =
        head.starts_with(b"<?xml") && head[..head.len().min(400)].windows(9).any(|part| part == b"<Database");
    (described && pair(path).is_some()) || name_of(path).ends_with(SAMPLES)
}

pub(super) fn read(path: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let [description, samples] =
        pair(path).ok_or("Rohde & Schwarz export: expected a name that ends in .bin; give the file its name back")?;
    let beside = |wanted: &Path, largest: u64| {
        if wanted == path {
            return Ok(bytes.to_vec());
        }
        let small = fs::metadata(wanted).is_ok_and(|it| it.is_file() && it.len() <= largest);
        small.then(|| fs::read(wanted).ok()).flatten().ok_or_else(|| {
            format!("Rohde & Schwarz export: expected {} beside it, found none; copy both files", name_of(wanted))
        })
    };
    let text = String::from_utf8_lossy(&beside(&description, LONGEST)?).into_owned();
    let data = beside(&samples, LARGEST)?;
    contents(&text, &data)
}

/// Value of a property of the description.
fn property<'a>(text: &'a str, name: &str, key: &str) -> Option<&'a str> {
    let from = text.split_once(&format!("Name=\"{name}\""))?.1;
    let element = from.split('>').next()?;
    element.split_once(&format!(" {key}=\""))?.1.split('"').next()
}

fn contents(text: &str, data: &[u8]) -> Result<Contents, String> {
    let missing = |what: &str| {
        format!("Rohde & Schwarz export: expected `{what}` in the description, found none; export the record again")
    };
    let number = |name: &str| property(text, name, "Value").and_then(|value| value.parse::<f64>().ok());
    let required = |name: &str| number(name).ok_or_else(|| missing(name));
    let (start, step) = (required("XStart")?, required("Resolution")?);
    let count = required("SignalRecordLength")? as usize;
    let left_out = number("LeadingSettlingSamples").unwrap_or(0.0) as usize;
    let format = property(text, "SignalFormat", "Value").ok_or_else(|| missing("SignalFormat"))?;
    let several = property(text, "MultiChannelExport", "Value").is_some_and(|value| value.ends_with("_ON"));
    let state = |index: usize| {
        property(text, "MultiChannelExportState", &format!("I_{index}")).is_some_and(|it| it.ends_with("_ON"))
    };
    let on: Vec<usize> = (0..4).filter(|index| several && state(*index)).collect();
    let on = if on.is_empty() { vec![0] } else { on };
    // The byte order of the description is not that of exports, which are little-endian.
    let file = Bytes::little(data);
    let (kind, time) = match format.rsplit('_').next().unwrap_or_default() {
        "FLOAT" => (Sample::Float(4), 0),
        "XYDOUBLEFLOAT" => (Sample::Float(4), 8),
        "INT8BIT" => (Sample::Signed(1), 0),
        "INT16BIT" => (Sample::Signed(2), 0),
        other => {
            return Err(format!(
                "Rohde & Schwarz export: expected samples of 8, 16 or 32 bits, found `{other}`; export again as FLOAT"
            ));
        }
    };
    let stride = time + on.len() * kind.width();
    let of_channel = |name: &str, index: usize| {
        let key = format!("I_{index}");
        let value =
            if several { property(text, &format!("MultiChannel{name}"), &key) } else { property(text, name, "Value") };
        value.and_then(|value| value.parse::<f64>().ok())
    };
    let levels = number("NofQuantisationLevels").unwrap_or(253.0);
    let mut channels = Vec::new();
    for (place, &index) in on.iter().enumerate() {
        let from = left_out.saturating_mul(stride).saturating_add(8 + time + place * kind.width());
        let mut values = file.samples(from, stride, count, kind);
        if values.len() < count {
            return Err(format!(
                "Rohde & Schwarz export: expected {count} samples, found {}; the file was cut short: copy it again",
                values.len()
            ));
        }
        if matches!(kind, Sample::Signed(_)) {
            let [scale, offset, position] = ["VerticalScale", "VerticalOffset", "VerticalPosition"]
                .map(|name| of_channel(name, index).unwrap_or(0.0));
            let divisions = number("VerticalDivisionCount").unwrap_or(10.0);
            let step = scale * divisions / levels;
            for value in &mut values {
                *value = *value * step + offset - position * scale;
            }
        }
        let source = property(text, "Source", "Value").unwrap_or_default();
        let of_source = source.split('_').find(|part| part.starts_with("CH") && part.len() == 3);
        let name = if several { format!("CH{}", index + 1) } else { of_source.unwrap_or("CH1").to_owned() };
        channels.push(Channel { name, unit: "V".into(), grid: Some((start, step)), values });
    }
    let is_mean = property(text, "TraceArithmetics", "Value").is_some_and(|value| value.ends_with("_AVERAGE"));
    let averages = number("NumberOfAcquisitions").filter(|_| is_mean);
    Ok(Contents {
        written: "Rohde & Schwarz (.bin, .Wfm.bin)".into(),
        channels,
        comments: averages.filter(|count| *count > 1.0).map(|count| format!("averages: {count}")).into_iter().collect(),
        assumptions: if left_out > 0 {
            vec![format!("{left_out} settling samples before the record are left out")]
        } else {
            Vec::new()
        },
    })
}
