//! Displacements, velocities and accelerations of all bodies, and what a step does to them between its contacts.

mod lossy;

use super::{
    arrangement::Arrangement,
    assembly::{Columns, Direction, DofMap},
    contact::{
        chain::{ContactState, RigidPrediction, net_force},
        face::Face,
    },
    factor::Half,
    loss::StepLoss,
    operator::{Interfaces, Operator},
    profile::Profile,
    scheme::Coefficients,
};
use lossy::{Lossy, dot};

#[derive(Debug, Clone)]
struct Group {
    /// Slots of its bodies (piston 0, beads 1…N, support N + 1), in the order of the columns.
    slots: Vec<usize>,
    displacement: Columns,
    velocity: Columns,
    acceleration: Columns,
    /// ũ of the coming step.
    predicted: Columns,
    /// Right-hand side, then the new displacements.
    solution: Columns,
    half: Half,
    /// Interface displacements without new contact forces.
    free: Columns,
    massless: Vec<u32>,
    forces: Columns,
    own_forces: Vec<f64>,
    lossy: Option<Lossy>,
}

/// Mass-mean motion of one body along z.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize, serde::Deserialize)]
struct Rigid {
    displacement: f64,
    velocity: f64,
    acceleration: f64,
}

impl Rigid {
    /// At the end of a step under these forces over the mass, m/s².
    fn after(self, c: &Coefficients, loss: Option<&StepLoss>, forced: f64) -> Self {
        let Self { displacement: u, velocity: v, acceleration: a } = self;
        let new = loss.map_or(forced, |loss| loss.braked(forced, c.lag, [v, c.velocity(v, a, 0.0)]));
        Self { displacement: c.predicted(u, v, a) + c.gain * new, velocity: c.velocity(v, a, new), acceleration: new }
    }
}

#[derive(Debug, Clone)]
pub struct Motion {
    groups: Vec<Group>,
    /// Kind and column of the body in each slot; none where it is rigid.
    columns: Vec<Option<(usize, usize)>>,
    rigid: Vec<Rigid>,
    /// Step for which ũ is known, s.
    predicted_for: Option<f64>,
}

/// The state of all bodies, to be saved: one list a body, in the order of slots, rigid ones empty.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub(crate) struct Saved {
    displacement: Vec<Vec<f64>>,
    velocity: Vec<Vec<f64>>,
    acceleration: Vec<Vec<f64>>,
    rigid: Vec<Rigid>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    behind: Vec<Vec<f64>>,
}

impl Motion {
    /// At rest, with the given displacements (m; one list a slot, none where the body is undeformed).
    pub(crate) fn at_rest(
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        displacements: &[Option<Vec<f64>>],
    ) -> Self {
        let slots = arrangement.beads.len() + 2;
        let mut columns = vec![None; slots];
        let mut groups = Vec::new();
        for (kind, body) in arrangement.kinds.iter().enumerate() {
            let members: Vec<usize> = (0..slots).filter(|&slot| arrangement.kind(slot) == Some(kind)).collect();
            let zeros = body.columns(members.len());
            let mut displacement = zeros.clone();
            for (column, &slot) in members.iter().enumerate() {
                columns[slot] = Some((kind, column));
                if let Some(values) = &displacements[slot] {
                    displacement.set_column(column, values);
                }
            }
            let interface = Columns::new(interfaces.unknowns[kind].len(), members.len());
            let massless: Vec<u32> = (0..body.mesh().nodes.len() as u32)
                .filter(|&node| body.mass().get(node, node) == 0.0)
                .flat_map(|node| [2 * node, 2 * node + 1])
                .collect();
            let lossy = arrangement.losses[kind].map(|loss| Lossy {
                blend: zeros.clone(),
                product: zeros.clone(),
                behind: loss.relaxation.map(|_| zeros.clone()),
                slopes: vec![0.0; if loss.retardation > 0.0 { massless.len() * zeros.width() } else { 0 }],
            });
            groups.push(Group {
                lossy,
                displacement,
                velocity: zeros.clone(),
                acceleration: zeros.clone(),
                predicted: zeros.clone(),
                solution: zeros,
                half: Half::new(body, &interfaces.unknowns[kind], members.len()),
                free: interface.clone(),
                massless,
                own_forces: vec![0.0; interface.rows()],
                forces: interface,
                slots: members,
            });
        }
        Self { groups, columns, rigid: vec![Rigid::default(); slots], predicted_for: None }
    }

