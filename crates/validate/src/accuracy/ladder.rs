//! The settings that are compared: one line for each model and for each number of it that is varied.

use std::fmt;

use serde::{Deserialize, Serialize};

use granchain_model::scene::{DampingKind, ModelKind, Scene, Support};

/// A model with its way of stepping: one colour of the figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum FidelityLevel {
    /// Chain of Hertz contacts, adaptive Dormand–Prince.
    Chain,
    /// The same at a fixed step, velocity Verlet.
    ChainFixed,
    FiniteBody,
    Reduced,
    Fea,
    /// All nodes, Hilber–Hughes–Taylor with α 0.1.
    FeaDamped,
    /// Chain before a disc, its water by elements.
    ChainElements,
}

impl FidelityLevel {
    /// All of them, in the order of what they leave out.
    pub const ALL: [Self; 7] = [
        Self::Chain,
        Self::ChainFixed,
        Self::FiniteBody,
        Self::ChainElements,
        Self::Reduced,
        Self::Fea,
        Self::FeaDamped,
    ];

    /// As a reader calls it, in a scene with or without a disc on water.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Chain => "chain, adaptive",
            Self::ChainFixed => "chain, fixed step",
            Self::FiniteBody => "chain of finite bodies",
            Self::Reduced => "reduced",
            Self::Fea => "finite elements",
            Self::FeaDamped => "finite elements, HHT 0.1",
            Self::ChainElements => "chain, water by elements",
        }
    }

    #[must_use]
    pub const fn model(self) -> ModelKind {
        match self {
            Self::Chain | Self::ChainFixed | Self::FiniteBody | Self::ChainElements => ModelKind::Chain,
            Self::Reduced => ModelKind::Reduced,
            Self::Fea | Self::FeaDamped => ModelKind::Fea,
        }
    }

    /// The overrides that every setting of the fidelity level has.
    const fn sets(self) -> &'static [&'static str] {
        match self {
            Self::Chain => &["model.kind=chain"],
            Self::ChainFixed => &["model.kind=chain", "model.integrator=symplectic"],
            Self::FiniteBody => &["model.kind=chain", "contact.law=finite-body"],
            Self::Reduced => &["model.kind=reduced"],
            Self::Fea => &["model.kind=fea"],
            Self::FeaDamped => &["model.kind=fea", "model.integrator=hht", "model.numerical_dissipation=0.1"],
            Self::ChainElements => &["model.kind=chain", "model.integrator=symplectic", "water.method=elements"],
        }
    }
}

/// Which number a line varies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Varied {
    /// Relative tolerance of a step, 1.
    Tolerance,
    Step,
    /// Mesh density n; the element size goes as 1/n.
    Density,
    Modes,
    /// Side of the water's elements, m.
    WaterMesh,
}

impl Varied {
    #[must_use]
    pub const fn key(self) -> &'static str {
        match self {
            Self::Tolerance => "model.tolerance",
            Self::Step => "model.step",
            Self::Density => "model.mesh_density",
            Self::Modes => "model.modes",
            Self::WaterMesh => "water.mesh_side",
        }
    }

    /// What the order is an order in, as one says it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Tolerance => "tolerance",
            Self::Step => "step",
            Self::Density => "element size",
            Self::Modes => "modes",
            Self::WaterMesh => "water’s element size",
        }
    }

    /// In a few letters, for the legend of a figure.
    #[must_use]
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::Tolerance => "tol.",
            Self::Step => "Δt",
            Self::Density | Self::WaterMesh => "h",
            Self::Modes => "modes",
        }
    }

    /// The size that goes to zero; modes have none.
    #[must_use]
    pub fn size(self, value: f64) -> Option<f64> {
        match self {
            Self::Tolerance | Self::Step | Self::WaterMesh => Some(value),
            Self::Density => Some(1.0 / value),
            Self::Modes => None,
        }
    }

    fn set(self, value: f64) -> String {
        let text = match self {
            Self::Step => format!("{} ns", short(1e9 * value)),
            Self::WaterMesh => format!("{} mm", short(1e3 * value)),
            Self::Tolerance => format!("{value:e}"),
            Self::Density | Self::Modes => format!("{value}"),
        };
        format!("{}={text}", self.key())
    }
}

/// A number without the dust of its conversion.
pub(super) fn short(value: f64) -> f64 {
    format!("{value:.9e}").parse().unwrap_or(value)
}

/// How a scene is run: overrides of the scene, in order.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Setting {
    #[serde(rename = "rung")]
    pub fidelity: FidelityLevel,
    /// `KEY=VALUE`, as behind `--set`.
    pub sets: Vec<String>,
}

