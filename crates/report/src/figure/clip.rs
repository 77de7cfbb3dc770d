//! What of a segment or a polygon lies in the frame, the unit square.

/// The part of a segment inside the unit square (Liang and Barsky 1984).
pub(super) fn segment(from: (f64, f64), to: (f64, f64)) -> Option<((f64, f64), (f64, f64))> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
    for (direction, room) in [(-dx, from.0), (dx, 1.0 - from.0), (-dy, from.1), (dy, 1.0 - from.1)] {
        if direction == 0.0 {
            if room < 0.0 {
                return None;
            }
        } else if direction < 0.0 {
            enter = enter.max(room / direction);
        } else {
            leave = leave.min(room / direction);
        }
    }
    if enter > leave {
        return None;
    }
    let at = |share: f64| (from.0 + share * dx, from.1 + share * dy);
    Some((if enter > 0.0 { at(enter) } else { from }, if leave < 1.0 { at(leave) } else { to }))
}

/// The part of a polygon inside the unit square (Sutherland and Hodgman 1974); empty when all of it lies outside.
pub(super) fn polygon(corners: &[(f64, f64)]) -> Vec<(f64, f64)> {
    // Distance inside each of the four sides.
    let sides: [fn((f64, f64)) -> f64; 4] = [|(x, _)| x, |(x, _)| 1.0 - x, |(_, y)| y, |(_, y)| 1.0 - y];
    let mut corners = corners.to_vec();
    for distance in sides {
        let mut kept = Vec::with_capacity(corners.len() + 1);
        for (index, &to) in corners.iter().enumerate() {
            let from = corners[(index + corners.len() - 1) % corners.len()];
            let (before, after) = (distance(from), distance(to));
            if (before < 0.0) != (after < 0.0) {
                let share = before / (before - after);
                kept.push((from.0 + share * (to.0 - from.0), from.1 + share * (to.1 - from.1)));
            }
            if after >= 0.0 {
                kept.push(to);
            }
        }
        corners = kept;
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clipping_cuts_a_segment_at_the_frame_and_drops_what_lies_outside() {
        assert_eq!(segment((-1.0, 0.5), (2.0, 0.5)), Some(((0.0, 0.5), (1.0, 0.5))));
        assert_eq!(segment((0.2, 0.2), (0.8, 0.9)), Some(((0.2, 0.2), (0.8, 0.9))));
        assert_eq!(segment((-1.0, 0.5), (0.5, 2.0)), None);
        assert_eq!(segment((0.5, 1.5), (0.9, 1.5)), None);
    }

    #[test]
    fn a_polygon_over_a_corner_keeps_the_part_in_the_frame() {
        let area = |corners: &[(f64, f64)]| {
            let next = |i: usize| corners[(i + 1) % corners.len()];
            let sum: f64 = corners.iter().enumerate().map(|(i, a)| a.0 * next(i).1 - next(i).0 * a.1).sum();
            0.5 * sum
        };
        let square = [(0.5, 0.5), (1.5, 0.5), (1.5, 1.5), (0.5, 1.5)];
        assert!((area(&polygon(&square)) - 0.25).abs() < 1e-12);
        let inside = [(0.1, 0.1), (0.9, 0.2), (0.5, 0.8)];
        assert_eq!(area(&polygon(&inside)), area(&inside));
        assert!(polygon(&square.map(|(x, y)| (x + 1.0, y))).is_empty());
    }
}