    pub(crate) fn predict(
        &mut self,
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        operator: &Operator,
        before: &[ContactState],
        profile: &mut Profile,
    ) {
        let c = operator.coefficients;
        let known = self.predicted_for == Some(c.step);
        let mut lap = profile.start();
        for (kind, group) in self.groups.iter_mut().enumerate() {
            let body = &arrangement.kinds[kind];
            if !known {
                group.predict(&c);
            }
            match &operator.losses[kind] {
                None => body.multiply_mass(&group.predicted, &mut group.solution),
                Some(loss) => group.load_losing(body, loss, &c),
            }
        }
        if c.lag > 0.0 {
            self.lag(arrangement, interfaces, operator, before);
        }
        self.predicted_for = Some(c.step);
        profile.mass += lap.lap();
        for (factor, group) in operator.factors.iter().zip(&mut self.groups) {
            factor.forward(&group.solution, &mut group.half);
            factor.interface_displacement(&mut group.half, &mut group.free);
        }
        profile.forward += lap.lap();
    }

    /// Add what the old forces still do to the right-hand sides: α β h² (f₀ − K u₀).
    fn lag(
        &mut self,
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        operator: &Operator,
        before: &[ContactState],
    ) {
        let c = &operator.coefficients;
        let gain = c.lag * c.gain;
        for (kind, group) in self.groups.iter_mut().enumerate() {
            let body = &arrangement.kinds[kind];
            match &operator.losses[kind] {
                None => body.multiply_stiffness(&group.displacement, &mut group.predicted),
                Some(loss) => group.resistance_losing(body, loss),
            }
            let (solution, product) = (group.solution.as_mut_slice(), group.predicted.as_slice());
            solution.iter_mut().zip(product).for_each(|(s, p)| *s -= gain * p);
            for (column, &slot) in group.slots.iter().enumerate() {
                interfaces.press(slot, |contact| Some(&before.get(contact)?.forces), &mut group.own_forces);
                for (&unknown, force) in interfaces.unknowns[kind].iter().zip(&group.own_forces) {
                    let value = group.solution.get(unknown as usize, column) + gain * force;
                    group.solution.set(unknown as usize, column, value);
                }
                let damping = net_force(before, slot, |contact| contact.damping) / body.total_mass();
                if damping != 0.0 && body.is_free() {
                    for (node, mass) in body.node_mass().iter().enumerate() {
                        let unknown = DofMap::dof(node as u32, Direction::Axial) as usize;
                        let value = group.solution.get(unknown, column) + gain * damping * mass;
                        group.solution.set(unknown, column, value);
                    }
                }
            }
            // The product took ũ's place.
            group.predict(c);
        }
    }

    /// Rigid motions without new forces, m and m/s; the piston's slot is left alone.
    pub(crate) fn predict_rigid(
        &self,
        arrangement: &Arrangement,
        operator: &Operator,
        before: &[ContactState],
        out: &mut [RigidPrediction],
    ) {
        let c = &operator.coefficients;
        for (slot, (out, rigid)) in out.iter_mut().zip(&self.rigid).enumerate().skip(1) {
            let Some(kind) = arrangement.kind(slot).filter(|&kind| arrangement.kinds[kind].is_free()) else { continue };
            let lagging = if c.lag > 0.0 {
                c.lag * net_force(before, slot, ContactState::total) / arrangement.kinds[kind].total_mass()
            } else {
                0.0
            };
            let Rigid { displacement, velocity, .. } = rigid.after(c, operator.losses[kind].as_ref(), lagging);
            *out = RigidPrediction { displacement, velocity };
        }
    }

