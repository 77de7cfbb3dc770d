//! The stress around the contact that presses hardest: Hertz' field below the surface.

use granchain::{
    model::fea::{Control, Frames, Simulation},
    response::Field,
    scene::{self, Scene},
};

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = ["model.kind=fea"].iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load("rigid", &overrides).unwrap()
}

/// The contact of the largest force of a run (0 is the piston's), that force (N), and the fields of all bodies at that instant.
fn hardest(scene: &Scene) -> (usize, f64, Field) {
    let mut simulation = Simulation::new(scene, Control::default()).unwrap();
    let frames = Frames::new(simulation.arrangement());
    let (mut contact, mut force, mut field) = (0, 0.0, frames.field(&simulation));
    while !simulation.is_done() {
        simulation.advance().unwrap();
        for (index, state) in simulation.contacts().iter().enumerate() {
            if state.pressing > force {
                (contact, force, field) = (index, state.pressing, frames.field(&simulation));
            }
        }
    }
    (contact, force, field)
}

/// Depth over contact radius and von Mises stress over peak pressure where the latter is largest on the axis.
///
/// Johnson (1985), *Contact Mechanics*, eq. (3.45).
fn hertz(poisson: f64) -> (f64, f64) {
    let stress = |depth: f64| {
        let fall = 1.0 / (1.0 + depth * depth);
        let radial = (1.0 + poisson) * (1.0 - depth * (1.0 / depth).atan()) - 0.5 * fall;
        fall - radial
    };
    (1..2000).map(|i| f64::from(i) * 1e-3).map(|z| (z, stress(z))).max_by(|a, b| a.1.total_cmp(&b.1)).unwrap()
}

#[test]
fn hertz_yields_first_0_48_radii_deep_at_0_62_of_the_peak_pressure() {
    let (depth, stress) = hertz(0.3);
    assert!((depth - 0.48).abs() < 0.005 && (stress - 0.62).abs() < 0.005, "{depth} {stress}");
}

#[test]
fn the_largest_stress_of_the_transient_lies_below_the_surface_where_hertz_has_it() {
    // The first pulse leaves the piston, then meets the rigid flat.
    let contacts: Vec<usize> = ["9us", "14us"].into_iter().map(contact_stressed_as_by_hertz).collect();
    assert_eq!(contacts, [1, 7]);
}

/// Compare the largest stress with Hertz; which contact it was.
fn contact_stressed_as_by_hertz(duration: &str) -> usize {
    let scene = scene(&["model.mesh_density=12", &format!("duration={duration}")]);
    let (contact, force, field) = hardest(&scene);
    let bead = &scene.chain.beads[0];
    let material = &bead.material;
    let own = (1.0 - material.poissons_ratio.powi(2)) / material.youngs_modulus;
    let beads = scene.chain.beads.len();
    let touching: Vec<usize> = [contact, contact + 1].into_iter().filter(|slot| (1..=beads).contains(slot)).collect();
    // Two equal spheres, or a sphere on the rigid piston or wall.
    let both = touching.len() == 2;
    let (modulus, radius) = if both { (0.5 / own, 0.5 * bead.radius) } else { (1.0 / own, bead.radius) };
    let contact_radius = (0.75 * force * radius / modulus).cbrt();
    let pressure = 1.5 * force / (std::f64::consts::PI * contact_radius.powi(2));
    let (depth, stress) = hertz(material.poissons_ratio);
    for slot in touching {
        let body = &field.bodies[slot - 1];
        // Where the undeformed surfaces touch: the far pole of the bead before, the near pole of the one behind.
        let poles = body.mesh.points.iter().filter(|place| place[0] == 0.0).map(|place| place[1]);
        let pole = if slot == contact { poles.fold(f64::MIN, f64::max) } else { poles.fold(f64::MAX, f64::min) };
        let mut axis: Vec<(f64, f64)> = body
            .mesh
            .points
            .iter()
            .zip(&body.von_mises)
            .filter(|(place, _)| place[0] == 0.0)
            .map(|(place, stress)| ((place[1] - pole).abs() / contact_radius, stress / pressure))
            .filter(|(depth, _)| *depth < 3.0)
            .collect();
        axis.sort_by(|a, b| a.0.total_cmp(&b.0));
        let highest = (1..axis.len() - 1).max_by(|a, b| axis[*a].1.total_cmp(&axis[*b].1)).unwrap();
        // The vertex of the parabola through the three highest nodes.
        let [(x0, y0), (x1, y1), (x2, y2)] = [axis[highest - 1], axis[highest], axis[highest + 1]];
        let (left, right) = ((y1 - y0) / (x1 - x0), (y2 - y1) / (x2 - x1));
        let bend = (right - left) / (x2 - x0);
        let vertex = 0.5 * (x0 + x1) - 0.5 * left / bend;
        // Stress recovered from strains at spacings of an eighth of the radius, and the force of a finite sphere: a few per cent; the place
        // of a flat maximum to its square root.
        assert!((y1 / stress - 1.0).abs() < 0.03, "{}: {y1} against {stress}", body.name);
        assert!((vertex / depth - 1.0).abs() < 0.1, "{}: {vertex} against {depth}", body.name);
        // Not at the surface, and nowhere off the axis by more than the recovery's error.
        assert!(axis[0].1 < 0.6 * y1, "{}: {} at the surface", body.name, axis[0].1);
        let everywhere = body.von_mises.iter().fold(0.0_f64, |most, stress| most.max(*stress)) / pressure;
        assert!(everywhere < 1.03 * stress, "{}: {everywhere} somewhere", body.name);
    }
    contact + 1
}
