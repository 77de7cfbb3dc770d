//! Self-convergence of the contact finite element analysis: the same scene on several meshes and steps, held against a refined run.
//!
//! Watched is the velocity of the last bead's centre, v, through a centred moving average (its undamped vibration is aliased by coarse
//! samples). The error of a run in a window of time is relative to the reference v̂ in the same window:
//!
//! ```text
//! e = √( Σ (v − v̂)² / Σ v̂² )
//! ```
//!
//! The observed order p follows from three runs of different h (step or element size) as in Richardson's extrapolation: with the distances
//! d of the two coarser runs from the finest of the three, (h₁^p − h₃^p)/(h₂^p − h₃^p) = d₁/d₂. Needed of the reference is only that it
//! is finer than all runs.

mod measure;

use rayon::prelude::*;
use serde::Serialize;
use thiserror::Error;

use super::members::Watch;
use granchain_model::{
    Model, ModelError,
    chain::ChainModel,
    contact_law::{FiniteBody, bead_pair_stiffness},
    fea::{Control, Simulation},
    response::Response,
    scene::{FlatContact, ModelKind, Scene, Support},
};
use granchain_signal::Series;
use measure::{first_pulse, lead};

pub(super) use measure::error;
pub use measure::{moving_average, observed_order};

/// A mesh and a step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Resolution {
    /// Mesh density n, 1.
    pub density: u32,
    /// Step, s.
    pub step_s: f64,
}

/// What is run and how it is compared.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConvergencePlan {
    /// Mesh densities, 1.
    pub densities: Vec<u32>,
    /// Steps, s.
    pub steps_s: Vec<f64>,
    /// The refined run.
    pub reference: Resolution,
    /// Windows of time (from, to), s; the runs end with the last.
    pub windows_s: Vec<(f64, f64)>,
    /// Length of the moving average, s.
    pub filter_s: f64,
}

impl Default for ConvergencePlan {
    /// Densities 8, 12, 16, steps 0.1, 0.05, 0.02 µs against 16 and 0.01 µs; 0–30, 30–60, 60–70 µs; 0.4 µs.
    fn default() -> Self {
        Self {
            densities: vec![8, 12, 16],
            steps_s: vec![1e-7, 5e-8, 2e-8],
            reference: Resolution { density: 16, step_s: 1e-8 },
            windows_s: vec![(0.0, 30e-6), (30e-6, 60e-6), (60e-6, 70e-6)],
            filter_s: 4e-7,
        }
    }
}

/// One run of the table.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ConvergenceRun {
    /// Mesh and step.
    pub resolution: Resolution,
    /// Unknowns of all bodies.
    pub unknowns: u64,
    /// Non-zeros of the factors, one a kind of body.
    pub factor_nonzeros: u64,
    /// Steps taken.
    pub steps: u64,
    /// Entries of factors read in all substitutions, twice the non-zeros a step: what a run costs, whatever the machine.
    pub entries_read: u64,
    /// Largest energy residual over the largest energy, 1.
    pub energy_balance: f64,
    /// e in each window, 1.
    pub errors: Vec<f64>,
    /// Filtered velocity of the last bead's centre on the reference's instants; not written.
    #[serde(skip)]
    pub velocity: Series,
}

/// Observed order in one window, where three runs allow it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Order {
    /// In the step, on the finest mesh.
    pub step: Option<f64>,
    /// In the element size, at the finest step.
    pub mesh: Option<f64>,
}

/// By how much the first pulse at the last bead runs ahead of that of the chain of Hertz contacts, and why.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lead {
    /// The pulse in the chain: from a tenth of its first maximum to the minimum behind it, s.
    pub pulse_s: (f64, f64),
    /// Lead of the refined finite elements, the time by which the chain's pulse is shifted to fit best, s.
    pub fea_s: f64,
    /// The same of the chain with all contacts stiffer by `excess`, s.
    pub stiffened_s: f64,
    /// Largest overlap of the contacts between beads as the pulse passes, their mean, m.
    pub overlap_m: f64,
    /// F/F_Hertz − 1 of finite bodies at that overlap, 1.
    pub excess: f64,
}

