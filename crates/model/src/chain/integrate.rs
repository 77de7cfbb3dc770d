//! The adaptive run: steps under error control, restarted where a contact changes its mode or the drive is not smooth.

use super::{
    InitialState,
    crossing::Resolution,
    dormand_prince::{Clock, Flow, SmoothInterval, Stepper},
    effects::place,
    equation::{Equation, Instant, Mode},
    forecast::Forecast,
    pace::Pace,
    record::Grid,
    system::System,
};
use crate::{
    ModelError, Progress,
    contact_law::{Dashpot, ElasticLaw, Terms},
    response::{EnergyBalance, EnergySums, SolverWork},
    scene::{DampingTerm, PistonMotion},
};

impl<const DAMPED: Terms, L: ElasticLaw> Flow for Equation<'_, DAMPED, L> {
    #[inline(always)]
    fn evaluate(&mut self, weight: f64, piston: (f64, f64), state: &mut [f64], derivative: &mut [f64]) {
        Equation::evaluate(self, weight, piston, state, derivative);
    }
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Control {
    /// Relative tolerance of a step, 1.
    pub tolerance: f64,
    /// Velocity (m/s) the tolerance refers to.
    pub velocity_scale: f64,
    /// End of the run, s.
    pub end: f64,
    pub most_steps: f64,
}

const STEPS_A_REPORT: u64 = 256;
/// Changes of mode at one instant after which the run is given up, beside two of every contact: in a long chain many may part at once.
const CHANGES_AT_ONCE: usize = 64;
/// Longest second step after a closing, over the first, both in √(t − t*).
const SECOND_AFTER_CLOSING: f64 = 0.72;

pub(super) fn integrate<const DAMPED: Terms, L: ElasticLaw>(
    system: &System,
    support: L,
    motion: &dyn PistonMotion,
    initial: &InitialState,
    control: &Control,
    grid: &mut Grid,
    progress: Progress<'_>,
) -> Result<(EnergyBalance, SolverWork), ModelError> {
    Run::<DAMPED, L>::new(system, support, motion, initial, control)?.run_to_end(grid, progress)
}

struct Run<'a, const DAMPED: Terms, L> {
    system: &'a System,
    equation: Equation<'a, DAMPED, L>,
    stepper: Stepper,
    motion: &'a dyn PistonMotion,
    control: Control,
    resolution: Resolution,
    time: f64,
    smooth: SmoothInterval,
    /// Energy of contacts lost when they were clipped (their dashpots take up what they still store), J.
    clipped: f64,
    balance: EnergySums,
    work: SolverWork,
    forecast: Forecast,
    /// Length of steps away from events, s.
    cruise: f64,
    /// Length of the first step after a closing, s.
    after_closing: f64,
    /// Length of the last step before an opening without dashpot, s.
    before_opening: f64,
    /// How much farther than to the opening such a step is aimed, over its length: so that it lies within the step, and the error does not mind.
    overshoot: f64,
}