    /// Interface displacements without new contact forces of the kind of the body in a slot, and its column; none where it is rigid.
    pub(crate) fn free_interface(&self, slot: usize) -> Option<(&Columns, usize)> {
        self.columns[slot].map(|(kind, column)| (&self.groups[kind].free, column))
    }

    /// Complete the displacements with the new forces: into the `solution`, the state untouched.
    pub(crate) fn complete(
        &mut self,
        arrangement: &Arrangement,
        interfaces: &Interfaces,
        operator: &Operator,
        contacts: &[ContactState],
        profile: &mut Profile,
    ) {
        let mut lap = profile.start();
        let gain = operator.coefficients.new_force_gain();
        for (kind, (factor, group)) in operator.factors.iter().zip(&mut self.groups).enumerate() {
            if group.slots.iter().any(|&slot| pressed(contacts, slot)) {
                for (column, &slot) in group.slots.iter().enumerate() {
                    interfaces.press(slot, |contact| Some(&contacts.get(contact)?.forces), &mut group.own_forces);
                    for (row, force) in group.own_forces.iter().enumerate() {
                        group.forces.set(row, column, gain * force);
                    }
                }
                factor.add_interface_force(&group.forces, &mut group.half);
            }
            factor.backward(&mut group.half, &mut group.solution);
            let body = &arrangement.kinds[kind];
            for (column, &slot) in group.slots.iter().enumerate() {
                let damping = net_force(contacts, slot, |contact| contact.damping);
                if damping != 0.0 && body.is_free() {
                    // A body force of constant density moves a free body as a whole.
                    let braking = operator.losses[kind].map_or(1.0, |loss| loss.mass_scale());
                    let shift = gain * damping / (body.total_mass() * braking);
                    let width = group.solution.width();
                    for row in group.solution.as_mut_slice().chunks_exact_mut(2 * width) {
                        row[width + column] += shift;
                    }
                }
            }
        }
        profile.backward += lap.lap();
    }

    pub(crate) fn not_finite(&self) -> Option<usize> {
        self.groups.iter().find_map(|group| {
            let (values, width) = (group.solution.as_slice(), group.solution.width());
            // One sum tells of all bodies, in parts that wait for no other; which it is matters only if one is not finite.
            let (eights, rest) = values.as_chunks::<8>();
            let mut sums = [0.0; 8];
            for eight in eights {
                sums.iter_mut().zip(eight).for_each(|(sum, value)| *sum += value);
            }
            if sums.iter().chain(rest).sum::<f64>().is_finite() {
                return None;
            }
            let sum = |column: usize| values.iter().skip(column).step_by(width).sum::<f64>();
            group.slots.iter().enumerate().find(|(column, _)| !sum(*column).is_finite()).map(|(_, &slot)| slot)
        })
    }

    /// Make the new displacements the state.
    pub(crate) fn accept(
        &mut self,
        arrangement: &Arrangement,
        operator: &Operator,
        contacts: &[ContactState],
        before: &[ContactState],
        profile: &mut Profile,
    ) {
        let mut lap = profile.start();
        let c = &operator.coefficients;
        for group in &mut self.groups {
            group.accept(c);
        }
        for slot in 1..self.rigid.len() {
            let Some(kind) = arrangement.kind(slot).filter(|&kind| arrangement.kinds[kind].is_free()) else { continue };
            let mass = arrangement.kinds[kind].total_mass();
            let old = if c.lag > 0.0 { c.lag * net_force(before, slot, ContactState::total) } else { 0.0 };
            let new = ((1.0 - c.lag) * net_force(contacts, slot, ContactState::total) + old) / mass;
            self.rigid[slot] = self.rigid[slot].after(c, operator.losses[kind].as_ref(), new);
        }
        profile.update += lap.lap();
    }

    /// Rigid velocity of a body, m/s.
    pub(crate) fn rigid_velocity(&self, slot: usize) -> f64 {
        self.rigid[slot].velocity
    }

