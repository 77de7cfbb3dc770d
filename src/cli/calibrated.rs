//! Taking up an earlier calibration: `--calibration DIR`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use anyhow::{Context, bail};
use serde::Deserialize;

use super::output;
use crate::{
    calibration::{drive, outcome::InputDigest, parameter},
    measurement::{
        ReadOptions,
        read_back::{SMALL, read_back_text},
        sha256, shell_word,
    },
    report::regime::Fit,
    scene::ModelKind,
};

/// The horn-tip record that drove a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedDrive {
    /// The file, and its digest at the time of the fit.
    pub input: drive::Input,
    /// How it was read, its drive frequency with it.
    pub options: ReadOptions,
}

/// What a calibration says about a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibrated {
    /// The folder or file that was named.
    pub named: PathBuf,
    /// Where it was read, and the digest of that.
    pub input: drive::Input,
    /// The scene it was made for, as on its command line.
    pub scene: Option<String>,
    /// The overrides of its own command line or plan, `KEY=VALUE`.
    pub own_overrides: Vec<String>,
    /// Its parameters as overrides, `KEY=VALUE` in SI.
    pub overrides: Vec<String>,
    /// The horn-tip record that drove it.
    pub drive: Option<CalibratedDrive>,
    pub model: ModelKind,
    /// Half of the 90 % intervals of α and the damping coefficient, of ln.
    half_widths: [Option<f64>; 2],
    /// α, the damping coefficient, and the outlines of their 90 % region.
    pub region: Option<Fit>,
    /// How it ended: `within scatter`, `outside scatter`, `not converged`.
    pub verdict: String,
}

#[derive(Deserialize)]
struct Outcome {
    parameters: BTreeMap<String, Parameter>,
    damping_kind: String,
    #[serde(default)]
    mount: Option<String>,
    verdict: String,
    #[serde(default)]
    model: String,
    #[serde(default)]
    scene: Option<String>,
    #[serde(default)]
    overrides: Vec<String>,
    #[serde(default)]
    inputs: BTreeMap<String, InputDigest>,
    /// Of ln α and ln of the damping coefficient.
    #[serde(default)]
    correlation: Option<f64>,
    #[serde(default)]
    lobes: Vec<Lobe>,
}

/// A part of the 90 % region.
#[derive(Deserialize)]
struct Lobe {
    extent: BTreeMap<String, (f64, f64)>,
}

impl Lobe {
    /// The ellipse of that correlation that fills the extent of ln α and ln of the damping coefficient.
    fn outline(&self, correlation: f64) -> Option<Vec<(f64, f64)>> {
        let ((left, right), (below, above)) = (self.extent.get("alpha")?, self.extent.get("damping")?);
        let on = |low: &f64, high: &f64, turn: f64| low * (high / low).powf(0.5 + 0.5 * turn.cos());
        let turns = (0..=72).map(|step| f64::from(5 * step).to_radians());
        Some(turns.map(|turn| (on(left, right, turn), on(below, above, turn - correlation.acos()))).collect())
    }
}

#[derive(Deserialize)]
struct Parameter {
    value: f64,
    #[serde(default)]
    low: Option<f64>,
    #[serde(default)]
    high: Option<f64>,
    #[serde(default)]
    unit: String,
}

impl Parameter {
    fn half_width(&self) -> Option<f64> {
        self.low.zip(self.high).map(|(low, high)| 0.5 * (high / low).ln()).filter(|half| half.is_finite())
    }
}

impl Calibrated {
    /// Half of the 90 % intervals of α and the damping coefficient, of ln; none of a calibration that states neither.
    pub fn half_widths(&self) -> Option<[Option<f64>; 2]> {
        self.half_widths.iter().any(Option::is_some).then_some(self.half_widths)
    }

