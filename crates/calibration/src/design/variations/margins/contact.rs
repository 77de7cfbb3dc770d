//! Contacts of a scene: the shortest, how fast they are pressed, and what drives them.

use std::f64::consts::PI;

use granchain_model::{
    analytical::Collision,
    contact_law::{bead_face_stiffness, bead_flat_stiffness, bead_pair_stiffness, dashpots},
    response::Response,
    scene::{Bead, DampingTerm, Scene, Support},
};

/// Share of the largest displacement of the drive from which it is in motion.
const ONSET: f64 = 0.05;
/// Share of the largest overlap from which a contact is looked at.
const PRESSED: f64 = 0.1;

/// Displacements (m) and velocities (m/s) of the drive, forty times a period.
fn driven(scene: &Scene) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let step = 1.0 / (40.0 * scene.drive.frequency);
    let times: Vec<f64> = (0..=(scene.duration / step) as usize).map(|sample| sample as f64 * step).collect();
    let (mut displacements, mut velocities) = (vec![0.0; times.len()], vec![0.0; times.len()]);
    scene.drive.motion(scene.amplitude_scale).sample(&times, &mut displacements, &mut velocities);
    (times, displacements, velocities)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// When the drive begins, s.
pub(super) fn onset(scene: &Scene) -> f64 {
    let (times, displacements, _) = driven(scene);
    let moves = ONSET * largest(&displacements);
    displacements.iter().position(|u| u.abs() > moves).map_or(0.0, |sample| times[sample])
}

/// The contacts with a Hertz stiffness: number from 1 at the piston, stiffness, reduced mass. A support other than a flat is softer than a bead.
fn contacts(scene: &Scene) -> Vec<(usize, f64, f64)> {
    let beads = &scene.chain.beads;
    let reduced = |one: &Bead, other: &Bead| one.mass() * other.mass() / (one.mass() + other.mass());
    let first = &beads[0];
    let mut all = vec![match scene.drive.kind.striker() {
        Some((striker, _)) => (1, bead_pair_stiffness(striker, first), reduced(striker, first)),
        None => (1, bead_face_stiffness(first, scene.piston_face()), first.mass()),
    }];
    let pair = |(place, pair): (usize, &[Bead])| {
        (place + 2, bead_pair_stiffness(&pair[0], &pair[1]), reduced(&pair[0], &pair[1]))
    };
    all.extend(beads.windows(2).enumerate().map(pair));
    let last = &beads[beads.len() - 1];
    if let Support::Flat(flat) = scene.support {
        all.push((beads.len() + 1, bead_flat_stiffness(last, flat), last.mass()));
    }
    all
}

/// Largest speed of what drives the chain, m/s.
fn speed(scene: &Scene) -> f64 {
    match scene.drive.kind.striker() {
        Some((_, velocity)) => (scene.amplitude_scale * velocity).abs(),
        None => largest(&driven(scene).2),
    }
}

/// The shortest contact, s: a collision at the largest velocity of the drive, or half a period under the precompression; and which contact.
pub(super) fn shortest_contact(scene: &Scene) -> Option<(f64, usize)> {
    let (speed, force) = (speed(scene), scene.chain.precompression);
    let all = contacts(scene).into_iter().flat_map(|(contact, hertz_stiffness, reduced_mass)| {
        let collision = (speed > 0.0).then(|| Collision { reduced_mass, hertz_stiffness, speed }.duration());
        let tangent = 1.5 * hertz_stiffness.powf(2.0 / 3.0) * force.cbrt();
        let pressed = (force > 0.0).then(|| PI * (reduced_mass / tangent).sqrt());
        collision.into_iter().chain(pressed).map(move |time| (time, contact))
    });
    all.min_by(|one, other| one.0.total_cmp(&other.0))
}

/// Largest (c + γ √(v h)) h/2m_r of the contacts that have a dashpot, 1, and which one.
pub(super) fn stiffest_dashpot(scene: &Scene, step: f64) -> Option<(f64, usize)> {
    let root = (speed(scene) * step).sqrt();
    let dashpots = dashpots(&scene.damping, scene.chain.beads.len() + 1);
    let all = contacts(scene).into_iter().map(|(contact, _, mass)| {
        let coefficients = dashpots[contact - 1].coefficients;
        let resistance = coefficients[DampingTerm::Linear] + coefficients[DampingTerm::KuwabaraKono] * root;
        (0.5 * resistance * step / mass, contact)
    });
    all.filter(|it| it.0 > 0.0).max_by(|one, other| one.0.total_cmp(&other.0))
}

