//! NumPy `.npy` (one array) and `.npz` (a zip archive of named arrays).
//!
//! An array of one dimension is a channel, one of two dimensions a channel a column. A scalar named `fs`, `sample_rate`, `dt` or the like states the
//! instants, a text named `unit` or the like the unit, of all in the same structure and in those within it.

use std::{
    io::{Cursor, Read as _},
    path::Path,
};

use super::{
    super::{
        ReadOptions,
        column::{Column, parse_unit},
        sampling, time_column,
    },
    Channel, Contents, MOST_UNPACKED,
    bytes::{Bytes, Sample},
};
use granchain_signal::number;

const MOST_ARRAYS: usize = 200;
/// Most rows of an array that holds a channel a row; least samples of a channel.
const MOST_ROWS: usize = 16;
const LEAST_SAMPLES: usize = 8;
/// First bytes of the end of a zip archive, and the least bytes that it lists a file with.
const END: &[u8] = b"PK\x05\x06";
const LEAST_ENTRY: usize = 46;

/// A named array of numbers, or a text.
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
    pub text: Option<String>,
}

impl Array {
    /// A text of the codes of its letters.
    pub(super) fn of_letters(name: String, codes: &[f64]) -> Self {
        let text: String = codes.iter().filter_map(|code| char::from_u32(*code as u32)).collect();
        Self { name, text: Some(text.trim().to_owned()), ..Self::default() }
    }

    /// Its structures and its name within them.
    fn parts(&self) -> (&str, &str) {
        self.name.rsplit_once('.').unwrap_or(("", &self.name))
    }
}

pub(super) fn read_array(path: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
    let name = path.file_stem().map_or_else(|| "array".into(), |stem| stem.to_string_lossy().into_owned());
    contents("NumPy (.npy)", vec![array(&name, bytes)?], options)
}

/// Whether a zip archive begins with an array.
pub(super) fn is_archive(head: &[u8]) -> bool {
    let name = Bytes::little(head).u16(26).and_then(|length| head.get(30..30 + usize::from(length)));
    name.is_some_and(|name| name.ends_with(b".npy"))
}

pub(super) fn read_archive(_: &Path, bytes: &[u8], options: &ReadOptions) -> Result<Contents, String> {
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
        // Objects are no records.
        if let Ok(array) = array(&name, &whole) {
            arrays.push(array);
        }
    }
    contents("NumPy (.npz)", arrays, options)
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
    let big_endian = descr.starts_with('>');
    let data = Bytes { all: bytes.get(from + length..).unwrap_or_default(), big_endian };
    // Texts: letters of four bytes or of one.
    let letters = match descr.get(1..2) {
        Some("U") => {
            Some((0..data.all.len() / 4).map_while(|at| char::from_u32(data.u32(4 * at)?)).collect::<String>())
        }
        Some("S") => Some(String::from_utf8_lossy(data.all).into_owned()),
        _ => None,
    };
    if let Some(text) = letters {
        let text = text.trim_end_matches('\0').trim().to_owned();
        return Ok(Array { name: name.to_owned(), text: Some(text), ..Array::default() });
    }
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

/// Names of a scalar that states the sample rate (Hz), the sample interval and the first instant (s), and of a text that states the unit of the
/// values or of the instants; small and without `_`.
const RATES: [&str; 5] = ["fs", "samplerate", "samplingrate", "samplingfrequency", "fsample"];
const STEPS: [&str; 7] = ["dt", "ts", "tinterval", "deltat", "sampleinterval", "samplinginterval", "xincr"];
const STARTS: [&str; 4] = ["t0", "tstart", "starttime", "xzero"];
const UNITS: [&str; 6] = ["unit", "units", "yunit", "yunits", "verticalunit", "verticalunits"];
const TIME_UNITS: [&str; 6] = ["timeunit", "timeunits", "xunit", "xunits", "horizontalunit", "horizontalunits"];