impl<'a, const DAMPED: Terms, L: ElasticLaw> Run<'a, DAMPED, L> {
    fn new(
        system: &'a System,
        support: L,
        motion: &'a dyn PistonMotion,
        initial: &InitialState,
        control: &Control,
    ) -> Result<Self, ModelError> {
        let equation = Equation::new(system, support);
        let mut stepper = Stepper::new(equation.state_length());
        let (padded, beads) = (system.padded, system.beads);
        let (displacement, velocity) = system.initial_blocks(initial)?;
        stepper.state.as_flattened_mut()[..padded].copy_from_slice(&displacement);
        stepper.state.as_flattened_mut()[padded..2 * padded].copy_from_slice(&velocity);

        let velocity_scale = control.velocity_scale;
        let displacement_scale = velocity_scale * system.natural_time;
        // A tolerance cannot ask for more than rounding of forces and displacements gives.
        let lightest = system.mass[1..=beads].iter().copied().fold(f64::INFINITY, f64::min);
        let force_scale = lightest * velocity_scale / system.natural_time;
        let pressed = system.laws.iter().zip(&system.static_force);
        let static_overlap = pressed.map(|(law, force)| law.overlap(*force)).fold(0.0, f64::max);
        let static_force = system.static_force.iter().copied().fold(0.0, f64::max);
        let rounding = 8.0 * f64::EPSILON;
        let velocity_floor = rounding * static_force * system.natural_time / lightest;
        let displacement_floor = rounding * static_overlap;
        let scales = stepper.inverse_scale.as_flattened_mut();
        scales[1..=beads].fill(1.0 / (control.tolerance * displacement_scale).max(displacement_floor));
        scales[padded + 1..=padded + beads].fill(1.0 / (control.tolerance * velocity_scale).max(velocity_floor));

        if L::HAS_EFFECTS {
            let tail = 2 * padded;
            scales[tail + place::HORN[0]] = scales[1];
            scales[tail + place::HORN[1]] = scales[padded + 1];
            scales[tail + place::RELAXING] = 1.0 / (control.tolerance * force_scale);
            // Beads that stick, and soft ones that yield, take up work without a motion that would hold the steps.
            scales[tail] = 1.0 / (control.tolerance * lightest * velocity_scale * velocity_scale);
        }
        if L::IS_COUPLED && (DAMPED != 0) {
            // A clipped dashpot takes up an elastic force that moves no bead: only the books see where it ends.
            scales[2 * padded + 1] = 1.0 / (control.tolerance * lightest * velocity_scale * velocity_scale);
        }

        let pull = 1e-12 * force_scale;
        let powers = system.dashpots.iter().filter_map(Dashpot::leading).map(DampingTerm::power);
        let pull = pull / displacement_scale.powf(powers.min_by(f64::total_cmp).unwrap_or(0.0));
        let resolution = Resolution {
            overlap: 1e-12 * displacement_scale,
            pull,
            velocity: 1e-12 * velocity_scale,
            force: 1e-12 * force_scale,
        };
        let energy = (system.kinetic_energy(&velocity), equation.stored_energy(&displacement));
        Ok(Self {
            system,
            equation,
            stepper,
            motion,
            control: *control,
            resolution,
            time: 0.0,
            smooth: SmoothInterval { from: 0.0, to: control.end },
            clipped: 0.0,
            balance: EnergySums::starting(energy, None),
            work: SolverWork { unknowns: 2 * beads as u64, ..SolverWork::default() },
            forecast: Forecast::new(control.end, control.most_steps),
            cruise: 0.02 * system.natural_time,
            after_closing: 0.02 * system.natural_time,
            before_opening: 0.1 * system.natural_time,
            overshoot: (0.6 * control.tolerance.powf(0.4)).clamp(1e-8, 3e-3),
        })
    }

    /// The piston now, on the side of a break that lies ahead.
    fn piston(&self) -> (f64, f64) {
        self.motion.at(self.time.clamp(self.smooth.from, self.smooth.to))
    }

    /// Put the piston into its slots, moved by what a horn gives way; its free motion.
    fn place_piston(&mut self) -> (f64, f64) {
        let piston = self.piston();
        let state = self.stepper.state.as_flattened_mut();
        (state[0], state[self.system.padded]) = piston;
        self.equation.add_horn_motion(state);
        piston
    }

    /// δ (m) and δ̇ (m/s) that a switch follows, now; of coupled contacts as last surveyed.
    fn overlap_and_rate(&self, switch: usize) -> (f64, f64) {
        self.equation.overlap_and_rate(Instant::Start, switch, self.stepper.state.as_flattened())
    }

    #[inline(always)]
    fn survey(&mut self) {
        if L::IS_COUPLED || L::HAS_EFFECTS {
            self.place_piston();
            self.equation.survey(Instant::Start, self.stepper.state.as_flattened());
        }
    }

    /// Put a switch into a mode and keep the energy balance of clipped contacts (coupled ones pass theirs to their dashpots as time goes).
    fn switch(&mut self, contact: usize, mode: Mode) {
        if L::IS_COUPLED {
            return self.equation.set_mode(contact, mode);
        }
        let before = self.equation.modes[contact];
        let energy = || self.equation.laws[contact].energy(self.overlap_and_rate(contact).0);
        if mode == Mode::Clipped && before != Mode::Clipped {
            self.clipped += energy();
        } else if before == Mode::Clipped && mode == Mode::Pressed {
            self.clipped -= energy();
        }
        self.equation.set_mode(contact, mode);
    }

