//! NI TDMS: segments of metadata and raw samples.
//!
//! A segment begins with `TDSm`, flags, and how far it and its metadata reach. The metadata name the channels with samples in this and the following
//! segments; samples stand channel by channel or interleaved, the whole repeated as often as fits. `wf_increment`, `wf_start_offset` and `unit_string`
//! of a channel state its instants and unit. Scaled raw samples of DAQmx are refused.

use std::{collections::BTreeMap, path::Path};

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

const METADATA: u32 = 1 << 1;
const NEW_LIST: u32 = 1 << 2;
const RAW: u32 = 1 << 3;
const INTERLEAVED: u32 = 1 << 5;
const BIG_ENDIAN: u32 = 1 << 6;
const LEAD_IN: usize = 28;
const NO_SAMPLES: u32 = u32::MAX;
const AS_BEFORE: u32 = 0;
const DAQMX: [u32; 2] = [0x1269, 0x1369];
const TEXT: u32 = 0x20;
/// Most segments, and most properties of an object.
const MOST_SEGMENTS: usize = 1_000_000;
const MOST_PROPERTIES: u32 = 100_000;

/// A channel while the file is read.
#[derive(Debug, Default)]
struct Object {
    /// Type and number of samples of each chunk.
    layout: Option<(Sample, usize)>,
    numbers: BTreeMap<String, f64>,
    unit: String,
    values: Vec<f64>,
}

pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let mut file = Tdms { objects: BTreeMap::new(), order: Vec::new(), active: Vec::new(), raw: false };
    let mut at = 0;
    let mut cut_short = false;
    for _ in 0..MOST_SEGMENTS {
        if at + LEAD_IN > bytes.len() {
            break;
        }
        match file.segment(bytes, at) {
            Some(next) if next > at => at = next,
            // The last segment of a recording that was stopped is not whole.
            _ => {
                cut_short = true;
                break;
            }
        }
    }
    if file.raw {
        return Err("TDMS file: expected samples, found raw samples of DAQmx with scalers; save the record with its scaling applied, or as text".into());
    }
    let mut channels = Vec::new();
    for name in &file.order {
        let Some(object) = file.objects.remove(name) else { continue };
        if object.values.is_empty() {
            continue;
        }
        let step = object.numbers.get("wf_increment").copied().filter(|step| *step > 0.0);
        let start = object.numbers.get("wf_start_offset").copied().unwrap_or(0.0);
        // `/'Group'/'Channel'`.
        let short = name.trim_end_matches('\'').rsplit("/'").next().unwrap_or(name).replace("''", "'");
        channels.push(Channel {
            name: short,
            unit: object.unit,
            grid: step.map(|step| (start, step)),
            values: object.values,
        });
    }
    let assumptions =
        if cut_short { vec!["the last segment is not whole and is left out".to_owned()] } else { Vec::new() };
    Ok(Contents { written: "NI TDMS".into(), channels, comments: Vec::new(), assumptions })
}

struct Tdms {
    objects: BTreeMap<String, Object>,
    /// Paths in the order found.
    order: Vec<String>,
    /// Channels with samples in the present segment.
    active: Vec<String>,
    /// Whether samples need the scalers of DAQmx.
    raw: bool,
}

impl Tdms {
    /// Reads a segment; returns where the next begins.
    fn segment(&mut self, bytes: &[u8], at: usize) -> Option<usize> {
        let little = Bytes::little(bytes);
        if little.slice(at, 4)? != b"TDSm" {
            return None;
        }
        let flags = little.u32(at + 4)?;
        let file = Bytes { all: bytes, big_endian: flags & BIG_ENDIAN != 0 };
        let begins = at + LEAD_IN;
        let reach = |offset: u64| usize::try_from(offset).ok()?.checked_add(begins);
        // All ones: the writer was stopped before it knew.
        let next = match file.u64(at + 12)? {
            u64::MAX => bytes.len(),
            offset => reach(offset)?,
        };
        let samples = reach(file.u64(at + 20)?)?;
        if samples > next || next > bytes.len() {
            return None;
        }
        if flags & METADATA != 0 {
            if flags & NEW_LIST != 0 {
                self.active.clear();
            }
            self.metadata(file, begins)?;
        }
        if flags & RAW != 0 {
            self.samples(Bytes { all: &bytes[..next], ..file }, samples, flags & INTERLEAVED != 0)?;
        }
        Some(next)
    }

