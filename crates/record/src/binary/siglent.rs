//! Siglent `.bin` of the versions 2 to 4: switches, scales and offsets of the channels, the clock, then channel after channel. Other versions are
//! named, with what to do.
//!
//! Siglent, *How to Extract Data from the Binary File*. Value: ((code − middle) · scale / codes a division − offset) · probe, from the left edge of
//! the screen on. Of the signs of offset and delay the document has both; these give known voltages and trigger instants of an SDS800X HD.

use std::path::Path;

use super::{
    super::ReadOptions,
    Channel, Contents,
    bytes::{Bytes, Sample},
};

/// Switches of four channels (0 or 1, one of them on), and the scale of the first, which is positive.
struct Revision {
    version: Option<u32>,
    switches: usize,
    scale: usize,
    double: bool,
}

const REVISIONS: [Revision; 6] = [
    Revision { version: Some(4), switches: 0x08, scale: 0x18, double: true },
    Revision { version: Some(3), switches: 0x04, scale: 0x14, double: true },
    Revision { version: Some(2), switches: 0x04, scale: 0x14, double: true },
    // From here on nothing else tells them.
    Revision { version: None, switches: 0x00, scale: 0x10, double: true },
    // SDS1000X, SDS1000X-E and SDS2000X.
    Revision { version: None, switches: 0x100, scale: 0xbc, double: false },
    Revision { version: Some(5), switches: 0x76, scale: 0x7a, double: true },
];
const SHORTEST: usize = 0x800;

pub(super) fn is_file(head: &[u8]) -> bool {
    let file = Bytes::little(head);
    let is = |revision: &Revision| {
        let spaced = if revision.version == Some(5) { 1 } else { 4 };
        let switches: Option<Vec<u32>> = (0..spaced).map(|index| file.u32(revision.switches + 4 * index)).collect();
        let switches = switches?;
        let scale = if revision.double { file.f64(revision.scale)? } else { file.f32(revision.scale)? };
        Some(
            revision.version.is_none_or(|version| file.u32(0) == Some(version))
                && switches.iter().all(|switch| *switch <= 1)
                && switches.contains(&1)
                && scale > 1e-6
                && scale < 1e6,
        )
    };
    head.len() > SHORTEST && REVISIONS.iter().any(|revision| is(revision) == Some(true))
}

/// A quantity with its prefix: 8 stands for none, 7 for milli.
fn quantity(file: Bytes<'_>, at: usize) -> Option<f64> {
    let prefix = file.i32(at + 8)? as i32;
    Some(file.f64(at)? * 1e3f64.powi((prefix - 8).clamp(-8, 8)))
}

/// Unit of a quantity: exponents of volt and ampere, as numerator and denominator.
fn unit(file: Bytes<'_>, at: usize) -> Option<&'static str> {
    let powers = [0, 1, 3].map(|index| file.u32(at + 12 + 4 * index));
    Some(match powers {
        [Some(0), Some(1), Some(0)] => "V",
        [Some(0), Some(0), Some(1)] => "A",
        [Some(_), Some(_), Some(_)] => "",
        _ => return None,
    })
}

pub(super) fn read(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let file = Bytes::little(bytes);
    let version = file.u32(0).unwrap_or(0);
    if !(2..=4).contains(&version) {
        return Err("Siglent file (.bin): expected one of the versions 2 to 4, found another; save the record as CSV on the oscilloscope, or \
                    convert it with Siglent's own program (its CSV is read)"
            .into());
    }
    // The fourth version has a field more at its beginning.
    let shift = if version == 4 { 4 } else { 0 };
    let channels = || {
        let data = if version == 4 { file.count(4)? } else { SHORTEST };
        let (points, rate) = (file.count(0x1e8 + shift)?, quantity(file, 0x1ec + shift)?);
        let (wide, big) = (file.byte(0x260 + shift)? == 1, version > 2 && file.byte(0x261 + shift)? == 1);
        let kind = Sample::Unsigned(if wide { 2 } else { 1 });
        let middle = if wide { 32_768.0 } else { 128.0 };
        // The second version has no room for what all oscilloscopes had then.
        let stated =
            |at: usize, usual: f64| file.i32(at + shift).filter(|value| version > 2 && *value != 0.0).unwrap_or(usual);
        let divisions = stated(0x268, 14.0);
        let start = quantity(file, 0x1c0 + shift)? - 0.5 * divisions * quantity(file, 0x198 + shift)?;
        let mut at = data;
        let mut found = Vec::new();
        for index in (0..4).filter(|index| file.u32(4 + shift + 4 * index) == Some(1)) {
            let scale = 0x14 + shift + 40 * index;
            let codes = stated(0x26c + 4 * index, if wide { 25.0 * 256.0 } else { 25.0 });
            let (step, offset) = (quantity(file, scale)? / codes, quantity(file, scale + 160)?);
            let probe = Some(file.f64(0x240 + shift + 8 * index)?).filter(|probe| *probe > 0.0).unwrap_or(1.0);
            let end = at.checked_add(points.checked_mul(kind.width())?)?;
            file.slice(at, end - at)?;
            let mut values = Bytes { all: bytes, big_endian: big }.samples(at, kind.width(), points, kind);
            values.iter_mut().for_each(|value| *value = ((*value - middle) * step - offset) * probe);
            at = end;
            let name = format!("CH{}", index + 1);
            found.push(Channel { name, unit: unit(file, scale)?.into(), grid: Some((start, 1.0 / rate)), values });
        }
        Some(found)
    };
    let cut = "Siglent file (.bin): expected the samples of its channels, found fewer bytes; the file was cut short: copy it again";
    Ok(Contents {
        written: format!("Siglent (.bin, version {version})"),
        channels: channels().ok_or(cut)?,
        assumptions: vec![
            "the file does not state where on the screen its trigger stood: taken in the middle, less its delay".into(),
        ],
        ..Contents::default()
    })
}