    /// Evaluate the derivative here, after putting every contact in the mode it belongs in.
    fn restart(&mut self) {
        let piston = self.place_piston();
        self.equation.survey(Instant::Start, self.stepper.state.as_flattened());
        for switch in 0..self.equation.modes.len() {
            let mode = self.equation.settled_mode(switch, self.overlap_and_rate(switch), &self.resolution);
            if mode != self.equation.modes[switch] {
                self.switch(switch, mode);
            }
        }
        self.equation.release_beads(self.stepper.state.as_flattened(), &self.resolution);
        self.stepper.restart(&mut self.equation, piston);
    }

    fn run_to_end(
        mut self,
        grid: &mut Grid,
        progress: Progress<'_>,
    ) -> Result<(EnergyBalance, SolverWork), ModelError> {
        let end = self.control.end;
        let motion = self.motion;
        let breaks = motion.breaks().iter().copied().filter(|t| *t > 0.0 && *t < end);
        let mut first = true;
        let mut pace = Pace::Plain { step: self.cruise };
        for stop in breaks.chain(std::iter::once(end)) {
            if stop <= self.time {
                continue;
            }
            // Never ask a motion for the instant of its break, where it may have either value.
            let inside = 1e-15 * stop;
            self.smooth = SmoothInterval { from: (self.time + inside).max(f64::MIN_POSITIVE), to: stop - inside };
            self.restart();
            if first {
                grid.begin(&mut self.equation, self.stepper.state.as_flattened());
                first = false;
                if self.system.static_force[0] == 0.0 {
                    pace = Pace::SinceClosing { closing: self.time, root: 0.0, step: self.after_closing.sqrt() };
                }
            }
            pace = granchain_signal::vectors::of_four(ToStop { run: &mut self, stop, pace, grid, progress })?;
        }
        Ok(self.settle())
    }

    /// Run up to `stop`, the drive being smooth until then; the pace to go on with.
    #[inline(always)]
    fn run_to_stop(
        &mut self,
        stop: f64,
        mut pace: Pace,
        grid: &mut Grid,
        progress: Progress<'_>,
    ) -> Result<Pace, ModelError> {
        let mut rejected = false;
        let mut changes_here = 0;
        let most_changes = CHANGES_AT_ONCE + 2 * self.equation.modes.len();
        loop {
            if !rejected {
                self.survey();
                pace = self.look_ahead(self.watching_piston(pace), stop);
            }
            let (clock, last) = pace.clock(self.time, stop);
            let length = clock.length();
            if !(length > 2.0 * f64::EPSILON * self.time && length > f64::MIN_POSITIVE) || changes_here > most_changes {
                if last && changes_here <= most_changes {
                    self.time = stop;
                    return Ok(Pace::Plain { step: self.cruise });
                }
                return Err(self.failure(length));
            }
            let error = self.stepper.attempt(&mut self.equation, self.motion, &clock, &self.smooth);
            if let Some(refined) = self.refine(pace, error) {
                pace = refined;
                rejected = true;
                self.work.rejected_steps += 1;
                continue;
            }
            if error.is_nan() || error > 1.0 {
                let factor = if error.is_nan() { 0.1 } else { (0.9 / error.sqrt().sqrt().sqrt()).max(0.2) };
                if let Pace::ToOpening { step, .. } = pace {
                    self.before_opening = factor * factor * step;
                }
                pace = self.opening_within(pace, stop).unwrap_or(pace.shortened(&clock, factor));
                rejected = true;
                self.work.rejected_steps += 1;
                continue;
            }
            self.stepper.finish(&mut self.equation, &clock);
            let step_end = if last { stop } else { clock.at(1.0) };
            let suspicious = self.equation.may_switch(&self.stepper, &clock, &self.resolution);
            let mut event = None;
            if suspicious || grid.wants(step_end) {
                self.stepper.extend(&mut self.equation, self.motion, &clock, &self.smooth);
                if suspicious {
                    event = self.equation.first_event(&self.stepper, &clock, self.motion, &self.resolution);
                }
            }
            let growth = if error == 0.0 { 6.0 } else { (0.9 / error.sqrt().sqrt().sqrt()).clamp(0.333, 6.0) };
            let growth = if rejected && !matches!(pace, Pace::ToOpening { .. }) { growth.min(1.0) } else { growth };
            self.work.steps += 1;
            rejected = false;
            if let Some(event) = event {
                self.work.events += 1;
                let now = if event.sigma >= 1.0 { step_end } else { clock.at(event.sigma) };
                changes_here = if now > self.time { 0 } else { changes_here + 1 };
                self.remember(pace, &clock, growth);
                grid.take(&mut self.equation, &self.stepper, &clock, now);
                self.stepper.truncate(event.sigma);
                self.time = now;
                pace = self.change(event.switch, event.sigma == 0.0);
                if now >= stop {
                    return Ok(pace);
                }
            } else {
                changes_here = 0;
                grid.take(&mut self.equation, &self.stepper, &clock, step_end);
                self.stepper.advance();
                self.time = step_end;
                if !last {
                    self.remember(pace, &clock, growth);
                }
                pace = self.following(pace, &clock, growth);
                self.relabel();
                if last {
                    return Ok(Pace::Plain { step: self.cruise });
                }
            }
            self.note_energy();
            if self.work.steps.is_multiple_of(STEPS_A_REPORT) && !progress(self.time) {
                return Err(ModelError::Stopped { time: self.time });
            }
            self.forecast.look(self.work.steps, self.time)?;
        }
    }

