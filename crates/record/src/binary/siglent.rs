//! Siglent `.bin`: named, with what to do. Its nine revisions differ in the sign and the probe of an offset, and none is published beside its CSV.

use std::path::Path;

use super::{super::ReadOptions, Contents, bytes::Bytes};

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

pub(super) fn refuse(_: &Path, _: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    Err("Siglent file (.bin): expected a form whose volts are known, found one whose offset is documented in two ways; save the record as CSV on the \
         oscilloscope, or convert it with Siglent's own program (its CSV is read)"
        .into())
}
