//! `granchain contact`: press one contact together and hold it against closed laws.

use clap::{Args, ValueEnum};

use super::{
    Outcome,
    arguments::{OutputArguments, Session, ValueError, positive_quantity, usage},
    interrupt,
    output::{OutputFolder, page_results},
    progress, summary,
    timing::{self, Timing},
};
use crate::{
    measurement::shell_line,
    model::{
        Estimate,
        contact_law::{Annulus, ElasticLaw, FiniteBody, Hertz, Law, bead_flat_stiffness, bead_pair_stiffness},
        fea::statics::{Curve, Loading, StaticState, Touching},
    },
    report::{
        contact::{ContactLoading, ContactReport, ContactState},
        number::{engineering, fixed, significant},
    },
    scene::{self, Bead, FeaSettings, FlatContact, ModelKind, Scene, Support},
    signal::Dimension,
};

/// Arguments of `granchain contact`.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  granchain contact --pair bead-bead --out bead-bead")]
pub struct Arguments {
    /// Which two bodies
    #[arg(long, value_enum, help_heading = "Contact")]
    pub pair: PairChoice,
    /// Approaches of the two bodies' mass means, each with its unit [default: 0.02um to 3um, on the annulus to 5um]
    #[arg(long, value_name = "LENGTH,…", value_delimiter = ',', value_parser = approach, help_heading = "Contact")]
    pub approaches: Vec<f64>,
    /// Built-in scene or scene file with the bodies [default: rigid, for the annulus annulus]
    #[arg(long, value_name = "NAME|FILE", help_heading = "Scene")]
    pub scene: Option<String>,
    /// Override one key of the scene, such as model.mesh_density=24; repeatable
    #[arg(long = "set", value_name = "KEY=VALUE", help_heading = "Scene")]
    pub set: Vec<String>,
    /// Where results go.
    #[command(flatten)]
    pub output: OutputArguments,
    /// Session flags.
    #[command(flatten)]
    pub session: Session,
}

/// `--pair`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PairChoice {
    /// The first bead and another like it
    BeadBead,
    /// The first bead on a rigid flat
    BeadFlat,
    /// The last bead on the annulus
    BeadAnnulus,
}

/// Approaches where none are given, m; those beyond the limit of the pair are left out.
const APPROACHES: [f64; 13] =
    [0.02e-6, 0.05e-6, 0.1e-6, 0.2e-6, 0.3e-6, 0.5e-6, 0.7e-6, 1e-6, 1.5e-6, 2e-6, 3e-6, 4e-6, 5e-6];

impl PairChoice {
    const fn touching(self) -> Touching {
        match self {
            Self::BeadBead => Touching::BeadBead,
            Self::BeadFlat => Touching::BeadFlat,
            Self::BeadAnnulus => Touching::BeadAnnulus,
        }
    }

    const fn name(self) -> &'static str {
        match self {
            Self::BeadBead => "bead on bead",
            Self::BeadFlat => "bead on rigid flat",
            Self::BeadAnnulus => "bead on annulus",
        }
    }

    fn approaches(self) -> Vec<f64> {
        let most = if self == Self::BeadAnnulus { 5e-6 } else { 3e-6 };
        APPROACHES.into_iter().filter(|approach| *approach <= most).collect()
    }

    const fn finite_body(self, loading: Loading) -> Option<FiniteBody> {
        match (self, loading) {
            (Self::BeadBead, Loading::BothPoles) => Some(FiniteBody::BeadsSqueezed),
            (Self::BeadBead, Loading::OneSided) => Some(FiniteBody::BeadsColliding),
            (Self::BeadFlat, Loading::OneSided) => Some(FiniteBody::FlatColliding),
            (Self::BeadFlat, Loading::BothPoles) | (Self::BeadAnnulus, _) => None,
        }
    }
}

fn approach(text: &str) -> Result<f64, ValueError> {
    positive_quantity(text, Dimension::LENGTH)
}

