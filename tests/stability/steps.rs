//! The step, from useless to far too fine.

use super::{
    FidelityLevel, Limit,
    room::{Balance, Room},
};
use granchain_model::scene::PistonMotion;

/// A piston that moves at constant speed from the start.
pub(super) struct Push(pub f64);

impl PistonMotion for Push {
    fn on_piece(&self, _piece: usize, t: f64) -> (f64, f64) {
        (self.0 * t.max(0.0), self.0)
    }

    fn breaks(&self) -> &[f64] {
        &[0.0]
    }
}

/// A piston moved on by so much (m) within so long (s).
pub(super) struct Slope {
    pub distance: f64,
    pub time: f64,
}

impl PistonMotion for Slope {
    fn on_piece(&self, _piece: usize, t: f64) -> (f64, f64) {
        let x = (t / self.time).clamp(0.0, 1.0);
        (self.distance * x * x * (3.0 - 2.0 * x), self.distance * 6.0 * x * (1.0 - x) / self.time)
    }

    fn breaks(&self) -> &[f64] {
        &[]
    }
}

/// Force of a piston at 0.1 m/s that hits a bead at rest, every 0.1 µs of the 4.2 µs it lasts.
fn hit(room: &Room<'_>, step: f64, more: &[&str]) -> Result<Vec<f64>, String> {
    let sets = [format!("model.step={step:e}"), format!("output_step={:e}", step.max(1e-7))];
    let plain = ["chain.beads=1", "chain.gaps.contact1=0 m", "chain.gaps.contact2=10 um", "duration=5 us"];
    let mesh = ["model.mesh_density=8"];
    let own = [sets[0].as_str(), sets[1].as_str()];
    let scene = room.scene("rigid", &[&plain[..], &mesh[..], &own[..], more].concat())?;
    Ok(room.run_with(&scene, &Push(0.1))?.response.contact_force.remove(0).values)
}

/// rms of the difference from a finer run over its peak, both seen every `stride` samples of the finer, 1.
fn error(force: &[f64], reference: &[f64], stride: usize) -> f64 {
    let peak = reference.iter().copied().fold(0.0, f64::max);
    let pairs = || force.iter().zip(reference.iter().step_by(stride));
    let sum: f64 = pairs().map(|(a, b)| (a - b).powi(2)).sum();
    (sum / pairs().count() as f64).sqrt() / peak
}

pub(super) fn examine(room: &mut Room<'_>) {
    let finest = 1e-9;
    let reference = match hit(room, finest / 2.0, &[]) {
        Ok(reference) => reference,
        Err(reason) => return room.failed("reference", reason),
    };
    let steps = [1e-6, 5e-7, 1e-7, 5e-8, 2e-8, 1e-8, 5e-9, 2e-9, 1e-9];
    let mut errors = Vec::new();
    for step in steps.into_iter().filter(|step| *step >= 0.99 * finest) {
        let which = format!("{} µs", 1e6 * step);
        let stride = (step / 1e-7).round().max(1.0) as usize;
        match hit(room, step, &[]) {
            Ok(force) => errors.push((step, error(&force, &reference, stride))),
            Err(reason) if step > 2e-7 => room.refused(&which, reason, "model.step"),
            Err(reason) => room.failed(&which, reason),
        }
    }
    // A tenth for the chance of single points.
    let rise = errors.windows(2).map(|pair| pair[1].1 / pair[0].1).fold(0.0, f64::max);
    room.check("largest growth of the force’s error from a step to the next", rise, Limit::AtMost(1.1), "1");
    if let (Some(first), Some(last)) = (errors.first(), errors.last()) {
        let name = format!("error at {} µs over that at {} µs", 1e6 * last.0, 1e6 * first.0);
        room.check(name, last.1 / first.1, Limit::AtMost(0.1), "1");
    }
}

/// A step fifty times the default's: it is refused, or the balance of energy warns.
pub(super) fn too_large(room: &mut Room<'_>) {
    let (scene, default) = match room.fidelity {
        // The chain has a fixed step on the clock of a disc only.
        FidelityLevel::Hertz | FidelityLevel::FiniteBody => ("water", 0.025),
        FidelityLevel::Reduced => ("rigid", 0.05),
        FidelityLevel::Fea => ("rigid", 0.1),
    };
    let step = 50.0 * default;
    let set = [format!("model.step={step} us"), format!("output_step={step} us")];
    let which = format!("{step} µs at 73 kHz");
    // A twentieth of a period is the longest step of any scene.
    match room.scene(scene, &[&set[0], &set[1], "duration=125 us"]).and_then(|scene| room.run(&scene)) {
        Ok(_) => room.failed(&which, "neither refused nor warned of".to_owned()),
        Err(reason) => room.refused(&which, reason, "model.step"),
    }
    // A slow drive admits it, and the collisions that it makes, of 5 µs, do not.
    let slow = ["drive.kind=sine", "drive.frequency=1 kHz", "drive.amplitude=10 um", "drive.cycles=2"];
    let which = format!("{default} µs at 1 kHz");
    match room.scene(scene, &[&slow[..], &["duration=100 us"]].concat()).and_then(|scene| room.run(&scene)) {
        Ok(ran) => room.sound(&which, &ran, Balance::WATER),
        Err(reason) => room.failed(&which, reason),
    }
    let which = format!("{step} µs at 1 kHz");
    let long = [&slow[..], &[&set[0], &set[1], "duration=2 ms"]].concat();
    match room.scene(scene, &long).and_then(|scene| room.run(&scene)) {
        Ok(ran) => {
            let warned = f64::from(u8::from(ran.response.energy.warning().is_some()));
            room.check(format!("{which}: refused, or warned of the energy"), warned, Limit::AtLeast(1.0), "1");
        }
        Err(reason) => room.refused(&which, reason, "step"),
    }
}

/// An undamped chain that rings for ten million steps.
pub(super) fn ten_million(room: &mut Room<'_>) {
    let which = "1050 ms";
    match room.scene("rigid", &["duration=1050 ms", "output_step=20 us"]).and_then(|scene| room.run(&scene)) {
        Ok(ran) => {
            // Were each step's error of 1e-10 of one sign, a thousandth would be missing.
            room.sound(which, &ran, Balance { chain: 1e-3, ..Balance::UNDAMPED });
            let steps = ran.response.work.steps as f64;
            room.check(format!("{which}: steps"), steps, Limit::AtLeast(1e7), "1");
        }
        Err(reason) => room.failed(which, reason),
    }
}
