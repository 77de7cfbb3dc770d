//! Tektronix `.isf`: a preamble of `KEY VALUE;` and one curve as a block `#NLENGTH…`.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

/// Longest preamble, bytes.
const LONGEST: usize = 16_384;

/// Value: (sample − YOFF) · YMULT + YZERO at XZERO + (i − PT_OFF) · XINCR.
pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let head = &bytes[..bytes.len().min(LONGEST)];
    let curve =
        head.windows(5).position(|part| part.eq_ignore_ascii_case(b"CURVE") || part.eq_ignore_ascii_case(b"CURV "));
    let missing =
        |what: &str| format!("Tektronix file (.isf): expected {what}, found none; export the record again, or as CSV");
    let curve = curve.ok_or_else(|| missing("the curve behind its preamble"))?;
    let hash =
        curve + head[curve..].iter().position(|byte| *byte == b'#').ok_or_else(|| missing("a curve in binary form"))?;
    let preamble = String::from_utf8_lossy(&head[..curve]).into_owned();
    // The long form and the short one: `BYT_NR` and `BYT_N`, `YMULT` and `YMU`.
    let of = |names: &[&str]| {
        preamble.split([';', ':']).find_map(|entry| {
            let (key, value) = entry.trim().split_once(char::is_whitespace)?;
            names.iter().any(|name| key.eq_ignore_ascii_case(name)).then(|| value.trim().trim_matches('"').to_owned())
        })
    };
    let number = |names: &[&str]| of(names).and_then(|value| value.parse::<f64>().ok());
    let width = number(&["BYT_NR", "BYT_N"]).map_or(1, |width| width as usize).clamp(1, 8);
    let digits = usize::from(head.get(hash + 1).copied().unwrap_or(b'0').saturating_sub(b'0'));
    let length =
        head.get(hash + 2..hash + 2 + digits).and_then(|text| std::str::from_utf8(text).ok()?.parse::<usize>().ok());
    let length = length.ok_or_else(|| missing("the length of the curve"))?;
    let kind = match of(&["BN_FMT", "BN_F"]).as_deref() {
        Some("RP") => Sample::Unsigned(width),
        Some("FP") => Sample::Float(width),
        _ => Sample::Signed(width),
    };
    if of(&["PT_FMT", "PT_F"]).is_some_and(|form| form.eq_ignore_ascii_case("ENV")) {
        return Err("Tektronix file (.isf): expected a sample an instant, found an envelope; record without envelope or peak detect".into());
    }
    let big_endian = !of(&["BYT_OR", "BYT_O"]).is_some_and(|order| order.eq_ignore_ascii_case("LSB"));
    let file = Bytes { all: bytes, big_endian };
    let mut values = file.samples(hash + 2 + digits, width, length / width, kind);
    if values.len() < length / width {
        return Err(format!(
            "Tektronix file (.isf): expected {} samples, found {}; the file was cut short: copy it again",
            length / width,
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