/// Run it.
///
/// # Errors
/// Whatever is wrong with the scene; a folder that cannot be written; Ctrl-C.
pub fn execute(arguments: Arguments) -> anyhow::Result<Outcome> {
    let Arguments { pair, mut approaches, scene: source, set, output, session } = arguments;
    let mut timing = Timing::start();
    let source = source.unwrap_or_else(|| if pair == PairChoice::BeadAnnulus { "annulus" } else { "rigid" }.into());
    let overrides: Vec<String> = std::iter::once("model.kind=fea".to_owned()).chain(set).collect();
    let scene = scene::load(&source, &overrides)?.with_limits(session.limits());
    Estimate::of_bodies(&scene).check(&scene.model.limits)?;
    if approaches.is_empty() {
        approaches = pair.approaches();
    }
    approaches.sort_by(f64::total_cmp);
    approaches.dedup();
    let folder = output
        .out
        .as_deref()
        .map(|out| OutputFolder::stage(out, &page_results("contact.json"), output.force))
        .transpose()?;
    timing.stage("read");

    let bar = progress::bar(&session, 2 * approaches.len() as u64, "states");
    let ring = ring_law(&scene, &session)?;
    let job = Job { pair, scene: &scene, approaches: &approaches, ring };
    let report = job.report(&|| bar.inc(1));
    bar.finish_and_clear();
    let report = report?;
    timing.stage("press");
    for warning in &report.warnings {
        session.note(format_args!("warning: {warning}"));
    }
    let mut text = text(&report);
    match folder {
        Some(folder) => {
            folder.write("scene.toml", scene.to_toml())?;
            for (name, bytes) in report.files()? {
                folder.write(name, bytes)?;
            }
            timing.stage("write");
            folder.write(timing::FILE, timing.to_json())?;
            let place = folder.finish()?;
            session.note(format_args!("written to {}", place.display()));
        }
        None => text.push_str("\nNothing was written; pass --out DIR for tables, pressure profiles and figures.\n"),
    }
    session.result(text, &report)?;
    Ok(Outcome::Done)
}

/// The law that the chain has of the scene's ring, or of the paper's where it has none.
fn ring_law(scene: &Scene, session: &Session) -> anyhow::Result<Annulus> {
    let factor = match scene.support {
        Support::Annulus { stiffness_factor, .. } => stiffness_factor,
        _ => 1.0,
    };
    if !scene.has_own_ring() {
        return Ok(Annulus::new(factor));
    }
    let mut chain = scene.clone();
    (chain.model.kind, chain.model.fea) = (ModelKind::Chain, FeaSettings::default());
    let prepared = session.prepare(&chain)?;
    let fitted = prepared.contact_laws().and_then(|laws| laws.fits.last());
    match fitted.map(|fit| fit.law) {
        Some(Law::Annulus(law)) => Ok(law.unscaled().times(factor)),
        _ => anyhow::bail!("the chain has no law of this ring; refine `model.mesh_density`"),
    }
}

struct Job<'a> {
    pair: PairChoice,
    scene: &'a Scene,
    approaches: &'a [f64],
    /// The chain's law of the ring.
    ring: Annulus,
}

