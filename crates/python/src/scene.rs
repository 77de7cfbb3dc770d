//! Scenes, their keys, and runs of them.

use std::{path::Path, path::PathBuf};

use granchain::{
    calibration::{bench::Bench, drive::RecordedDrive},
    cli::{experiment, replay::pressures},
    model::{self, Estimate, reduced::Cache},
    response::{Response, columns},
    scene::{BUILT_IN, KEYS, Limits, ModelKind, Scene as Built, SceneText, SettingValue, ValueKind, effects},
    signal::Dimension,
    study::observation,
};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use serde_json::{Value, json};

use crate::{
    attend::attend,
    error::raised,
    record::{Arrays, Record, arrays, quiet},
};

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Scene>()?;
    module.add_class::<Run>()?;
    module.add_function(wrap_pyfunction!(built_in, module)?)?;
    module.add_function(wrap_pyfunction!(keys, module)?)?;
    module.add_function(wrap_pyfunction!(replay, module)?)
}

/// The built-in scenes: name and the text of its file.
#[pyfunction]
fn built_in() -> Vec<(&'static str, &'static str)> {
    BUILT_IN.iter().map(|scene| (scene.name, scene.toml)).collect()
}

/// Every key of a scene file, as JSON.
#[pyfunction]
fn keys() -> String {
    let key = |key: &granchain::scene::Key| {
        let unit = match key.kind {
            ValueKind::Quantity(Dimension::MASS) => "kg".to_owned(),
            ValueKind::Quantity(dimension) => dimension.si_unit(),
            ValueKind::Gaps => "m".to_owned(),
            _ => String::new(),
        };
        let conditions: Vec<_> = key.conditions();
        json!({
            "name": key.name,
            "takes": key.takes(),
            "unit": unit,
            "default": key.default_text(),
            "meaning": key.meaning,
            "conditions": conditions,
            "alternative": key.alternative(),
        })
    };
    Value::Array(KEYS.iter().map(key).collect()).to_string()
}

/// A scene as written, with what was changed in it and what drives it.
#[pyclass(frozen, module = "granchain._granchain")]
pub struct Scene(pub Bench);

impl Scene {
    fn built(&self) -> PyResult<Built> {
        self.0.scene_with(&[]).map_err(raised)
    }
}

#[pymethods]
impl Scene {
    /// A built-in scene or a scene file, or the `text` of one, changed by `KEY=VALUE`; `chain` is the model where the scene names none.
    #[new]
    #[pyo3(signature = (source, text, overrides, drive, chain, limits))]
    fn new(
        source: &str,
        text: Option<String>,
        overrides: Vec<String>,
        drive: Option<PyRef<'_, Record>>,
        chain: bool,
        limits: bool,
    ) -> PyResult<Self> {
        let text = match text {
            Some(text) => SceneText::of_file(Path::new(source), text),
            None => SceneText::read(source).map_err(raised)?,
        };
        let preferred = if chain { ModelKind::Chain } else { ModelKind::Reduced };
        let mut assumptions = text.load(&overrides, preferred).map_err(raised)?.notes;
        let drive = drive.map(|record| RecordedDrive::of(record.0.clone())).transpose().map_err(raised)?;
        assumptions.extend(drive.iter().flat_map(|drive| drive.assumptions.iter().cloned()));
        let limits = if limits { Limits::default() } else { Limits::NONE };
        let source = source.to_owned();
        let bench = Bench { source, text, overrides, preferred, drive, frequency_stated: false, assumptions, limits };
        if bench.drive.is_some() {
            experiment::refuse_drive_keys(&bench, bench.overrides.iter().map(String::as_str)).map_err(raised)?;
        }
        Ok(Self(bench))
    }

    /// Every key that has an effect, with its value in SI, as JSON.
    fn settings(&self) -> PyResult<String> {
        let scene = self.built()?;
        let setting = |setting: granchain::scene::Setting| {
            json!({
                "key": setting.key,
                "value": value(&setting.value),
                "unit": setting.value.unit(),
                "text": setting.value.display(),
                "meaning": setting.meaning,
            })
        };
        Ok(Value::Array(scene.settings().into_iter().map(setting).collect()).to_string())
    }

    /// All but the settings, as JSON.
    fn about(&self) -> PyResult<String> {
        let (Self(bench), scene) = (self, self.built()?);
        Ok(json!({
            "name": scene.name,
            "description": scene.description,
            "model": scene.model.kind.name(),
            "duration": scene.duration,
            "drive_frequency": scene.drive.frequency,
            "effects": effects(&scene),
            "assumed": bench.assumptions,
            "warnings": bench.warnings(),
        })
        .to_string())
    }

