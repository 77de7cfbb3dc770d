//! Keysight and Agilent `.bin`, and Rigol's, which follow them.
//!
//! `AG` or `RG`, a version, the size of the file and the number of waveforms; each waveform has a header that states its own size, and
//! buffers, each with a header that does. From version 03 on sizes have 64 bits.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents, SPECTRUM,
    bytes::{Bytes, Sample},
};

/// Types of a buffer: floats; the least and the greatest of every interval; counts.
const FLOATS: u16 = 1;
const EXTREMES: [u16; 2] = [2, 3];
/// Waveform types: an average; histograms over instants and values.
const AVERAGE: u32 = 3;
const HISTOGRAMS: [u32; 2] = [4, 5];
const HERTZ: usize = 6;
const UNITS: [&str; 8] = ["", "V", "s", "", "A", "dB", "Hz", ""];

pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let file = Bytes::little(bytes);
    let is_rigol = bytes.starts_with(b"R");
    let maker = if is_rigol { "Rigol" } else { "Keysight" };
    let cut = || {
        format!(
            "{maker} file: expected waveforms with their samples, found fewer bytes; the file was cut short: copy it again"
        )
    };
    let wide = bytes.get(2..4).is_some_and(|version| version == b"03");
    let (mut at, count) = if wide { (16, file.count(12)) } else { (12, file.count(8)) };
    let mut contents = Contents { written: format!("{maker} oscilloscope (.bin)"), ..Contents::default() };
    for number in 0..count.ok_or_else(cut)?.min(super::MOST_CHANNELS) {
        let (channel, model, averages, next) = waveform(file, at, number, is_rigol, wide).ok_or_else(cut)??;
        contents.channels.push(channel);
        contents.written = format!("{maker} {model} (.bin)");
        if averages > 1 && contents.comments.is_empty() {
            contents.comments.push(format!("averages: {averages}"));
        }
        at = next;
    }
    Ok(contents)
}

type Waveform = Result<(Channel, String, u32, usize), String>;

fn waveform(file: Bytes<'_>, at: usize, number: usize, is_rigol: bool, wide: bool) -> Option<Waveform> {
    let header = file.count(at)?;
    let (kind, buffers, points) = (file.u32(at + 4)?, file.count(at + 8)?, file.count(at + 12)?);
    // Rigol aligns doubles where the header has 144 bytes.
    let step = file.f64(at + 32)?;
    let (step, origin) = (step, file.f64(at + 40)?);
    let (axis, unit) = (file.count(at + 48)?, file.count(at + 52)?);
    let model = file.text(at + 88, 24)?;
    let label = file.text(at + 112, 16)?;
    let name = if label.is_empty() { format!("channel {}", number + 1) } else { label };
    if HISTOGRAMS.contains(&kind) {
        return Some(Err(format!(
            "channel `{name}`: expected samples in time, found a histogram; save the record itself"
        )));
    }
    if axis == HERTZ {
        return Some(Err(format!("channel `{name}`: {SPECTRUM}")));
    }
    let mut next = at.checked_add(header)?;
    let mut values = Vec::new();
    for _ in 0..buffers.min(8) {
        let (size, kind, width) = (file.count(next)?, file.u16(next + 4)?, usize::from(file.u16(next + 6)?));
        let length = if wide { usize::try_from(file.u64(next + 8)?).ok()? } else { file.count(next + 8)? };
        let data = next.checked_add(size)?;
        file.slice(data, length)?;
        if kind == FLOATS && width == 4 {
            values = file.samples(data, 4, points.min(length / 4), Sample::Float(4));
        } else if EXTREMES.contains(&kind) {
            return Some(Err(format!(
                "channel `{name}`: expected a sample an instant, found the extremes of every interval (peak detect); record without peak detect"
            )));
        }
        next = data.checked_add(length)?;
    }
    // Keysight states the first instant, Rigol how long before the trigger it lies.
    let start = if is_rigol { -origin } else { origin };
    let unit = UNITS.get(unit).copied().unwrap_or_default().to_owned();
    let averages = if kind == AVERAGE { file.u32(at + 16)? } else { 1 };
    let model = model.split(':').next().unwrap_or_default().to_owned();
    Some(Ok((Channel { name, unit, grid: Some((start, step)), values }, model, averages, next)))
}