/// The outcome.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// What was asked for.
    pub plan: ConvergencePlan,
    /// The runs: densities in the order given, within each the steps.
    pub runs: Vec<ConvergenceRun>,
    /// The refined run; its errors are zero.
    pub reference: ConvergenceRun,
    /// Observed orders in each window.
    pub orders: Vec<Order>,
    /// Error of the chain of Hertz contacts in each window, 1.
    pub chain_errors: Vec<f64>,
    /// Error of the stiffened chain in each window, 1.
    pub stiffened_errors: Option<Vec<f64>>,
    /// The lead of the finite elements; only for equal beads before a rigid flat.
    pub lead: Option<Lead>,
    /// Filtered velocity of the last bead in the chain; not written.
    #[serde(skip)]
    pub chain: Series,
    /// The same of the stiffened chain.
    #[serde(skip)]
    pub stiffened: Option<Series>,
}

/// Why there is no table.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConvergenceError {
    /// The scene is not on the finite element analysis.
    #[error("convergence is that of the finite element analysis: expected model.kind = \"fea\", found \"{found}\"")]
    OtherModel {
        /// Which model it has.
        found: &'static str,
    },
    /// A list of the plan is empty.
    #[error("`{what}`: expected at least one, found none")]
    Nothing {
        /// Which list.
        what: &'static str,
    },
    /// A window without length, or after which none can come.
    #[error("window {number}: expected a start ≥ 0 before its end, found {from:e} to {to:e} s")]
    Window {
        /// Which, from 1.
        number: usize,
        /// Start, s.
        from: f64,
        /// End, s.
        to: f64,
    },
    /// The reference is not finer than a run.
    #[error(
        "the reference (density {reference_density}, {reference_step:e} s) must be no coarser than any run and shorter in its step; found a run at \
         density {density}, {step:e} s; raise --reference-density or lower --reference-step"
    )]
    CoarseReference {
        /// Its density.
        reference_density: u32,
        /// Its step, s.
        reference_step: f64,
        /// Density of the run.
        density: u32,
        /// Step of the run, s.
        step: f64,
    },
    /// A run failed.
    #[error("density {density}, step {step:e} s: {source}")]
    Run {
        /// Its density.
        density: u32,
        /// Its step, s.
        step: f64,
        /// Why.
        source: Box<ModelError>,
    },
    /// The chain to compare with failed.
    #[error("the chain: {0}")]
    Chain(Box<ModelError>),
    /// The caller stopped it.
    #[error("stopped")]
    Stopped,
}

/// Steps from one report of progress to the next.
const STEPS_PER_REPORT: u64 = 50;

/// Units of progress of the whole plan: every run by its share of the work.
#[must_use]
pub fn cost(plan: &ConvergencePlan) -> u64 {
    resolutions(plan)
        .iter()
        .map(|resolution| steps(plan, resolution).div_ceil(STEPS_PER_REPORT) * units(resolution))
        .sum()
}

/// Weight of a report of one run; factors grow as n² ln n, taken as n².
fn units(resolution: &Resolution) -> u64 {
    u64::from(resolution.density).pow(2)
}

fn steps(plan: &ConvergencePlan, resolution: &Resolution) -> u64 {
    (duration(plan) / resolution.step_s).ceil() as u64
}

/// Length of all runs, s: the windows, and the filter beyond their end.
fn duration(plan: &ConvergencePlan) -> f64 {
    plan.windows_s.iter().fold(0.0, |end: f64, (_, to)| end.max(*to)) + plan.filter_s
}

/// The runs of the table in its order, then the reference.
fn resolutions(plan: &ConvergencePlan) -> Vec<Resolution> {
    let table = plan
        .densities
        .iter()
        .flat_map(|&density| plan.steps_s.iter().map(move |&step_s| Resolution { density, step_s }));
    table.chain([plan.reference]).collect()
}

