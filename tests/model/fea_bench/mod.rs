//! Scenes, pistons and thrown beads for the tests of the contact finite element analysis.
#![allow(dead_code, reason = "each test binary takes what it needs")]

use granchain::{
    model::fea::{Control, FeaError, Simulation},
    response::Response,
    scene::{self, PistonMotion, Scene},
};

/// A built-in scene on the contact finite element analysis.
pub fn scene(name: &str, overrides: &[&str]) -> Scene {
    let mut all = vec!["model.kind=fea".to_owned()];
    all.extend(overrides.iter().map(|text| (*text).to_owned()));
    scene::load(name, &all).unwrap()
}

/// A piston at constant velocity from t = 0, at rest from `breaks[1]` on.
pub struct Push {
    speed: f64,
    breaks: [f64; 2],
}

impl PistonMotion for Push {
    fn on_piece(&self, piece: usize, t: f64) -> (f64, f64) {
        match piece {
            0 => (0.0, 0.0),
            1 => (self.speed * t, self.speed),
            _ => (self.speed * self.breaks[1], 0.0),
        }
    }

    fn breaks(&self) -> &[f64] {
        &self.breaks
    }
}

/// A piston at `speed` (m/s) until `until` (s).
pub fn push(speed: f64, until: f64) -> Box<dyn PistonMotion> {
    Box::new(Push { speed, breaks: [0.0, until] })
}

/// A piston that stays where it is.
pub fn still() -> Box<dyn PistonMotion> {
    push(0.0, 1.0)
}

pub fn finish(simulation: &mut Simulation) -> Result<Response, FeaError> {
    while !simulation.is_done() {
        simulation.advance()?;
    }
    Ok(simulation.response())
}

/// Run a scene with its own drive.
pub fn run(scene: &Scene) -> (Simulation<'static>, Response) {
    let mut simulation = Simulation::new(scene, Control::default()).unwrap();
    let response = finish(&mut simulation).unwrap();
    (simulation, response)
}

/// The scene at time zero with the piston still and bead `number` (from 1) flying at `speed` (m/s) without strain: a saved state is given
/// that velocity, and the books its energy.
pub fn thrown(scene: &Scene, number: usize, speed: f64) -> Simulation<'static> {
    let mut simulation = Simulation::with_motion(scene, still(), Control::default()).unwrap();
    let mut state = serde_json::to_value(simulation.snapshot("thrown")).unwrap();
    let velocity = state["motion"]["velocity"][number].as_array_mut().unwrap();
    velocity.iter_mut().skip(1).step_by(2).for_each(|axial| *axial = speed.into());
    state["motion"]["rigid"][number]["velocity"] = speed.into();
    let mass = simulation.arrangement().kinds[simulation.arrangement().beads[number - 1]].total_mass();
    for key in ["initial", "kinetic", "largest"] {
        state["ledger"][key] = (0.5 * mass * speed * speed).into();
    }
    simulation.restore(serde_json::from_value(state).unwrap(), "thrown").unwrap();
    simulation
}

/// Mass-mean velocity of every bead, m/s.
pub fn mean_velocities(simulation: &Simulation) -> Vec<f64> {
    let arrangement = simulation.arrangement();
    (1..=arrangement.beads.len())
        .map(|slot| {
            let (_, velocity, column) = simulation.motion().columns(slot).unwrap();
            let mut mean = vec![0.0; velocity.width()];
            arrangement.kinds[arrangement.beads[slot - 1]].mass_mean(velocity, &mut mean);
            mean[column]
        })
        .collect()
}
