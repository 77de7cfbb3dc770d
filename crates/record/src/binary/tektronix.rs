//! Tektronix `.isf`: a preamble of `KEY VALUE;` and one curve, in text or as a block `#NLENGTH…`; and `.wfm` of the versions `WFM#001` to `WFM#003`.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents, SPECTRUM,
    bytes::{Bytes, Sample},
};

/// Data of a `.wfm` that are samples in time.
const VECTOR: u32 = 2;
/// Longest preamble, bytes.
const LONGEST: usize = 16_384;

pub(super) fn is_isf(head: &[u8]) -> bool {
    let begins = head.strip_prefix(b":").unwrap_or(head);
    [&b"WFMP"[..], b"WFMO", b"CURV", b"BYT_N"].iter().any(|key| begins.starts_with(key))
}

/// Value: (sample − YOFF) · YMULT + YZERO at XZERO + (i − PT_OFF) · XINCR.
pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let head = &bytes[..bytes.len().min(LONGEST)];
    let curve =
        head.windows(5).position(|part| part.eq_ignore_ascii_case(b"CURVE") || part.eq_ignore_ascii_case(b"CURV "));
    let missing =
        |what: &str| format!("Tektronix file (.isf): expected {what}, found none; export the record again, or as CSV");
    let curve = curve.ok_or_else(|| missing("the curve behind its preamble"))?;
    let preamble = String::from_utf8_lossy(&head[..curve]).into_owned();
    // The long form and the short one: `BYT_NR` and `BYT_N`, `YMULT` and `YMU`.
    let of = |names: &[&str]| {
        preamble.split([';', ':']).find_map(|entry| {
            let (key, value) = entry.trim().split_once(char::is_whitespace)?;
            names.iter().any(|name| key.eq_ignore_ascii_case(name)).then(|| value.trim().trim_matches('"').to_owned())
        })
    };
    let number = |names: &[&str]| of(names).and_then(|value| value.parse::<f64>().ok());
    if of(&["PT_FMT", "PT_F"]).is_some_and(|form| form.eq_ignore_ascii_case("ENV")) {
        return Err("Tektronix file (.isf): expected a sample an instant, found an envelope; record without envelope or peak detect".into());
    }
    if of(&["XUNIT", "XUN"]).is_some_and(|unit| unit.eq_ignore_ascii_case("Hz")) {
        return Err(format!("Tektronix file (.isf): {SPECTRUM}"));
    }
    let rest = &bytes[curve + 5..];
    let (expected, mut values) = if rest.trim_ascii_start().starts_with(b"#") {
        let width = number(&["BYT_NR", "BYT_N"]).map_or(1, |width| width as usize).clamp(1, 8);
        let hash = rest.iter().position(|byte| *byte == b'#').unwrap_or(0);
        let digits = usize::from(rest.get(hash + 1).copied().unwrap_or(b'0').saturating_sub(b'0'));
        let length =
            rest.get(hash + 2..hash + 2 + digits).and_then(|text| std::str::from_utf8(text).ok()?.parse().ok());
        let length: usize = length.ok_or_else(|| missing("the length of the curve"))?;
        let kind = match of(&["BN_FMT", "BN_F"]).as_deref() {
            Some("RP") => Sample::Unsigned(width),
            Some("FP") => Sample::Float(width),
            _ => Sample::Signed(width),
        };
        let big_endian = !of(&["BYT_OR", "BYT_O"]).is_some_and(|order| order.eq_ignore_ascii_case("LSB"));
        let file = Bytes { all: rest, big_endian };
        (length / width, file.samples(hash + 2 + digits, width, length / width, kind))
    } else {
        // `ENCDG ASC`: the curve in text.
        let text = String::from_utf8_lossy(rest);
        let numbers = text.split([';', '\n']).next().unwrap_or_default().split(',');
        let values: Vec<f64> = numbers.map_while(|number| number.trim().parse().ok()).collect();
        (number(&["NR_PT", "NR_P"]).map_or(values.len(), |points| points as usize), values)
    };
    if values.is_empty() {
        return Err(missing("a curve in numbers or in binary form"));
    }
    if values.len() < expected {
        return Err(format!(
            "Tektronix file (.isf): expected {expected} samples, found {}; the file was cut short: copy it again",
            values.len()
        ));
    }
    let (gain, offset, zero) =
        (number(&["YMULT", "YMU"]), number(&["YOFF", "YOF"]).unwrap_or(0.0), number(&["YZERO", "YZE"]).unwrap_or(0.0));
    let gain = gain.ok_or_else(|| missing("YMULT"))?;
    let step = number(&["XINCR", "XIN"]).ok_or_else(|| missing("XINCR"))?;
    let first = number(&["XZERO", "XZE"]).unwrap_or(0.0) - step * number(&["PT_OFF", "PT_O"]).unwrap_or(0.0);
    for value in &mut values {
        *value = (*value - offset) * gain + zero;
    }
    let about = of(&["WFID", "WFI"]).unwrap_or_default();
    let name = about.split(',').next().filter(|name| !name.is_empty()).unwrap_or("curve").to_owned();
    let averages = about.to_lowercase().contains("average mode");
    Ok(Contents {
        written: "Tektronix (.isf)".into(),
        channels: vec![Channel {
            name,
            unit: of(&["YUNIT", "YUN"]).unwrap_or_default(),
            grid: Some((first, step)),
            values,
        }],
        comments: if about.is_empty() { Vec::new() } else { vec![about] },
        assumptions: if averages {
            vec!["the preamble says that the record is an average, not of how many shots".into()]
        } else {
            Vec::new()
        },
    })
}

