//! The settings of which none is both faster and more accurate, and the cheapest within a level.

use super::{
    ladder::FidelityLevel,
    stored::{Measured, Stored},
};

/// Places of the settings that no other beats in error and in time (bodies made and one run), cheapest first.
///
/// Of settings with errors below `least_quotable`, of which none is known to be better than another, only the cheapest can be among them.
fn pareto(measured: &[Measured], least_quotable: f64) -> Vec<usize> {
    let mut places: Vec<usize> = (0..measured.len()).collect();
    places.sort_by(|a, b| measured[*a].cost.total().total_cmp(&measured[*b].cost.total()));
    let mut least = f64::INFINITY;
    places.retain(|place| {
        let error = measured[*place].error.max(least_quotable);
        let better = error < least;
        if better {
            least = error;
        }
        better
    });
    places
}

impl Stored {
    /// Places of the settings that no other is shown to beat in error and in time, cheapest first.
    #[must_use]
    pub fn front(&self) -> Vec<usize> {
        pareto(&self.measured, self.least_quotable())
    }

    /// Whether an error is too small to be distinguished from 0 with the reference that there is.
    #[must_use]
    pub fn is_below_limit(&self, measured: &Measured) -> bool {
        measured.error < self.least_quotable()
    }

    /// Total error of a setting as far as it is known: no smaller than ten times what the reference itself may be off.
    #[must_use]
    pub fn known_error(&self, measured: &Measured) -> f64 {
        measured.error.max(self.least_quotable())
    }

    /// The smallest total error that is quoted, 1.
    #[must_use]
    pub fn least_quotable(&self) -> f64 {
        self.references.first().map_or(0.0, super::stored::Reference::least_quotable)
    }

    /// The setting that takes least (bodies made and one run) among those of models that the caller takes with a known error of at most
    /// `level`.
    #[must_use]
    pub fn cheapest_within(&self, level: f64, takes: impl Fn(FidelityLevel) -> bool) -> Option<&Measured> {
        let taken = self.measured.iter().filter(|measured| takes(measured.setting.fidelity));
        let within = taken.filter(|measured| self.known_error(measured) <= level);
        within.min_by(|a, b| a.cost.total().total_cmp(&b.cost.total()))
    }

    /// The setting with the smallest error of models that the caller takes, and of those the cheapest.
    #[must_use]
    pub fn most_accurate(&self, takes: impl Fn(FidelityLevel) -> bool) -> Option<&Measured> {
        let known = |measured: &Measured| (self.known_error(measured), measured.cost.total());
        self.measured.iter().filter(|measured| takes(measured.setting.fidelity)).min_by(|a, b| {
            let ((x, s), (y, t)) = (known(a), known(b));
            x.total_cmp(&y).then(s.total_cmp(&t))
        })
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::accuracy::{
        Cost, Seconds,
        ladder::Setting,
        stored::{Chaos, Reference},
    };
    use granchain_model::response::SolverWork;

    fn measured(error: f64, seconds: f64) -> Measured {
        let time = |least| Seconds { least, median: least, repetitions: 3 };
        Measured {
            setting: Setting { fidelity: FidelityLevel::Reduced, sets: vec![format!("model.mesh_density={seconds}")] },
            error,
            energy: 0.0,
            work: SolverWork::default(),
            features: Vec::new(),
            cost: Cost { setup_s: time(0.4 * seconds), run_s: time(0.6 * seconds), peak_memory_bytes: None },
        }
    }

    pub fn stored(change: f64, points: &[(f64, f64)]) -> Stored {
        let setting = Setting { fidelity: FidelityLevel::Reduced, sets: Vec::new() };
        let reference = Reference {
            key: "best".into(),
            setting: setting.clone(),
            next: setting.clone(),
            change,
            values: vec![1.0],
        };
        Stored {
            program: "granchain".into(),
            scene: "rigid".into(),
            scene_sha256: String::new(),
            watched: String::new(),
            window_s: 7e-5,
            interval_s: 4e-7,
            processor: String::new(),
            references: vec![reference],
            chaos: Chaos { setting, replicates: 0, seed: 1, floor: 0.0, features: Vec::new() },
            own: Vec::new(),
            measured: points.iter().map(|(error, seconds)| measured(*error, *seconds)).collect(),
        }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let stored = stored(1e-9, &[(0.1, 1.0), (0.01, 5.0), (0.2, 2.0), (0.02, 4.0), (0.02, 6.0)]);
        assert_eq!(stored.front(), [0, 3, 1]);
    }

    #[test]
    fn of_what_lies_below_the_limit_only_the_cheapest_is_on_the_front() {
        let stored = stored(1e-3, &[(0.1, 1.0), (5e-3, 2.0), (1e-4, 5.0), (0.02, 1.5)]);
        assert_eq!(stored.front(), [0, 3, 1]);
        let below: Vec<bool> = stored.measured.iter().map(|measured| stored.is_below_limit(measured)).collect();
        assert_eq!(below, [false, true, true, false]);
    }

    #[test]
    fn the_cheapest_within_a_level_is_never_better_than_the_reference_is_known() {
        let stored = stored(1e-3, &[(0.1, 1.0), (0.03, 3.0), (1e-4, 5.0)]);
        let seconds = |level| stored.cheapest_within(level, |_| true).map(|measured: &Measured| measured.cost.total());
        assert_eq!(seconds(0.05), Some(3.0));
        assert_eq!(seconds(0.01), Some(5.0));
        assert_eq!(seconds(0.001), None);
        assert!(stored.cheapest_within(0.05, |fidelity| fidelity == FidelityLevel::Fea).is_none());
        assert_eq!(stored.most_accurate(|_| true).unwrap().cost.total(), 5.0);
    }
}
