//! Scenes, runs and a push that the tests of horn, holder and losses share.

use std::f64::consts::PI;

use granchain::{
    model,
    response::{Channels, Response},
    scene::{self, PistonMotion, Scene},
};

/// A built-in scene on a model, its bodies coarsely meshed.
pub fn load(name: &str, kind: &str, keys: &[&str]) -> Scene {
    let kind_key = format!("model.kind={kind}");
    let density: &[&str] = if kind == "chain" { &[] } else { &["model.mesh_density=6"] };
    let all = [&kind_key[..]].into_iter().chain(density.iter().copied()).chain(keys.iter().copied());
    scene::load(name, &all.map(str::to_owned).collect::<Vec<_>>()).unwrap_or_else(|error| panic!("{error}"))
}

pub fn run(scene: &Scene) -> Response {
    model::run(scene, &mut |_| true).unwrap_or_else(|error| panic!("{error}"))
}

pub fn channels(response: &Response) -> Channels {
    response.energy.channels.unwrap()
}

/// A push that ends at rest: the velocity is a raised cosine up to `until` (s), forward and never back.
pub struct Knock {
    /// Largest speed, m/s.
    pub speed: f64,
    pub until: f64,
}

impl PistonMotion for Knock {
    fn breaks(&self) -> &[f64] {
        &[]
    }

    fn on_piece(&self, _: usize, time: f64) -> (f64, f64) {
        if time >= self.until {
            return (0.5 * self.speed * self.until, 0.0);
        }
        let turn = 2.0 * PI / self.until;
        (0.5 * self.speed * (time - (turn * time).sin() / turn), 0.5 * self.speed * (1.0 - (turn * time).cos()))
    }
}
