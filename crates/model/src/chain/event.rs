//! Where contacts close, open and stop being pulled, located on the continuous extension.

use super::{
    beyond::place,
    dormand_prince::{Clock, Course, Stepper},
    equation::{Equation, Instant, Mode},
};
use crate::{
    contact_law::{ElasticLaw, Terms},
    scene::PistonMotion,
};

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

impl<const DAMPED: Terms, L: ElasticLaw> Equation<'_, DAMPED, L> {
    /// The mode a switch belongs in at δ, δ̇ at the start of a step, coming from its present one.
    pub(crate) fn settled_mode(&self, switch: usize, (overlap, rate): (f64, f64), resolution: &Resolution) -> Mode {
        if self.is_idle(switch) {
            return Mode::Open;
        }
        let may_clip = self.may_clip(switch);
        let pull = || self.pull(Instant::Start, switch, (overlap, rate));
        if overlap < -resolution.overlap {
            return Mode::Open;
        }
        if overlap <= resolution.overlap && !(may_clip && self.modes[switch] == Mode::Clipped) {
            if self.is_coupled_force(switch) {
                // A contact at rest that its neighbour's force is about to draw open shows no rate yet: it stays what the event made it.
                return self.modes[switch];
            }
            // Touching: pressed as long as it was, or as it is not parting.
            return match self.modes[switch] {
                // What relaxes lags behind a bead that comes again.
                Mode::Pressed if may_clip && pull() < -resolution.pull && rate > 0.0 => Mode::Clipped,
                Mode::Pressed if may_clip && pull() < -resolution.pull => Mode::Open,
                Mode::Pressed => Mode::Pressed,
                _ if rate < 0.0 => Mode::Open,
                _ => Mode::Pressed,
            };
        }
        match self.modes[switch] {
            Mode::Pressed if may_clip && pull() < -resolution.pull => Mode::Clipped,
            Mode::Pressed => Mode::Pressed,
            _ if may_clip && pull() <= resolution.pull => Mode::Clipped,
            _ => Mode::Pressed,
        }
    }

    /// Whether a switch that was at (δ₀, δ̇₀) has to change its mode within a step that ends at (δ₁, δ̇₁): surely, perhaps (look
    /// inside), or not.
    #[inline(always)]
    fn crossing(
        &self,
        switch: usize,
        start: (f64, f64),
        end: (f64, f64),
        clock: &Clock,
        resolution: &Resolution,
    ) -> Crossing {
        if self.is_idle(switch) {
            return Crossing::None;
        }
        match self.modes[switch] {
            Mode::Pressed if self.may_clip(switch) => {
                if self.pull(Instant::End, switch, end) < -resolution.pull {
                    Crossing::Sure
                } else {
                    Crossing::None
                }
            }
            Mode::Pressed => {
                if end.0 < -resolution.overlap {
                    Crossing::Sure
                } else if may_rise((-start.0, -start.1), (-end.0, -end.1), clock) {
                    Crossing::Perhaps
                } else {
                    Crossing::None
                }
            }
            Mode::Open => {
                if end.0 > resolution.overlap {
                    Crossing::Sure
                } else if may_rise(start, end, clock) {
                    Crossing::Perhaps
                } else {
                    Crossing::None
                }
            }
            Mode::Clipped => {
                let repressed = end.0 > 0.0 && self.pull(Instant::End, switch, end) > resolution.pull;
                if repressed { Crossing::Sure } else { Crossing::None }
            }
        }
    }

    #[inline(always)]
    pub(crate) fn may_switch(&mut self, stepper: &Stepper, clock: &Clock, resolution: &Resolution) -> bool {
        let (start, end) = (stepper.state.as_flattened(), stepper.end_state.as_flattened());
        self.survey(Instant::End, end);
        (0..self.modes.len()).any(|switch| {
            let start = self.overlap_and_rate(Instant::Start, switch, start);
            let end = self.overlap_and_rate(Instant::End, switch, end);
            self.crossing(switch, start, end, clock, resolution) != Crossing::None
        }) || L::IS_BEYOND && self.may_turn(stepper, clock, resolution)
    }

    pub(crate) fn first_event(
        &mut self,
        stepper: &Stepper,
        clock: &Clock,
        motion: &dyn PistonMotion,
        resolution: &Resolution,
    ) -> Option<Event> {
        let mut first: Option<Event> = None;
        for switch in 0..self.modes.len() {
            let start = self.overlap_and_rate(Instant::Start, switch, stepper.state.as_flattened());
            let end = self.overlap_and_rate(Instant::End, switch, stepper.end_state.as_flattened());
            let crossing = self.crossing(switch, start, end, clock, resolution);
            if crossing == Crossing::None {
                continue;
            }
            let courses = self.courses(switch, stepper);
            // Positive while the mode holds, and its rate.
            let margin = |sigma: f64| {
                let (overlap, rate) = self.overlap_and_rate_within(switch, &courses, stepper, clock, motion, sigma);
                match self.modes[switch] {
                    Mode::Pressed if self.may_clip(switch) => {
                        (self.pull(Instant::Within, switch, (overlap, rate)), 0.0)
                    }
                    Mode::Pressed => (overlap, rate),
                    Mode::Open => (-overlap, -rate),
                    Mode::Clipped if overlap > 0.0 => (-self.pull(Instant::Within, switch, (overlap, rate)), 0.0),
                    Mode::Clipped => (f64::MIN_POSITIVE, 0.0),
                }
            };
            const PARTS: u32 = 8;
            if let Some(sigma) =
                first_fall(margin, crossing, (0..=PARTS).map(|part| f64::from(part) / f64::from(PARTS)))
                && first.is_none_or(|event| sigma < event.sigma)
            {
                first = Some(Event { switch, sigma });
            }
        }
        if L::IS_BEYOND { self.first_turn(stepper, clock, motion, resolution, first) } else { first }
    }

    /// δ (m) and δ̇ (m/s) of a switch over the extended step, without a piston's own motion, and what relaxes (N); of coupled contacts none is used.
    #[inline]
    fn courses(&self, switch: usize, stepper: &Stepper) -> [Course; 3] {
        let (padded, tail) = (self.system.padded, 2 * self.system.padded);
        let (contact, still) = (self.contact(switch), Course([0.0; 8]));
        let [mut overlap, rate] = [0, 1].map(|block| {
            let before = match contact {
                0 if L::IS_BEYOND => stepper.course(tail + place::HORN[block]),
                0 => still,
                _ => stepper.course(block * padded + contact),
            };
            let at_wall = contact == self.system.beads;
            before.above(if at_wall { still } else { stepper.course(block * padded + contact + 1) })
        });
        overlap.0[0] += self.offset[contact];
        let relaxing = if self.relaxes(switch) { stepper.course(tail + place::RELAXING) } else { still };
        [overlap, rate, relaxing]
    }

    /// δ (m) and δ̇ (m/s) that a switch follows, within the extended step.
    #[inline(always)]
    fn overlap_and_rate_within(
        &mut self,
        switch: usize,
        [overlap, rate, relaxing]: &[Course; 3],
        stepper: &Stepper,
        clock: &Clock,
        motion: &dyn PistonMotion,
        sigma: f64,
    ) -> (f64, f64) {
        let padded = self.system.padded;
        if let Some(coupled) = &mut self.coupled {
            // Every contact takes part in the overlap of every other.
            let mut within = std::mem::take(&mut coupled.within);
            stepper.values(sigma, &mut within);
            let state = within.as_flattened_mut();
            (state[0], state[padded]) = motion.at(clock.at(sigma));
            self.give_way(state);
            self.survey(Instant::Within, state);
            let found = self.overlap_and_rate(Instant::Within, switch, state);
            if let Some(coupled) = &mut self.coupled {
                coupled.within = within;
            }
            return found;
        }
        if self.relaxes(switch) {
            self.relax_within(relaxing.at(sigma));
        }
        let (free, speed) = if switch == 0 { motion.at(clock.at(sigma)) } else { (0.0, 0.0) };
        (overlap.at(sigma) + free, rate.at(sigma) + speed)
    }
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
    // It never held: it has to change at once.
    if held { found } else { Some(0.0) }
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