/// Largest overlap gained between two samples over the largest of the same contact, of contacts that are pressed at all; and which one.
pub(super) fn overlap_gained(scene: &Scene, response: &Response) -> (f64, usize) {
    let place = |slot: usize, sample: usize| match slot.checked_sub(1) {
        None => response.piston_displacement.values[sample],
        Some(bead) => response.bead_displacement.get(bead).map_or(0.0, |series| series.values[sample]),
    };
    let samples = response.piston_displacement.len();
    let of = |(contact, stiffness, _): (usize, f64, f64)| {
        let rest = (scene.chain.precompression / stiffness).powf(2.0 / 3.0) - scene.chain.gaps[contact - 1];
        let overlap = |sample| (rest + place(contact - 1, sample) - place(contact, sample)).max(0.0);
        let gained = (1..samples).map(|sample| overlap(sample) - overlap(sample - 1)).fold(0.0, f64::max);
        (gained, (0..samples).map(overlap).fold(0.0, f64::max), contact)
    };
    let all: Vec<(f64, f64, usize)> = contacts(scene).into_iter().map(of).collect();
    let most = all.iter().map(|it| it.1).fold(0.0, f64::max);
    let pressed = all.iter().filter(|it| it.1 > PRESSED * most).map(|it| (it.0 / it.1, it.2));
    pressed.max_by(|one, other| one.0.total_cmp(&other.0)).unwrap_or((0.0, 1))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may fail by panicking")]
mod tests {
    use super::*;
    use granchain_model::scene;

    fn of(sets: &[&str]) -> Scene {
        let all: Vec<String> = ["model.kind=chain"].iter().chain(sets).map(|set| (*set).to_owned()).collect();
        scene::load("rigid", &all).unwrap()
    }

    #[test]
    fn the_shortest_contact_is_a_hit_of_the_lightest_or_half_a_period_where_that_is_shorter() {
        // T ∝ m^(2/5) k^(-2/5) v^(-1/5): between two beads 4.8477 µs at 0.1 m/s; a bead at a rigid flat has twice m_r and 2√2 times k.
        let speed = std::f64::consts::TAU * 73e3 * 1e-6;
        let flat = 4.847_749_96e-6 * (2.0_f64 / 8.0_f64.sqrt()).powf(0.4) * (speed / 0.1).powf(-0.2);
        let (shortest, contact) = shortest_contact(&of(&[])).unwrap();
        assert!((shortest / flat - 1.0).abs() < 1e-4, "{shortest:e} {flat:e}");
        assert!(contact == 1 || contact == 7);
        let light = ["chain.override=[{bead=3, mass=\"0.1 mg\"}]"];
        assert!(matches!(shortest_contact(&of(&light)), Some((time, 3 | 4)) if time < 0.6 * flat));
        // Under a force the stiffest contact swings at √(K/m), K = (3/2) k^(2/3) F^(1/3).
        let hard = of(&["chain.precompression=100 N"]);
        let stiffness = bead_face_stiffness(&hard.chain.beads[0], None);
        let tangent = 1.5 * stiffness.powf(2.0 / 3.0) * 100.0_f64.cbrt();
        let half = PI * (hard.chain.beads[0].mass() / tangent).sqrt();
        assert!((shortest_contact(&hard).unwrap().0 / half - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_dashpot_is_stiff_by_what_half_a_step_of_it_does_to_the_reduced_mass() {
        let damped = of(&["damping.kind=linear", "damping.coefficient=0.3 N s/m", "damping.at=beads"]);
        let mass = 0.5 * damped.chain.beads[0].mass();
        let (stiffness, contact) = stiffest_dashpot(&damped, 1e-7).unwrap();
        assert!((stiffness / (0.5 * 0.3 * 1e-7 / mass) - 1.0).abs() < 1e-12 && (2..=6).contains(&contact));
        assert!(stiffest_dashpot(&of(&[]), 1e-7).is_none());
    }

    #[test]
    fn the_drive_begins_where_it_first_moves_by_a_twentieth_of_its_largest_way() {
        // A Gaussian burst of 30 periods about its middle has a twentieth of its peak near its beginning, at e^(−½(2.5 x)²) = 1/20.
        let scene = of(&["drive.kind=gaussian-burst", "drive.cycles=30", "duration=500 us"]);
        let begins = 0.5 * 30.0 / 73e3 * (1.0 - (2.0 * 20.0_f64.ln()).sqrt() / 2.5);
        assert!((begins.max(0.0)..begins.max(0.0) + 1.0 / 73e3).contains(&onset(&scene)), "{}", onset(&scene));
    }
}
