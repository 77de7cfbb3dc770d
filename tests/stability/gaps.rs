//! Gaps: wide, narrow, and one that closes.

use super::{
    FidelityLevel, Limit,
    impact::{Throw, ringing},
    room::{Balance, Ran, Room, difference},
    vacuum::openings,
};
use granchain_model::{analytical::Collision, contact_law::bead_face_stiffness, scene::PistonMotion};

/// Speed of the bead in flight, m/s.
const SPEED: f64 = 10.0;
const WIDE: f64 = 1e-3;
const NARROW: f64 = 1e-12;

/// A bead flies 1 mm and hits one that stands 1 pm before a third.
pub(super) fn examine(room: &mut Room<'_>) {
    let which = "1 mm, then 1 pm";
    let run = |room: &Room<'_>, narrow: f64| {
        let narrow = format!("chain.gaps.contact3={narrow:e}");
        // A gap is below a radius.
        let plain = [
            "chain.beads=3",
            "chain.radius=1.1 mm",
            "chain.gaps.contact1=0 m",
            "chain.gaps.contact2=1 mm",
            "chain.gaps.contact4=1 mm",
        ];
        let scene = room.scene("rigid", &[&plain[..], &[&narrow, "duration=140 us"]].concat())?;
        room.run_with(&scene, &Throw::at(SPEED))
    };
    let (ran, touching) = match run(room, NARROW).and_then(|ran| Ok((ran, run(room, 0.0)?))) {
        Ok(both) => both,
        Err(reason) => return room.failed(which, reason),
    };
    room.sound(which, &ran, Balance::UNDAMPED);
    let response = &ran.response;
    let (force, step) = (&response.contact_force[1].values, response.contact_force[1].step);
    let touch = force.iter().position(|force| *force > 0.0).unwrap_or(0);
    let place = |bead: usize| response.bead_displacement[bead].values[touch];
    // A bead that has flown its gap and no further is pressed for at most a sample; centres ring by a twentieth of that.
    let travelled = (place(0) - place(1) - WIDE) / (SPEED * step);
    let name = format!("{which}: way beyond 1 mm when the beads touch, over that of a sample");
    room.check(&name, travelled, Limit::AtMost(1.0 + ringing(room)), "1");
    room.check(&name, travelled, Limit::AtLeast(-ringing(room)), "1");
    // As long as the narrow gap lasts the second bead goes alone: a share of the overlap, which the hits to come magnify.
    let overlap = response.bead_displacement[0].values.iter().zip(&response.bead_displacement[1].values);
    let overlap = overlap.map(|(one, other)| one - other - WIDE).fold(0.0, f64::max);
    let last = |ran: &Ran| ran.response.contact_force[2].values.clone();
    let name = format!("{which}: force behind 1 pm against that without the gap, rms");
    room.check(name, difference(&last(&ran), &last(&touching)), Limit::AtMost(100.0 * NARROW / overlap), "1");
}

/// A piston that throws, waits, and closes the gap before it.
struct Closing {
    throw: Throw,
    /// It closes at this speed, m/s, between two instants, s.
    speed: f64,
    between: [f64; 2],
}

impl PistonMotion for Closing {
    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64) {
        let [from, to] = self.between;
        let (thrown, velocity) = self.throw.on_piece(piece, t);
        let moves = if piece == 1 { self.speed } else { 0.0 };
        (thrown + self.speed * (t.clamp(from, to) - from), velocity + moves)
    }

    fn breaks(&self) -> &[f64] {
        &self.between
    }
}

/// ∫√(1 − s^(5/2)) ds from 0 to 1: what a Hertz contact of overlap δ adds to the way of a bead, over δ.
const OF_CONTACT: f64 = 0.817_47;

/// A bead between a wall and a piston that comes near: the action ∮p dq of its bouncing is an adiabatic invariant.
pub(super) fn chatter(room: &mut Room<'_>) {
    let which = "closed from 10 µm to 1 µm";
    let (throw, speed) = (Throw { speed: 2.0, ramp: 10e-6 }, 0.05);
    let (begin, closed) = (40e-6, 9e-6);
    // The throw itself takes 20 µm.
    let motion = Closing { throw, speed, between: [begin, begin + closed / speed] };
    let sets = ["chain.beads=1", "chain.gaps.contact1=0 m", "chain.gaps.contact2=30 um", "duration=230 us"];
    let ran = room.scene("rigid", &sets).and_then(|scene| Ok((room.run_with(&scene, &motion)?, scene)));
    let (ran, scene) = match ran {
        Ok(ran) => ran,
        Err(reason) => return room.failed(which, reason),
    };
    room.sound(which, &ran, Balance::UNDAMPED);
    let response = &ran.response;
    let hits: usize = response.contact_force.iter().map(|force| openings(&force.values)).sum();
    // Two a bounce, which takes 14.6 µs at first and less ever after.
    let least = (2.0 * closed / speed / 14.6e-6).floor();
    room.check(format!("{which}: openings of contacts"), hits as f64, Limit::AtLeast(least), "1");
    let bead = &scene.chain.beads[0];
    let action = |speed: f64, way: f64| {
        let (reduced_mass, hertz_stiffness) = (bead.mass(), bead_face_stiffness(bead, None));
        let overlap = Collision { reduced_mass, hertz_stiffness, speed }.largest_overlap();
        speed * (way + 2.0 * OF_CONTACT * overlap)
    };
    let velocity = &response.bead_velocity[0];
    let free = |sample: usize| response.contact_force.iter().all(|force| force.values[sample] == 0.0);
    let waiting = (0..velocity.len()).filter(|sample| (20e-6..begin).contains(&velocity.time(*sample)));
    let flown: Vec<f64> = waiting.filter(|sample| free(*sample)).map(|sample| velocity.values[sample].abs()).collect();
    let first = flown.iter().sum::<f64>() / flown.len() as f64;
    let last = (2.0 * (response.energy.kinetic_j + response.energy.stored_j) / bead.mass()).sqrt();
    let change = action(last, 1e-6) / action(first, 10e-6) - 1.0;
    // Two bounces of a piston that is as much slower than the bead; the finite body is stiffer than Hertz' by 8 % of the part in contact.
    let body = if room.fidelity == FidelityLevel::Hertz { 0.0 } else { 0.05 };
    let name = format!("{which}: change of the action ∮p dq");
    room.check(name, change.abs(), Limit::AtMost(2.0 * speed / first + body), "1");
}
