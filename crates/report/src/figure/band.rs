//! A cell of a field cut into bands of equal colour.

/// Cut a cell (x, y, share 0…1 of the colours) into its pieces: into `bands[k]` goes the part whose share is at least that of band k, the
/// whole cell into its lowest band and the one before. Drawn from the lowest band on, every piece covers the seams below it.
pub(super) fn cut(corners: &[(f64, f64, f64)], count: usize, bands: &mut [Vec<Vec<(f64, f64)>>]) {
    let of = |share: f64| ((share * count as f64).floor() as usize).min(count - 1);
    let (low, high) = corners
        .iter()
        .map(|corner| of(corner.2))
        .fold((count - 1, 0), |(low, high), band| (low.min(band), high.max(band)));
    for (band, pieces) in bands.iter_mut().enumerate().take(high + 1).skip(low.saturating_sub(1)) {
        let piece = if band <= low {
            corners.iter().map(|(x, y, _)| (*x, *y)).collect()
        } else {
            above(corners, band as f64 / count as f64)
        };
        if piece.len() > 2 {
            pieces.push(piece);
        }
    }
}

/// The part of a cell where the value is at least `level`.
fn above(corners: &[(f64, f64, f64)], level: f64) -> Vec<(f64, f64)> {
    let mut kept = Vec::with_capacity(corners.len() + 2);
    for (index, &to) in corners.iter().enumerate() {
        let from = corners[(index + corners.len() - 1) % corners.len()];
        if (from.2 < level) != (to.2 < level) {
            // From the lower end whatever the direction, so that neighbours cut their common side at the same point.
            let (low, high) = if from.2 < to.2 { (from, to) } else { (to, from) };
            let share = (level - low.2) / (high.2 - low.2);
            kept.push((low.0 + share * (high.0 - low.0), low.1 + share * (high.1 - low.1)));
        }
        if to.2 >= level {
            kept.push((to.0, to.1));
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(corners: &[(f64, f64)]) -> f64 {
        let next = corners.iter().cycle().skip(1);
        0.5 * corners.iter().zip(next).map(|(a, b)| a.0 * b.1 - a.1 * b.0).sum::<f64>()
    }

    #[test]
    fn the_bands_of_a_ramp_shrink_evenly_from_the_whole_cell() {
        let cell = [(0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (1.0, 1.0, 1.0), (0.0, 1.0, 0.0)];
        let mut bands = vec![Vec::new(); 4];
        cut(&cell, 4, &mut bands);
        for (band, pieces) in bands.iter().enumerate() {
            let total: f64 = pieces.iter().map(|piece| area(piece)).sum();
            // Rounding of a few products.
            assert!((total - (1.0 - 0.25 * band as f64)).abs() < 1e-12, "{band}: {total}");
        }
    }

    #[test]
    fn an_even_cell_lies_whole_in_its_band_and_on_a_ground_of_the_one_below() {
        let mut bands = vec![Vec::new(); 4];
        cut(&[(0.0, 0.0, 0.6), (1.0, 0.0, 0.6), (0.0, 1.0, 0.7)], 4, &mut bands);
        assert_eq!(bands.iter().map(Vec::len).collect::<Vec<_>>(), [0, 1, 1, 0]);
    }
}
