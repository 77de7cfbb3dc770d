//! NI TDMS: segments of metadata and raw samples.
//!
//! A segment begins with `TDSm`, flags, and how far it and its metadata reach. The metadata name the channels with samples in this and the following
//! segments; samples stand channel by channel or interleaved, the whole repeated as often as fits. `wf_increment`, `wf_start_offset` and `unit_string`
//! of a channel state its instants and unit, `NI_Scale[n]_…` of it, its group or its file how raw samples are scaled. Raw samples of DAQmx are refused.

use std::{collections::BTreeMap, path::Path};

use granchain_signal::Dimension;

use super::{
    super::{ReadOptions, column},
    Channel, Contents, SPECTRUM,
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
const TRUTH: u32 = 0x21;
const INSTANT: u32 = 0x44;
/// Most scales of a channel, and most coefficients of one.
const MOST_SCALES: usize = 64;
/// Most segments, and most properties of an object.
const MOST_SEGMENTS: usize = 1_000_000;
const MOST_PROPERTIES: u32 = 100_000;

/// A channel while the file is read.
#[derive(Debug, Default)]
struct Object {
    layout: Option<Layout>,
    numbers: BTreeMap<String, f64>,
    texts: BTreeMap<String, String>,
    values: Vec<f64>,
}

/// Part of a channel in each chunk.
#[derive(Debug, Clone, Copy)]
struct Layout {
    /// `None`: texts, truth values or instants, which are passed over.
    kind: Option<Sample>,
    count: usize,
    size: usize,
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
    let mut spectrum = None;
    for name in &file.order {
        let Some(object) = file.objects.get_mut(name).filter(|object| !object.values.is_empty()) else { continue };
        let mut values = std::mem::take(&mut object.values);
        // Groups and file stay, as they may state the scale of a channel.
        let object = &file.objects[name];
        // `/'Group'/'Channel'`.
        let short = name.trim_end_matches('\'').rsplit("/'").next().unwrap_or(name).replace("''", "'");
        let text = |name: &str| object.texts.get(name).map_or("", |text| text.trim());
        let axis = column::parse_unit(text("wf_xunit_string")).ok();
        if text("wf_xname") == "Frequency" || axis.is_some_and(|unit| unit.dimension == Dimension::FREQUENCY) {
            spectrum = Some(short);
            continue;
        }
        let factor = axis.filter(|unit| unit.dimension == Dimension::TIME).map_or(1.0, |unit| unit.factor);
        let step = object.numbers.get("wf_increment").copied().filter(|step| *step > 0.0);
        let start = object.numbers.get("wf_start_offset").copied().unwrap_or(0.0);
        let unit = [text("unit_string"), text("NI_UnitDescription")].into_iter().find(|unit| !unit.is_empty());
        let unit = unit.unwrap_or_default().to_owned();
        let scale = file.scale(name)?;
        values.iter_mut().for_each(|value| *value = scale.iter().fold(*value, |raw, scale| polynomial(scale, raw)));
        let grid = step.map(|step| (factor * start, factor * step));
        channels.push(Channel { name: short, unit, grid, values });
    }
    if let (true, Some(name)) = (channels.is_empty(), spectrum) {
        return Err(format!("TDMS file: channel `{name}`: {SPECTRUM}"));
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
    /// The polynomials that scale a channel's raw samples, in order.
    fn scale(&self, name: &str) -> Result<Vec<Vec<f64>>, String> {
        let group = name.rsplit_once("/'").map_or("/", |(group, _)| group);
        let owners = [name, group, "/"].into_iter().filter_map(|path| self.objects.get(path));
        let Some((owner, count)) = owners
            .filter_map(|object| Some((object, *object.numbers.get("NI_Number_Of_Scales")? as usize)))
            .find(|(_, count)| (1..=MOST_SCALES).contains(count))
        else {
            return Ok(Vec::new());
        };
        if owner.texts.get("NI_Scaling_Status").is_some_and(|status| status == "scaled") {
            return Ok(Vec::new());
        }
        let number = |name: String| owner.numbers.get(&name).copied();
        let mut scales = Vec::new();
        let mut next = Some(count - 1);
        while let Some(index) = next.filter(|_| scales.len() < count) {
            let kind = owner.texts.get(&format!("NI_Scale[{index}]_Scale_Type")).map_or("", String::as_str);
            let of = |key: &str| number(format!("NI_Scale[{index}]_{kind}_{key}"));
            scales.push(match kind {
                "Linear" => vec![of("Y_Intercept").unwrap_or(0.0), of("Slope").unwrap_or(1.0)],
                "Polynomial" => {
                    let size = of("Coefficients_Size").map_or(0, |size| size as usize).min(MOST_SCALES);
                    (0..size).map(|power| of(&format!("Coefficients[{power}]")).unwrap_or(0.0)).collect()
                }
                _ => {
                    return Err(format!(
                        "TDMS file: channel `{name}`: expected a linear or polynomial scale of the raw samples, found `{kind}`; save the record with \
                         its scaling applied, or as text"
                    ));
                }
            });
            // All ones: the raw samples.
            next = of("Input_Source").map(|source| source as usize).filter(|source| *source < count);
        }
        scales.reverse();
        Ok(scales)
    }

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
                    let kind = file.u32(at)?;
                    let size = match (kind, sample(kind)) {
                        (_, Some(sample)) => count.checked_mul(sample.width()),
                        (TEXT, _) => usize::try_from(file.u64(at + 16)?).ok(),
                        (TRUTH, _) => Some(count),
                        (INSTANT, _) => count.checked_mul(16),
                        _ => None,
                    };
                    object.layout = size.map(|size| Layout { kind: sample(kind), count, size });
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
                    object.texts.insert(name, string(file, &mut at)?);
                } else if let Some(kind) = sample(kind) {
                    object.numbers.insert(name, file.sample(at, kind)?);
                    at += kind.width();
                } else {
                    // An instant has 16 bytes, a truth value one.
                    at += if kind == INSTANT { 16 } else { 1 };
                }
            }
        }
        Some(())
    }

    fn samples(&mut self, file: Bytes<'_>, at: usize, interleaved: bool) -> Option<()> {
        let layouts: Vec<(String, Layout)> =
            self.active.iter().filter_map(|path| Some((path.clone(), self.objects[path].layout?))).collect();
        // Of an unknown type nobody knows where the next channel begins.
        if layouts.len() != self.active.len() {
            return None;
        }
        let chunk = layouts.iter().try_fold(0usize, |sum, (_, layout)| sum.checked_add(layout.size))?;
        if chunk == 0 {
            return Some(());
        }
        let width = |layout: &Layout| layout.size.checked_div(layout.count).unwrap_or(0);
        let stride: usize = layouts.iter().map(|(_, layout)| width(layout)).sum();
        for first in (at..).step_by(chunk).take((file.all.len() - at) / chunk) {
            let mut place = first;
            for (path, layout) in &layouts {
                if let Some(kind) = layout.kind {
                    let step = if interleaved { stride } else { kind.width() };
                    let values = file.samples(place, step, layout.count, kind);
                    self.objects.get_mut(path)?.values.extend(values);
                }
                place += if interleaved { width(layout) } else { layout.size };
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

/// Coefficients from the constant one on.
fn polynomial(coefficients: &[f64], value: f64) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * value + coefficient)
}

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