fn check(scene: &Scene, plan: &ConvergencePlan) -> Result<(), ConvergenceError> {
    if scene.model.kind != ModelKind::Fea {
        return Err(ConvergenceError::OtherModel { found: scene.model.kind.name() });
    }
    let empty = [
        ("densities", plan.densities.is_empty()),
        ("steps", plan.steps_s.is_empty()),
        ("windows", plan.windows_s.is_empty()),
    ];
    if let Some((what, _)) = empty.into_iter().find(|(_, empty)| *empty) {
        return Err(ConvergenceError::Nothing { what });
    }
    for (index, &(from, to)) in plan.windows_s.iter().enumerate() {
        if !(from >= 0.0 && to > from && to.is_finite()) {
            return Err(ConvergenceError::Window { number: index + 1, from, to });
        }
    }
    let Resolution { density: reference_density, step_s: reference_step } = plan.reference;
    let finer = |run: &Resolution| reference_density >= run.density && reference_step < run.step_s;
    let table = resolutions(plan);
    match table[..table.len() - 1].iter().find(|run| !finer(run)) {
        None => Ok(()),
        Some(&Resolution { density, step_s: step }) => {
            Err(ConvergenceError::CoarseReference { reference_density, reference_step, density, step })
        }
    }
}

/// Run the plan on a scene of the finite element analysis; the outcome does not depend on the number of threads.
///
/// # Errors
/// [`ConvergenceError`].
pub fn converge(scene: &Scene, plan: &ConvergencePlan, watch: &dyn Watch) -> Result<Convergence, ConvergenceError> {
    check(scene, plan)?;
    // The longest first, so that no thread is left with it at the end.
    let mut order: Vec<(usize, Resolution)> = resolutions(plan).into_iter().enumerate().collect();
    order.sort_by_key(|(_, resolution)| std::cmp::Reverse(steps(plan, resolution) * units(resolution)));
    let mut runs: Vec<(usize, ConvergenceRun)> = order
        .into_par_iter()
        .with_max_len(1)
        .map(|(index, resolution)| Ok((index, run(scene, plan, resolution, watch)?)))
        .collect::<Result<_, ConvergenceError>>()?;
    runs.sort_by_key(|(index, _)| *index);
    let mut runs: Vec<ConvergenceRun> = runs.into_iter().map(|(_, run)| run).collect();
    let Some(mut reference) = runs.pop() else { return Err(ConvergenceError::Nothing { what: "runs" }) };
    let errors = |velocity: &Series| -> Vec<f64> {
        plan.windows_s.iter().map(|window| error(velocity, &reference.velocity, *window)).collect()
    };
    for run in &mut runs {
        run.errors = errors(&run.velocity);
    }
    let orders = plan.windows_s.iter().map(|window| observed(plan, &runs, *window)).collect();

    let (whole, chain) = hertz_chain(scene, plan, 1.0)?;
    let (begin, _, bottom) = first_pulse(&chain);
    let pulse = (begin, bottom);
    let comparison = stiffening(scene, &whole, &chain)
        .map(|(overlap_m, excess)| {
            let (_, stiffened) = hertz_chain(scene, plan, 1.0 + excess)?;
            let ahead = |velocity: &Series| lead(velocity, &chain, pulse);
            let (fea_s, stiffened_s) = (ahead(&reference.velocity), ahead(&stiffened));
            let lead = Lead { pulse_s: pulse, fea_s, stiffened_s, overlap_m, excess };
            Ok((lead, stiffened))
        })
        .transpose()?;
    let chain_errors = errors(&chain);
    let stiffened_errors = comparison.as_ref().map(|(_, stiffened)| errors(stiffened));
    let (lead, stiffened) = comparison.unzip();
    reference.errors = vec![0.0; plan.windows_s.len()];
    Ok(Convergence {
        plan: plan.clone(),
        runs,
        reference,
        orders,
        chain_errors,
        stiffened_errors,
        lead,
        chain,
        stiffened,
    })
}