    fn to_toml(&self) -> PyResult<String> {
        Ok(self.built()?.to_toml())
    }
}

fn value(value: &SettingValue) -> Value {
    match value {
        SettingValue::Quantity(quantity) => json!(quantity.value),
        SettingValue::Lengths(lengths) => json!(lengths),
        SettingValue::Count(count) => json!(count),
        SettingValue::Text(text) => json!(text),
        SettingValue::Flag(flag) => json!(flag),
        SettingValue::FieldPoints(points) => {
            points.iter().map(|point| json!({"r": point.radius, "z": point.distance})).collect()
        }
        SettingValue::Beads(_) => json!(value.to_toml()),
    }
}

/// A run of a scene.
#[pyclass(frozen, module = "granchain._granchain")]
pub struct Run {
    scene: Built,
    response: Response,
    warnings: Vec<String>,
    origin: Option<f64>,
}

#[pymethods]
impl Run {
    /// Instants, s.
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        let clock = &self.response.piston_displacement;
        (0..clock.len()).map(|index| clock.time(index)).collect::<Vec<_>>().into_pyarray(py)
    }

    /// Every column of `response.csv` behind the time, by its name.
    fn columns<'py>(&self, py: Python<'py>) -> Vec<(String, Bound<'py, PyArray1<f64>>)> {
        let columns = columns(&self.response).into_iter();
        columns.map(|(name, series)| (name, series.values.clone().into_pyarray(py))).collect()
    }

    /// Displacement of each bead, m.
    fn displacements<'py>(&self, py: Python<'py>) -> Vec<Bound<'py, PyArray1<f64>>> {
        self.response.bead_displacement.iter().map(|series| series.values.clone().into_pyarray(py)).collect()
    }

    /// Time (s) and velocity (m/s) as the vibrometer passes it.
    fn seen<'py>(&self, py: Python<'py>) -> Arrays<'py> {
        arrays(py, &observation::seen(&self.scene, self.response.observed_velocity()))
    }

    /// What was measured of the observed velocity and of the pressures, as JSON.
    fn features(&self, py: Python<'_>) -> PyResult<String> {
        let measured = py.detach(|| {
            let settings = observation::settings(&self.scene)?;
            let features = observation::measure_response(&self.scene, &self.response, &settings)?;
            let pressure = pressures(&self.scene, &self.response, features.window)?;
            Ok::<_, granchain::feature::FeatureError>(json!({"velocity": features, "pressure": pressure}))
        });
        measured.map(|measured| measured.to_string()).map_err(raised)
    }

    /// All but samples and features, as JSON.
    fn about(&self) -> String {
        let Response { observed, energy, work, .. } = &self.response;
        json!({
            "model": self.scene.model.kind.name(),
            "observed": observed,
            "energy": energy,
            "work": work,
            "warnings": self.warnings,
            "drive_origin": self.origin,
        })
        .to_string()
    }
}

/// Where reduced bodies are kept: as the program does, or in that folder, or nowhere (`none`).
pub fn cache(folder: Option<PathBuf>) -> Option<Cache> {
    granchain::cli::arguments::Session { cache: folder, ..quiet() }.cache()
}

/// Run a scene; `progress` receives the nanoseconds simulated and their total.
#[pyfunction]
fn replay(py: Python<'_>, scene: &Scene, cache_folder: Option<PathBuf>, progress: Option<Py<PyAny>>) -> PyResult<Run> {
    let (origin, scene) = (scene.0.drive.as_ref().map(|drive| drive.motion.origin), scene.built()?);
    let nanoseconds = |time: f64| (time * 1e9) as u64;
    let done = attend(py, progress.as_ref(), |attendance| {
        Estimate::of(&scene).check(&scene.model.limits)?;
        let prepared = model::prepare_with(&scene, cache(cache_folder).as_ref())?;
        let all = nanoseconds(scene.duration);
        let response = prepared.run(&scene, &mut |time| attendance.go_on(nanoseconds(time), all))?;
        let warnings = prepared.warning().map(str::to_owned).into_iter().chain(prepared.warnings(&scene, &response));
        Ok::<_, model::ModelError>((warnings.collect(), response))
    });
    let (warnings, response) = done?.map_err(raised)?;
    Ok(Run { scene, response, warnings, origin })
}