    /// Read `calibration.json` in `folder` (or the file itself).
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let path = if folder.is_dir() { folder.join("calibration.json") } else { folder.to_path_buf() };
        let text = read_back_text(&path, SMALL).with_context(|| {
            if folder.exists() {
                return format!("{}: expected the outcome of a calibration", path.display());
            }
            let shown = folder.display().to_string();
            format!("{shown}: no such folder; make one with `granchain calibrate --out {}`", shell_word(&shown))
        })?;
        if output::is_altered(&path)? {
            bail!(
                "{}: expected what `granchain calibrate` wrote, found a file that was changed since (`{}` beside it holds another digest); \
                 calibrate again, or copy it to another folder to use it as it is",
                path.display(),
                output::LIST
            );
        }
        let outcome: Outcome = serde_json::from_str(&text)
            .with_context(|| format!("{}: expected what `granchain calibrate` writes", path.display()))?;
        let mut overrides = vec![format!("damping.kind={}", outcome.damping_kind)];
        overrides.extend(outcome.mount.as_ref().map(|mount| format!("disc.rim={mount}")));
        for (name, parameter) in &outcome.parameters {
            let beside = || parameter::Parameter::term_named(name).map(|term| term.description().key);
            let of_law = || (name == "damping").then_some("damping.coefficient");
            let row =
                parameter::PARAMETERS.iter().find(|row| row.key == name).map(|row| (row.scene_key)(&parameter.unit));
            let Some(key) = row.or_else(of_law).or_else(beside) else {
                bail!("{}: parameter `{name}` has no scene key; calibrate again with this version", path.display());
            };
            if !parameter.value.is_finite() {
                bail!("{}: parameter `{name}`: expected a finite value, found {}", path.display(), parameter.value);
            }
            overrides.push(format!("{key}={}", parameter.value));
        }
        let half_widths = ["alpha", "damping"].map(|name| outcome.parameters.get(name).and_then(Parameter::half_width));
        let value = |name: &str| outcome.parameters.get(name).map(|parameter| parameter.value);
        let regions = outcome.lobes.iter().filter_map(|lobe| lobe.outline(outcome.correlation?)).collect();
        let region = value("alpha").zip(value("damping")).map(|value| Fit { value, regions });
        let Outcome { scene, model, verdict, overrides: own_overrides, mut inputs, .. } = outcome;
        // A calibration that names no model was made on the chain.
        let models = [ModelKind::Reduced, ModelKind::Fea];
        let model = models.into_iter().find(|kind| kind.name() == model).unwrap_or(ModelKind::Chain);
        let drive = inputs.remove("drive").map(|drive| {
            let options = drive.options().with_context(|| format!("{}: the reading of the drive", path.display()))?;
            let input = drive::Input { path: drive.path.into(), sha256: drive.sha256 };
            anyhow::Ok(CalibratedDrive { input, options })
        });
        let drive = drive.transpose()?;
        let input = drive::Input { sha256: sha256(text.as_bytes()), path };
        Ok(Self {
            named: folder.into(),
            input,
            model,
            scene,
            own_overrides,
            overrides,
            drive,
            half_widths,
            region,
            verdict,
        })
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn read(text: &str) -> anyhow::Result<Calibrated> {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("calibration.json"), text).unwrap();
        Calibrated::read(place.path())
    }

    #[test]
    fn parameters_become_overrides_behind_the_damping_law() {
        let calibrated = read(
            r#"{"parameters": {"alpha": {"value": 0.5, "low": 0.4, "high": 0.6, "unit": "1", "at_bound": false},
                "damping": {"value": 0.31, "unit": "N s/m"}}, "damping_kind": "linear", "verdict": "within scatter",
                "scene": "annulus"}"#,
        )
        .unwrap();
        assert_eq!(calibrated.overrides, ["damping.kind=linear", "alpha=0.5", "damping.coefficient=0.31"]);
        assert_eq!(calibrated.scene.as_deref(), Some("annulus"));
    }

    #[test]
    fn a_calibration_changed_since_it_was_written_is_refused_where_its_list_stands_beside_it() {
        let place = tempfile::tempdir().unwrap();
        let folder = place.path().join("fit");
        let text = r#"{"parameters": {"alpha": {"value": 0.5}}, "damping_kind": "linear", "verdict": ""}"#;
        let staged = output::OutputFolder::stage(&folder, &[], false).unwrap();
        staged.write("calibration.json", text).unwrap();
        staged.finish().unwrap();
        assert_eq!(Calibrated::read(&folder).unwrap().overrides[1], "alpha=0.5");
        let (file, other) = (folder.join("calibration.json"), text.replace("0.5", "0.4"));
        fs::write(&file, &other).unwrap();
        for place in [&folder, &file] {
            let error = Calibrated::read(place).unwrap_err().to_string();
            assert!(error.contains("calibration.json") && error.contains("changed since"), "{error}");
        }
        assert_eq!(read(&other).unwrap().overrides[1], "alpha=0.4");
    }

    #[test]
    fn what_is_no_calibration_is_refused_with_its_path() {
        for text in ["", "{}", r#"{"parameters": {"colour": {"value": 1}}, "damping_kind": "linear", "verdict": ""}"#] {
            let error = read(text).unwrap_err();
            assert!(format!("{error:#}").contains("calibration.json"), "{error:#}");
        }
        assert!(Calibrated::read(Path::new("/nowhere")).is_err());
    }
}
