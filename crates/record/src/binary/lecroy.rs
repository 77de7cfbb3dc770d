//! LeCroy and Teledyne `.trc`, as the template `LECROY_2_3` lays it out.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
    part,
};

/// Places in a descriptor, bytes from its beginning.
struct Template {
    /// Lengths of the blocks before the samples, the descriptor first, the instants of segments at `triggers`.
    blocks: &'static [usize],
    triggers: Option<usize>,
    length: usize,
    name: usize,
    label: usize,
    count: usize,
    segments: usize,
    sweeps: Option<usize>,
    gain: usize,
    step: usize,
    start: usize,
    unit: usize,
    axis: usize,
    whole: usize,
}

const LECROY_2: Template = Template {
    blocks: &[36, 40, 44, 48, 52, 56],
    triggers: Some(3),
    length: 60,
    name: 76,
    label: 96,
    count: 116,
    segments: 144,
    sweeps: Some(148),
    gain: 156,
    step: 176,
    start: 180,
    unit: 196,
    axis: 244,
    whole: 346,
};

/// Of the 7200 and its contemporaries.
const LECROY_1: Template = Template {
    blocks: &[36, 40, 44],
    triggers: None,
    length: 48,
    name: 56,
    label: 76,
    count: 92,
    segments: 112,
    sweeps: None,
    gain: 120,
    step: 134,
    start: 138,
    unit: 154,
    axis: 202,
    whole: 320,
};

/// Place of the type of a record, and types that hold no sample an instant.
const RECORD_TYPE: usize = 316;
const NO_RECORDS: [(u16, &str); 4] = [
    (2, "a histogram"),
    (5, "complex numbers"),
    (6, "extrema of many sweeps"),
    (9, "extremes of every interval (peak detect)"),
];

/// Instant of sample i: offset + i · interval; value: gain · sample − offset. The instants of segments stand in an array of their own.
pub(super) fn read(_: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
    let cut = || {
        "LeCroy file: expected a descriptor and samples, found fewer bytes; the file was cut short: copy it again"
            .to_owned()
    };
    let from = bytes.windows(8).position(|part| part == b"WAVEDESC").ok_or_else(cut)?;
    let whole = bytes.get(from..).unwrap_or_default();
    let template = if whole.get(16..).is_some_and(|name| name.starts_with(b"LECROY_1")) { LECROY_1 } else { LECROY_2 };
    if whole.len() < template.whole {
        return Err(cut());
    }
    // 0: most significant byte first; read the same in either order.
    let file = Bytes { all: whole, big_endian: whole[34] == 0 && whole[35] == 0 };
    let read = || {
        let width = if file.u16(32)? == 0 { 1 } else { 2 };
        let (mut places, mut at) = (Vec::new(), 0usize);
        for block in template.blocks {
            places.push(at);
            at = at.checked_add(file.count(*block)?)?;
        }
        Some((
            width,
            places,
            at,
            file.count(template.length)?,
            file.count(template.count)?,
            file.count(template.segments)?.max(1),
        ))
    };
    let (width, places, at, length, count, segments) = read().ok_or_else(cut)?;
    let number = part(options, segments, "segment")?;
    let [gain, offset, step] =
        [template.gain, template.gain + 4, template.step].map(|place| file.f32(place).unwrap_or(f64::NAN));
    let mut start = file.f64(template.start).unwrap_or(f64::NAN);
    if let Some(triggers) = template.triggers.filter(|_| segments > 1) {
        start = file.f64(places[triggers] + 16 * number + 8).ok_or_else(cut)?;
    }
    let size = count / segments;
    if length < count.saturating_mul(width) {
        return Err(cut());
    }
    let mut values = file.samples(at + number * size * width, width, size, Sample::Signed(width));
    if values.len() < size {
        return Err(cut());
    }
    for value in &mut values {
        *value = gain * *value - offset;
    }
    let text = |at, length| file.text(at, length).unwrap_or_default();
    let source = file.u16(344).map_or(0, |source| source.saturating_add(1));
    let label = Some(text(template.label, 16)).filter(|label| !label.is_empty());
    let name = label.unwrap_or_else(|| format!("C{source}"));
    // Only an average has more than one sweep.
    let sweeps = template.sweeps.and_then(|place| file.u32(place)).unwrap_or(1);
    let comments = if sweeps > 1 { vec![format!("averages: {sweeps}")] } else { Vec::new() };
    // Of the first template nothing is known of them.
    let kind = if template.segments == LECROY_2.segments { file.u16(RECORD_TYPE).unwrap_or(0) } else { 0 };
    if let Some((_, what)) = NO_RECORDS.iter().find(|(code, _)| *code == kind) {
        return Err(format!("LeCroy file: expected a sample an instant, found {what}; export the trace itself"));
    }
    let axis = text(template.axis, 48);
    if axis != "S" && !axis.is_empty() {
        return Err(format!(
            "LeCroy file: expected samples in time, found an axis in `{axis}`; export the trace in time"
        ));
    }
    Ok(Contents {
        written: format!("{} waveform (.trc)", text(template.name, 16)),
        channels: vec![Channel { name, unit: text(template.unit, 48), grid: Some((start, step)), values }],
        comments,
        assumptions: if segments > 1 { vec![format!("segment {} of {segments}", number + 1)] } else { Vec::new() },
    })
}
