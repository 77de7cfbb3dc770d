//! An elastic bar and a rigid wall: the textbook case of contact dynamics, seen from the bar.

use super::{
    FidelityLevel, Limit,
    grid_mesh::{Rectangle, Side},
    room::{Balance, Room},
    steps::Push,
};

const LENGTH: f64 = 10e-3;
const RADIUS: f64 = 0.5e-3;
/// Speed of the wall, m/s.
const SPEED: f64 = 0.1;
/// Over which the reduced model's force is averaged, s: as wherever it is held against another model.
const MEAN_OVER: f64 = 4e-7;

pub(super) fn examine(room: &mut Room<'_>) {
    if let Err(reason) = measure(room) {
        room.failed("bar", reason);
    }
}

fn measure(room: &mut Room<'_>) -> Result<(), String> {
    let elements = 200;
    let rectangle = Rectangle {
        r: vec![0.0, 0.5 * RADIUS, RADIUS],
        z: (0..=elements).map(|k| LENGTH * f64::from(k) / f64::from(elements)).collect(),
        boundaries: &[("front", &[Side::Bottom(f64::INFINITY)]), ("back", &[Side::Top])],
    };
    let folder = tempfile::tempdir().map_err(|error| error.to_string())?;
    let path = rectangle.write(folder.path(), "bar").map_err(|error| error.to_string())?;
    let sets = [
        format!("chain.mesh=\"{}\"", path.display()),
        "chain.beads=1".to_owned(),
        "chain.gaps.contact1=0 m".to_owned(),
        "chain.gaps.contact2=400 um".to_owned(),
        // No Poisson effect: a rod, exactly one-dimensional.
        "materials.chrome-steel.poissons_ratio=0".to_owned(),
        "duration=7 us".to_owned(),
        "output_step=0.01 us".to_owned(),
        "model.step=0.01 us".to_owned(),
    ];
    let mut sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    if room.fidelity == FidelityLevel::Reduced {
        // As many as the mesh can tell apart.
        sets.push("model.modes=120");
    }
    let scene = room.scene("rigid", &sets)?;
    let ran = room.run_with(&scene, &Push(SPEED))?;
    room.sound("bar", &ran, Balance::UNDAMPED);
    let material = &scene.chain.beads[0].material;
    let celerity = (material.youngs_modulus / material.density).sqrt();
    let area = std::f64::consts::PI * RADIUS * RADIUS;
    let (lasts, carries) = (2.0 * LENGTH / celerity, material.density * celerity * SPEED * area);
    let force = &ran.response.contact_force[0];
    let pressed = force.values.iter().filter(|force| **force > 0.0).count() as f64 * force.step;
    room.check("contact lasts 2L/c, deviation", (pressed / lasts - 1.0).abs(), Limit::AtMost(0.02), "1");
    // Away from the two fronts, which the step smears.
    let inside = |(index, _): &(usize, &f64)| (0.1..0.9).contains(&(*index as f64 * force.step / lasts));
    let plateau: Vec<f64> = force.values.iter().enumerate().filter(inside).map(|(_, force)| force / carries).collect();
    let mean = plateau.iter().sum::<f64>() / plateau.len() as f64;
    room.check("force is ρ c v A, deviation of the mean", (mean - 1.0).abs(), Limit::AtMost(0.01), "1");
    let wander = |length: usize| {
        let means = plateau.windows(length).map(|part| part.iter().sum::<f64>() / length as f64);
        means.map(|force| (force - 1.0).abs()).fold(0.0, f64::max)
    };
    if room.fidelity == FidelityLevel::Reduced {
        // A bar of finitely many modes rings at the last of them, all along the contact: no front is sharper than its half wave.
        let length = (MEAN_OVER / force.step).round() as usize;
        let smoothed = "force away from the fronts, mean over 0.4 µs: largest oscillation";
        room.check(smoothed, wander(length), Limit::AtMost(0.1), "1");
        let name = "force away from the fronts, sample by sample: largest oscillation (the last mode rings)";
        room.check(name, wander(1), Limit::AtMost(1.0), "1");
    } else {
        room.check(
            "force away from the fronts, sample by sample: largest oscillation",
            wander(1),
            Limit::AtMost(0.1),
            "1",
        );
    }
    let impulse: f64 = force.values.iter().sum::<f64>() * force.step;
    let leaves = impulse / (material.density * area * LENGTH);
    room.check(
        "leaves the wall with its speed, deviation",
        (leaves / (2.0 * SPEED) - 1.0).abs(),
        Limit::AtMost(0.01),
        "1",
    );
    let late = force.values[(1.1 * lasts / force.step) as usize..].iter().copied().fold(0.0, f64::max) / carries;
    room.check("force after the bar has left", late, Limit::AtMost(0.0), "1");
    Ok(())
}
