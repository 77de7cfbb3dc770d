//! The settings that nothing beats: by cost, and by an error in which accidental cancellations do not count.

use super::Row;

impl Row {
    /// √(total² + own²), and no smaller than what the reference is known to: where errors of step and mesh cancel, the own error remains.
    #[must_use]
    pub fn ranked_error(&self, reference_error: f64) -> Option<f64> {
        self.own.map(|own| self.total.hypot(own).max(reference_error))
    }

    /// Bodies made and one run, s.
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.bodies_s + self.run_s
    }
}

/// An error is better that is below so much of another.
const WORTH: f64 = 0.9;

/// Places of the rows that none beats in ranked error and in time, cheapest first.
#[must_use]
pub fn front(rows: &[Row], reference_error: f64) -> Vec<usize> {
    let ranked = |(place, row): (usize, &Row)| Some((place, row.seconds(), row.ranked_error(reference_error)?));
    let mut points: Vec<(usize, f64, f64)> = rows.iter().enumerate().filter_map(ranked).collect();
    points.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2)));
    let mut least = f64::INFINITY;
    points.retain(|(_, _, error)| {
        let better = *error < WORTH * least;
        if better {
            least = *error;
        }
        better
    });
    points.into_iter().map(|(place, ..)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row((seconds, total, own): (f64, f64, f64)) -> Row {
        Row { bodies_s: 0.25 * seconds, run_s: 0.75 * seconds, total, own: Some(own), ..Row::default() }
    }

    #[test]
    fn an_accidental_cancellation_never_wins() {
        // Cheap and seemingly exact: its errors of step and mesh, 0.8 % each way, cancel to 0.1 %. The next is honest at 0.4 %.
        let rows = [(1.0, 0.001, 0.008), (2.0, 0.004, 0.001), (0.5, 0.02, 0.0), (3.0, 0.0045, 0.0)].map(row);
        assert_eq!(front(&rows, 0.0), [2, 0, 1]);
        let within = |level: f64| front(&rows, 0.0).into_iter().find(|at| rows[*at].ranked_error(0.0) <= Some(level));
        assert_eq!((within(0.006), within(0.009), within(0.001)), (Some(1), Some(0), None));
    }

    #[test]
    fn below_what_the_reference_is_known_to_only_the_cheapest_counts() {
        let rows = [(1.0, 0.01, 0.0), (2.0, 0.002, 0.0), (5.0, 0.0001, 0.0)].map(row);
        assert_eq!(front(&rows, 0.003), [0, 1]);
        assert_eq!(front(&rows, 0.0), [0, 1, 2]);
    }

    #[test]
    fn a_row_without_an_own_error_is_no_candidate() {
        let rows = [Row { own: None, ..row((0.1, 0.0, 0.0)) }, row((1.0, 0.01, 0.0))];
        assert_eq!(front(&rows, 0.0), [1]);
    }
}
