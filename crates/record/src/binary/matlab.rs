//! MATLAB `.mat` of versions 4 to 7: matrices of real numbers, also within structures and cells.
//!
//! In version 4 each matrix has a header of five integers, its name and its numbers.
//!
//! Behind a header of 128 bytes follow elements of a type, a length and data that fill up to eight bytes; a compressed element is a zlib stream of one
//! element. A matrix holds its flags, sizes, name and real part.

use std::{io::Read as _, path::Path};

use flate2::read::ZlibDecoder;

use super::{
    super::ReadOptions,
    Contents, DEEPEST, MOST_UNPACKED,
    bytes::{Bytes, Sample},
    numpy::{Array, contents},
};

const MATRIX: u32 = 14;
const COMPRESSED: u32 = 15;
/// Classes of a matrix: array of cells; structure; text; first and last class of numbers.
const CELLS: u8 = 1;
const STRUCTURE: u8 = 2;
const TEXT: u8 = 4;
const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
/// Flag of a complex matrix.
const COMPLEX: u8 = 8;
const MOST_MATRICES: usize = 2000;

pub(super) fn read(_: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
    let big_endian = bytes.get(126..128) == Some(b"MI");
    let mut found = Vec::new();
    let mut left = MOST_UNPACKED.saturating_mul(bytes.len());
    elements(Bytes { all: bytes, big_endian }, 128, "", &mut found, &mut left, 0)
        .ok_or("MATLAB file: expected whole variables, found fewer bytes; the file was cut short: copy it again")?;
    contents("MATLAB (.mat)", found, options)
}

/// Header of a matrix of version 4: rows, columns, whether complex, bytes of its name; the type of its numbers, and whether they are a full matrix
/// (0), a text (1) or a sparse one (2).
fn header_4(file: Bytes<'_>, at: usize) -> Option<([usize; 4], Sample, usize)> {
    let form = file.count(at)?;
    let sizes = [4, 8, 12, 16].map(|offset| file.count(at + offset));
    let [Some(rows), Some(columns), Some(complex), Some(name)] = sizes else { return None };
    let kind = match form / 10 % 10 {
        0 => Sample::Float(8),
        1 => Sample::Float(4),
        2 => Sample::Signed(4),
        3 => Sample::Signed(2),
        4 => Sample::Unsigned(2),
        5 => Sample::Unsigned(1),
        _ => return None,
    };
    let is_header = form / 100 == if file.big_endian { 10 } else { 0 } && form % 10 <= 2 && complex <= 1;
    (is_header && (2..=64).contains(&name)).then_some(([rows, columns, complex, name], kind, form % 10))
}

fn order_4(bytes: &[u8]) -> Option<Bytes<'_>> {
    let orders = [false, true].map(|big_endian| Bytes { all: bytes, big_endian });
    orders.into_iter().find(|file| {
        let name = header_4(*file, 0).and_then(|([_, _, _, length], ..)| file.slice(20, length));
        name.and_then(<[u8]>::split_last).is_some_and(|(end, name)| {
            *end == 0
                && name[0].is_ascii_alphabetic()
                && name.iter().all(|byte| byte.is_ascii_alphanumeric() || *byte == b'_')
        })
    })
}

/// Whether the file begins with a matrix of version 4.
pub(super) fn is_4(head: &[u8]) -> bool {
    order_4(head).is_some()
}

pub(super) fn read_4(_: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
    let cut = "MATLAB file: expected whole variables, found fewer bytes; the file was cut short: copy it again";
    let file = order_4(bytes).ok_or(cut)?;
    let (mut found, mut at) = (Vec::new(), 0);
    while at < bytes.len() && found.len() < MOST_MATRICES {
        let matrix = || {
            let ([rows, columns, complex, length], kind, class) = header_4(file, at)?;
            let data = at + 20 + length;
            let count = rows.checked_mul(columns)?;
            let size = count.checked_mul(kind.width() * (1 + complex))?;
            file.slice(data, size)?;
            let values = file.samples(data, kind.width(), if class < 2 && complex == 0 { count } else { 0 }, kind);
            let name = file.text(at + 20, length)?;
            let array = match class {
                1 => Array::of_letters(name, &values),
                _ => Array { name, rows, columns, values, ..Array::default() },
            };
            Some((array, data + size))
        };
        let (array, next) = matrix().ok_or(cut)?;
        if array.text.is_some() || !array.values.is_empty() {
            found.push(array);
        }
        at = next;
    }
    contents("MATLAB 4 (.mat)", found, options)
}

/// Type, length and place of the data of an element, and where the next begins.
fn element(file: Bytes<'_>, at: usize) -> Option<(u32, usize, usize, usize)> {
    let first = file.u32(at)?;
    if first >> 16 != 0 {
        // A small element: length and type share four bytes, the data are the other four.
        let length = (first >> 16) as usize;
        return (length <= 4).then_some((first & 0xffff, length, at + 4, at + 8));
    }
    let length = file.count(at + 4)?;
    let end = (at + 8).checked_add(length)?;
    let padded = if first == COMPRESSED { end } else { end.checked_add((8 - length % 8) % 8)? };
    Some((first, length, at + 8, padded))
}