impl fmt::Display for Setting {
    /// What tells it from others of its fidelity level: `mesh_density=12, step=50 ns, modes=8`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let own = self.fidelity.sets();
        let mut given = self.sets.iter().filter(|set| !own.contains(&set.as_str())).map(|set| {
            let (key, value) = set.split_once('=').unwrap_or((set, ""));
            (key.rsplit('.').next().unwrap_or(key).replace('_', " "), value)
        });
        if let Some((key, value)) = given.next() {
            write!(f, "{key} {value}")?;
        }
        given.try_for_each(|(key, value)| write!(f, ", {key} {value}"))
    }
}

impl Setting {
    /// A model with values of what can be varied of it.
    #[must_use]
    pub fn of(fidelity: FidelityLevel, values: &[(Varied, f64)]) -> Self {
        let values = values.iter().map(|(varied, value)| varied.set(*value));
        Self { fidelity, sets: fidelity.sets().iter().map(|set| (*set).to_owned()).chain(values).collect() }
    }
}

/// One number of one model varied, all others kept.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    pub key: &'static str,
    pub fidelity: FidelityLevel,
    pub varied: Varied,
    /// The values, coarsest first, each with its setting.
    pub settings: Vec<(f64, Setting)>,
    /// The limit its own error is measured against, and the next level that shows how far it has converged.
    pub limit: [Setting; 2],
}

/// What is run of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Ladder {
    /// The waveform means something up to here, s.
    pub window: f64,
    /// The reference of the scene, finest bodies and step, and the next level that shows how far it has converged.
    pub best: [Setting; 2],
    pub lines: Vec<Line>,
    pub beside: Vec<Setting>,
    /// The setting whose perturbed copies show the chaos.
    pub chaos: Setting,
}

/// Dearest settings that the quick form leaves to `--full`, by what they are expected to take (s, one thread of a common processor).
const QUICK_SECONDS: f64 = 4.5;

impl Ladder {
    /// The ladder of a scene; the same for all its drives and dampers.
    #[must_use]
    pub fn of(scene: &Scene) -> Self {
        match scene.support {
            Support::Disc { .. } => Self::before_water(),
            _ => Self::dry(scene),
        }
    }

    /// Every setting once: the lines in order, then those beside them.
    #[must_use]
    pub fn settings(&self) -> Vec<Setting> {
        let of_lines = self.lines.iter().flat_map(|line| line.settings.iter().map(|(_, setting)| setting));
        let mut all: Vec<Setting> = Vec::new();
        for setting in of_lines.chain(&self.beside) {
            if !all.contains(setting) {
                all.push(setting.clone());
            }
        }
        all
    }

    fn dry(scene: &Scene) -> Self {
        let (step, density, modes, tolerance) = (Varied::Step, Varied::Density, Varied::Modes, Varied::Tolerance);
        let is_damped = scene.damping.kind != DampingKind::None;
        let window = if is_damped { DAMPED_WINDOW } else { UNDAMPED_WINDOW };
        let exact = [
            Setting::of(FidelityLevel::Chain, &[(tolerance, 1e-13)]),
            Setting::of(FidelityLevel::Chain, &[(tolerance, 1e-14)]),
        ];
        let reduced =
            |n: f64, h: f64, m: f64| Setting::of(FidelityLevel::Reduced, &[(density, n), (step, h), (modes, m)]);
        let mut lines = vec![
            line(
                "chain-tolerance",
                FidelityLevel::Chain,
                tolerance,
                &[],
                &[1e-2, 1e-3, 1e-4, 1e-6, 1e-8],
                Limit::Is(exact.clone()),
            ),
            line(
                "finite-body-tolerance",
                FidelityLevel::FiniteBody,
                tolerance,
                &[(density, 16.0)],
                &[1e-2, 1e-3, 1e-4, 1e-6],
                Limit::At(1e-12, 1e-13),
            ),
            line(
                "finite-body-mesh",
                FidelityLevel::FiniteBody,
                density,
                &[(tolerance, 1e-6)],
                &[6.0, 8.0, 12.0, 16.0],
                Limit::At(32.0, 48.0),
            ),
            line(
                "reduced-step",
                FidelityLevel::Reduced,
                step,
                &[(density, 16.0), (modes, 8.0)],
                &[1e-7, 5e-8, 2.5e-8, 1.25e-8, 6.25e-9],
                Limit::At(1e-9, 0.5e-9),
            ),
            line(
                "reduced-mesh",
                FidelityLevel::Reduced,
                density,
                &[(step, 1.25e-8), (modes, 8.0)],
                &[6.0, 8.0, 12.0, 16.0, 24.0],
                if is_damped { Limit::At(64.0, 88.0) } else { Limit::At(48.0, 64.0) },
            ),
            line(
                "reduced-modes",
                FidelityLevel::Reduced,
                modes,
                &[(density, 16.0), (step, 1.25e-8)],
                &[0.0, 1.0, 2.0, 4.0, 8.0, 16.0],
                Limit::At(64.0, 100.0),
            ),
        ];
        lines.extend(Self::fea());
        let beside = vec![
            reduced(6.0, 1e-7, 0.0),
            reduced(8.0, 1e-7, 0.0),
            reduced(8.0, 5e-8, 2.0),
            reduced(12.0, 5e-8, 8.0),
            reduced(16.0, 5e-8, 4.0),
            reduced(24.0, 2.5e-8, 8.0),
            reduced(32.0, 2.5e-8, 8.0),
            Setting::of(FidelityLevel::Fea, &[(density, 12.0), (step, 1e-7)]),
        ];
        // The annulus converges more slowly in the element size than a bead; step and modes are a twentieth of what the mesh leaves.
        let best = if is_damped {
            [reduced(64.0, 5e-9, 12.0), reduced(88.0, 2.5e-9, 16.0)]
        } else {
            [reduced(64.0, 2.5e-9, 24.0), reduced(88.0, 1.25e-9, 36.0)]
        };
        Self { window, best, lines, beside, chaos: reduced(16.0, 5e-8, 8.0) }
    }