    /// Push the body in a slot as a whole: its velocity changes by `change` (m/s) everywhere.
    pub(crate) fn push(&mut self, operator: &Operator, slot: usize, change: f64) {
        let Some((kind, column)) = self.columns[slot] else { return };
        let c = &operator.coefficients;
        // Drag answers at once.
        let braking = -operator.losses[kind].map_or(0.0, |loss| loss.own.drag) * change;
        let Group { displacement, velocity, acceleration, predicted, .. } = &mut self.groups[kind];
        let width = velocity.width();
        for row in velocity.as_mut_slice().chunks_exact_mut(2 * width) {
            row[width + column] += change;
        }
        if braking != 0.0 {
            for row in acceleration.as_mut_slice().chunks_exact_mut(2 * width) {
                row[width + column] += braking;
            }
        }
        let (u, v, a) = (displacement.as_slice(), velocity.as_slice(), acceleration.as_slice());
        for place in (width + column..u.len()).step_by(2 * width) {
            predicted.as_mut_slice()[place] = c.predicted(u[place], v[place], a[place]);
        }
        self.rigid[slot].velocity += change;
        self.rigid[slot].acceleration += braking;
    }

    /// ũ must be made again: the step changes.
    pub(crate) fn forget_prediction(&mut self) {
        self.predicted_for = None;
    }

    /// Displacement of one unknown of the body in a slot, m.
    pub fn displacement(&self, slot: usize, unknown: u32) -> f64 {
        self.columns[slot].map_or(0.0, |(kind, column)| self.groups[kind].displacement.get(unknown as usize, column))
    }

    /// Velocity of one unknown of the body in a slot, m/s; at a massless node its mean over the last step.
    pub(crate) fn velocity(&self, slot: usize, unknown: u32) -> f64 {
        self.columns[slot].map_or(0.0, |(kind, column)| self.groups[kind].velocity.get(unknown as usize, column))
    }

    /// Rigid displacement of a body, m.
    pub(crate) fn rigid_displacement(&self, slot: usize) -> f64 {
        self.rigid[slot].displacement
    }

    /// Put the piston where it is, m.
    pub(crate) fn move_piston(&mut self, displacement: f64) {
        self.rigid[0].displacement = displacement;
    }

    /// All displacements of the bodies of a kind, with the column of a slot.
    pub fn columns(&self, slot: usize) -> Option<(&Columns, &Columns, usize)> {
        self.columns[slot].map(|(kind, column)| {
            let group = &self.groups[kind];
            (&group.displacement, &group.velocity, column)
        })
    }

    /// Outward normal displacement of point i of a face (numbered over the interface) of the body in a slot, m.
    pub(crate) fn normal_displacement(&self, interfaces: &Interfaces, slot: usize, face: &Face, point: usize) -> f64 {
        let Some((kind, column)) = self.columns[slot] else { return 0.0 };
        let values = &self.groups[kind].displacement;
        face.terms(point)
            .map(|(local, coefficient)| coefficient * values.get(interfaces.unknowns[kind][local] as usize, column))
            .sum()
    }

    /// Kinetic and elastic energy of all bodies, J; overwrites work space only.
    pub(crate) fn energy(&mut self, arrangement: &Arrangement) -> (f64, f64) {
        let (mut kinetic, mut stored) = (0.0, 0.0);
        for (body, group) in arrangement.kinds.iter().zip(&mut self.groups) {
            body.multiply_mass(&group.velocity, &mut group.solution);
            kinetic += 0.5 * dot(&group.velocity, &group.solution);
            body.multiply_stiffness(&group.displacement, &mut group.solution);
            stored += 0.5 * dot(&group.displacement, &group.solution);
        }
        for (kind, group) in self.groups.iter_mut().enumerate() {
            if let (Some(lossy), Some(relaxation)) =
                (&mut group.lossy, arrangement.losses[kind].and_then(|loss| loss.relaxation))
            {
                stored += lossy.energy(&arrangement.kinds[kind], relaxation.strength);
            }
        }
        (kinetic, stored)
    }

