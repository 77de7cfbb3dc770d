//! NumPy `.npy` (one array) and `.npz` (a zip archive of named arrays).
//!
//! An array of one dimension is a channel, one of two dimensions a channel a column. A scalar named `fs`, `sample_rate`, `dt` or the like states the
//! instants of all.

use std::{
    io::{Cursor, Read as _},
    path::Path,
};

use super::{
    super::ReadOptions,
    Channel, Contents, MOST_UNPACKED,
    bytes::{Bytes, Sample},
};

const MOST_ARRAYS: usize = 200;
/// Most rows of an array that holds a channel a row; least samples of a channel.
const MOST_ROWS: usize = 16;
const LEAST_SAMPLES: usize = 8;
/// First bytes of the end of a zip archive, and the least bytes that it lists a file with.
const END: &[u8] = b"PK\x05\x06";
const LEAST_ENTRY: usize = 46;

/// A named array of numbers.
#[derive(Default)]
pub(super) struct Array {
    pub name: String,
    /// As the file states it; empty if it does not.
    pub unit: String,
    /// First instant and step, s, if the file states those of this array.
    pub grid: Option<(f64, f64)>,
    pub rows: usize,
    pub columns: usize,
    /// One column after the other.
    pub values: Vec<f64>,
}

pub(super) fn read_array(path: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let name = path.file_stem().map_or_else(|| "array".into(), |stem| stem.to_string_lossy().into_owned());
    contents("NumPy (.npy)", vec![array(&name, bytes)?])
}

/// Whether a zip archive begins with an array.
pub(super) fn is_archive(head: &[u8]) -> bool {
    let name = Bytes::little(head).u16(26).and_then(|length| head.get(30..30 + usize::from(length)));
    name.is_some_and(|name| name.ends_with(b".npy"))
}

pub(super) fn read_archive(_: &Path, bytes: &[u8], _: &ReadOptions) -> Result<Contents, String> {
    let refused =
        |error: &dyn std::fmt::Display| format!("NumPy archive (.npz): expected arrays, found: {error}; save it again");
    // The archive reserves memory for as many files as its end announces.
    let end = bytes.windows(END.len()).rposition(|part| part == END).unwrap_or(bytes.len());
    let announced = [8, 10].map(|at| Bytes::little(bytes).u16(end + at).map_or(0, usize::from));
    if announced.iter().any(|count| count * LEAST_ENTRY > bytes.len()) {
        return Err(refused(&"an end that announces more files than there are bytes for"));
    }
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| refused(&error))?;
    let mut arrays = Vec::new();
    let mut left = (MOST_UNPACKED * bytes.len()) as u64;
    for index in 0..archive.len().min(MOST_ARRAYS) {
        let file = archive.by_index(index).map_err(|error| refused(&error))?;
        let name = file.name().trim_end_matches(".npy").to_owned();
        let mut whole = Vec::new();
        file.take(left).read_to_end(&mut whole).map_err(|error| refused(&error))?;
        left -= whole.len() as u64;
        // Texts and objects are no records.
        if let Ok(array) = array(&name, &whole) {
            arrays.push(array);
        }
    }
    contents("NumPy (.npz)", arrays)
}

