//! Records: read from files or made of arrays, and what is measured on them.

use std::path::{Path, PathBuf};

use granchain::{
    cli::{
        inspect,
        spectrum::{Drive, Summary},
    },
    feature::{Window, amplitude_spectrum},
    measurement::{
        ByteOrder, Precision, ReadOptions, Record as Read, RecordKind, RecordedQuantity, Samples, TimeResponse,
        UniversalForm, read_record_bytes,
    },
    signal::Series,
};
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1};
use pyo3::{exceptions::PyValueError, prelude::*};
use serde_json::json;

use crate::{attend::attend, error::raised, keyword::arguments};

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Record>()?;
    module.add_function(wrap_pyfunction!(read, module)?)?;
    module.add_function(wrap_pyfunction!(read_bytes, module)?)?;
    module.add_function(wrap_pyfunction!(table, module)?)?;
    module.add_function(wrap_pyfunction!(universal, module)?)?;
    module.add_function(wrap_pyfunction!(measure, module)?)?;
    module.add_function(wrap_pyfunction!(spectrum, module)?)
}

/// Instants and values of a series.
pub type Arrays<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>);

pub fn arrays<'py>(py: Python<'py>, series: &Series) -> Arrays<'py> {
    let instants: Vec<f64> = (0..series.len()).map(|index| series.time(index)).collect();
    (instants.into_pyarray(py), series.values.clone().into_pyarray(py))
}

#[pyclass(frozen, module = "granchain._granchain")]
pub struct Record(pub Read);

#[pymethods]
impl Record {
    /// Time (s) and values (SI), conditioned.
    fn series<'py>(&self, py: Python<'py>) -> Arrays<'py> {
        arrays(py, &self.0.series)
    }

    /// Time (s) and values (SI) as they stand in the file.
    fn raw<'py>(&self, py: Python<'py>) -> Arrays<'py> {
        arrays(py, &self.0.raw)
    }

    /// All but the samples, as JSON.
    fn about(&self) -> String {
        let Read { series, .. } = &self.0;
        let record = &self.0;
        json!({
            "path": record.path.display().to_string(),
            "sha256": record.sha256,
            "kind": record.kind,
            "quantity": record.kind.quantity(),
            "unit": record.kind.unit(),
            "recorded": record.recorded,
            "recorded_unit": record.recorded.unit(),
            "sampling": {"start": series.start, "step": series.step, "rate": series.sample_rate(), "count": series.len()},
            "noise_rms": record.noise_rms,
            "quantisation_step": record.quantisation_step,
            "clipped": record.clipped,
            "pretrigger": record.pretrigger,
            "baseline": record.baseline,
            "baseline_error": record.baseline_error,
            "bandwidth": record.bandwidth,
            "delay": record.delay,
            "trigger": record.trigger,
            "drive_frequency": record.drive_frequency(),
            "form": record.form,
            "columns": record.columns,
            "time_column": record.time_column,
            "value_column": record.value_column,
            "comments": record.comments,
            "interpolated": record.interpolated,
            "assumed": record.assumptions,
            "warnings": record.warnings,
        })
        .to_string()
    }
}

/// The record of a file, by the flags of `granchain inspect`.
#[pyfunction]
fn read(py: Python<'_>, path: PathBuf, flags: Vec<String>) -> PyResult<Record> {
    let (kind, options) = reading(&path, &flags)?;
    attend(py, None, |_| inspect::read(&path, kind, &options))?.map(Record).map_err(raised)
}

/// The same of the bytes of a file.
#[pyfunction]
fn read_bytes(py: Python<'_>, path: PathBuf, bytes: &[u8], flags: Vec<String>) -> PyResult<Record> {
    let (kind, options) = reading(&path, &flags)?;
    attend(py, None, |_| read_record_bytes(&path, bytes, kind, &options))?.map(Record).map_err(raised)
}