    pub(crate) fn save(&self) -> Saved {
        let all = |part: fn(&Group) -> &Columns| {
            let of_slot = |place: &Option<(usize, usize)>| {
                place.map_or_else(Vec::new, |(kind, column)| part(&self.groups[kind]).column(column))
            };
            self.columns.iter().map(of_slot).collect()
        };
        Saved {
            displacement: all(|group| &group.displacement),
            velocity: all(|group| &group.velocity),
            acceleration: all(|group| &group.acceleration),
            rigid: self.rigid.clone(),
            behind: self.relaxing().map(|(kind, column)| self.behind(kind).column(column)).collect(),
        }
    }

    /// Take a saved state; false (and nothing taken) if it is of other bodies.
    pub(crate) fn restore(&mut self, saved: &Saved) -> bool {
        let fits = |values: &[Vec<f64>]| {
            values.len() == self.columns.len()
                && values.iter().zip(&self.columns).all(|(values, place)| {
                    values.len() == place.map_or(0, |(kind, _)| self.groups[kind].displacement.rows())
                })
        };
        let Saved { displacement, velocity, acceleration, rigid, behind } = saved;
        let relaxing: Vec<(usize, usize)> = self.relaxing().collect();
        let relaxes = behind.len() == relaxing.len()
            && behind.iter().zip(&relaxing).all(|(values, &(kind, _))| values.len() == self.behind(kind).rows());
        if !relaxes {
            return false;
        }
        if ![displacement, velocity, acceleration].iter().all(|values| fits(values)) || rigid.len() != self.rigid.len()
        {
            return false;
        }
        for (slot, place) in self.columns.iter().enumerate() {
            if let Some((kind, column)) = *place {
                let group = &mut self.groups[kind];
                group.displacement.set_column(column, &displacement[slot]);
                group.velocity.set_column(column, &velocity[slot]);
                group.acceleration.set_column(column, &acceleration[slot]);
            }
        }
        for (values, (kind, column)) in behind.iter().zip(relaxing) {
            if let Some(own) = self.groups[kind].lossy.as_mut().and_then(|lossy| lossy.behind.as_mut()) {
                own.set_column(column, values);
            }
        }
        self.rigid.clone_from(rigid);
        self.predicted_for = None;
        true
    }
}

impl Group {
    fn predict(&mut self, c: &Coefficients) {
        let (u, v, a) = (self.displacement.as_slice(), self.velocity.as_slice(), self.acceleration.as_slice());
        for (((predicted, &u), &v), &a) in self.predicted.as_mut_slice().iter_mut().zip(u).zip(v).zip(a) {
            *predicted = c.predicted(u, v, a);
        }
    }

    /// a₁, v₁, u₁, and ũ of the next step of the same size, in one pass.
    fn accept(&mut self, c: &Coefficients) {
        let inverse = 1.0 / c.gain;
        if let Some(lossy) = &mut self.lossy {
            let width = self.velocity.width();
            let rows = self.massless.iter().flat_map(|&unknown| self.velocity.row(unknown as usize));
            debug_assert!(lossy.slopes.is_empty() || lossy.slopes.len() == self.massless.len() * width);
            lossy.slopes.iter_mut().zip(rows).for_each(|(slope, velocity)| *slope = *velocity);
        }
        std::mem::swap(&mut self.displacement, &mut self.solution);
        let u = self.displacement.as_slice();
        let v = self.velocity.as_mut_slice();
        let a = self.acceleration.as_mut_slice();
        for (((&u, v), a), predicted) in u.iter().zip(v).zip(a).zip(self.predicted.as_mut_slice()) {
            let new = inverse * (u - *predicted);
            *v = c.velocity(*v, *a, new);
            *a = new;
            *predicted = c.predicted(u, *v, new);
        }
        // Nodes without mass follow at once: their velocity is what they just did.
        let old = self.solution.as_slice();
        for &unknown in &self.massless {
            let row = unknown as usize * self.velocity.width();
            for place in row..row + self.velocity.width() {
                self.velocity.as_mut_slice()[place] = (u[place] - old[place]) / c.step;
                self.acceleration.as_mut_slice()[place] = 0.0;
            }
        }
        if let Some(lossy) = &self.lossy {
            // Where material is viscous, how their velocity changed.
            let width = self.velocity.width();
            for (before, &unknown) in lossy.slopes.chunks_exact(width).zip(&self.massless) {
                for (place, before) in (unknown as usize * width..).zip(before) {
                    self.acceleration.as_mut_slice()[place] = (self.velocity.as_slice()[place] - before) / c.step;
                }
            }
        }
    }
}

