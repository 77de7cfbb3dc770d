//! Where a function of the step falls through zero, and whether it may.

use super::dormand_prince::Clock;

/// Smallest overlap (m), force indicator, velocity (m/s) and force (N) that count as a change of mode: far below any tolerance, so that contacts which touch
/// with rounding errors do not chatter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Resolution {
    pub overlap: f64,
    pub pull: f64,
    pub velocity: f64,
    pub force: f64,
}

/// A switch (a contact, unless coupled) changes its mode at σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Event {
    pub switch: usize,
    pub sigma: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crossing {
    None,
    Perhaps,
    Sure,
}

/// Whether an overlap at (δ, δ̇) at both ends of a step, not above 0 there, may rise above 0 within: it approaches first and parts at last, and
/// the tangents at both ends, below which a motion stays whose rate only falls, meet that high; taken twice as far, since the rate may rise first.
pub(super) fn may_rise(start: (f64, f64), end: (f64, f64), clock: &Clock) -> bool {
    if !(start.1 > 0.0 && end.1 < 0.0) {
        return false;
    }
    let length = clock.length();
    let until = ((end.0 - start.0 - end.1 * length) / (start.1 - end.1)).clamp(0.0, length);
    let higher = start.0.max(end.0);
    higher + 2.0 * (start.0 + start.1 * until - higher) > 0.0
}

/// First σ at which the first of what `margin` gives falls through zero, the second being its rate. One that is known to be negative at σ = 1 is looked for
/// between `sigmas`, ascending; one that is positive at both ends has fallen, if at all, where its rate passes zero.
pub(super) fn first_fall(
    mut margin: impl FnMut(f64) -> (f64, f64),
    crossing: Crossing,
    sigmas: impl Iterator<Item = f64>,
) -> Option<f64> {
    if crossing == Crossing::Perhaps {
        let ends = [1.0, 0.0].map(|sigma| (sigma, margin(sigma).1));
        let lowest = bracketed_root(|sigma| margin(sigma).1, ends[0], ends[1]);
        return first_root(|sigma| margin(sigma).0, [0.0, lowest].into_iter());
    }
    let mut held = false;
    let value = |sigma: f64| {
        let value = margin(sigma).0;
        held |= value > 0.0;
        value
    };
    let found = first_root(value, sigmas);
    if held {
        return found;
    }
    // It held for less than a part, about where its rate passes zero, or never: then it has to change at once.
    let ends = [0.0, 1.0].map(|sigma| (sigma, margin(sigma).1));
    if ends[0].1 > 0.0 && ends[1].1 < 0.0 {
        let highest = bracketed_root(|sigma| margin(sigma).1, ends[0], ends[1]);
        if margin(highest).0 > 0.0 {
            return first_root(|sigma| margin(sigma).0, [highest, 1.0].into_iter());
        }
    }
    Some(0.0)
}

/// First root where a function falls through zero between two of `sigmas`, ascending.
fn first_root(mut function: impl FnMut(f64) -> f64, sigmas: impl Iterator<Item = f64>) -> Option<f64> {
    let mut held: Option<(f64, f64)> = None;
    for sigma in sigmas {
        let value = function(sigma);
        if value > 0.0 {
            held = Some((sigma, value));
        } else if let Some(held) = held {
            return Some(bracketed_root(&mut function, held, (sigma, value)));
        }
    }
    None
}

/// Root between a point where the function is positive and one where it is not: false position (Illinois), bisected when slow.
fn bracketed_root(mut function: impl FnMut(f64) -> f64, positive: (f64, f64), negative: (f64, f64)) -> f64 {
    let (mut a, mut fa) = positive;
    let (mut b, mut fb) = negative;
    for iteration in 0..96 {
        if (b - a).abs() <= 4.0 * f64::EPSILON * b.abs() || fb == 0.0 {
            break;
        }
        let secant = (a * fb - b * fa) / (fb - fa);
        let inside = secant > a.min(b) && secant < a.max(b);
        // Two roots close together draw the secant to one end.
        let c = if inside && iteration % 8 != 7 && iteration < 24 { secant } else { 0.5 * (a + b) };
        let fc = function(c);
        if (fc > 0.0) == (fb > 0.0) {
            fa *= 0.5;
        } else {
            (a, fa) = (b, fb);
        }
        (b, fb) = (c, fc);
    }
    b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_of_several_roots_is_found_to_rounding() {
        let eighths = || (0..=8).map(|part| f64::from(part) / 8.0);
        let root = |function: fn(f64) -> f64| first_fall(|s| (function(s), 0.0), Crossing::Sure, eighths());
        assert!((root(|s| (0.3 - s) * (0.7 - s) * (0.95 - s)).unwrap() - 0.3).abs() < 1e-15);
        assert!((root(|s| 1e-9 - s * s * s).unwrap() - 1e-3).abs() < 1e-15);
        assert_eq!(root(|s| -1.0 - s), Some(0.0));
    }

    /// A contact that opens with a rounding's overlap and closes again before the first of the parts.
    #[test]
    fn a_change_that_lasts_for_less_than_a_part_ends_where_it_does_and_not_at_once() {
        let eighths = || (0..=8).map(|part| f64::from(part) / 8.0);
        let short = |depth: f64| move |s: f64| (depth - (s - 0.01).powi(2), -2.0 * (s - 0.01));
        let found = first_fall(short(0.99e-4), Crossing::Sure, eighths()).unwrap();
        assert!((found - 0.01 - 0.99e-4_f64.sqrt()).abs() < 1e-12, "{found}");
        assert_eq!(first_fall(short(-1e-9), Crossing::Sure, eighths()), Some(0.0));
    }

    /// Overlap −g + v t − ½ a t² of a flight that touches within the step, and of one that passes by.
    #[test]
    fn a_touch_within_a_step_is_found_however_short_it_is() {
        let clock = Clock { start: 0.0, linear: 1.0, quadratic: 0.0 };
        let flight = |gap: f64, speed: f64| move |t: f64| (-gap + speed * t - 5.0 * t * t, speed - 10.0 * t);
        let fall = |flight: &dyn Fn(f64) -> (f64, f64)| {
            first_fall(|t| (-flight(t).0, -flight(t).1), Crossing::Perhaps, std::iter::empty())
        };
        for (speed, highest) in [(0.3, 1e-6), (0.3, 1e-3), (5.0, 1e-9), (9.9, 1e-4)] {
            let touches = flight(speed * speed / 20.0 - highest, speed);
            assert!(may_rise(touches(0.0), touches(1.0), &clock));
            let (found, closed) = (fall(&touches).unwrap(), (speed - (20.0_f64 * highest).sqrt()) / 10.0);
            assert!((found - closed).abs() < 1e-9, "{found} {closed}");
            assert_eq!(fall(&flight(speed * speed / 20.0 + highest, speed)), None);
        }
        let far = flight(6.0, 5.0);
        assert!(!may_rise(far(0.0), far(1.0), &clock));
    }
}
