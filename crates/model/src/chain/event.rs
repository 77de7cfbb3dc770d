//! Where contacts close, open and stop being pulled, located on the continuous extension.

use super::{
    crossing::{Crossing, Event, Resolution, first_fall, may_rise},
    dormand_prince::{Clock, Course, Stepper},
    effects::place,
    equation::{Equation, Instant, Mode},
};
use crate::{
    contact_law::{ElasticLaw, Terms},
    scene::PistonMotion,
};

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
        }) || L::HAS_EFFECTS && self.may_turn(stepper, clock, resolution)
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
        if L::HAS_EFFECTS { self.first_turn(stepper, clock, motion, resolution, first) } else { first }
    }

    /// δ (m) and δ̇ (m/s) of a switch over the extended step, without a piston's own motion, and what relaxes (N); of coupled contacts none is used.
    #[inline]
    fn courses(&self, switch: usize, stepper: &Stepper) -> [Course; 3] {
        let (padded, tail) = (self.system.padded, 2 * self.system.padded);
        let (contact, still) = (self.contact(switch), Course([0.0; 8]));
        let [mut overlap, rate] = [0, 1].map(|block| {
            let before = match contact {
                0 if L::HAS_EFFECTS => stepper.course(tail + place::HORN[block]),
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
            self.add_horn_motion(state);
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
