//! The step, from useless to far too fine.

use super::{Limit, room::Room};
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
