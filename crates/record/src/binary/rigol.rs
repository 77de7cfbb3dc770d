//! Rigol `.wfm`: DS1000D and E, DS1000B, DS2000 and DS4000; others are named and refused.
//!
//! One byte a sample. Steps of a division and the step at 0 V were found from files whose maker's CSV stands beside them: 25 and 125 (D, E), 25 and 99
//! (B), 25 and 127 (DS2000). Of a DS4000 there was no such file: 32 and 127 are those of an open input.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

/// Places in a file of the older series, and the step at 0 V.
struct Layout {
    points: usize,
    channels: usize,
    /// Channel 1; the others follow every 24 bytes. Whether it is on stands at `on` from there, whether it is inverted behind that.
    at: usize,
    on: usize,
    rate: usize,
    /// Instant of the middle, ps.
    middle: usize,
    data: usize,
    /// Whether channels that are off leave no gap.
    packed: bool,
    zero: f64,
}

const DS1000E: Layout =
    Layout { points: 28, channels: 2, at: 36, on: 13, rate: 100, middle: 112, data: 276, packed: true, zero: 125.0 };
const DS1000B: Layout =
    Layout { points: 60, channels: 4, at: 68, on: 14, rate: 180, middle: 192, data: 420, packed: false, zero: 99.0 };
/// With alternating triggers channel 2 of a DS1000E has its own number of points, rate and middle.
const ALTERNATING: (usize, u8) = (142, 4);
const SECOND: [usize; 3] = [232, 252, 264];
/// Bytes at the end of a rolling record that are no samples, less two.
const ROLLED: usize = 20;

/// Acquisition of a DS2000 or DS4000.
const AVERAGE: u16 = 1;
const PEAK_DETECT: u16 = 2;

type Reader = fn(&Path, &[u8], &ReadOptions) -> Result<Contents, String>;

/// The reader of a file with these first bytes.
pub(super) fn reader(head: &[u8]) -> Option<Reader> {
    Some(match head {
        [0xa5, 0xa5, 0, 0, ..] if head.len() > 40 => |_, bytes, _| old(bytes, &DS1000E, "DS1000D or E"),
        [0xa5, 0xa5, 0xa4, 1, b'D', b'S', ..] => |_, bytes, _| old(bytes, &DS1000B, "DS1000B"),
        [0xa5, 0xa5, 0x38, 0, ..] => |_, bytes, _| new(bytes),
        [0xa1, 0xa5, 0, 0, ..] => |_, _, _| {
            Err("Rigol waveform (.wfm): expected a series whose volts are known, found a DS1000C or CA, of which no file with its CSV is \
                 published; save the record as CSV on the oscilloscope"
                .into())
        },
        [1, 0xff, 0xff, 0xff, 0xa5 | 0xa6, 0xa5, 0x38, 0, ..] => |_, _, _| {
            Err("Rigol waveform (.wfm): expected volts, found counts of a DS1000Z's converter, whose gain the file does not state (the nominal one \
                 is up to 20 % off); save the record as CSV on the oscilloscope"
                .into())
        },
        [2, 0, 0, 0, ..] if head.get(24..36) == Some(&[11, 0, 17, 0, 47, 0, 47, 0, 48, 0, 0, 0]) => |_, _, _| {
            Err("Rigol waveform (.wfm): expected a series whose form is known, found a DHO800 or DHO1000; save the record as .bin or CSV on the \
                 oscilloscope"
                .into())
        },
        _ => return None,
    })
}

fn cut() -> String {
    "Rigol waveform (.wfm): expected the samples of its channels, found fewer bytes; the file was cut short: copy it again"
        .into()
}

/// First instant and step of `points` samples about `middle` (s).
fn grid(points: usize, rate: f64, middle: f64) -> Option<(f64, f64)> {
    (rate > 0.0).then(|| (middle - points as f64 / 2.0 / rate, 1.0 / rate))
}

fn inverted(name: &str) -> String {
    format!("`{name}` was shown inverted: check its sign")
}

