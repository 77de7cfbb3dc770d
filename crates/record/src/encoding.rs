//! Bytes → text: UTF-8 with or without byte-order mark, UTF-16 of either byte order, Windows-1252.

use std::{borrow::Cow, path::Path};

use encoding_rs::{UTF_16BE, UTF_16LE, WINDOWS_1252};

use super::{MeasurementError, Place, binary::is_binary, universal::is_universal};

/// Character encoding of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Utf8,
    Utf8Marked,
    Utf16Le,
    Utf16Be,
    Windows1252,
}

impl Encoding {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Utf8 => "UTF-8",
            Self::Utf8Marked => "UTF-8 with byte-order mark",
            Self::Utf16Le => "UTF-16 little-endian",
            Self::Utf16Be => "UTF-16 big-endian",
            Self::Windows1252 => "Windows-1252",
        }
    }
}

/// A file's text without byte-order mark.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Decoded<'a> {
    pub text: Cow<'a, str>,
    pub encoding: Encoding,
    /// Line and byte of the first character that is not UTF-8, if Windows-1252 was assumed.
    pub foreign: Option<(u64, u8)>,
    /// Bytes left out at the end: NUL, Ctrl-Z.
    pub padding: usize,
}

/// Most bytes of padding among the first ones of a file.
const MOST_PADDING: usize = 4096;

const MAGIC: [(&[u8], &str); 18] = [
    (b"PK\x03\x04", "a zip archive or a spreadsheet (.xlsx)"),
    (b"\xd0\xcf\x11\xe0", "an old spreadsheet (.xls)"),
    (b"\x1f\x8b", "gzip-compressed data"),
    (b"LLWFM", "a Tektronix file of the TDS 400 to 700 (.wfm)"),
    (b"SPBS", "an OWON file (.bin)"),
    (b"SPBV", "an OWON file (.bin)"),
    (b"SPBW", "an OWON file (.bin)"),
    (b"SPBX", "an OWON file (.bin)"),
    (b"MDF     ", "an ASAM file (.mf4, .mdf)"),
    (b"PAR1\x15", "a Parquet file"),
    (b"ARROW1\x00", "an Arrow or Feather file"),
    (b"SQLite format 3\x00", "an SQLite database (.tradb of Vallen, .db)"),
    (b"fLaC", "a FLAC file"),
    (b"FORM\x00", "an AIFF file"),
    (b"caff\x00", "a Core Audio file (.caf)"),
    (b"riff\x2e\x91", "a Wave64 file (.w64)"),
    (b"CDF\x01", "a netCDF file of version 3"),
    (b"CDF\x02", "a netCDF file of version 3"),
];

/// Refuses a file whose first bytes show that it is not text, before the rest is read. UTF-16 is detected later.
pub(super) fn refuse_early(path: &Path, head: &[u8]) -> Result<(), MeasurementError> {
    if is_universal(head) || is_binary(path, head) {
        return Ok(());
    }
    refuse_magic(path, head)?;
    let bare = unpadded(head);
    let text = if head.len() - bare.len() <= MOST_PADDING { bare } else { head };
    if sixteen_bits(head).is_some() { Ok(()) } else { refuse_control(path, text) }
}

fn binary(path: &Path, found: &str) -> MeasurementError {
    MeasurementError::Binary { path: path.into(), found: found.into() }
}

fn refuse_magic(path: &Path, bytes: &[u8]) -> Result<(), MeasurementError> {
    match MAGIC.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        Some((_, what)) => Err(binary(path, what)),
        None => Ok(()),
    }
}

fn refuse_empty(path: &Path, bytes: &[u8]) -> Result<(), MeasurementError> {
    if bytes.trim_ascii().is_empty() { Err(MeasurementError::Empty { path: path.into() }) } else { Ok(()) }
}

/// Decodes bytes to text, or names what they seem to be. UTF-8 is not copied.
///
/// Bytes that are not UTF-8 are read as Windows-1252 (µ is 0xb5), unless one of them is undefined there. A wrong
/// character in a name or a comment does no harm; in a unit or a number it is refused later.
pub(super) fn decode<'a>(path: &Path, bytes: &'a [u8]) -> Result<Decoded<'a>, MeasurementError> {
    refuse_magic(path, bytes)?;
    let plain = |text, encoding| Decoded { text, encoding, foreign: None, padding: 0 };
    if let Some((encoding, name)) = sixteen_bits(bytes) {
        let (text, broken) = encoding.decode_with_bom_removal(bytes);
        if broken {
            return Err(binary(path, "UTF-16 text with characters cut in half"));
        }
        refuse_empty(path, text.as_bytes())?;
        refuse_control(path, text.as_bytes())?;
        return Ok(plain(text, name));
    }
    let marked = bytes.strip_prefix(b"\xef\xbb\xbf");
    let (bytes, encoding) = marked.map_or((bytes, Encoding::Utf8), |rest| (rest, Encoding::Utf8Marked));
    refuse_empty(path, bytes)?;
    let whole = bytes.len();
    let bytes = unpadded(bytes);
    let padding = whole - bytes.len();
    refuse_control(path, bytes)?;
    let error = match std::str::from_utf8(bytes) {
        Ok(text) => return Ok(Decoded { padding, ..plain(Cow::Borrowed(text), encoding) }),
        Err(error) => error,
    };
    let at = error.valid_up_to();
    let line = line_of(bytes, at);
    let undefined = bytes.iter().position(|byte| matches!(byte, 0x81 | 0x8d | 0x8f | 0x90 | 0x9d));
    if let Some(at) = undefined.or(marked.is_some().then_some(at)) {
        return Err(MeasurementError::NotUtf8 { place: Place::line(path, line_of(bytes, at)), byte: bytes[at] });
    }
    let (text, _) = WINDOWS_1252.decode_without_bom_handling(bytes);
    Ok(Decoded { text, encoding: Encoding::Windows1252, foreign: Some((line, bytes[at])), padding })
}

