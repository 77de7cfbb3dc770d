//! Fast hits, large and tiny drives.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Ran, Room, difference},
};
use granchain_model::{
    contact_law::bead_pair_stiffness,
    scene::{PistonMotion, Scene},
};

/// Speed of the hit of case 3, m/s.
const SPEED: f64 = 10.0;
/// The piston's speed rises over this time and falls again, s.
const RAMP: f64 = 30e-6;

/// A piston that throws: smoothly up to a speed (m/s) over a time (s) and back to rest over another.
pub(super) struct Throw {
    pub speed: f64,
    pub ramp: f64,
}

impl Throw {
    pub(super) const fn at(speed: f64) -> Self {
        Self { speed, ramp: RAMP }
    }
}

impl PistonMotion for Throw {
    fn on_piece(&self, _piece: usize, t: f64) -> (f64, f64) {
        let Self { speed, ramp } = *self;
        // v = V s²(3 − 2s), its integral V T (s³ − s⁴/2).
        let rise = |t: f64| {
            let s = (t / ramp).clamp(0.0, 1.0);
            let after = (t - ramp).max(0.0);
            (speed * (ramp * (s.powi(3) - 0.5 * s.powi(4)) + after), speed * s * s * (3.0 - 2.0 * s))
        };
        let ((up, gained), (down, lost)) = (rise(t), rise(t - ramp));
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

/// A bead thrown at another.
pub(super) struct Hit {
    pub ran: Ran,
    pub scene: Scene,
    /// Velocity of the first bead before, of both at the end, m/s: means over two microseconds, since centres ring in the models of elastic bodies.
    pub before: f64,
    pub after: [f64; 2],
    /// Largest force between them, N.
    pub force: f64,
}

/// Throw the first of two beads (gaps, duration and what else in `sets`).
pub(super) fn thrown(room: &Room<'_>, throw: &Throw, sets: &[&str]) -> Result<Hit, String> {
    let plain = ["chain.beads=2", "chain.gaps.contact1=0 m", "output_step=0.1 us"];
    let scene = room.scene("rigid", &[&plain[..], sets].concat())?;
    let ran = room.run_with(&scene, throw)?;
    let velocity = |bead: usize| &ran.response.bead_velocity[bead].values;
    let force = &ran.response.contact_force[1];
    // A dashpot may take all of the force into a step between two samples.
    let place = |bead: usize, sample: usize| ran.response.bead_displacement[bead].values[sample];
    let meet = |sample: &usize| place(0, *sample) - place(1, *sample) >= scene.chain.gaps[1];
    let touch = (0..force.len()).find(meet).ok_or("the beads do not meet")?;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let before = mean(&velocity(0)[touch.saturating_sub(20)..touch.max(1)]);
    let end = velocity(0).len() - 1;
    let after = [0, 1].map(|bead| mean(&velocity(bead)[end - 20..end]));
    let force = force.peak();
    Ok(Hit { before, after, force, ran, scene })
}

/// Share of a hit's speed that may stay in the beads as ringing; the chain has none.
pub(super) fn ringing(room: &Room<'_>) -> f64 {
    if matches!(room.fidelity, FidelityLevel::Reduced | FidelityLevel::Fea) { 0.05 } else { 1e-6 }
}

/// What restitution and largest force of two beads are held against.
pub(super) fn elastic(room: &mut Room<'_>, which: &str, hit: &Hit) {
    let restitution = (hit.after[1] - hit.after[0]) / hit.before;
    let most = ringing(room);
    room.check(format!("{which}: restitution, lost"), (1.0 - restitution).abs(), Limit::AtMost(most), "1");
    let hertz = largest_force(&hit.scene, hit.before);
    // A tenth of a microsecond misses the peak by 0.2 %; a finite sphere at 6.5 µm exceeds Hertz' force at that approach by 8 %.
    let most = if room.fidelity == FidelityLevel::Hertz { 5e-3 } else { 0.1 };
    let name = format!("{which}: largest force against Hertz’");
    room.check(name, (hit.force / hertz - 1.0).abs(), Limit::AtMost(most), "1");
}

fn hit(room: &mut Room<'_>) {
    let which = "10 m/s";
    let sets = ["chain.gaps.contact2=300 um", "chain.gaps.contact3=450 um", "duration=75 us"];
    match thrown(room, &Throw::at(SPEED), &sets) {
        Ok(hit) => {
            room.sound(which, &hit.ran, Balance::UNDAMPED);
            room.check(format!("{which}: speed of the hit"), hit.before, Limit::AtLeast(0.95 * SPEED), "m/s");
            elastic(room, which, &hit);
        }
        Err(reason) => room.failed(which, reason),
    }
}

/// Largest force (N) of two beads of a scene meeting at a relative speed (m/s).
pub(super) fn largest_force(scene: &Scene, speed: f64) -> f64 {
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

/// Drive of so many m times α, of which others are scaled copies.
fn scaled(room: &Room<'_>, amplitude: f64, alpha: f64) -> Result<Ran, String> {
    // Hertz: with displacements × s and times × s^(−1/4) every term of m ü = k δ^(3/2) is multiplied by s^(3/2).
    let time = (alpha * amplitude / 1e-6).powf(-0.25);
    let sets = [
        format!("alpha={alpha:e}"),
        format!("drive.amplitude={amplitude:e}"),
        format!("drive.frequency={:e}", 73e3 / time),
        format!("duration={:e}", 70e-6 * time),
        format!("output_step={:e}", 1e-7 * time),
    ];
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    room.scene("rigid", &sets).and_then(|scene| room.run(&scene))
}

/// A chain of Hertz contacts driven by 1 pm or so is the scaled copy of one driven by 1 µm.
pub(super) fn copy(room: &mut Room<'_>, which: &str, amplitude: f64, alpha: f64) {
    match scaled(room, 1e-6, 1.0).and_then(|plain| Ok((plain, scaled(room, amplitude, alpha)?))) {
        Ok((plain, tiny)) => {
            room.sound(which, &tiny, Balance::UNDAMPED);
            let factor = (alpha * amplitude / 1e-6).powf(1.25);
            let grown: Vec<f64> = tiny.last().iter().map(|v| v / factor).collect();
            let apart = difference(&grown, plain.last());
            // Tolerance 1e-10, magnified by at most 16/m/s × … over 70 µs.
            let name = format!("{which}: difference from the scaled copy of 1 µm, rms");
            room.check(name, apart, Limit::AtMost(1e-5), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}

fn tiny(room: &mut Room<'_>) {
    let which = "1e-12 m";
    if room.fidelity == FidelityLevel::Hertz {
        return copy(room, which, 1e-12, 1.0);
    }
    match room.scene("rigid", &["drive.amplitude=1e-12"]).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(which, &ran, Balance::UNDAMPED),
        Err(reason) if reason.contains("model.mesh_density") => room.refused(which, reason, "model.mesh_density"),
        Err(reason) => room.failed(which, reason),
    }
}
