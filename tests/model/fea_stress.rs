//! The stress around the contact that presses hardest: Hertz' field below the surface, and the figure of it.

use granchain::{
    model::fea::{Control, Peak, PeakStress, Simulation},
    report::{figure::FigureError, von_mises},
    scene::{self, Scene},
};

fn scene(overrides: &[&str]) -> Scene {
    let overrides: Vec<String> = ["model.kind=fea"].iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load("rigid", &overrides).unwrap()
}

fn peak(scene: &Scene) -> PeakStress {
    let mut simulation = Simulation::new(scene, Control::default()).unwrap();
    let mut peak = Peak::default();
    while !simulation.is_done() {
        simulation.advance().unwrap();
        peak.follow(&simulation);
    }
    peak.stress(simulation.arrangement()).unwrap()
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
    let peak = peak(&scene);
    let bead = &scene.chain.beads[0];
    let material = &bead.material;
    let own = (1.0 - material.poissons_ratio.powi(2)) / material.youngs_modulus;
    // Two equal spheres, or a sphere on the rigid piston.
    let both = peak.bodies.iter().flatten().count() == 2;
    let (modulus, radius) = if both { (0.5 / own, 0.5 * bead.radius) } else { (1.0 / own, bead.radius) };
    let contact_radius = (0.75 * peak.force * radius / modulus).cbrt();
    let pressure = 1.5 * peak.force / (std::f64::consts::PI * contact_radius.powi(2));
    let (depth, stress) = hertz(material.poissons_ratio);
    for body in peak.bodies.iter().flatten() {
        let mut axis: Vec<(f64, f64)> = body
            .mesh
            .points
            .iter()
            .zip(&body.von_mises)
            .filter(|(place, _)| place[0] == 0.0)
            .map(|(place, stress)| ((place[1] + body.offset - peak.place[1]).abs() / contact_radius, stress / pressure))
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
    peak.contact
}

#[test]
fn nothing_pressed_gives_no_stress_and_a_state_without_bodies_no_figure() {
    let small = scene(&["model.mesh_density=3", "duration=1us"]);
    let simulation = Simulation::new(&small, Control::default()).unwrap();
    let mut untouched = Peak::default();
    untouched.follow(&simulation);
    assert!(untouched.stress(simulation.arrangement()).is_none());

    let mut found = peak(&scene(&["model.mesh_density=3", "duration=10us"]));
    let figure = von_mises::figure(&found);
    let svg = figure.to_svg().unwrap();
    for text in [">Von Mises stress (GPa)<", ">r (µm)<", ">z from the contact (µm)<"] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(figure.title.contains(&format!("contact {} (", found.contact)) && figure.title.contains("µs"));
    for body in found.bodies.iter_mut().flatten() {
        body.stress.iter_mut().for_each(|stress| stress[1] = f64::NAN);
    }
    assert!(von_mises::figure(&found).to_svg().is_err());
    found.bodies = [None, None];
    assert!(matches!(von_mises::figure(&found).to_svg(), Err(FigureError::NoCells { .. })));
}