pub(super) fn contents(written: &str, arrays: Vec<Array>, options: &ReadOptions) -> Result<Contents, String> {
    let plain = |name: &str| name.to_lowercase().replace('_', "");
    let said: Vec<(&Array, String)> = arrays
        .iter()
        .filter(|it| it.text.is_some() || it.values.len() == 1)
        .map(|it| (it, plain(it.parts().1)))
        .collect();
    // What stands beside an array, or beside a structure that holds it.
    let beside = |array: &Array, is: &dyn Fn(&Array, &str) -> bool| {
        let mut scope = array.parts().0;
        loop {
            let here = said.iter().filter(|(it, name)| it.parts().0 == scope && is(it, name)).map(|(it, _)| *it);
            let found: Vec<&Array> = here.collect();
            if !found.is_empty() || scope.is_empty() {
                return found;
            }
            scope = scope.rsplit_once('.').map_or("", |(outer, _)| outer);
        }
    };
    let scalars = |array: &Array, names: &[&str]| {
        let is = |it: &Array, name: &str| it.values.iter().any(|value| value.is_finite()) && names.contains(&name);
        beside(array, &is).into_iter().map(|it| (it.values[0], it.name.clone())).collect::<Vec<_>>()
    };
    let unit = |array: &Array| {
        let column = Column::from_header(array.parts().1);
        let names = if time_column::is_named_or_numbered(&column) { &TIME_UNITS[..] } else { &UNITS[..] };
        let own = format!("{}unit", plain(array.parts().1));
        let is = |it: &Array, name: &str| {
            it.text.as_ref().is_some_and(|text| parse_unit(text).is_ok())
                && (names.contains(&name) || name.trim_end_matches('s') == own)
        };
        let text = beside(array, &is).first().and_then(|it| it.text.clone());
        text.filter(|_| array.unit.is_empty() && column.unit.is_none()).unwrap_or_else(|| array.unit.clone())
    };
    let mut stated = Vec::new();
    let mut assumptions: Vec<String> = Vec::new();
    let is_time = |array: &Array| {
        array.values.len() >= LEAST_SAMPLES && time_column::is_named_or_numbered(&Column::from_header(&array.name))
    };
    let timed = arrays.iter().any(is_time) || options.sample_rate.is_some();
    for array in &arrays {
        if array.values.len() < LEAST_SAMPLES {
            stated.push((String::new(), None));
            continue;
        }
        let steps = scalars(array, &STEPS)
            .into_iter()
            .chain(scalars(array, &RATES).into_iter().map(|(rate, name)| (1.0 / rate, name)));
        let steps = steps.filter(|(step, _)| *step > 0.0).map(|(step, name)| (name, step));
        // Instants in the file, or on the command line, count more than both.
        let step = match sampling::agreed(steps) {
            Err(text) if !timed => return Err(format!("{written}: {text}")),
            step => step.unwrap_or_default(),
        };
        let start = scalars(array, &STARTS).first().map_or(0.0, |(start, _)| *start);
        stated.push((unit(array), array.grid.or(step.as_ref().map(|(_, step)| (start, *step)))));
        if let Some((name, step)) = step {
            let text = format!("instants from `{name}`: every {} from {}", number::time(step), number::time(start));
            if !assumptions.contains(&text) {
                assumptions.push(text);
            }
        }
    }
    let mut contents = Contents { written: written.into(), assumptions, ..Contents::default() };
    for (Array { name, rows, columns, values, .. }, (unit, grid)) in arrays.into_iter().zip(stated) {
        // Arrays of a few rows and many columns hold a channel a row.
        let (rows, columns, values) = if rows <= MOST_ROWS && columns >= LEAST_SAMPLES && columns > rows {
            (columns, rows, by_column(&values, rows))
        } else {
            (rows, columns, values)
        };
        if rows < LEAST_SAMPLES {
            continue;
        }
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