    /// Keep the lengths that the error control found right, to take them up again after an event.
    fn remember(&mut self, pace: Pace, clock: &Clock, growth: f64) {
        match pace {
            Pace::Plain { .. } => self.cruise = growth.min(2.0) * clock.length(),
            Pace::SinceClosing { root: 0.0, .. } => self.after_closing = (growth * growth).min(2.0) * clock.length(),
            Pace::SinceClosing { .. } => {}
            Pace::ToOpening { .. } => self.before_opening = (growth * growth).min(2.0) * clock.length(),
        }
    }

    fn following(&self, pace: Pace, clock: &Clock, growth: f64) -> Pace {
        match pace {
            Pace::Plain { .. } => Pace::Plain { step: growth * clock.linear },
            Pace::SinceClosing { closing, root: 0.0, .. } => {
                let step = clock.quadratic.sqrt();
                Pace::SinceClosing { closing, root: step, step: growth.min(SECOND_AFTER_CLOSING) * step }
            }
            Pace::SinceClosing { .. } => Pace::Plain { step: growth.clamp(0.5, 1.6) * clock.length() },
            Pace::ToOpening { step, .. } => Pace::Plain { step },
        }
    }

    /// Whether the end of the contact's overlap is the end of its force, in a singular way.
    fn opens_singularly(&self, switch: usize) -> bool {
        self.equation.modes[switch] == Mode::Pressed && !self.equation.may_clip(switch)
    }

    /// A piston that touches nothing enters no error: a step across one of its ways would miss that it meets its bead.
    fn watching_piston(&self, pace: Pace) -> Pace {
        match pace {
            Pace::Plain { step } if self.equation.modes[0] == Mode::Open => {
                Pace::Plain { step: step.min(self.motion.longest_step()) }
            }
            pace => pace,
        }
    }

