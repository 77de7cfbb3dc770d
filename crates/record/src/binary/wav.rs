//! WAV and its forms for long files, RF64 and BW64: samples as parts of full scale.
//!
//! Microsoft, *Multimedia Programming Interface and Data Specifications 1.0*; EBU Tech 3306 (`RF64`); ITU-R BS.2088 (`BW64`).

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

/// Codes of the format: counts, floats, and another code behind the usual fields.
const COUNTS: u16 = 1;
const FLOATS: u16 = 3;
const EXTENSIBLE: u16 = 0xfffe;
/// Size of a chunk that stands elsewhere (in `ds64`), or that a recorder that was stopped never wrote.
const ELSEWHERE: u32 = u32::MAX;

pub(super) fn is_file(head: &[u8]) -> bool {
    ["RIFF", "RIFX", "RF64", "BW64"].iter().any(|form| head.starts_with(form.as_bytes()))
        && head.get(8..12) == Some(b"WAVE")
}

/// Values are parts of full scale: state what full scale means with `--scale` or `--unit`.
pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let file = Bytes { all: bytes, big_endian: bytes.starts_with(b"RIFX") };
    let wrong = |found: &str| {
        format!(
            "WAV file: expected counts of 8 to 32 bits or floats, found {found}; export it again as PCM or as floats"
        )
    };
    let cut = || wrong("fewer bytes than its header announces: it was cut short");
    // Sizes of 64 bits: of the whole, of the data.
    let (mut at, mut long, mut form, mut data) = (12, None, None, None);
    while let (Some(name), Some(size)) = (file.slice(at, 4), file.u32(at + 4)) {
        let (from, length) = match (name, long) {
            (b"data", Some(long)) if size == ELSEWHERE => (at + 8, long),
            _ => (at + 8, size as usize),
        };
        match name {
            b"ds64" => long = file.u64(from + 8).and_then(|length| usize::try_from(length).ok()),
            b"fmt " => form = Some(from),
            b"data" => {
                data = Some((from, length));
                break;
            }
            _ => {}
        }
        let Some(next) = from.checked_add(length + length % 2) else { break };
        at = next;
    }
    let (form, (from, length)) = form.zip(data).ok_or_else(cut)?;
    let fields = || {
        let code = file.u16(form)?;
        let code = if code == EXTENSIBLE { file.u16(form + 24)? } else { code };
        Some((code, usize::from(file.u16(form + 2)?), file.u32(form + 4)?, usize::from(file.u16(form + 12)?)))
    };
    let (code, width, rate, block) = fields().ok_or_else(cut)?;
    let bytes_of_sample = block.checked_div(width).unwrap_or(0);
    let bits = 8 * bytes_of_sample;
    let kind = match (code, bytes_of_sample) {
        (COUNTS, 1) => Some(Sample::Unsigned(1)),
        (COUNTS, 2 | 4 | 8) => Some(Sample::Signed(bytes_of_sample)),
        (COUNTS, 3) => None,
        (FLOATS, 4 | 8) => Some(Sample::Float(bytes_of_sample)),
        _ => return Err(wrong(&format!("the format {code} with {bits} bits"))),
    };
    // A size that was never written stands for the rest of the file.
    let there = bytes.len().saturating_sub(from);
    let unwritten = length == 0 || length == ELSEWHERE as usize;
    if length > there && !unwritten {
        return Err(cut());
    }
    let count = if unwritten { there } else { length } / block;
    let value = |place: usize| match kind {
        Some(kind) => file.sample(place, kind),
        None => file.slice(place, 3).map(|part| {
            let [low, middle, high] =
                if file.big_endian { [part[2], part[1], part[0]] } else { [part[0], part[1], part[2]] };
            f64::from(i32::from_le_bytes([0, low, middle, high]) >> 8)
        }),
    };
    let (zero, full) = match code {
        FLOATS => (0.0, 1.0),
        _ if bytes_of_sample == 1 => (128.0, 128.0),
        _ => (0.0, (1u64 << (bits - 1)) as f64),
    };
    let channel = |number: usize| {
        let places = (0..count).map(|index| from + index * block + number * bytes_of_sample);
        let values = places.map_while(|place| value(place).map(|value| (value - zero) / full)).collect();
        let name = format!("channel {}", number + 1);
        Channel { name, grid: Some((0.0, 1.0 / f64::from(rate.max(1)))), values, ..Channel::default() }
    };
    Ok(Contents {
        written: format!("WAV, {bits} bits"),
        channels: (0..width).map(channel).collect(),
        assumptions: vec!["values are parts of full scale, as a WAV file states no unit".into()],
        ..Contents::default()
    })
}