fn pressed(contacts: &[ContactState], slot: usize) -> bool {
    contacts[slot - 1].pressing != 0.0 || contacts.get(slot).is_some_and(|contact| contact.pressing != 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        fea::arrangement::Arrangement,
        scene::{self, Scheme},
    };

    fn bench(overrides: &[&str]) -> (Arrangement, Interfaces) {
        let mut all = vec!["model.kind=fea".to_owned(), "model.mesh_density=4".to_owned()];
        all.extend(overrides.iter().map(|text| (*text).to_owned()));
        let arrangement = Arrangement::new(&scene::load("rigid", &all).unwrap()).unwrap();
        let interfaces = Interfaces::new(&arrangement);
        (arrangement, interfaces)
    }

    #[test]
    fn a_body_in_flight_keeps_its_shape_and_its_velocity() {
        let (arrangement, interfaces) = bench(&["chain.beads=2"]);
        let mut motion = Motion::at_rest(&arrangement, &interfaces, &vec![None; 4]);
        let body = &arrangement.kinds[0];
        let flight: Vec<f64> = body.rigid().iter().map(|part| 0.3 * part).collect();
        motion.groups[0].velocity.set_column(1, &flight);
        motion.rigid[2].velocity = 0.3;
        let c = Coefficients::new(Scheme::Trapezoid, 1e-7);
        let operator = Operator::new(&arrangement, &interfaces, c, false).unwrap();
        let open: Vec<_> =
            arrangement.contacts.iter().map(|&pair| ContactState::open(arrangement.pairs[pair].len())).collect();
        let mut profile = Profile::default();
        for _ in 0..50 {
            motion.predict(&arrangement, &interfaces, &operator, &open, &mut profile);
            motion.complete(&arrangement, &interfaces, &operator, &open, &mut profile);
            motion.accept(&arrangement, &operator, &open, &open, &mut profile);
        }
        let moved = 50.0 * 1e-7 * 0.3;
        assert!((motion.rigid_displacement(2) - moved).abs() < 1e-20 && motion.rigid_displacement(1) == 0.0);
        for &unknown in body.dofs().free() {
            let expected = if unknown % 2 == 1 { moved } else { 0.0 };
            // Rounding of 50 solutions.
            assert!((motion.displacement(2, unknown) - expected).abs() < 1e-10 * moved);
            assert_eq!(motion.displacement(1, unknown), 0.0);
        }
        let (kinetic, stored) = motion.energy(&arrangement);
        let expected = 0.5 * body.total_mass() * 0.09;
        // Rounding of K times a rigid motion.
        assert!((kinetic / expected - 1.0).abs() < 1e-9 && stored.abs() < 1e-9 * kinetic, "{kinetic:e} {stored:e}");
        assert_eq!(motion.not_finite(), None);
    }

    #[test]
    fn a_saved_motion_is_taken_up_whole_or_not_at_all() {
        let (arrangement, interfaces) = bench(&["chain.beads=2"]);
        let mut motion = Motion::at_rest(&arrangement, &interfaces, &vec![None; 4]);
        let values: Vec<f64> = (0..motion.groups[0].displacement.rows()).map(|i| (i as f64).sin()).collect();
        motion.groups[0].displacement.set_column(1, &values);
        motion.rigid[2].velocity = 0.3;
        let saved = motion.save();
        let mut other = Motion::at_rest(&arrangement, &interfaces, &vec![None; 4]);
        assert!(other.restore(&saved));
        assert_eq!((other.save(), other.displacement(2, 5)), (saved.clone(), values[5]));
        let (longer, its_interfaces) = bench(&["chain.beads=3"]);
        let mut longer_motion = Motion::at_rest(&longer, &its_interfaces, &vec![None; 5]);
        let before = longer_motion.save();
        assert!(!longer_motion.restore(&saved));
        assert_eq!(longer_motion.save(), before);
    }
}