    fn fea() -> Vec<Line> {
        let (step, density) = (Varied::Step, Varied::Density);
        let (steps, limit) = ([1e-7, 5e-8, 2.5e-8], || Limit::At(3.125e-9, 1.5625e-9));
        vec![
            line("fea-step", FidelityLevel::Fea, step, &[(density, 8.0)], &steps, limit()),
            line("fea-mesh", FidelityLevel::Fea, density, &[(step, 5e-8)], &[6.0, 8.0, 12.0], Limit::At(24.0, 32.0)),
            line("fea-hht-step", FidelityLevel::FeaDamped, step, &[(density, 8.0)], &steps, limit()),
        ]
    }

    fn before_water() -> Self {
        let (step, density, modes) = (Varied::Step, Varied::Density, Varied::Modes);
        let reduced =
            |n: f64, h: f64, m: f64| Setting::of(FidelityLevel::Reduced, &[(density, n), (step, h), (modes, m)]);
        let fixed = |h: f64| Setting::of(FidelityLevel::ChainFixed, &[(step, h)]);
        let lines = vec![
            line(
                "chain-step",
                FidelityLevel::ChainFixed,
                step,
                &[],
                &[5e-8, 2.5e-8, 1.25e-8, 6.25e-9],
                Limit::At(1.5625e-9, 7.8125e-10),
            ),
            line(
                "chain-elements-mesh",
                FidelityLevel::ChainElements,
                Varied::WaterMesh,
                &[(step, 2.5e-8)],
                &[1e-4, 7e-5, 5e-5],
                Limit::At(2.5e-5, 2e-5),
            ),
            line(
                "reduced-step",
                FidelityLevel::Reduced,
                step,
                &[(density, 16.0), (modes, 8.0)],
                &[5e-8, 2.5e-8, 1.25e-8],
                Limit::At(3.125e-9, 1.5625e-9),
            ),
            line(
                "reduced-mesh",
                FidelityLevel::Reduced,
                density,
                &[(step, 1.25e-8), (modes, 8.0)],
                &[8.0, 12.0, 16.0, 24.0],
                Limit::At(64.0, 88.0),
            ),
            line(
                "fea-step",
                FidelityLevel::Fea,
                step,
                &[(density, 8.0)],
                &[5e-8, 2.5e-8, 1.25e-8],
                Limit::At(3.125e-9, 1.5625e-9),
            ),
        ];
        let beside = vec![
            reduced(12.0, 5e-8, 8.0),
            reduced(16.0, 6.25e-9, 8.0),
            Setting::of(FidelityLevel::Fea, &[(density, 12.0), (step, 5e-8)]),
        ];
        let best = [reduced(64.0, 6.25e-9, 12.0), reduced(88.0, 3.125e-9, 12.0)];
        Self { window: WATER_WINDOW, best, lines, beside, chaos: fixed(2.5e-8) }
    }
}

/// Waveforms mean something, and references converge, up to here, s. Undamped: chaos. With dashpots: past 100 µs the mesh of the reference
/// leaves more than 0.1 %. Before water: at 76 µs beads that had parted meet, and what a step changes no longer falls with its square.
const UNDAMPED_WINDOW: f64 = 70e-6;
const DAMPED_WINDOW: f64 = 100e-6;
const WATER_WINDOW: f64 = 75e-6;