    /// Aim the step at the first opening of a contact without dashpot, if one is expected within it.
    fn look_ahead(&self, pace: Pace, stop: f64) -> Pace {
        let (clock, _) = pace.clock(self.time, stop);
        let length = match pace {
            Pace::SinceClosing { root: 0.0, .. } => return pace,
            Pace::Plain { .. } | Pace::SinceClosing { .. } => clock.length(),
            Pace::ToOpening { .. } => return pace,
        };
        let (state, rate_of_state) = (self.stepper.state.as_flattened(), self.stepper.derivative());
        let padded = self.system.padded;
        let mut soonest = (length + self.before_opening).min(stop - self.time);
        let mut pace = pace;
        for switch in 0..self.equation.modes.len() {
            if !self.opens_singularly(switch) {
                continue;
            }
            let (overlap, rate) = self.equation.overlap_and_rate(Instant::Start, switch, state);
            if overlap <= self.resolution.overlap || overlap + 1.5 * rate * soonest > 0.0 {
                continue;
            }
            let contact = self.equation.contact(switch);
            let acceleration = rate_of_state[padded + contact] - rate_of_state[padded + contact + 1];
            // Its own force pushes it apart and fades as (1 − t/τ)^(3/2): 2/3.5 of the force at the start counts as constant.
            let own = self.equation.laws[contact].force(overlap)
                * (self.system.inverse_mass[contact] + self.system.inverse_mass[contact + 1]);
            let acceleration = acceleration + own * (1.0 - 2.0 / 3.5);
            let discriminant = rate * rate - 2.0 * acceleration * overlap;
            if discriminant < 0.0 || rate >= 0.0 {
                continue;
            }
            let remaining = 2.0 * overlap / (discriminant.sqrt() - rate);
            if remaining > 0.0 && remaining < soonest {
                soonest = remaining;
                // An estimate is less sure than a correction.
                pace = Pace::ToOpening { switch, step: remaining * (1.0 + 1.5 * self.overshoot), refinements: 0 };
            }
        }
        if matches!(pace, Pace::ToOpening { .. }) && soonest > 1.1 * self.before_opening {
            // Too long for one step: a plain one first.
            return Pace::Plain { step: (soonest - 0.95 * self.before_opening).min(length) };
        }
        pace
    }

    /// A better aim at an opening that the step attempted last missed by more than its error admits.
    fn refine(&mut self, pace: Pace, error: f64) -> Option<Pace> {
        let Pace::ToOpening { switch, step, refinements } = pace else { return None };
        let (overlap, rate) = self.end_overlap_and_rate(switch);
        if (error <= 1.0 && overlap <= 0.0) || refinements >= 4 || !(error < 20.0) {
            return None;
        }
        let correction = -overlap / rate;
        let missed = correction > 0.0 || correction.abs() > 3.0 * self.overshoot * step;
        (missed && correction.abs() < 0.4 * step).then_some(Pace::ToOpening {
            switch,
            step: (step + correction) * (1.0 + self.overshoot),
            refinements: refinements + 1,
        })
    }

    /// Aim at the first opening that the rejected step of another pace ran across.
    fn opening_within(&mut self, pace: Pace, stop: f64) -> Option<Pace> {
        if matches!(pace, Pace::ToOpening { .. } | Pace::SinceClosing { root: 0.0, .. }) {
            return None;
        }
        let length = pace.clock(self.time, stop).0.length();
        let mut first: Option<(usize, f64)> = None;
        for switch in 0..self.equation.modes.len() {
            if !self.opens_singularly(switch) {
                continue;
            }
            let (overlap, _) = self.overlap_and_rate(switch);
            let (end_overlap, end_rate) = self.end_overlap_and_rate(switch);
            if overlap > self.resolution.overlap && end_overlap < 0.0 && end_rate < 0.0 {
                // Free flight near the opening.
                let step = length - end_overlap / end_rate;
                if step > 0.02 * length && first.is_none_or(|(_, soonest)| step < soonest) {
                    first = Some((switch, step));
                }
            }
        }
        first.map(|(switch, step)| Pace::ToOpening { switch, step, refinements: 0 })
    }

    /// δ (m) and δ̇ (m/s) at the end of the step attempted last.
    fn end_overlap_and_rate(&mut self, switch: usize) -> (f64, f64) {
        let padded = self.system.padded;
        let piston = self.stepper.end_piston();
        let state = self.stepper.end_state.as_flattened_mut();
        (state[0], state[padded]) = piston;
        self.equation.add_horn_motion(state);
        self.equation.survey(Instant::End, state);
        self.equation.overlap_and_rate(Instant::End, switch, state)
    }