/// Format of the samples of a `.wfm`, and its version from 0 on, by its first bytes.
fn version(head: &[u8]) -> Option<(bool, usize)> {
    let big_endian = match head.get(..2)? {
        [0x0f, 0x0f] => false,
        [0xf0, 0xf0] => true,
        _ => return None,
    };
    let version = head.get(2..10)?.strip_prefix(b":WFM#00")?;
    Some((big_endian, usize::from(version[0].checked_sub(b'1')?)))
}

pub(super) fn is_wfm(head: &[u8]) -> bool {
    version(head).is_some()
}

/// Value: sample · scale + offset at offset + i · scale of the time; samples before and after the record serve its interpolation and are left out.
pub(super) fn read_wfm(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let wrong = |expected: &str, found: &str, remedy: &str| {
        format!("Tektronix file (.wfm): expected {expected}, found {found}; {remedy}")
    };
    let (big_endian, version) = version(bytes).unwrap_or_default();
    // Places of the voltage, the time and the curve: the second version has two bytes more before them, the third eight for four in each of four parts.
    let Some(&[volts, time, curve]) = [[166, 478, 790], [168, 480, 792], [168, 488, 808]].get(version) else {
        return Err(wrong(
            "the version WFM#001 to WFM#003",
            &format!("WFM#00{}", version + 1),
            "save the record as CSV",
        ));
    };
    let file = Bytes { all: bytes, big_endian };
    let cut = || wrong("a header and samples", "fewer bytes", "the file was cut short: copy it again");
    let head = || {
        let kind = match file.u32(volts + 72)? {
            0 => Sample::Signed(2),
            1 => Sample::Signed(4),
            2 => Sample::Unsigned(4),
            3 => Sample::Unsigned(8),
            4 => Sample::Float(4),
            5 => Sample::Float(8),
            6 => Sample::Unsigned(1),
            7 => Sample::Signed(1),
            _ => return Some(None),
        };
        let buffer = file.count(16)?;
        let [from, until] =
            [curve + 14, curve + 18].map(|at| file.count(at).and_then(|offset| buffer.checked_add(offset)));
        Some(Some((kind, file.count(72)?, file.u32(122)?, from?, until?)))
    };
    let (kind, frames, data, from, until) = head()
        .ok_or_else(cut)?
        .ok_or_else(|| wrong("samples of 8 to 64 bits", "another format", "save the record as CSV"))?;
    if frames > 0 {
        let found = format!("{} frames", frames + 1);
        return Err(wrong("one record", &found, "save the frames one by one (FastFrame off, or as CSV)"));
    }
    if data != VECTOR {
        return Err(wrong(
            "samples in time",
            &format!("data of kind {data}"),
            "save the channel, not a digital or spectral one",
        ));
    }
    let body = until.checked_sub(from).and_then(|length| file.slice(from, length)).ok_or_else(cut)?;
    let mut values = file.samples(from, kind.width(), body.len() / kind.width(), kind);
    let [gain, offset, step, start] = [volts, volts + 8, time, time + 8].map(|at| file.f64(at).unwrap_or(f64::NAN));
    values.iter_mut().for_each(|value| *value = *value * gain + offset);
    let text = |at, length| file.text(at, length).unwrap_or_default();
    let label = Some(text(40, 32)).filter(|label| !label.is_empty()).unwrap_or_else(|| "waveform".into());
    // A spectrum view names its I and Q behind the curve, where they stand by turns.
    if bytes[until..].windows(4).any(|part| part == b"\0IQ_") {
        return Err(wrong(
            "real samples",
            "complex ones of a spectrum view (I and Q by turns)",
            "save the channel itself, not its spectrum view",
        ));
    }
    let axis = text(time + 20, 20);
    if !axis.to_lowercase().starts_with('s') && !axis.is_empty() {
        return Err(wrong("samples in time", &format!("an axis in `{axis}`"), "save the record in time"));
    }
    Ok(Contents {
        written: format!("Tektronix (.wfm, version {})", version + 1),
        channels: vec![Channel { name: label, unit: text(volts + 20, 20), grid: Some((start, step)), values }],
        ..Contents::default()
    })
}
