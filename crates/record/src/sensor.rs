//! Record of a force sensor whose gain is not known: volts, newtons or plain numbers, as they stand in the file.
//!
//! No drive, no line and no period is looked for: the record is of impulses.

use std::path::{Path, PathBuf};

use granchain_signal::{Dimension, Series, sha256};

use super::{
    MeasurementError, Place, ReadOptions, RecordKind, binary,
    column::{Column, is_counter},
    encoding,
    notes::Notes,
    read::read_file,
    sampling, table, time_column,
};

/// Trace of a force sensor, in the unit of its file.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorRecord {
    pub path: PathBuf,
    /// SHA-256 of the file, hexadecimal.
    pub sha256: String,
    pub series: Series,
    /// Header of the column that was read.
    pub column: String,
    pub assumptions: Vec<String>,
    pub warnings: Vec<String>,
    /// The options it was read with.
    pub options: ReadOptions,
}

/// Words that name the column of a force sensor.
const NAMES: [&str; 6] = ["sensor", "force", "piezo", "load", "cell", "gauge"];

fn is_named(column: &Column) -> bool {
    let header = column.header.to_lowercase();
    header.split(|letter: char| !letter.is_alphanumeric()).any(|word| NAMES.iter().any(|name| word.starts_with(name)))
}

/// Headers of the columns of a force: those in newtons, or of such a name in volts or without a unit, or else all that are in volts, or all without a
/// unit that are no instants.
fn candidates(columns: &[Column]) -> Vec<&str> {
    let of = |accept: &dyn Fn(&Column) -> bool| -> Vec<&str> {
        columns
            .iter()
            .filter(|column| !is_counter(&column.name) && accept(column))
            .map(|it| it.header.as_str())
            .collect()
    };
    let plain = |column: &Column| matches!(column.dimension(), None | Some(Dimension::VOLTAGE));
    let ways: [&dyn Fn(&Column) -> bool; 4] = [
        &|column| column.dimension() == Some(Dimension::FORCE),
        &|column| is_named(column) && plain(column),
        &|column| column.dimension() == Some(Dimension::VOLTAGE),
        &|column| column.dimension().is_none() && !time_column::is_named_or_numbered(column),
    ];
    ways.iter().map(|accept| of(accept)).find(|found| !found.is_empty()).unwrap_or_default()
}

/// The cell array that all these columns are cells of, one hit a cell.
fn is_of_cells(columns: &[&str]) -> bool {
    let array = |column: &&str| Some(column.strip_suffix('}')?.rsplit_once('{')?.0.to_owned());
    columns.first().and_then(array).is_some_and(|first| columns.iter().all(|it| array(it).as_ref() == Some(&first)))
}

fn columns_of(path: &Path, head: &[u8], options: &ReadOptions) -> Result<Vec<Column>, MeasurementError> {
    if let Some(columns) = binary::columns(path, head, options) {
        return columns;
    }
    let end = head.iter().rposition(|byte| matches!(byte, b'\n' | b'\r')).map_or(head.len(), |end| end + 1);
    table::columns(path, &head[..end], options)
}

/// Read the trace of a force sensor as it stands in the file: its gain, and so its unit, is of no account. Of a cell array every cell is one.
///
/// # Errors
/// [`MeasurementError`] with file, line and column.
pub fn read_sensor(path: &Path, options: &ReadOptions) -> Result<Vec<SensorRecord>, MeasurementError> {
    read_sensor_bytes(path, &read_file(path, encoding::refuse_early)?, options)
}

/// The same of bytes in memory; `path` names them in messages.
///
/// # Errors
/// [`MeasurementError`] with file, line and column.
pub fn read_sensor_bytes(
    path: &Path,
    bytes: &[u8],
    options: &ReadOptions,
) -> Result<Vec<SensorRecord>, MeasurementError> {
    if let Some(column) = &options.column {
        return Ok(vec![read_column(path, bytes, column.clone(), options)?]);
    }
    let columns = columns_of(path, bytes, options)?;
    let found = candidates(&columns);
    if found.len() != 1 && !is_of_cells(&found) {
        return Err(MeasurementError::NoForce {
            place: Place::line(path, 1),
            found: found.iter().map(|header| (*header).into()).collect(),
            columns: columns.iter().map(|column| column.header.clone()).collect(),
        });
    }
    found.iter().map(|column| read_column(path, bytes, (*column).to_owned(), options)).collect()
}