/// Text without the NULs of a padded copy and the end mark of DOS.
fn unpadded(bytes: &[u8]) -> &[u8] {
    let is_padding = |byte: &u8| matches!(byte, 0 | 0x1a);
    let bare = bytes.trim_ascii_end();
    if !bare.last().is_some_and(is_padding) {
        return bytes;
    }
    &bare[..bare.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1)]
}

fn line_of(bytes: &[u8], at: usize) -> u64 {
    1 + bytes[..at].iter().filter(|&&byte| byte == b'\n').count() as u64
}

/// UTF-16, recognised by its byte-order mark, or by zeros in every other byte.
fn sixteen_bits(bytes: &[u8]) -> Option<(&'static encoding_rs::Encoding, Encoding)> {
    const LOOKED_AT: usize = 64;
    if bytes.starts_with(b"\xff\xfe") {
        return Some((UTF_16LE, Encoding::Utf16Le));
    }
    if bytes.starts_with(b"\xfe\xff") {
        return Some((UTF_16BE, Encoding::Utf16Be));
    }
    let pairs = bytes[..bytes.len().min(LOOKED_AT)].chunks_exact(2);
    if pairs.len() < 4 {
        return None;
    }
    if pairs.clone().all(|pair| pair[0] != 0 && pair[1] == 0) {
        return Some((UTF_16LE, Encoding::Utf16Le));
    }
    pairs.clone().all(|pair| pair[0] == 0 && pair[1] != 0).then_some((UTF_16BE, Encoding::Utf16Be))
}

fn refuse_control(path: &Path, bytes: &[u8]) -> Result<(), MeasurementError> {
    let odd = |byte: u8| (byte < 0x20 && !matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c)) || byte == 0x7f;
    match bytes.iter().position(|&byte| odd(byte)) {
        Some(at) => Err(binary(path, &format!("byte 0x{:02x} at offset {at}", bytes[at]))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(bytes: &[u8]) -> Result<(String, Encoding), String> {
        let path = Path::new("a.csv");
        decode(path, bytes).map(|it| (it.text.into_owned(), it.encoding)).map_err(|error| error.to_string())
    }

    #[test]
    fn the_same_text_comes_out_of_every_encoding() {
        let text = "Zeit [µs];v [mm/s]\n0,5;1\n";
        let wide = |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<u8>>();
        let marked = |mark: &[u8], rest: Vec<u8>| [mark, &rest].concat();
        let single: Vec<u8> = text.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
        for (bytes, encoding) in [
            (text.as_bytes().to_vec(), Encoding::Utf8),
            (marked(b"\xef\xbb\xbf", text.as_bytes().to_vec()), Encoding::Utf8Marked),
            (marked(b"\xff\xfe", wide(u16::to_le_bytes)), Encoding::Utf16Le),
            (marked(b"\xfe\xff", wide(u16::to_be_bytes)), Encoding::Utf16Be),
            (single, Encoding::Windows1252),
        ] {
            assert_eq!(decoded(&bytes), Ok((text.to_owned(), encoding)));
        }
        // Without a mark the zeros tell, as long as there are only plain letters.
        let plain = "time_s,velocity_m_per_s\n0,1\n";
        let wide: Vec<u8> = plain.encode_utf16().flat_map(u16::to_le_bytes).collect();
        assert_eq!(decoded(&wide), Ok((plain.to_owned(), Encoding::Utf16Le)));
    }

    #[test]
    fn what_is_no_text_is_refused() {
        for (bytes, expected) in [
            (&b"\xff\xfea\x00b"[..], "a.csv: expected text, found UTF-16 text with characters cut in half"),
            (b"t,v\n\x811\n", "a.csv:2: expected UTF-8 text, found byte 0x81"),
            (b"\xef\xbb\xbft,v\n\xb51\n", "a.csv:2: expected UTF-8 text, found byte 0xb5"),
        ] {
            let message = decoded(bytes).unwrap_err();
            assert!(message.starts_with(expected), "{message}");
        }
    }
}
