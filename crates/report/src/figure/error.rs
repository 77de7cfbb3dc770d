//! Why a figure cannot be drawn.

use thiserror::Error;

/// Why a figure cannot be drawn; panels and layers are counted from 1.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FigureError {
    #[error("figure `{figure}`: no panel; add at least one")]
    NoPanel { figure: String },
    #[error(
        "figure `{figure}`, panel {panel}, layer {layer}: expected a finite {expected} at index {index}, found {found}; leave the value out or repair it before drawing"
    )]
    Unplaceable { figure: String, panel: usize, layer: usize, index: usize, expected: &'static str, found: f64 },
    #[error("figure `{figure}`, panel {panel}: the {axis} axis has neither data nor a range; give one of them")]
    NoExtent { figure: String, panel: usize, axis: &'static str },
    #[error(
        "figure `{figure}`, panel {panel}: the {axis} axis cannot run from {low} to {high}; give finite, ascending ends (positive on a logarithmic axis)"
    )]
    BadRange { figure: String, panel: usize, axis: &'static str, low: f64, high: f64 },
    #[error("figure `{figure}`, panel {panel}: the {axis} axis needs a label and a unit (`1` for a pure number)")]
    UnnamedAxis { figure: String, panel: usize, axis: &'static str },
    #[error(
        "figure `{figure}`, panel {panel}, layer {layer}: a map of {columns} × {rows} ascending positions needs {expected} values, found {found}"
    )]
    BadMap { figure: String, panel: usize, layer: usize, columns: usize, rows: usize, expected: usize, found: usize },

    #[error("figure `{figure}`: drawing failed: {reason}")]
    Drawing { figure: String, reason: String },
}
