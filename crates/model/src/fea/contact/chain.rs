//! All contacts of a chain in one step: complementarity at every point, dashpots on the beads' rigid motion, coupled through the bodies.
//!
//! Contact c = 0…N lies between body c and body c + 1 in the row piston, bead 1 … bead N, support. Its gaps after the step are
//!
//! ```text
//! g_c = q_c + W_c λ_c + V_c λ_{c−1} + V_{c+1}ᵀ λ_{c+1} − a_c⁻ s_c − a_c⁺ s_{c+1}
//! ```
//!
//! with the predicted gaps q (no force at the end of the step), the compliance W of the contact itself, V across the body between two
//! contacts, and the shifts s of the bodies by the dashpots' forces; a is the axial part of the normals. Blocks are solved in turn, each
//! exactly; a step is short against the time a push needs to reach the next contact, so that three or four sweeps do.
//!
//! Dashpots follow the beads' rigid motion: they act while its overlap δ > 0, with (c + γ√δ) δ̇, and unless tension is allowed never more
//! than the contact's own force.

use super::complementarity::{Compliance, NotSolved, Scratch};
use crate::contact_law::Dashpot;

#[derive(Debug, Clone)]
pub(crate) struct Link {
    /// W of this contact, shared by contacts of the same kind through `compliances`.
    pub compliance: usize,
    /// V across the body on the piston's side, to the contact before: index into `couplings`; none where that body is rigid.
    pub coupling: Option<usize>,
    /// Axial part of the outward normal of the body on the piston's side at every point, 1.
    pub axial_before: Vec<f64>,
    /// The same of the body on the support's side; ≤ 0.
    pub axial_after: Vec<f64>,
    pub dashpot: Dashpot,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Mobility {
    /// Displacement at the end of the step, m/N; 0 for a rigid or clamped body.
    pub displacement: f64,
    /// Velocity at the end of the step, m/(N·s); 0 for a rigid or clamped body.
    pub velocity: f64,
}

#[derive(Debug, Clone)]
pub(crate) struct Contacts {
    pub links: Vec<Link>,
    pub compliances: Vec<Compliance>,
    /// The different V, row by row: points of the later contact × points of the earlier.
    pub couplings: Vec<Vec<f64>>,
    /// Of piston, beads, support: N + 2; the piston's is that of a compliant horn, whose displacement a force feels a step later.
    pub mobilities: Vec<Mobility>,
    /// What the last dashpot stands on, if it moves without being a body of the chain.
    pub dashpot_base: DashpotBase,
    pub tension: bool,
}

/// What the last dashpot stands on, such as a disc on water in its lowest modes; its prediction is that of slot N + 1.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct DashpotBase {
    /// How a unit force on it moves every point of the last contact away over a step, and a unit force there moves it, m/N; empty for a support
    /// that does not move.
    pub coupling: Vec<f64>,
    /// What a unit force on it adds to its own displacement (m/N) and velocity (m/s/N) at the end of a step.
    pub mobility: [f64; 2],
}

impl DashpotBase {
    fn as_mobility(&self) -> Mobility {
        let [displacement, velocity] = self.mobility;
        Mobility { displacement, velocity }
    }

    /// Displacement (m) and velocity (m/s) under the forces of the points (N) at the end of a step of that length; the dashpot's left out.
    fn under(&self, free: &RigidPrediction, forces: &[f64]) -> RigidPrediction {
        let moved: f64 = self.coupling.iter().zip(forces).map(|(c, force)| c * force).sum();
        // A force straight over a step: the velocity is 2/Δ of the displacement.
        let rate = if self.mobility[0] > 0.0 { self.mobility[1] / self.mobility[0] } else { 0.0 };
        RigidPrediction { displacement: free.displacement + moved, velocity: free.velocity + rate * moved }
    }
}

/// Rigid motion of every body predicted without forces at the end of the step; for the piston its prescribed one.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct RigidPrediction {
    pub displacement: f64,
    pub velocity: f64,
}

#[derive(Debug, Clone, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct ContactState {
    /// λ at every point, N, ≥ 0.
    pub forces: Vec<f64>,
    /// g at every point, m, ≥ 0.
    pub gaps: Vec<f64>,
    /// Axial force of the points, N, ≥ 0.
    pub pressing: f64,
    /// Force of the dashpot, N; negative while it holds parting bodies.
    pub damping: f64,
}

impl ContactState {
    pub(crate) fn open(points: usize) -> Self {
        Self { forces: vec![0.0; points], gaps: vec![0.0; points], pressing: 0.0, damping: 0.0 }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.forces.copy_from_slice(&other.forces);
        self.gaps.copy_from_slice(&other.gaps);
        (self.pressing, self.damping) = (other.pressing, other.damping);
    }