fn read_column(
    path: &Path,
    bytes: &[u8],
    column: String,
    options: &ReadOptions,
) -> Result<SensorRecord, MeasurementError> {
    // The table wants a unit of a kind it knows. One of a factor of 1 leaves the numbers as they are.
    let as_written = ReadOptions { column: Some(column), unit: Some("Pa".into()), scale: None, ..options.clone() };
    let (mut table, _) = table::read(path, bytes, RecordKind::Hydrophone, &as_written)?;
    let column = table.columns[table.chosen.value].header.clone();
    let sampled = sampling::even_series(path, &mut table, options.resample)?;
    let mut notes = Notes::default();
    notes.about_table(&table, &as_written);
    notes.about_sampling(&sampled);
    notes.about_clipping(&sampled.series, Some(0.0));
    notes.assume(format!("`{column}` is the sensor's force times an unknown gain"));
    let (path, sha256) = (path.into(), sha256(bytes));
    Ok(SensorRecord {
        path,
        sha256,
        series: sampled.series,
        column,
        assumptions: notes.assumptions,
        warnings: notes.warnings,
        options: options.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str, options: &ReadOptions) -> Result<SensorRecord, MeasurementError> {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("hit.csv");
        std::fs::write(&path, text).unwrap();
        read_sensor(&path, options).map(|mut records| records.remove(0))
    }

    fn rows(header: &str, row: impl Fn(usize) -> String) -> String {
        std::iter::once(header.to_owned())
            .chain((0..12).map(|i| format!("{},{}", i as f64 * 1e-5, row(i))))
            .collect::<Vec<_>>()
            .join("\n")
            + "\n"
    }

    #[test]
    fn the_trace_of_a_sensor_stands_as_it_is_written_whatever_its_unit() {
        for header in ["time_s,sensor_V", "time_s,force_N", "Time (s),CH1 (mV)", "t / s,piezo"] {
            let record = read(&rows(header, |i| format!("{}", i * i)), &ReadOptions::default()).unwrap();
            assert_eq!((record.series.values[3], record.series.len()), (9.0, 12), "{header}");
            assert!((record.series.step - 1e-5).abs() < 1e-12 && record.warnings.is_empty(), "{:?}", record.warnings);
        }
    }

    #[test]
    fn two_columns_in_volts_are_asked_about_and_a_velocity_is_no_force() {
        let two = rows("time_s,CH1_V,CH2_V", |i| format!("{i},{}", 2 * i));
        let error = read(&two, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("`CH1_V`, `CH2_V`") && error.contains("--channel"), "{error}");
        let options = ReadOptions { column: Some("CH2_V".into()), ..ReadOptions::default() };
        assert_eq!(read(&two, &options).unwrap().series.values[3], 6.0);
        let error = read(&rows("time_s,velocity_m_per_s", |i| format!("{i}")), &ReadOptions::default()).unwrap_err();
        assert!(error.to_string().contains("expected the force of a sensor"), "{error}");
    }

    #[test]
    fn an_only_channel_of_an_instrument_is_the_sensor_and_of_a_cell_array_every_cell_is_a_hit() {
        let file = |name: &str| {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/instruments").join(name);
            read_sensor(&path, &ReadOptions::default()).unwrap()
        };
        // Volts, and an array without a unit beside its clock.
        for name in ["rate.npz", "averaged.trc", "curve.isf", "version-4.mat"] {
            let [record] = &file(name)[..] else { panic!("{name}") };
            assert!((record.series.step / 2e-7 - 1.0).abs() < 1e-3 && record.series.len() == 400, "{name}");
        }
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("hits.mat");
        std::fs::write(&path, cells(3)).unwrap();
        let hits = read_sensor(&path, &ReadOptions::default()).unwrap();
        let columns: Vec<&str> = hits.iter().map(|hit| hit.column.as_str()).collect();
        assert_eq!(columns, ["hits{1}", "hits{2}", "hits{3}"]);
        assert!((hits[2].series.step - 2e-5).abs() < 1e-12 && hits[2].series.values[5] == 75.0);
    }

    /// A MATLAB file of a rate and so many cells of 50 samples, k i² in cell k: elements of a type, a length and data.
    fn cells(count: u32) -> Vec<u8> {
        let part = |kind: u32, data: Vec<u8>| {
            let padding = vec![0; (8 - data.len() % 8) % 8];
            [&kind.to_le_bytes()[..], &(data.len() as u32).to_le_bytes(), &data, &padding].concat()
        };
        let whole = |numbers: &[u32]| numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>();
        let matrix = |class: u32, sizes: [u32; 2], name: &str, data: Vec<u8>| {
            let head = [part(6, whole(&[class, 0])), part(5, whole(&sizes)), part(1, name.into()), data].concat();
            part(14, head)
        };
        let numbers = |name: &str, values: &[f64]| {
            let data = part(9, values.iter().flat_map(|value| value.to_le_bytes()).collect());
            matrix(6, [1, values.len() as u32], name, data)
        };
        let cell = |k: u32| numbers("", &(0..50).map(|i| f64::from(k * i * i)).collect::<Vec<_>>());
        let mut file = format!("{:124}", "MATLAB 5.0 MAT-file").into_bytes();
        file.extend([0, 1, b'I', b'M']);
        file.extend(numbers("fs", &[5e4]));
        file.extend(matrix(1, [1, count], "hits", (1..=count).flat_map(cell).collect()));
        file
    }

    #[test]
    fn a_force_that_rests_at_zero_is_not_clipped_and_one_cut_at_its_peak_is() {
        let warned = |force: fn(usize) -> usize| {
            read(&rows("time_s,force_N", |i| force(i).to_string()), &ReadOptions::default()).unwrap().warnings.len()
        };
        assert_eq!(warned(|i| if i < 6 { 0 } else { i * i }), 0);
        assert_eq!(warned(|i| if i < 6 { i * i } else { 90 }), 1);
    }
}