impl Setting {
    fn value(&self, varied: Varied) -> Option<f64> {
        let set = self.sets.iter().find_map(|set| set.strip_prefix(varied.key())?.strip_prefix('='))?;
        let (number, factor) = match varied {
            Varied::Step => (set.strip_suffix(" ns")?, 1e-9),
            Varied::WaterMesh => (set.strip_suffix(" mm")?, 1e-3),
            Varied::Tolerance | Varied::Density | Varied::Modes => (set, 1.0),
        };
        number.parse::<f64>().ok().map(|number| number * factor)
    }

    /// Its fixed step, s; none where it adapts.
    #[must_use]
    pub fn step(&self) -> Option<f64> {
        self.value(Varied::Step)
    }

    /// What a run of `duration` (s) is expected to take on one thread of a common processor, s: for the bar and for what is left to
    /// `--full`, to a factor of two.
    #[must_use]
    pub fn expected_seconds(&self, duration: f64) -> f64 {
        let density = self.value(Varied::Density).unwrap_or(12.0) / 12.0;
        let steps = |step: f64| duration / self.value(Varied::Step).unwrap_or(step);
        let modes = self.value(Varied::Modes).unwrap_or(8.0);
        match self.fidelity {
            FidelityLevel::Chain => 0.03 * duration / 1e-4,
            FidelityLevel::ChainFixed => 1.5e-6 * steps(25e-9),
            FidelityLevel::FiniteBody => 0.3 * density * density + 0.1 * duration / 1e-4,
            FidelityLevel::Reduced => {
                0.2 * density.powf(2.2) * (1.0 + modes / 16.0) + 7e-6 * density.max(1.0) * steps(5e-8)
            }
            FidelityLevel::Fea | FidelityLevel::FeaDamped => {
                0.1 * density * density + 1.3e-3 * density * density * steps(1e-7)
            }
            FidelityLevel::ChainElements => {
                let side = 5e-5 / self.value(Varied::WaterMesh).unwrap_or(5e-5);
                1.5e-4 * side * side * steps(25e-9)
            }
        }
    }

    /// Whether the quick form measures it.
    #[must_use]
    pub(crate) fn is_quick(&self, duration: f64) -> bool {
        self.expected_seconds(duration) <= QUICK_SECONDS
    }
}

enum Limit {
    /// At these two values of what it varies.
    At(f64, f64),
    Is([Setting; 2]),
}

fn line(
    key: &'static str,
    fidelity: FidelityLevel,
    varied: Varied,
    fixed: &[(Varied, f64)],
    values: &[f64],
    limit: Limit,
) -> Line {
    // The same order in every line, so that settings of two lines are seen to be the same.
    let at = |value: f64| {
        let mut all: Vec<(Varied, f64)> = fixed.iter().copied().chain([(varied, value)]).collect();
        all.sort_by_key(|(varied, _)| match varied {
            Varied::Density => 0,
            Varied::Step => 1,
            Varied::Modes => 2,
            Varied::Tolerance => 3,
            Varied::WaterMesh => 4,
        });
        Setting::of(fidelity, &all)
    };
    let limit = match limit {
        Limit::At(reference, next) => [at(reference), at(next)],
        Limit::Is(settings) => settings,
    };
    let settings = values.iter().map(|value| (*value, at(*value))).collect();
    Line { key, fidelity, varied, settings, limit }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    #[test]
    fn every_setting_of_every_built_in_scene_is_a_scene_and_stands_once() {
        for name in ["rigid", "annulus", "water"] {
            let ladder = Ladder::of(&scene::load(name, &[]).unwrap());
            let settings = ladder.settings();
            for (index, setting) in settings.iter().enumerate() {
                scene::load(name, &setting.sets).unwrap_or_else(|error| panic!("{name}, {setting}: {error}"));
                assert!(!settings[..index].contains(setting), "{name}: {setting} twice");
            }
            for setting in ladder.lines.iter().flat_map(|line| &line.limit).chain(&ladder.best) {
                scene::load(name, &setting.sets).unwrap_or_else(|error| panic!("{name}, {setting}: {error}"));
            }
        }
    }

    #[test]
    fn lines_share_the_settings_that_are_the_same() {
        let ladder = Ladder::of(&scene::load("rigid", &[]).unwrap());
        let find = |key: &str| ladder.lines.iter().find(|line| line.key == key).unwrap();
        let (step, mesh, modes) = (find("reduced-step"), find("reduced-mesh"), find("reduced-modes"));
        assert_eq!(step.settings[3].1, mesh.settings[3].1);
        assert_eq!(mesh.settings[3].1, modes.settings[4].1);
        assert_eq!(step.settings[3].1.to_string(), "mesh density 16, step 12.5 ns, modes 8");
    }
}