    pub fn total(&self) -> f64 {
        self.pressing + self.damping
    }
}

/// Net axial force on the body in a slot, positive along z.
pub(crate) fn net_force(contacts: &[ContactState], slot: usize, force: impl Fn(&ContactState) -> f64) -> f64 {
    let before = slot.checked_sub(1).map_or(0.0, |contact| force(&contacts[contact]));
    before - contacts.get(slot).map_or(0.0, force)
}

#[derive(Debug, Clone)]
pub(crate) struct Workspace {
    scratch: Vec<Scratch>,
    gaps: Vec<f64>,
    before: Vec<f64>,
    /// c + γ √δ of every contact, N·s/m; 0 while its dashpot is off.
    damping: Vec<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct Effort {
    pub sweeps: u32,
    pub sets: u32,
    pub dashpots: u32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Failure {
    /// No active set of this contact (0 = piston) satisfies all conditions.
    NoActiveSet {
        contact: usize,
        iterations: u32,
    },
    NotSettled {
        contact: usize,
        change: f64,
        sweeps: u32,
    },
}

const MOST_SWEEPS: u32 = 400;
/// Sweeps after which the dashpots' coefficients stay as they are, should a contact at the very edge of closing flicker.
const FREEZING_SWEEPS: u32 = 40;
/// Largest change of a force in the last sweep over the largest force: a few roundings.
const SETTLED: f64 = 1e-13;

impl Workspace {
    pub(crate) fn new(contacts: &Contacts) -> Self {
        let points = contacts.compliances.iter().map(Compliance::size).max().unwrap_or(0);
        Self {
            scratch: contacts.links.iter().map(|_| Scratch::new(points)).collect(),
            gaps: vec![0.0; points],
            before: vec![0.0; contacts.links.len()],
            damping: vec![0.0; contacts.links.len()],
        }
    }
}

impl Contacts {
    /// Solve one step. `predicted` holds q of every contact, `rigid` the prediction of the N + 2 rigid motions, `overlap` the rigid
    /// overlap of every contact with all displacements zero (m). `states` holds the last step's forces on entry and this step's on return.
    pub(crate) fn solve(
        &self,
        predicted: &[Vec<f64>],
        rigid: &[RigidPrediction],
        overlap: &[f64],
        states: &mut [ContactState],
        work: &mut Workspace,
    ) -> Result<Effort, Failure> {
        let mut effort = Effort::default();
        let mut last_change = f64::INFINITY;
        loop {
            effort.sweeps += 1;
            let (mut worst, mut change, mut largest) = (0, 0.0, 0.0);
            for c in 0..self.links.len() {
                work.before[c] = states[c].total();
                effort.sets += self.press(c, &predicted[c], states, work)?;
                effort.dashpots += self.damp(c, rigid, overlap[c], states, work, effort.sweeps > FREEZING_SWEEPS);
                let moved = (states[c].total() - work.before[c]).abs();
                largest = f64::max(largest, states[c].total().abs().max(states[c].pressing));
                if effort.sweeps > FREEZING_SWEEPS {
                    // A dashpot rounds with the velocities that it takes from each other.
                    largest = largest.max(work.damping[c] * rigid[c].velocity.abs().max(rigid[c + 1].velocity.abs()));
                }
                if !(moved <= change) {
                    (worst, change) = (c, moved);
                }
            }
            // Sweeps that change the forces by a factor q less each time leave q/(1 − q) of the last change to come.
            let ratio = change / last_change;
            let to_come = if ratio < 1.0 { change * f64::max(1.0, ratio / (1.0 - ratio)) } else { change };
            if to_come <= SETTLED * largest {
                return Ok(effort);
            }
            last_change = change;
            if effort.sweeps >= MOST_SWEEPS || !change.is_finite() {
                return Err(Failure::NotSettled { contact: worst, change, sweeps: effort.sweeps });
            }
        }
    }

    /// Forces of the points of contact c, all other forces given; returns the number of sets tried.
    fn press(
        &self,
        c: usize,
        predicted: &[f64],
        states: &mut [ContactState],
        work: &mut Workspace,
    ) -> Result<u32, Failure> {
        let link = &self.links[c];
        let compliance = &self.compliances[link.compliance];
        let n = compliance.size();
        let gaps = &mut work.gaps[..n];
        gaps.copy_from_slice(predicted);
        if let Some(coupling) = link.coupling {
            let (matrix, earlier) = (&self.couplings[coupling], &states[c - 1].forces);
            let m = earlier.len();
            // The active points come first in most contacts, but not on an annulus: skip what carries nothing.
            for (j, &force) in earlier.iter().enumerate().filter(|(_, force)| **force > 0.0) {
                for (i, gap) in gaps.iter_mut().enumerate() {
                    *gap += matrix[i * m + j] * force;
                }
            }
        }
        if let Some(coupling) = self.links.get(c + 1).and_then(|next| next.coupling) {
            let (matrix, later) = (&self.couplings[coupling], &states[c + 1].forces);
            for (j, &force) in later.iter().enumerate().filter(|(_, force)| **force > 0.0) {
                for (gap, v) in gaps.iter_mut().zip(&matrix[j * n..(j + 1) * n]) {
                    *gap += v * force;
                }
            }
        }
        let (before, after) = (self.damping_shift(c, states), self.damping_shift(c + 1, states));
        if before != 0.0 || after != 0.0 {
            for ((gap, a), b) in gaps.iter_mut().zip(&link.axial_before).zip(&link.axial_after) {
                *gap -= a * before + b * after;
            }
        }
        if c + 1 == self.links.len() {
            let damping = states[c].damping;
            gaps.iter_mut().zip(&self.dashpot_base.coupling).for_each(|(gap, share)| *gap += share * damping);
        }
        let ContactState { forces, gaps: final_gaps, pressing, .. } = &mut states[c];
        let solved = compliance
            .solve(gaps, forces, final_gaps, &mut work.scratch[c])
            .map_err(|NotSolved { iterations }| Failure::NoActiveSet { contact: c, iterations })?;
        *pressing = forces.iter().zip(&link.axial_before).map(|(force, axial)| force * axial).sum();
        Ok(solved.iterations)
    }

    /// Displacement of body b by the dashpots on both its sides, m.
    pub(crate) fn damping_shift(&self, body: usize, states: &[ContactState]) -> f64 {
        let mobility = self.mobilities[body].displacement;
        if mobility == 0.0 {
            return 0.0;
        }
        mobility * (states[body - 1].damping - states[body].damping)
    }

    /// Force of the dashpot of contact c, all other forces given; returns how many dashpots there are.
    fn damp(
        &self,
        c: usize,
        rigid: &[RigidPrediction],
        overlap: f64,
        states: &mut [ContactState],
        work: &mut Workspace,
        frozen: bool,
    ) -> u32 {
        let dashpot = self.links[c].dashpot;
        if dashpot.is_absent() {
            return 0;
        }
        // Overlap and rate without this dashpot's own force: it must not switch itself.
        let own = states[c].damping;
        let on_base = c + 1 == self.links.len() && !self.dashpot_base.coupling.is_empty();
        let (before, after) =
            (self.mobilities[c], if on_base { self.dashpot_base.as_mobility() } else { self.mobilities[c + 1] });
        // Of both sides, with all forces.
        let motion = |free: RigidPrediction, mobility: Mobility, net: f64| RigidPrediction {
            displacement: free.displacement + mobility.displacement * net,
            velocity: free.velocity + mobility.velocity * net,
        };
        let near = motion(rigid[c], before, self.net(c, states));
        let far = if on_base {
            motion(self.dashpot_base.under(&rigid[c + 1], &states[c].forces), after, own)
        } else {
            motion(rigid[c + 1], after, self.net(c + 1, states))
        };
        if !frozen {
            let pressed =
                overlap + near.displacement - far.displacement + (before.displacement + after.displacement) * own;
            work.damping[c] = dashpot.force(pressed, 1.0);
        }
        let mobility = before.velocity + after.velocity;
        let rate = near.velocity - far.velocity + mobility * own;
        let coefficient = work.damping[c];
        let force = coefficient * rate / (1.0 + coefficient * mobility);
        states[c].damping = if self.tension { force } else { force.max(-states[c].pressing) };
        1
    }

    /// Net axial force on body b, N.
    fn net(&self, body: usize, states: &[ContactState]) -> f64 {
        if self.mobilities[body].velocity == 0.0 {
            return 0.0;
        }
        // The piston is pushed by its own contact alone; it moves by that where the horn gives way.
        body.checked_sub(1).map_or(0.0, |contact| states[contact].total()) - states[body].total()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fea::contact::complementarity::Ordering;
    use crate::scene::DampingTerm;

    const MOBILITY: Mobility = Mobility { displacement: 5e-10, velocity: 0.01 };

    /// A free body between two rigid ones, a point at either contact, V across it.
    fn two_contacts(dashpot: Dashpot, tension: bool) -> Contacts {
        let link =
            |coupling| Link { compliance: 0, coupling, axial_before: vec![1.0], axial_after: vec![-1.0], dashpot };
        Contacts {
            links: vec![link(None), link(Some(0))],
            compliances: vec![Compliance::new(vec![1e-7], 1, Ordering::Prefix).unwrap()],
            couplings: vec![vec![-3e-8]],
            mobilities: vec![Mobility::default(), MOBILITY, Mobility::default()],
            dashpot_base: DashpotBase::default(),
            tension,
        }
    }

    fn solve(contacts: &Contacts, gaps: [f64; 2], rigid: [RigidPrediction; 3], overlap: [f64; 2]) -> Vec<ContactState> {
        let mut states = vec![ContactState::open(1); 2];
        let predicted = gaps.map(|gap| vec![gap]);
        contacts.solve(&predicted, &rigid, &overlap, &mut states, &mut Workspace::new(contacts)).unwrap();
        states
    }

    #[test]
    fn coupled_contacts_close_together() {
        let contacts = two_contacts(Dashpot::default(), false);
        let states = solve(&contacts, [-2e-7, -1e-7], [RigidPrediction::default(); 3], [0.0; 2]);
        // W λ₀ + V λ₁ = 2e-7, V λ₀ + W λ₁ = 1e-7 with W = 1e-7, V = −3e-8.
        let determinant = 1.0 - 0.09;
        let expected = [(2.0 + 0.3) / determinant, (1.0 + 0.6) / determinant];
        for (state, expected) in states.iter().zip(expected) {
            assert!((state.total() - expected).abs() < 1e-11 && state.gaps[0] == 0.0, "{state:?} {expected}");
        }
        // The push on one side alone opens or closes the other by V λ.
        let states = solve(&contacts, [-2e-7, 1e-7], [RigidPrediction::default(); 3], [0.0; 2]);
        assert!((states[0].total() - 2.0).abs() < 1e-12 && states[1].total() == 0.0);
        assert!((states[1].gaps[0] - (1e-7 - 3e-8 * 2.0)).abs() < 1e-20);
    }

    #[test]
    fn a_dashpot_answers_the_rate_that_its_own_force_leaves() {
        let dashpot = Dashpot { coefficients: [(DampingTerm::Linear, 0.3)].into() };
        let moving = |velocity: f64| {
            [RigidPrediction { displacement: 1e-6, velocity }, RigidPrediction::default(), RigidPrediction::default()]
        };
        let states = solve(&two_contacts(dashpot, false), [-2e-7, 5e-6], moving(0.1), [0.0, -1e-5]);
        // The body follows: rate = 0.1 − 0.01 (pressing + damping).
        let rate = 0.1 - MOBILITY.velocity * states[0].total();
        assert!((states[0].damping - 0.3 * rate).abs() < 1e-12 && states[0].damping > 0.0, "{:?}", states[0]);
        assert_eq!(states[1].damping, 0.0);
    }

    #[test]
    fn a_parting_dashpot_pulls_only_if_it_may_and_only_while_overlapping() {
        let dashpot = Dashpot { coefficients: [(DampingTerm::Linear, 30.0)].into() };
        let parting = [
            RigidPrediction { displacement: 1e-6, velocity: -0.1 },
            RigidPrediction::default(),
            RigidPrediction::default(),
        ];
        let clipped = solve(&two_contacts(dashpot, false), [-2e-8, 5e-6], parting, [0.0, -1e-5]);
        assert!(clipped[0].damping < 0.0 && clipped[0].total() == 0.0, "{:?}", clipped[0]);
        let pulling = solve(&two_contacts(dashpot, true), [-2e-8, 5e-6], parting, [0.0, -1e-5]);
        assert!(pulling[0].total() < -1.0, "{:?}", pulling[0]);
        let apart = solve(&two_contacts(dashpot, true), [5e-8, 5e-6], parting, [-2e-6, -1e-5]);
        assert_eq!(apart[0].total(), 0.0);
    }

    #[test]
    fn what_has_no_solution_names_its_contact() {
        let contacts = two_contacts(Dashpot::default(), false);
        let mut states = vec![ContactState::open(1); 2];
        let predicted = [vec![1e-7], vec![f64::NAN]];
        let failure = contacts.solve(
            &predicted,
            &[RigidPrediction::default(); 3],
            &[0.0; 2],
            &mut states,
            &mut Workspace::new(&contacts),
        );
        assert!(matches!(failure, Err(Failure::NoActiveSet { contact: 1, .. })), "{failure:?}");
    }
}
