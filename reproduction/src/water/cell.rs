//! Runs at one drive, as they are measured.

use serde::{Deserialize, Serialize};

use super::{LEVEL_TOLERANCE_DB, PRINTED_LEVEL_DB, PRINTED_PRESSURE};
use granchain_signal::feature::PressureFeatures;

/// Median and ends of a handful of runs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    pub median: f64,
    pub lowest: f64,
    pub highest: f64,
}

impl Quantiles {
    /// Of some values; none of none.
    #[must_use]
    pub fn of(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut values: Vec<f64> = values.into_iter().collect();
        values.sort_by(f64::total_cmp);
        let (&lowest, &highest) = (values.first()?, values.last()?);
        let middle = values.len() / 2;
        let median = if values.len() % 2 == 1 { values[middle] } else { 0.5 * (values[middle - 1] + values[middle]) };
        Some(Self { median, lowest, highest })
    }
}

/// One run as it is measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    pub drive_m: f64,
    pub pressure: PressureFeatures,
    /// Largest size of the velocity of the last bead's far pole, m/s.
    pub velocity_m_per_s: f64,
}

/// All runs at one drive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cell {
    pub drive_m: f64,
    /// Larger peak of the pressure, Pa.
    pub pressure_pa: Option<Quantiles>,
    /// Level around 0.95 MHz, dB re the fundamental.
    pub level_db: Option<Quantiles>,
    /// Highest frequency at −21 dB, Hz.
    pub content_hz: Option<Quantiles>,
    /// −6 dB width of the strongest band, Hz.
    pub band_width_hz: Option<Quantiles>,
    pub thd: Option<Quantiles>,
    /// Velocity of the pole, m/s.
    pub velocity_m_per_s: Option<Quantiles>,
    /// Why runs failed, one a failed run.
    pub failures: Vec<String>,
}

impl Cell {
    pub(super) fn of(drive_m: f64, runs: &[Result<Run, String>]) -> Self {
        let over = |pick: &dyn Fn(&Run) -> Option<f64>| Quantiles::of(runs.iter().flatten().filter_map(pick));
        Self {
            drive_m,
            pressure_pa: over(&|run| Some(run.pressure.largest())),
            level_db: over(&|run| run.pressure.probe_level_db),
            content_hz: over(&|run| run.pressure.content_hz),
            band_width_hz: over(&|run| run.pressure.band_width_hz),
            thd: over(&|run| Some(run.pressure.thd)),
            velocity_m_per_s: over(&|run| Some(run.velocity_m_per_s)),
            failures: runs.iter().filter_map(|run| run.as_ref().err().cloned()).collect(),
        }
    }

    /// Whether the printed pressure lies between the lowest and the highest of the runs.
    #[must_use]
    pub fn has_pressure(&self) -> bool {
        self.pressure_pa.is_some_and(|found| (found.lowest..=found.highest).contains(&PRINTED_PRESSURE))
    }

    /// Whether the printed level lies between the lowest and the highest of the runs, a reader's error aside.
    #[must_use]
    pub fn has_level(&self) -> bool {
        self.level_db.is_some_and(|found| {
            found.lowest - LEVEL_TOLERANCE_DB <= PRINTED_LEVEL_DB
                && PRINTED_LEVEL_DB <= found.highest + LEVEL_TOLERANCE_DB
        })
    }
}