/// Value: (zero − sample − shift) · scale / 25, with the scale of the probe.
fn old(bytes: &[u8], layout: &Layout, series: &str) -> Result<Contents, String> {
    let file = Bytes::little(bytes);
    let mut contents = Contents { written: format!("Rigol {series} (.wfm)"), ..Contents::default() };
    let mut data = layout.data;
    for channel in 0..layout.channels {
        let at = layout.at + 24 * channel;
        let mut read = || {
            let alternating = layout.packed
                && channel == 1
                && file.byte(ALTERNATING.0)? == ALTERNATING.1
                && file.count(SECOND[0])? > 0;
            let [points, rate, middle] = if alternating { SECOND } else { [layout.points, layout.rate, layout.middle] };
            let points = file.count(points)?;
            let from = data;
            let is_on = file.byte(at + layout.on)? != 0;
            if is_on || !layout.packed {
                data = data.checked_add(points)?;
            }
            if !is_on {
                return Some(None);
            }
            let rolled = if layout.packed { file.count(ROLLED)? } else { 0 };
            let valid = if rolled > 0 { points.saturating_sub(rolled.saturating_add(2)) } else { points };
            file.slice(from, points)?;
            let step = 1e-6 * file.i32(at + 16)? * file.f32(at + 8)? / 25.0;
            let zero = layout.zero - f64::from(file.i16(at + 20)?);
            let grid = grid(points, file.f32(rate)?, 1e-12 * file.i64(middle)?)?;
            let mut values = file.samples(from, 1, valid, Sample::Unsigned(1));
            values.iter_mut().for_each(|value| *value = (zero - *value) * step);
            let name = format!("CH{}", channel + 1);
            Some(Some((
                file.byte(at + layout.on + 1)? != 0,
                Channel { name, unit: "V".into(), grid: Some(grid), values },
            )))
        };
        if let Some((turned, channel)) = read().ok_or_else(cut)? {
            contents.assumptions.extend(turned.then(|| inverted(&channel.name)));
            contents.channels.push(channel);
        }
    }
    Ok(contents)
}

/// Value: (sample − 127) · scale / steps − offset.
fn new(bytes: &[u8]) -> Result<Contents, String> {
    let file = Bytes::little(bytes);
    let serial = file.text(4, 20).unwrap_or_default();
    // A DS4000 has four bytes more before the number of its samples, and its middle elsewhere.
    let (series, more, steps, samples, middle) = match serial
        .trim_start_matches("MSO")
        .trim_start_matches("DS")
        .chars()
        .next()
    {
        Some('2') => ("DS2000", 0, 25.0, 252, 112),
        Some('4') => ("DS4000", 4, 32.0, 268, 568),
        _ => {
            return Err(format!(
                "Rigol waveform (.wfm): expected a DS2000 or DS4000, found `{serial}`; save the record as CSV on the oscilloscope"
            ));
        }
    };
    let head = || {
        let points = file.count(samples)?;
        let grid = grid(points, file.f32(96 + more)?, 1e-12 * file.i64(middle)?)?;
        Some((file.byte(64)?, more == 0 && file.byte(65)? & 1 == 1, file.u16(84)?, file.u16(86)?, points, grid))
    };
    let (on, interwoven, acquisition, averages, points, grid) = head().ok_or_else(cut)?;
    if acquisition == PEAK_DETECT {
        return Err("Rigol waveform (.wfm): expected a sample an instant, found the extremes of every interval (peak detect); record without peak detect".into());
    }
    let mut contents = Contents { written: format!("Rigol {series} (.wfm)"), ..Contents::default() };
    if acquisition == AVERAGE && averages > 1 {
        contents.comments.push(format!("averages: {averages}"));
    }
    if more > 0 {
        contents.assumptions.push(
            "32 steps a division, as is published of the series; no file with its maker's CSV was at hand".into(),
        );
    }
    for channel in (0..4).filter(|channel| on >> channel & 1 == 1) {
        let at = 120 + more + 28 * channel;
        let read = || {
            let skipped = if more == 0 { file.count(248)? } else { 0 };
            let place = |number: usize, count: usize| {
                let from = file.count(68 + 4 * number)?.checked_add(skipped)?;
                file.slice(from, count).map(|_| from)
            };
            // One channel alone fills the memory of two, every other sample in each.
            let mut values = if interwoven {
                let halves = [place(0, points.div_ceil(2))?, place(1, points / 2)?];
                (0..points).filter_map(|i| file.sample(halves[i % 2] + i / 2, Sample::Unsigned(1))).collect()
            } else {
                file.samples(place(channel, points)?, 1, points, Sample::Unsigned(1))
            };
            let (step, offset) = (file.f32(at + 8)? / steps, file.f32(at + 12)?);
            values.iter_mut().for_each(|value| *value = (*value - 127.0) * step - offset);
            // Where a channel that is on is marked 8, the unit precedes the inversion.
            let turned = file.byte(at + if file.byte(at)? == 1 { 16 } else { 17 })? == 1;
            let name = format!("CH{}", channel + 1);
            Some((turned, Channel { name, unit: "V".into(), grid: Some(grid), values }))
        };
        let (turned, channel) = read().ok_or_else(cut)?;
        contents.assumptions.extend(turned.then(|| inverted(&channel.name)));
        contents.channels.push(channel);
    }
    Ok(contents)
}
