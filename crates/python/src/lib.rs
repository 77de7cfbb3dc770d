//! The extension module `granchain._granchain`: what the Python package `granchain` is made of.
//!
//! Keywords of the package are flags of the program and are parsed as such, so that there is one list of them; numbers leave as NumPy arrays,
//! structured answers as the JSON that the program writes. Work is done without the interpreter's lock ([`attend`]).

mod attend;
mod calibrate;
mod error;
mod keyword;
mod record;
mod scene;
mod sweep;

use std::ffi::OsString;

use pyo3::prelude::*;

/// Run the program with what was typed, its name first. Returns the exit code.
#[pyfunction]
#[pyo3(signature = (typed, subcommand=None))]
fn run_program(py: Python<'_>, typed: Vec<OsString>, subcommand: Option<&str>) -> u8 {
    py.detach(|| granchain::cli::run_typed(typed, subcommand))
}

#[pymodule]
fn _granchain(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    error::add(module)?;
    record::add(module)?;
    scene::add(module)?;
    sweep::add(module)?;
    calibrate::add(module)
}