    fn metadata(&mut self, file: Bytes<'_>, mut at: usize) -> Option<()> {
        let objects = file.u32(at)?;
        at += 4;
        for _ in 0..objects {
            let path = string(file, &mut at)?;
            if !self.objects.contains_key(&path) {
                self.order.push(path.clone());
            }
            let index = file.u32(at)?;
            at += 4;
            let object = self.objects.entry(path.clone()).or_default();
            match index {
                NO_SAMPLES | AS_BEFORE => {}
                index if DAQMX.contains(&index) => {
                    self.raw = true;
                    return None;
                }
                length => {
                    let count = usize::try_from(file.u64(at + 8)?).ok()?;
                    object.layout = sample(file.u32(at)?).map(|kind| (kind, count));
                    // The length counts itself.
                    at = at.checked_add((length as usize).saturating_sub(4).max(16))?;
                }
            }
            if index != NO_SAMPLES && !self.active.contains(&path) {
                self.active.push(path.clone());
            }
            let properties = file.u32(at)?;
            at += 4;
            for _ in 0..properties.min(MOST_PROPERTIES) {
                let name = string(file, &mut at)?;
                let kind = file.u32(at)?;
                at += 4;
                if kind == TEXT {
                    let text = string(file, &mut at)?;
                    if name == "unit_string" || (name == "NI_UnitDescription" && object.unit.is_empty()) {
                        object.unit = text;
                    }
                } else if let Some(kind) = sample(kind) {
                    object.numbers.insert(name, file.sample(at, kind)?);
                    at += kind.width();
                } else {
                    // An instant has 16 bytes, a truth value one.
                    at += if kind == 0x44 { 16 } else { 1 };
                }
            }
        }
        Some(())
    }

    fn samples(&mut self, file: Bytes<'_>, at: usize, interleaved: bool) -> Option<()> {
        let layouts: Vec<(String, Sample, usize)> = self
            .active
            .iter()
            .filter_map(|path| self.objects[path].layout.map(|(kind, count)| (path.clone(), kind, count)))
            .collect();
        // A channel of texts has a layout of its own.
        if layouts.len() != self.active.len() {
            return None;
        }
        let size = |(_, kind, count): &(String, Sample, usize)| kind.width().checked_mul(*count);
        let chunk = layouts.iter().try_fold(0usize, |sum, layout| sum.checked_add(size(layout)?))?;
        if chunk == 0 {
            return Some(());
        }
        let stride: usize = layouts.iter().map(|(_, kind, _)| kind.width()).sum();
        for first in (at..).step_by(chunk).take((file.all.len() - at) / chunk) {
            let mut place = first;
            for (path, kind, count) in &layouts {
                let width = kind.width();
                let step = if interleaved { stride } else { width };
                let values = file.samples(place, step, *count, *kind);
                self.objects.get_mut(path)?.values.extend(values);
                place += if interleaved { width } else { width * count };
            }
        }
        Some(())
    }
}

fn string(file: Bytes<'_>, at: &mut usize) -> Option<String> {
    let length = file.count(*at)?;
    let text = String::from_utf8_lossy(file.slice(*at + 4, length)?).into_owned();
    *at += 4 + length;
    Some(text)
}

/// Data types of samples.
fn sample(kind: u32) -> Option<Sample> {
    Some(match kind {
        1 => Sample::Signed(1),
        2 => Sample::Signed(2),
        3 => Sample::Signed(4),
        4 => Sample::Signed(8),
        5 => Sample::Unsigned(1),
        6 => Sample::Unsigned(2),
        7 => Sample::Unsigned(4),
        8 => Sample::Unsigned(8),
        9 | 0x19 => Sample::Float(4),
        10 | 0x1a => Sample::Float(8),
        _ => return None,
    })
}
