//! Figures, tables, pages.
//!
//! [`figure`] draws a declarative figure to SVG or PNG; the other modules say which figures and tables a calibration, a
//! replay, a sweep, a set of synthetic records or a static contact deserves. Nothing here computes physics and nothing here touches the file system: a
//! report is a list of relative paths and bytes.

pub mod accuracy;
pub mod calibration;
pub mod design;
pub mod dynamics;
pub mod figure;
pub mod hydrophone;
pub mod interface;
pub mod mesh;
pub mod motion;
pub mod page;
pub mod pressure;
pub mod regime;
pub mod replay;
pub mod spectrum;
pub mod sweep;

pub use granchain_signal::number;
