//! Calibrations: the calls of `granchain calibrate`, with what it writes kept in memory.

use std::{path::PathBuf, sync::Arc};

use granchain::{
    calibration::{Fitted, Schedule, fingerprints, fit::Fit, refusal::Refusal},
    cli::{
        arguments::usage,
        calibrate::{
            Arguments, InMemory, Job, RESULTS,
            files::{Files, Stop},
            prepare,
        },
        output::OutputFolder,
        timing::{self, Timing},
    },
};
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::{exceptions::PyIndexError, prelude::*};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::{attend::attend, error::raised, keyword::arguments};

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<Calibration>()?;
    module.add_function(wrap_pyfunction!(calibrate, module)?)
}

#[pyclass(frozen, module = "granchain._granchain")]
struct Calibration {
    job: Job,
    fitted: Fitted,
    files: Vec<(PathBuf, Vec<u8>)>,
    timing: Vec<u8>,
}

type Points<'py> = Bound<'py, PyArray2<f64>>;

/// Parameters, misfits, and why runs failed.
type Runs<'py> = (Points<'py>, Bound<'py, PyArray1<f64>>, Vec<Option<String>>);

/// Rows of one length as an array.
fn rows<'py>(py: Python<'py>, rows: &[Vec<f64>]) -> PyResult<Points<'py>> {
    Ok(PyArray2::from_vec2(py, rows)?)
}

impl Calibration {
    /// The fit of a law by its place among `laws` of `calibration.json`, or, below it, that of the chain.
    fn fit(&self, law: usize, below: bool) -> PyResult<&Fit> {
        let ranked = self.fitted.ranked();
        let fit = ranked.get(law).map(|candidate| &candidate.fit);
        let fit = if below { fit.and_then(|fit| fit.below.as_ref()).map(|below| &below.fit) } else { fit };
        fit.ok_or_else(|| PyIndexError::new_err("there is no such fit"))
    }
}

/// Unit coordinates as values, SI.
fn values(fit: &Fit, position: &[f64]) -> Vec<f64> {
    fit.parameters.iter().zip(position).map(|(parameter, u)| parameter.value(*u)).collect()
}

#[pymethods]
impl Calibration {
    /// The bytes of a file of the report.
    fn file(&self, name: &str) -> Option<&[u8]> {
        let found = self.files.iter().find(|(path, _)| path.as_os_str() == name);
        found.map(|(_, bytes)| bytes.as_slice())
    }

    /// Names of the files of the report.
    fn files(&self) -> Vec<PathBuf> {
        self.files.iter().map(|(path, _)| path.clone()).collect()
    }

    /// Every run, as a table.
    fn fingerprints(&self) -> Option<&[u8]> {
        self.file(fingerprints::FILE)
    }

    /// Names of the parameters, in the order of the columns below.
    fn parameters(&self, law: usize) -> PyResult<Vec<String>> {
        Ok(self.fit(law, false)?.parameters.iter().map(|parameter| parameter.name.clone()).collect())
    }

    /// Whether there is a fit of the chain below the answer.
    fn has_below(&self, law: usize) -> PyResult<bool> {
        Ok(self.fit(law, false)?.below.is_some())
    }

    /// Centres of the posterior's cells, SI, and the probability of each.
    fn posterior<'py>(
        &self,
        py: Python<'py>,
        law: usize,
        below: bool,
    ) -> PyResult<(Points<'py>, Bound<'py, PyArray1<f64>>)> {
        let fit = self.fit(law, below)?;
        let posterior = &fit.posterior;
        let centres = py.detach(|| {
            let centre = |index: usize| values(fit, &posterior.centre(index));
            (0..posterior.mass.len()).map(centre).collect::<Vec<_>>()
        });
        Ok((rows(py, &centres)?, posterior.mass.clone().into_pyarray(py)))
    }

    /// Points drawn from the posterior, SI.
    fn draw<'py>(&self, py: Python<'py>, law: usize, below: bool, count: usize, seed: u64) -> PyResult<Points<'py>> {
        let fit = self.fit(law, below)?;
        let drawn = py.detach(|| {
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            (0..count).map(|_| values(fit, &fit.posterior.draw(1.0, &mut random))).collect::<Vec<_>>()
        });
        rows(py, &drawn)
    }

    /// Parameters of every run, SI, its misfit (NaN of a failed one), and why it failed.
    fn runs<'py>(&self, py: Python<'py>, law: usize, below: bool) -> PyResult<Runs<'py>> {
        let fit = self.fit(law, below)?;
        let misfits = self.job.problem.misfits(fit).into_iter().map(|misfit| misfit.unwrap_or(f64::NAN));
        let points: Vec<_> = fit.runs.iter().map(|run| values(fit, &run.position)).collect();
        let failed = fit.runs.iter().map(|run| run.outcome.as_ref().err().cloned()).collect();
        Ok((rows(py, &points)?, misfits.collect::<Vec<_>>().into_pyarray(py), failed))
    }

    /// Write the folder that `granchain calibrate` writes; returns its place.
    fn write(&self, py: Python<'_>, folder: PathBuf, force: bool) -> PyResult<PathBuf> {
        let write = || {
            let folder = OutputFolder::stage(&folder, &RESULTS, force)?;
            for (name, bytes) in &self.files {
                folder.write(name, bytes)?;
            }
            folder.write(timing::FILE, &self.timing)?;
            folder.finish()
        };
        py.detach(write).map_err(raised)
    }
}

/// Calibrate by the flags of `granchain calibrate`; records in memory stand in place of the files named there.
#[pyfunction]
fn calibrate(
    py: Python<'_>,
    flags: Vec<String>,
    cache_folder: Option<PathBuf>,
    measured: Vec<Option<Vec<u8>>>,
    drives: Vec<Option<Vec<u8>>>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Calibration> {
    let mut arguments: Arguments = arguments(&flags)?;
    (arguments.session.quiet, arguments.session.cache) = (true, cache_folder);
    let unused = [
        ("out", arguments.output.out.is_some()),
        ("resume", arguments.resume),
        ("dry_run", arguments.dry_run),
        ("strict", arguments.strict),
    ];
    if let Some((name, _)) = unused.into_iter().find(|(_, given)| *given) {
        return Err(raised(usage(format!("`{name}` is of the program alone; write a report with write_report"))));
    }
    let in_memory = InMemory { measured, drives };
    let done = attend(py, progress.as_ref(), move |attendance| {
        let mut timing = Timing::start();
        let session = arguments.session.clone();
        let job = prepare(arguments, flags, &in_memory)?;
        timing.stage("read");
        let bodies = job.problem.bodies(session.cache().as_ref()).map_err(Refusal::from)?;
        timing.stage("prepare");
        let (work, attending) = (job.problem.work(), attendance.clone());
        let watch = Arc::new(move |done| attending.go_on(done, work));
        let fitted = job.problem.fit(Schedule { bodies: bodies.as_ref(), saved: Vec::new(), watch })?;
        timing.stage("fit");
        let attending = attendance.clone();
        let stop = Stop(Arc::new(move || attending.stops()));
        let Files { files, .. } = Files::of(&job, &fitted, &session, &mut timing, &stop)?;
        anyhow::Ok(Calibration { job, fitted, files, timing: timing.to_json() })
    });
    done?.map_err(raised)
}
