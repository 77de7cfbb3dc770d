//! Curves with many samples thinned to what a printed line can show.

/// At most four points a column of width `column`: the first, the extremes and the last of every run of points that falls into
/// the same column, in their order. The outline of the curve is that of all points. x need not ascend.
pub(super) fn thin(points: &[(f64, f64)], column: f64) -> Vec<(f64, f64)> {
    let mut kept = Vec::new();
    let mut rest = points;
    while let Some(first) = rest.first() {
        let home = (first.0 / column).floor();
        let length = rest.iter().take_while(|point| (point.0 / column).floor() == home).count();
        let (run, tail) = rest.split_at(length);
        rest = tail;
        if length <= 4 {
            kept.extend_from_slice(run);
            continue;
        }
        let position = |better: fn(f64, f64) -> bool| {
            (1..length).fold(0, |best, index| if better(run[index].1, run[best].1) { index } else { best })
        };
        let mut indices = [0, position(|a, b| a < b), position(|a, b| a > b), length - 1];
        indices.sort_unstable();
        let mut last = None;
        for index in indices {
            if last != Some(index) {
                kept.push(run[index]);
            }
            last = Some(index);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_the_ends_and_the_extremes() {
        let points: Vec<_> = (0..10_000).map(|i| (f64::from(i) * 0.01, (f64::from(i) * 0.7).sin())).collect();
        let thinned = thin(&points, 0.5);
        assert!(thinned.len() <= 4 * 201);
        assert_eq!(thinned.first(), points.first());
        assert_eq!(thinned.last(), points.last());
        let highest = |points: &[(f64, f64)]| points.iter().fold(f64::MIN, |high, point| high.max(point.1));
        assert_eq!(highest(&thinned), highest(&points));
    }

    #[test]
    fn a_sparse_curve_is_left_as_it_is() {
        let points = [(0.0, 1.0), (5.0, 2.0), (3.0, -1.0)];
        assert_eq!(thin(&points, 0.5), points);
    }
}
