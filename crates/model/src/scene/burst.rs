//! When the piston is at work.

use super::{Drive, DriveKind};
use granchain_signal::Series;

/// Level, relative to the peak, at which a recorded burst counts as begun.
const BEGUN: f64 = 0.05;

/// Level, relative to the peak, below which a recorded burst counts as over.
const OVER: f64 = 0.5;

impl Drive {
    /// Realisations of what is not known of a recorded drive, m; none of any other.
    pub fn shakes(&self) -> &[Series] {
        if let DriveKind::Record { shakes, .. } = &self.kind { shakes } else { &[] }
    }

    /// First motion and end of the burst, s.
    ///
    /// Analytic drives say so themselves; a record begins where it first exceeds 5 % and ends where it last exceeds half
    /// of its peak, but no later than it was recorded.
    pub fn burst(&self) -> (f64, f64) {
        match &self.kind {
            DriveKind::SineCycles { cycles }
            | DriveKind::ToneBurst { cycles, .. }
            | DriveKind::GaussianBurst { cycles } => (0.0, cycles / self.frequency),
            DriveKind::Striker { .. } => (0.0, 1.0 / self.frequency),
            DriveKind::UnreadRecord { .. } => (0.0, 0.0),
            DriveKind::Record { displacement, recorded_until, .. } => {
                let peak = displacement.peak();
                let beyond = |level: f64| move |value: &f64| value.abs() > level * peak;
                let first = displacement.values.iter().position(beyond(BEGUN)).unwrap_or(0);
                let last = displacement.values.iter().rposition(beyond(OVER)).unwrap_or(0);
                (displacement.time(first), displacement.time(last).min(*recorded_until))
            }
        }
    }

    /// Time from the first motion to half of the peak, s: for a record; 0 for a drive that is not given by samples.
    pub fn ring_up(&self) -> f64 {
        let DriveKind::Record { displacement, .. } = &self.kind else { return 0.0 };
        let half = 0.5 * displacement.peak();
        let first = displacement.values.iter().position(|value| value.abs() > half).unwrap_or(0);
        displacement.time(first) - self.burst().0
    }

    /// Whether the end of the burst is known: it is where a record goes on behind it.
    pub fn ends(&self) -> bool {
        match &self.kind {
            DriveKind::Record { recorded_until, .. } => self.burst().1 < *recorded_until,
            DriveKind::UnreadRecord { .. } => false,
            DriveKind::SineCycles { .. }
            | DriveKind::ToneBurst { .. }
            | DriveKind::GaussianBurst { .. }
            | DriveKind::Striker { .. } => true,
        }
    }
}