/// All elements from `at` on; `None` if one is cut short.
fn elements(
    file: Bytes<'_>,
    mut at: usize,
    prefix: &str,
    found: &mut Vec<Array>,
    left: &mut usize,
    depth: usize,
) -> Option<()> {
    while at + 8 <= file.all.len() && found.len() < MOST_MATRICES {
        let (kind, length, data, next) = element(file, at)?;
        let body = file.slice(data, length)?;
        match kind {
            COMPRESSED => {
                let mut whole = Vec::new();
                ZlibDecoder::new(body).take(*left as u64).read_to_end(&mut whole).ok()?;
                *left -= whole.len();
                let inner = Bytes { all: &whole, ..file };
                elements(inner, 0, prefix, found, left, depth)?;
            }
            MATRIX => matrix(Bytes { all: body, ..file }, prefix, found, depth)?,
            _ => {}
        }
        at = next;
    }
    Some(())
}

/// A matrix, and those in the fields of a structure or in cells, which are numbered from 1.
fn matrix(file: Bytes<'_>, prefix: &str, found: &mut Vec<Array>, depth: usize) -> Option<()> {
    if file.all.is_empty() {
        return Some(());
    }
    let (_, _, flags, at) = element(file, 0)?;
    let flags = file.u32(flags)?;
    let (class, flags) = (flags as u8, (flags >> 8) as u8);
    let (_, length, sizes, at) = element(file, at)?;
    let sizes: Vec<usize> = (0..length / 4).map(|index| file.count(sizes + 4 * index)).collect::<Option<_>>()?;
    let (_, length, name, mut at) = element(file, at)?;
    let name = file.text(name, length)?;
    let name =
        if prefix.is_empty() || name.is_empty() { format!("{prefix}{name}") } else { format!("{prefix}.{name}") };
    if class == STRUCTURE && depth < DEEPEST {
        let (_, _, width, next) = element(file, at)?;
        let width = file.count(width)?;
        let (_, length, names, next) = element(file, next)?;
        at = next;
        let count = length.checked_div(width)?;
        let all = sizes.iter().try_fold(count, |all, size| all.checked_mul(*size))?;
        for field in (0..count).cycle().take(all) {
            let (kind, length, data, next) = element(file, at)?;
            let inner = Bytes { all: file.slice(data, length)?, ..file };
            if kind == MATRIX && found.len() < MOST_MATRICES {
                let field = format!("{name}.{}", file.text(names + field * width, width)?);
                matrix(inner, &field, found, depth + 1)?;
            }
            at = next;
        }
        return Some(());
    }
    if class == CELLS && depth < DEEPEST {
        let all = sizes.iter().try_fold(1, |all: usize, size| all.checked_mul(*size))?;
        for cell in 1..=all {
            let (kind, length, data, next) = element(file, at)?;
            let inner = Bytes { all: file.slice(data, length)?, ..file };
            if kind == MATRIX && found.len() < MOST_MATRICES {
                matrix(inner, &format!("{name}{{{cell}}}"), found, depth + 1)?;
            }
            at = next;
        }
        return Some(());
    }
    // Logical and complex matrices and sparse matrices are no records.
    if !(NUMBERS.contains(&class) || class == TEXT) || flags & COMPLEX != 0 || sizes.len() != 2 {
        return Some(());
    }
    let (kind, length, data, _) = element(file, at)?;
    let kind = match kind {
        // UTF-8, of which units have one byte a letter or two (`µ`).
        16 if class == TEXT => {
            let text = Some(String::from_utf8_lossy(file.slice(data, length)?).trim().to_owned());
            found.push(Array { name, text, ..Array::default() });
            return Some(());
        }
        17 if class == TEXT => Sample::Unsigned(2),
        1 => Sample::Signed(1),
        2 => Sample::Unsigned(1),
        3 => Sample::Signed(2),
        4 => Sample::Unsigned(2),
        5 => Sample::Signed(4),
        6 => Sample::Unsigned(4),
        7 => Sample::Float(4),
        9 => Sample::Float(8),
        12 => Sample::Signed(8),
        13 => Sample::Unsigned(8),
        _ => return Some(()),
    };
    let count = sizes[0].checked_mul(sizes[1])?;
    if length / kind.width() < count {
        return None;
    }
    file.slice(data, length)?;
    let values = file.samples(data, kind.width(), count, kind);
    found.push(if class == TEXT {
        Array::of_letters(name, &values)
    } else {
        Array { name, rows: sizes[0], columns: sizes[1], values, ..Array::default() }
    });
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_whose_sizes_pass_the_end_of_the_file_is_refused_at_once() {
        let part =
            |kind: u32, length: u32, data: &[u8]| [&kind.to_le_bytes()[..], &length.to_le_bytes(), data].concat();
        let bytes = [part(6, 8, &[6, 0, 0, 0, 0, 0, 0, 0]), part(5, 0xffff_fff8, &[1, 0, 0, 0])].concat();
        let before = std::time::Instant::now();
        assert_eq!(matrix(Bytes::little(&bytes), "", &mut Vec::new(), 0), None);
        assert!(before.elapsed().as_secs_f64() < 0.05, "{:?}", before.elapsed());
    }

    /// Else elements could hold each other, and a file of 4 kB would take seconds.
    #[test]
    fn a_small_element_holds_four_bytes_and_no_more() {
        let of = |length: u8| element(Bytes::little(&[14, 0, length, 0, 1, 2, 3, 4, 5, 6, 7, 8]), 0);
        assert_eq!(of(4), Some((MATRIX, 4, 4, 8)));
        assert_eq!(of(5), None);
    }
}
