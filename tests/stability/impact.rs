//! Fast hits, large and tiny drives.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Ran, Room, difference},
};
use granchain_model::{
    contact_law::bead_pair_stiffness,
    scene::{PistonMotion, Scene},
};

/// Speed of the hit, m/s.
const SPEED: f64 = 10.0;
/// The piston's speed rises to [`SPEED`] over this time and falls again, s.
const RAMP: f64 = 30e-6;

/// A piston that throws: smoothly up to a speed and back to rest.
struct Throw;

impl PistonMotion for Throw {
    fn on_piece(&self, _piece: usize, t: f64) -> (f64, f64) {
        // v = V s²(3 − 2s), its integral V T (s³ − s⁴/2).
        let rise = |t: f64| {
            let s = (t / RAMP).clamp(0.0, 1.0);
            let after = (t - RAMP).max(0.0);
            (SPEED * (RAMP * (s.powi(3) - 0.5 * s.powi(4)) + after), SPEED * s * s * (3.0 - 2.0 * s))
        };
        let ((up, gained), (down, lost)) = (rise(t), rise(t - RAMP));
        (up - down, gained - lost)
    }

    fn breaks(&self) -> &[f64] {
        &[]
    }
}

pub(super) fn examine(room: &mut Room<'_>) {
    hit(room);
    large(room);
    tiny(room);
}

fn hit(room: &mut Room<'_>) {
    let which = "10 m/s";
    let sets = [
        "chain.beads=2",
        "chain.gaps.contact1=0 m",
        "chain.gaps.contact2=300 um",
        "chain.gaps.contact3=450 um",
        "duration=75 us",
        "output_step=0.1 us",
    ];
    let ran = room.scene("rigid", &sets).and_then(|scene| Ok((room.run_with(&scene, &Throw)?, scene)));
    let (ran, scene) = match ran {
        Ok(ran) => ran,
        Err(reason) => return room.failed(which, reason),
    };
    room.sound(which, &ran, Balance::UNDAMPED);
    let velocity = |bead: usize| &ran.response.bead_velocity[bead].values;
    let force = &ran.response.contact_force[1].values;
    let touch = force.iter().position(|force| *force > 0.0).unwrap_or(0);
    // Centres ring by mm/s in the models of elastic bodies: mean over the two microseconds beside the hit.
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let before = mean(&velocity(0)[touch.saturating_sub(20)..touch.max(1)]);
    let end = velocity(0).len() - 1;
    let after = |bead: usize| mean(&velocity(bead)[end - 20..end]);
    let restitution = (after(1) - after(0)) / before;
    room.check(format!("{which}: speed of the hit"), before, Limit::AtLeast(0.95 * SPEED), "m/s");
    let name = format!("{which}: restitution, lost");
    // What stays in the beads as ringing; the chain has none.
    let most = if matches!(room.fidelity, FidelityLevel::Reduced | FidelityLevel::Fea) { 0.05 } else { 1e-6 };
    room.check(name, (1.0 - restitution).abs(), Limit::AtMost(most), "1");
    let hertz = largest_force(&scene, before);
    let peak = force.iter().copied().fold(0.0, f64::max);
    // A tenth of a microsecond misses the peak by 0.2 %; a finite sphere at 6.5 µm exceeds Hertz' force at that approach by 8 %.
    let most = if room.fidelity == FidelityLevel::Hertz { 5e-3 } else { 0.1 };
    room.check(format!("{which}: largest force against Hertz’"), (peak / hertz - 1.0).abs(), Limit::AtMost(most), "1");
}

/// Largest force (N) of two beads of a scene meeting at a relative speed (m/s).
fn largest_force(scene: &Scene, speed: f64) -> f64 {
    let bead = &scene.chain.beads[0];
    let stiffness = bead_pair_stiffness(bead, bead);
    let overlap = (5.0 * 0.5 * bead.mass() * speed * speed / (4.0 * stiffness)).powf(0.4);
    stiffness * overlap.powf(1.5)
}

fn large(room: &mut Room<'_>) {
    let which = "10 µm";
    // The usual patch of 50 µm is for 3 µm of overlap; a hit ten times as fast lasts 0.6 times as long.
    let patch: &[&str] = match room.fidelity {
        FidelityLevel::Hertz | FidelityLevel::FiniteBody => &[],
        FidelityLevel::Reduced => &["model.contact_patch=0.2"],
        FidelityLevel::Fea => &["model.contact_patch=0.2", "model.step=0.05 us"],
    };
    match room.scene("rigid", &[&["drive.amplitude=10 um"], patch].concat()).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(which, &ran, Balance::UNDAMPED),
        Err(reason) => room.failed(which, reason),
    }
}

/// Drive of which others are scaled copies.
fn scaled(room: &Room<'_>, amplitude: f64) -> Result<Ran, String> {
    // Hertz: with displacements × s and times × s^(−1/4) every term of m ü = k δ^(3/2) is multiplied by s^(3/2).
    let time = (amplitude / 1e-6).powf(-0.25);
    let sets = [
        format!("drive.amplitude={amplitude:e}"),
        format!("drive.frequency={:e}", 73e3 / time),
        format!("duration={:e}", 70e-6 * time),
        format!("output_step={:e}", 1e-7 * time),
    ];
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    room.scene("rigid", &sets).and_then(|scene| room.run(&scene))
}

fn tiny(room: &mut Room<'_>) {
    let which = "1e-12 m";
    if room.fidelity == FidelityLevel::Hertz {
        let pair = scaled(room, 1e-6).and_then(|plain| Ok((plain, scaled(room, 1e-12)?)));
        return match pair {
            Ok((plain, tiny)) => {
                room.sound(which, &tiny, Balance::UNDAMPED);
                let factor = 1e-6_f64.powf(1.25);
                let grown: Vec<f64> = tiny.last().iter().map(|v| v / factor).collect();
                let apart = difference(&grown, plain.last());
                // Tolerance 1e-10, magnified by at most 16/m/s × … over 70 µs.
                let name = format!("{which}: difference from the scaled copy of 1 µm, rms");
                room.check(name, apart, Limit::AtMost(1e-5), "1");
            }
            Err(reason) => room.failed(which, reason),
        };
    }
    match room.scene("rigid", &["drive.amplitude=1e-12"]).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(which, &ran, Balance::UNDAMPED),
        Err(reason) if reason.contains("model.mesh_density") => room.refused(which, reason, "model.mesh_density"),
        Err(reason) => room.failed(which, reason),
    }
}