/// One run, its errors still open.
fn run(
    scene: &Scene,
    plan: &ConvergencePlan,
    resolution: Resolution,
    watch: &dyn Watch,
) -> Result<ConvergenceRun, ConvergenceError> {
    let Resolution { density, step_s: step } = resolution;
    let failed = |source: ModelError| ConvergenceError::Run { density, step, source: Box::new(source) };
    let mut scene = scene.clone();
    (scene.model.fea.density, scene.model.fea.step, scene.output_step) = (density, step, step);
    scene.duration = duration(plan);
    let mut simulation = Simulation::new(&scene, Control::default()).map_err(|error| failed(error.into()))?;
    let mut taken = 0_u64;
    while !simulation.is_done() {
        simulation.advance().map_err(|error| failed(error.into()))?;
        taken += 1;
        if taken.is_multiple_of(STEPS_PER_REPORT) {
            watch.advance(units(&resolution));
            if watch.stop() {
                return Err(ConvergenceError::Stopped);
            }
        }
    }
    let response = simulation.response();
    let factor_nonzeros = simulation.factor_nonzeros() as u64;
    Ok(ConvergenceRun {
        resolution,
        unknowns: response.work.unknowns,
        factor_nonzeros,
        steps: response.work.steps,
        entries_read: 2 * factor_nonzeros * response.work.steps,
        energy_balance: simulation.ledger().balance(),
        errors: Vec::new(),
        velocity: watched(&response, plan),
    })
}

/// The filtered velocity of the last bead's centre.
fn watched(response: &Response, plan: &ConvergencePlan) -> Series {
    response.bead_velocity.last().map_or_else(
        || Series::new(0.0, plan.reference.step_s, Vec::new()),
        |velocity| moving_average(velocity, plan.filter_s),
    )
}

/// Response and filtered velocity of the chain of Hertz contacts, all its contacts stiffer by a factor.
fn hertz_chain(scene: &Scene, plan: &ConvergencePlan, factor: f64) -> Result<(Response, Series), ConvergenceError> {
    let mut scene = scene.clone();
    scene.model.kind = ModelKind::Chain;
    (scene.duration, scene.output_step) = (duration(plan), plan.reference.step_s);
    for bead in &mut scene.chain.beads {
        bead.material.youngs_modulus *= factor;
    }
    let response = ChainModel.run(&scene, &mut |_| true).map_err(|error| ConvergenceError::Chain(Box::new(error)))?;
    let velocity = watched(&response, plan);
    Ok((response, velocity))
}

/// Mean of the largest overlaps of the contacts between beads before the first pulse is through (m), and the excess of finite bodies there;
/// none where one factor cannot stand for all contacts.
fn stiffening(scene: &Scene, chain: &Response, velocity: &Series) -> Option<(f64, f64)> {
    let beads = &scene.chain.beads;
    let equal = beads.iter().all(|bead| *bead == beads[0] && bead.mesh.is_none());
    if !(equal && beads.len() > 1 && scene.support == Support::Flat(FlatContact::Rigid)) {
        return None;
    }
    let (_, peak, _) = first_pulse(velocity);
    let stiffness = bead_pair_stiffness(&beads[0], &beads[1]);
    let inner = &chain.contact_force[1..beads.len()];
    let overlaps = inner.iter().map(|force| (force.window(0.0, peak).peak() / stiffness).powf(2.0 / 3.0));
    let overlap = overlaps.sum::<f64>() / inner.len() as f64;
    Some((overlap, FiniteBody::BeadsColliding.excess(overlap, beads[0].radius)))
}

