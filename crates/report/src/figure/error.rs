//! Why a figure cannot be drawn.

use thiserror::Error;

/// Why a figure cannot be drawn.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum FigureError {
    /// The figure has no panel.
    #[error("figure `{figure}`: no panel; add at least one")]
    NoPanel {
        /// Title of the figure.
        figure: String,
    },
    /// A value that cannot be placed on its axis.
    #[error(
        "figure `{figure}`, panel {panel}, layer {layer}: expected a finite {expected} at index {index}, found {found}; leave the value out or repair it before drawing"
    )]
    Unplaceable {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Layer, counted from 1.
        layer: usize,
        /// Index of the value in the layer.
        index: usize,
        /// What the axis can carry.
        expected: &'static str,
        /// What was found.
        found: f64,
    },
    /// Neither data nor a fixed range tells where the axis begins and ends.
    #[error("figure `{figure}`, panel {panel}: the {axis} axis has neither data nor a range; give one of them")]
    NoExtent {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Which axis.
        axis: &'static str,
    },
    /// A fixed range that is empty, reversed, not finite, or not positive on a logarithmic axis.
    #[error(
        "figure `{figure}`, panel {panel}: the {axis} axis cannot run from {low} to {high}; give finite, ascending ends (positive on a logarithmic axis)"
    )]
    BadRange {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Which axis.
        axis: &'static str,
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// An axis without label or without unit.
    #[error("figure `{figure}`, panel {panel}: the {axis} axis needs a label and a unit (`1` for a pure number)")]
    UnnamedAxis {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Which axis.
        axis: &'static str,
    },
    /// Grid and values of a map do not fit together.
    #[error(
        "figure `{figure}`, panel {panel}, layer {layer}: a map of {columns} × {rows} ascending positions needs {expected} values, found {found}"
    )]
    BadMap {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Layer, counted from 1.
        layer: usize,
        /// Positions along x.
        columns: usize,
        /// Positions along y.
        rows: usize,
        /// Values needed.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// A field without a cell.
    #[error(
        "figure `{figure}`, panel {panel}, layer {layer}: a field without a cell; leave the layer out or give what it lies on"
    )]
    NoCells {
        /// Title of the figure.
        figure: String,
        /// Panel, counted from 1.
        panel: usize,
        /// Layer, counted from 1.
        layer: usize,
    },
    /// The drawing library or the image encoder refused.
    #[error("figure `{figure}`: drawing failed: {reason}")]
    Drawing {
        /// Title of the figure.
        figure: String,
        /// What it said.
        reason: String,
    },
}