    /// Change the mode of a switch at a located event; the pace to go on with.
    fn change(&mut self, switch: usize, at_once: bool) -> Pace {
        if let Some(turn) = switch.checked_sub(self.equation.modes.len()) {
            self.place_piston();
            self.equation.turn(turn, at_once, self.stepper.state.as_flattened_mut(), &self.resolution);
            self.restart();
            return Pace::Plain { step: self.cruise };
        }
        let closing = self.equation.modes[switch] == Mode::Open;
        let mode = match self.equation.modes[switch] {
            Mode::Open | Mode::Clipped => Mode::Pressed,
            Mode::Pressed if self.equation.may_clip(switch) => Mode::Clipped,
            Mode::Pressed => Mode::Open,
        };
        self.switch(switch, mode);
        self.restart();
        if closing {
            Pace::SinceClosing { closing: self.time, root: 0.0, step: self.after_closing.sqrt() }
        } else {
            Pace::Plain { step: self.cruise }
        }
    }

    /// Clipped contacts that have separated meanwhile are open: same force, other next event.
    fn relabel(&mut self) {
        if DAMPED == 0 {
            return;
        }
        self.survey();
        for switch in 0..self.equation.modes.len() {
            if self.equation.modes[switch] == Mode::Clipped && self.overlap_and_rate(switch).0 <= 0.0 {
                self.switch(switch, Mode::Open);
            }
        }
    }

    /// Enter the works done so far, which are entries of the state.
    fn note_energy(&mut self) {
        let state = self.stepper.state.as_flattened();
        let [piston_work, dissipated] = [0, 1].map(|entry| state[2 * self.system.padded + entry]);
        self.balance.piston_work = piston_work;
        self.balance.dissipated = dissipated + self.clipped;
        self.balance.channels = self.equation.channels(state);
        self.balance.note();
    }

    fn settle(mut self) -> (EnergyBalance, SolverWork) {
        self.note_energy();
        self.work.evaluations = self.stepper.evaluations;
        self.work.dashpot_evaluations = self.work.evaluations * self.system.damped_contacts();
        let (padded, beads) = (self.system.padded, self.system.beads);
        let still_stored: f64 = (0..=beads)
            .filter(|contact| !L::IS_COUPLED && self.equation.modes[*contact] == Mode::Clipped)
            .map(|contact| self.equation.laws[contact].energy(self.overlap_and_rate(contact).0))
            .sum();
        self.balance.dissipated -= still_stored;
        let piston = self.motion.at(self.smooth.to);
        let state = self.stepper.state.as_flattened_mut();
        (state[0], state[padded]) = piston;
        self.equation.add_horn_motion(state);
        let state = self.stepper.state.as_flattened();
        self.balance.channels = self.equation.channels(state);
        let kinetic = self.system.kinetic_energy(&state[padded..2 * padded]);
        self.balance.hold((kinetic, self.equation.stored_energy(&state[..padded])));
        let SolverWork { unknowns, steps, rejected_steps, evaluations, events, dashpot_evaluations, .. } = self.work;
        let further = self.equation.counts();
        let work = SolverWork { unknowns, steps, rejected_steps, evaluations, events, dashpot_evaluations, ..further };
        (self.balance.balance(), work)
    }

    fn failure(&self, step: f64) -> ModelError {
        let padded = self.system.padded;
        let entry = self.stepper.worst_entry();
        let broken = self.stepper.end_state.as_flattened()[..2 * padded].iter().position(|value| !value.is_finite());
        match broken {
            Some(entry) => ModelError::NonFinite { time: self.time, step, bead: (entry % padded).max(1) },
            None => ModelError::StepUnderflow {
                time: self.time,
                step,
                contact: if entry < 2 * padded { (entry % padded).clamp(1, self.system.beads + 1) } else { 1 },
                tolerance: self.control.tolerance,
            },
        }
    }
}

/// [`Run::run_to_stop`], compiled for the widest vectors this machine has. No operation is fused, so the result does not depend on them.
struct ToStop<'r, 'a, const DAMPED: Terms, L> {
    run: &'r mut Run<'a, DAMPED, L>,
    stop: f64,
    pace: Pace,
    grid: &'r mut Grid,
    progress: &'r mut dyn FnMut(f64) -> bool,
}

impl<const DAMPED: Terms, L: ElasticLaw> pulp::NullaryFnOnce for ToStop<'_, '_, DAMPED, L> {
    type Output = Result<Pace, ModelError>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        self.run.run_to_stop(self.stop, self.pace, self.grid, self.progress)
    }
}
