//! Which variations a scene has: models, meshes, steps.

use granchain_model::scene::{ContactLaw, ModelKind, Scene, SceneError, Support};

use super::Method;

/// What is refined of a method's integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Step {
    /// Relative error of a step, 1.
    Tolerance(f64),
    /// Fixed, s.
    Time(f64),
}

/// A way to compute a scene.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Variation {
    pub method: Method,
    pub density: Option<u32>,
    pub step: Step,
    /// Whether it is a row; others show what a finer step or mesh changes.
    pub shown: bool,
}

/// Keys that belong to how a scene is computed, by how they begin.
const COMPUTED: [&str; 2] = ["model.", "contact.law"];
/// And what only meshed bodies have.
const OF_MESHES: [&str; 2] = ["loss.beads", "loss.support"];

impl Variation {
    /// Its keys, `KEY=VALUE` as for `--set`.
    pub fn sets(&self) -> Vec<String> {
        let (kind, law) = match self.method {
            Method::Hertz => ("chain", Some("hertz")),
            Method::FiniteBody => ("chain", Some("finite-body")),
            Method::Reduced => ("reduced", None),
            Method::Fea | Method::Effect => ("fea", None),
        };
        let mut sets = vec![format!("model.kind={kind}")];
        sets.extend(law.map(|law| format!("contact.law={law}")));
        sets.extend(self.density.map(|density| format!("model.mesh_density={density}")));
        match self.step {
            Step::Tolerance(_) => sets.push(format!("model.tolerance={}", self.step_said())),
            Step::Time(_) => {
                if kind == "chain" {
                    sets.push("model.integrator=symplectic".into());
                }
                sets.push(format!("model.step={}", self.step_said()));
            }
        }
        sets
    }

    pub fn step_said(&self) -> String {
        match self.step {
            Step::Tolerance(tolerance) => format!("{tolerance:e}"),
            Step::Time(step) => format!("{} ns", 1e-3 * (1e12 * step).round()),
        }
    }

    /// The scene computed so.
    pub fn scene(&self, scene: &Scene) -> Result<Scene, SceneError> {
        let is_chain = matches!(self.method, Method::Hertz | Method::FiniteBody);
        let dropped: Vec<&str> = COMPUTED.into_iter().chain(OF_MESHES.into_iter().filter(|_| is_chain)).collect();
        scene.changed(&dropped, &self.sets())
    }

    /// What it is expected to take for so many s of motion: bodies, s, and run, s, on one thread of a common processor.
    pub fn expected(&self, scene: &Scene, duration: f64) -> (f64, f64) {
        let density = f64::from(self.density.unwrap_or(12)) / 16.0;
        let steps = match self.step {
            Step::Tolerance(_) => duration / 25e-9,
            Step::Time(step) => duration / step,
        };
        let beads = scene.chain.beads.len() as f64 / 6.0;
        let bodies = kinds(scene) * 0.3 * density.powf(2.7);
        match self.method {
            Method::Hertz => (0.0, 1e-6 * beads * steps),
            Method::FiniteBody => (0.06 * kinds(scene) * density.powi(2), 3e-6 * beads * steps),
            Method::Reduced => (bodies, 1e-5 * beads * density.max(0.7) * steps),
            Method::Fea | Method::Effect => (0.0, 2.3e-3 * beads * density.powi(2) * steps),
        }
    }
}

/// Bodies that differ.
fn kinds(scene: &Scene) -> f64 {
    let beads = &scene.chain.beads;
    let differing = beads.iter().enumerate().filter(|(at, bead)| !beads[..*at].contains(bead)).count();
    let has_own_body = matches!(scene.support, Support::Annulus { .. } | Support::Disc { .. });
    differing as f64 + f64::from(u8::from(has_own_body))
}

/// Mesh densities of the reduced bodies: three that are rows, and the one that shows what the finest leaves.
pub(super) type Densities = [u32; 4];

/// The finest set first: the first that fits the time is taken.
pub(super) const DENSITIES: [Densities; 3] = [[12, 16, 24, 32], [8, 12, 16, 24], [6, 8, 12, 16]];

/// Variations by the bodies that they share, each group from its coarsest step to its finest.
pub(super) fn groups(scene: &Scene, densities: Densities, fea: bool) -> Vec<Vec<Variation>> {
    let steps = |method, density, shown: &[Step], helper: Step| -> Vec<Variation> {
        let one = |step: &Step, shown| Variation { method, density, step: *step, shown };
        shown.iter().map(|step| one(step, true)).chain([one(&helper, false)]).collect()
    };
    let time = |nanoseconds: f64| Step::Time(1e-9 * nanoseconds);
    let is_disc = matches!(scene.support, Support::Disc { .. });
    let mut groups = Vec::new();
    if is_disc {
        groups.push(steps(Method::Hertz, None, &[time(50.0), time(25.0), time(12.5)], time(6.25)));
    } else {
        let tolerances = [1e-4, 1e-6, 1e-10].map(Step::Tolerance);
        groups.push(steps(Method::Hertz, None, &tolerances, Step::Tolerance(1e-12)));
        for density in [8, 12] {
            groups.push(steps(Method::FiniteBody, Some(density), &tolerances[1..], Step::Tolerance(1e-12)));
        }
        groups.push(steps(Method::FiniteBody, Some(16), &[], Step::Tolerance(1e-12)));
    }
    let [coarse, usual, fine, finer] = densities;
    groups.push(steps(Method::Reduced, Some(coarse), &[time(50.0)], time(12.5)));
    groups.push(steps(Method::Reduced, Some(usual), &[time(100.0), time(50.0), time(25.0)], time(12.5)));
    groups.push(steps(Method::Reduced, Some(fine), &[time(50.0), time(25.0)], time(12.5)));
    groups.push(steps(Method::Reduced, Some(finer), &[], time(12.5)));
    if fea {
        groups.extend([8, 12].map(|density| steps(Method::Fea, Some(density), &[time(100.0)], time(50.0))));
    }
    groups
}

/// The method of a scene as it is.
pub(super) fn method_of(scene: &Scene) -> Method {
    match scene.model.kind {
        ModelKind::Chain if scene.contact_law == ContactLaw::FiniteBody => Method::FiniteBody,
        ModelKind::Chain => Method::Hertz,
        ModelKind::Reduced => Method::Reduced,
        ModelKind::Fea => Method::Fea,
    }
}