fn reading(path: &Path, flags: &[String]) -> PyResult<(Option<RecordKind>, ReadOptions)> {
    let flags: Vec<String> = flags.iter().cloned().chain(["--".into(), path.display().to_string()]).collect();
    let arguments: inspect::Arguments = arguments(&flags)?;
    let kind = arguments.kind;
    let options = arguments.reading.options_of_any(kind, arguments.drive_frequency).map_err(raised)?;
    Ok((kind, options))
}

/// The text of a table of instants (s) and values of that name and unit: every number reads back to the same bits.
#[pyfunction]
fn table<'py>(
    py: Python<'py>,
    time: PyReadonlyArray1<'py, f64>,
    values: PyReadonlyArray1<'py, f64>,
    name: &str,
    unit: &str,
) -> PyResult<Vec<u8>> {
    let (time, values) = (time.as_array(), values.as_array());
    if time.len() != values.len() {
        let message = format!("expected as many instants as values, found {} and {}", time.len(), values.len());
        return Err(PyValueError::new_err(message));
    }
    py.detach(|| {
        let mut text = format!("time [s],{name} [{unit}]\n");
        let mut digits = ryu::Buffer::new();
        for (instant, value) in time.iter().zip(values) {
            text.push_str(digits.format(*instant));
            text.push(',');
            text.push_str(digits.format(*value));
            text.push('\n');
        }
        Ok(text.into_bytes())
    })
}

/// The bytes of a universal file (58b, double precision) with the conditioned samples, or the raw ones.
#[pyfunction]
fn universal(record: &Record, title: &str, raw: bool) -> Vec<u8> {
    let Record(record) = record;
    let conditioned = match record.kind {
        RecordKind::HornTip => RecordedQuantity::Displacement,
        RecordKind::Vibrometer => RecordedQuantity::Velocity,
        RecordKind::Hydrophone => RecordedQuantity::Pressure,
    };
    let (quantity, series) = if raw { (record.recorded, &record.raw) } else { (conditioned, &record.series) };
    let response = TimeResponse { title, quantity, samples: Samples::Even(series) };
    response.to_bytes(UniversalForm { precision: Precision::Double, binary: Some(ByteOrder::Little) })
}

/// What `granchain spectrum` measures, as JSON; the drive's record with what it is called.
#[pyfunction]
fn measure(
    py: Python<'_>,
    record: &Record,
    drive: Option<(PyRef<'_, Record>, String)>,
    drive_frequency: Option<f64>,
    span: (Option<f64>, Option<f64>),
) -> PyResult<String> {
    let drive = drive.map(|(drive, named)| Drive::of(drive.0.clone(), named));
    let session = quiet();
    let Record(record) = record;
    let own = || (record.kind == RecordKind::HornTip).then(|| Drive::of(record.clone(), "the record".into()));
    let done = attend(py, None, move |_| {
        let drive = drive.or_else(own);
        Summary::of(record, drive.as_ref(), drive_frequency, span, record.noise_rms, &session)
    });
    let summary = done?.map_err(raised)?;
    serde_json::to_string(&summary).map_err(raised)
}

/// Flags of a session that says nothing.
pub fn quiet() -> granchain::cli::arguments::Session {
    granchain::cli::arguments::Session { quiet: true, ..Default::default() }
}

/// Frequencies (Hz) and amplitudes of a trace that begins at `start` with that `step` (s), over a window.
#[pyfunction]
fn spectrum<'py>(
    py: Python<'py>,
    values: PyReadonlyArray1<'py, f64>,
    start: f64,
    step: f64,
    window: (f64, f64),
) -> PyResult<Arrays<'py>> {
    let series = Series::new(start, step, values.as_array().to_vec());
    let spectrum = py.detach(|| amplitude_spectrum(&series, Window::new(window.0, window.1))).map_err(raised)?;
    let frequencies: Vec<f64> = (0..spectrum.amplitudes.len()).map(|index| spectrum.frequency(index)).collect();
    Ok((frequencies.into_pyarray(py), spectrum.amplitudes.into_pyarray(py)))
}