/// Orders from the runs on the finest mesh, and from those of the finest step.
fn observed(plan: &ConvergencePlan, runs: &[ConvergenceRun], window: (f64, f64)) -> Order {
    let finest_density = plan.densities.iter().copied().max().unwrap_or(0);
    let finest_step = plan.steps_s.iter().copied().fold(f64::INFINITY, f64::min);
    let order = |chosen: &dyn Fn(&Resolution) -> bool, size: &dyn Fn(&Resolution) -> f64| {
        let mut family: Vec<&ConvergenceRun> = runs.iter().filter(|run| chosen(&run.resolution)).collect();
        family.sort_by(|a, b| size(&b.resolution).total_cmp(&size(&a.resolution)));
        let [coarse, .., fine] = family[..] else { return None };
        let middle = family.get(1).filter(|_| family.len() > 2)?;
        let distance = |run: &ConvergenceRun| error(&run.velocity, &fine.velocity, window);
        let sizes = [coarse, middle, fine].map(|run| size(&run.resolution));
        observed_order(sizes, [distance(coarse), distance(middle)])
    };
    Order {
        step: order(&|run| run.density == finest_density, &|run| run.step_s),
        mesh: order(&|run| run.step_s == finest_step, &|run| 1.0 / f64::from(run.density)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    struct Quiet;

    impl Watch for Quiet {
        fn advance(&self, _: u64) {}
        fn stop(&self) -> bool {
            false
        }
    }

    struct Impatient;

    impl Watch for Impatient {
        fn advance(&self, _: u64) {}
        fn stop(&self) -> bool {
            true
        }
    }

    fn plan() -> ConvergencePlan {
        ConvergencePlan {
            densities: vec![4],
            steps_s: vec![1e-7, 5e-8],
            reference: Resolution { density: 4, step_s: 2e-8 },
            windows_s: vec![(0.0, 10e-6), (10e-6, 20e-6)],
            ..ConvergencePlan::default()
        }
    }

    fn rigid() -> Scene {
        scene::load("rigid", &["model.kind=fea".into()]).unwrap()
    }

    #[test]
    fn errors_fall_with_the_step_and_do_not_depend_on_the_threads() {
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| converge(&rigid(), &plan(), &Quiet)).unwrap()
        };
        let (one, two) = (on(1), on(2));
        assert_eq!(one, two);
        let [coarse, fine] = &one.runs[..] else { panic!("{}", one.runs.len()) };
        assert!(fine.errors[0] < 0.5 * coarse.errors[0] && coarse.errors[0] < 0.1, "{coarse:?} {fine:?}");
        assert_eq!((coarse.steps, fine.steps), (204, 408));
        assert_eq!(one.orders[0].step, None);
        // The chain is farther off than the coarsest run, the stiffened one less.
        let stiffened = one.stiffened_errors.unwrap();
        assert!(one.chain_errors[0] > coarse.errors[0] && stiffened[0] < 0.5 * one.chain_errors[0], "{stiffened:?}");
    }

    #[test]
    fn a_plan_that_shows_nothing_is_refused() {
        let fails = |scene: &Scene, plan: &ConvergencePlan| converge(scene, plan, &Quiet).unwrap_err();
        let chain = scene::load("rigid", &[]).unwrap();
        assert_eq!(fails(&chain, &plan()), ConvergenceError::OtherModel { found: "chain" });
        let coarse = ConvergencePlan { reference: Resolution { density: 4, step_s: 5e-8 }, ..plan() };
        assert!(matches!(fails(&rigid(), &coarse), ConvergenceError::CoarseReference { density: 4, .. }));
        let empty = ConvergencePlan { windows_s: Vec::new(), ..plan() };
        assert_eq!(fails(&rigid(), &empty), ConvergenceError::Nothing { what: "windows" });
        let backwards = ConvergencePlan { windows_s: vec![(2e-6, 1e-6)], ..plan() };
        assert!(matches!(fails(&rigid(), &backwards), ConvergenceError::Window { number: 1, .. }));
        assert_eq!(converge(&rigid(), &plan(), &Impatient).unwrap_err(), ConvergenceError::Stopped);
    }
}