impl Job<'_> {
    fn bead(&self) -> anyhow::Result<&Bead> {
        let beads = &self.scene.chain.beads;
        let bead = if self.pair == PairChoice::BeadAnnulus { beads.last() } else { beads.first() };
        bead.ok_or_else(|| usage("the scene has no beads; set chain.beads"))
    }

    fn report(&self, done: &dyn Fn()) -> anyhow::Result<ContactReport> {
        let mut warnings = Vec::new();
        let mut loadings = Vec::new();
        let mut description = String::new();
        for (loading, name) in
            [(Loading::BothPoles, "squeezed at both poles"), (Loading::OneSided, "loaded on one side")]
        {
            let curve = Curve::new(self.scene, self.pair.touching(), loading)?;
            description = self.description(&curve)?;
            let mut states = Vec::new();
            for approach in self.approaches {
                interrupt::check()?;
                match curve.at(*approach) {
                    Ok(state) => states.push(self.state(&curve, loading, state)?),
                    // Two loadings that both fail at every approach leave no state, and the report refuses to be made.
                    Err(error) => warnings.push(format!("{name}, {}: {error}", engineering(*approach, "m", 3))),
                }
                done();
            }
            loadings.push(ContactLoading { name: name.into(), states });
        }
        if loadings.iter().all(|loading| loading.states.is_empty()) {
            anyhow::bail!("no approach can be computed: {}", warnings.join("; "));
        }
        let annulus = self.pair == PairChoice::BeadAnnulus;
        let abscissa = if annulus { "Distance from the middle of the contact" } else { "Radius" };
        Ok(ContactReport {
            program: summary::program(),
            pair: self.pair.name().into(),
            description,
            law: if annulus { "the chain's law" } else { "Hertz" }.into(),
            abscissa: abscissa.into(),
            loadings,
            warnings,
            statements: self.statements(),
            command_line: shell_line(std::iter::once("granchain".to_owned()).chain(super::typed().skip(1))),
        })
    }

    fn description(&self, curve: &Curve) -> anyhow::Result<String> {
        let bead = self.bead()?;
        let fea = &self.scene.model.fea;
        let arrangement = curve.arrangement();
        let kinds = arrangement.beads.iter().chain(&arrangement.support);
        let elements: usize = kinds.map(|&kind| arrangement.kinds[kind].mesh().elements.len()).sum();
        Ok(format!(
            "A bead of radius {} of {} pressed together with {}, axisymmetric, frictionless: {elements} elements ({}, density {}), \
             {} unknowns. The approach is that of the mass means of both bodies; a clamped body stays.",
            engineering(bead.radius, "m", 4),
            bead.material.name,
            match self.pair {
                PairChoice::BeadBead => "another like it",
                PairChoice::BeadFlat => "a rigid flat",
                PairChoice::BeadAnnulus => "the support",
            },
            fea.elements.name(),
            fea.density,
            arrangement.unknowns(),
        ))
    }

    fn statements(&self) -> Vec<String> {
        let mut said = vec![
            "Squeezed at both poles: the opposite pole carries the same force, as in a static chain. Loaded on one side: the force is \
             balanced by the bead's inertia, as in a collision."
                .to_owned(),
        ];
        match self.pair {
            PairChoice::BeadAnnulus if self.scene.has_own_ring() => said.push(
                "The chain's law of this ring, w = F (C − D ln F), is fitted to static solutions between 0.05 and 5 µm at a mesh density of 12."
                    .to_owned(),
            ),
            PairChoice::BeadAnnulus => said.push(
                "The chain's law of the annulus is fitted to five forces of a converged static solution between 0.1 and 5 µm."
                    .to_owned(),
            ),
            PairChoice::BeadBead | PairChoice::BeadFlat => {
                said.push(
                    "Hertz takes each body for a half-space; a whole sphere is stiffer by a few per cent. The finite-body law is a \
                     fit of this excess for ν = 0.3 up to 3 µm at a radius of 0.5 mm; for a bead squeezed between flats there is none."
                        .to_owned(),
                );
            }
        }
        said
    }

    /// A state beside the laws' at the same approach (force) or under the same force (radius, pressure).
    fn state(&self, curve: &Curve, loading: Loading, state: StaticState) -> anyhow::Result<ContactState> {
        let bead = self.bead()?;
        let hertz = match self.pair {
            PairChoice::BeadBead => Some(Hertz { stiffness: bead_pair_stiffness(bead, bead) }),
            PairChoice::BeadFlat => Some(Hertz { stiffness: bead_flat_stiffness(bead, FlatContact::Rigid) }),
            PairChoice::BeadAnnulus => None,
        };
        let law_force = hertz.map_or_else(|| self.ring.force(state.approach), |hertz| hertz.force(state.approach));
        let under_force = hertz.map(|hertz| hertz.overlap(state.force));
        let excess = self.pair.finite_body(loading).map(|law| law.excess(state.approach, bead.radius));
        let pressure: Vec<[f64; 2]> = state.pressure.iter().map(|(place, pressure)| [*place, *pressure]).collect();
        Ok(ContactState {
            approach_m: state.approach,
            force_n: state.force,
            radius_m: state.radius,
            peak_pressure_pa: pressure.iter().map(|[_, pressure]| *pressure).fold(0.0, f64::max),
            law_force_n: law_force,
            finite_body_force_n: excess.map(|excess| law_force * (1.0 + excess)),
            law_radius_m: under_force.and_then(|overlap| curve.hertz_radius(overlap)),
            law_peak_pressure_pa: under_force.and_then(|overlap| curve.hertz_pressure(overlap, 0.0)),
            pressure,
        })
    }
}

/// The form for people.
fn text(report: &ContactReport) -> String {
    let mut text = format!("{}\n{}\n", report.pair, report.description);
    let (unit, factor) = report.pressure_unit();
    for loading in &report.loadings {
        text.push_str(&format!(
            "\n{}\n{:>12}{:>12}{:>16}{:>14}{:>12}{:>12}\n",
            loading.name,
            "approach µm",
            "force N",
            format!("over {} %", if report.law == "Hertz" { "Hertz" } else { "law" }),
            "finite body %",
            "radius µm",
            format!("peak {unit}")
        ));
        for state in &loading.states {
            let finite = state
                .finite_body_force_n
                .map_or_else(|| "–".to_owned(), |law| fixed(100.0 * (state.force_n / law - 1.0), 2));
            text.push_str(&format!(
                "{:>12}{:>12}{:>16}{finite:>14}{:>12}{:>12}\n",
                significant(1e6 * state.approach_m, 3),
                significant(state.force_n, 4),
                fixed(100.0 * state.deviation(), 2),
                significant(1e6 * state.radius_m, 3),
                significant(factor * state.peak_pressure_pa, 3),
            ));
        }
    }
    text
}
