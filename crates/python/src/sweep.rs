//! A scene over a grid of values.

use std::path::PathBuf;

use granchain::{
    cli::{self, sweep_table::SweepTable},
    study::{
        Axis, Bodies, EnsemblePlan, Grid,
        sweep::{Study, Watch, sweep as run_all},
    },
};
use pyo3::prelude::*;

use crate::{
    attend::{Attendance, attend},
    error::raised,
    scene::{Scene, cache},
};

pub fn add(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(sweep, module)?)
}

struct Points<'a>(&'a Attendance, u64);

impl Watch for Points<'_> {
    fn finished(&self, points: usize) {
        self.0.go_on(points as u64, self.1);
    }

    fn stop(&self) -> bool {
        self.0.stops()
    }
}

/// What `granchain sweep` writes as `sweep.csv` and `sweep.json`; axes are written as for `--vary`.
#[pyfunction]
#[pyo3(signature = (scene, axes, ensemble, seed, cache_folder, progress))]
fn sweep(
    py: Python<'_>,
    scene: &Scene,
    axes: Vec<String>,
    ensemble: Option<usize>,
    seed: u64,
    cache_folder: Option<PathBuf>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let mut bench = scene.0.clone();
    let done = attend(py, progress.as_ref(), move |attendance| {
        let axes = axes.iter().map(|axis| Axis::parse(axis)).collect::<Result<_, _>>()?;
        let grid = Grid::new(axes)?;
        let study = ensemble.map_or(Study::Single, |replicates| Study::Ensemble(EnsemblePlan::new(replicates, seed)));
        let base = cli::sweep::base(&mut bench, &grid)?;
        cli::sweep::refuse_excess(&bench, &base, &grid, study.ensemble())?;
        let place = tempfile::tempdir()?;
        let build = |overrides: &[String]| bench.scene_with(overrides);
        let (bodies, log) = (Bodies::new(cache(cache_folder)), place.path().join("runs.jsonl"));
        let runs = run_all(&grid, &build, &bodies, &study, &log, &Points(attendance, grid.len() as u64))?;
        let table = SweepTable::new(&base, &grid, &runs, &study)?;
        let mut csv = Vec::new();
        table.csv(&mut csv)?;
        anyhow::Ok((String::from_utf8(csv)?, serde_json::to_string(&table.json(&bench, None, seed)?)?))
    });
    done?.map_err(raised)
}