/// `\x93NUMPY`, version, length of the header, and a dictionary with `descr`, `fortran_order` and `shape`.
fn array(name: &str, bytes: &[u8]) -> Result<Array, String> {
    let wrong = |found: &str| {
        format!(
            "NumPy file: `{name}`: expected an array of numbers in one or two dimensions, found {found}; save such an array"
        )
    };
    let cut = || wrong("fewer bytes than its header announces");
    let file = Bytes::little(bytes);
    let version = *bytes.get(6).ok_or_else(cut)?;
    let (from, length) = if version == 1 { (10, file.u16(8).map(usize::from)) } else { (12, file.count(8)) };
    let length = length.ok_or_else(cut)?;
    let header = file.text(from, length).ok_or_else(cut)?;
    let of = |key: &str| Some(header.split_once(&format!("'{key}':"))?.1.trim_start());
    let descr = of("descr").and_then(|text| text.strip_prefix('\'')?.split('\'').next()).unwrap_or("a structure");
    let kind = match (descr.get(1..2), descr.get(2..).and_then(|width| width.parse::<usize>().ok())) {
        (Some("f"), Some(width @ (4 | 8))) => Sample::Float(width),
        (Some("i"), Some(width @ (1 | 2 | 4 | 8))) => Sample::Signed(width),
        (Some("u" | "b"), Some(width @ (1 | 2 | 4 | 8))) => Sample::Unsigned(width),
        _ => return Err(wrong(&format!("the type `{descr}`"))),
    };
    let shape = of("shape").and_then(|text| text.strip_prefix('(')?.split(')').next()).unwrap_or_default();
    let sizes: Option<Vec<usize>> =
        shape.split(',').map(str::trim).filter(|size| !size.is_empty()).map(|size| size.parse().ok()).collect();
    let (rows, columns) = match sizes.as_deref() {
        Some([]) => (1, 1),
        Some([rows]) => (*rows, 1),
        Some([rows, columns]) => (*rows, *columns),
        _ => return Err(wrong(&format!("the shape ({shape})"))),
    };
    let data = Bytes { all: bytes.get(from + length..).unwrap_or_default(), big_endian: descr.starts_with('>') };
    let count = rows.checked_mul(columns).filter(|count| *count <= data.all.len() / kind.width()).ok_or_else(cut)?;
    let stored = data.samples(0, kind.width(), count, kind);
    let is_by_column = columns == 1 || of("fortran_order").is_some_and(|order| order.starts_with("True"));
    let values = if is_by_column { stored } else { by_column(&stored, columns) };
    Ok(Array { name: name.to_owned(), rows, columns, values, ..Array::default() })
}

/// Values stored row after row, column after column.
pub(super) fn by_column(values: &[f64], columns: usize) -> Vec<f64> {
    (0..columns).flat_map(|column| values.iter().skip(column).step_by(columns)).copied().collect()
}

/// Names of a scalar that states the sample rate (Hz), and the sample interval (s).
const RATES: [&str; 6] = ["fs", "sample_rate", "samplerate", "samplingrate", "sampling_rate", "fsample"];
const STEPS: [&str; 6] = ["dt", "ts", "tinterval", "delta_t", "sample_interval", "xincr"];
const STARTS: [&str; 4] = ["t0", "tstart", "t_start", "xzero"];

pub(super) fn contents(written: &str, arrays: Vec<Array>) -> Result<Contents, String> {
    let scalar = |names: &[&str]| {
        let named = arrays.iter().find(|it| it.values.len() == 1 && names.contains(&it.name.to_lowercase().as_str()));
        named.map(|it| (it.values[0], it.name.clone())).filter(|(value, _)| value.is_finite())
    };
    let positive = |names| scalar(names).filter(|(value, _)| *value > 0.0);
    let step = positive(&STEPS).or_else(|| positive(&RATES).map(|(rate, name)| (1.0 / rate, name)));
    let start = scalar(&STARTS).map_or(0.0, |(start, _)| start);
    let assumptions = step.as_ref().map(|(step, name)| {
        format!(
            "instants from `{name}`: every {} from {}",
            granchain_signal::number::time(*step),
            granchain_signal::number::time(start)
        )
    });
    let mut contents =
        Contents { written: written.into(), assumptions: assumptions.into_iter().collect(), ..Contents::default() };
    for Array { name, unit, grid, rows, columns, values } in arrays {
        // Arrays of a few rows and many columns hold a channel a row.
        let (rows, columns, values) = if rows <= MOST_ROWS && columns >= LEAST_SAMPLES && columns > rows {
            (columns, rows, by_column(&values, rows))
        } else {
            (rows, columns, values)
        };
        if rows < LEAST_SAMPLES {
            continue;
        }
        let grid = grid.or_else(|| step.as_ref().map(|(step, _)| (start, *step)));
        for (column, values) in values.chunks_exact(rows).enumerate() {
            let name = if columns == 1 { name.clone() } else { format!("{name}:{}", column + 1) };
            contents.channels.push(Channel { name, unit: unit.clone(), grid, values: values.to_vec() });
        }
    }
    if contents.channels.is_empty() {
        return Err(format!(
            "{written}: expected an array of samples, found none; save the record as an array of numbers"
        ));
    }
    Ok(contents)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_archive_that_announces_more_files_than_it_can_list_is_refused_before_it_is_opened() {
        let mut bytes = vec![0; 100];
        bytes[60..64].copy_from_slice(END);
        bytes[70..72].copy_from_slice(&3072u16.to_le_bytes());
        let refused = read_archive(Path::new("a.npz"), &bytes, &ReadOptions::default()).unwrap_err();
        assert!(refused.contains("more files than there are bytes for"), "{refused}");
    }
}
