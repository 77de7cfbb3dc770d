//! Calibration of a column that a striker hits, against records of a force sensor of unknown gain.
//!
//! ```text
//! records ─ observe ─► features of the hits ─► mean and scatter ┐
//! scene, parameters, unknowns ─► runs ─ observe ─► regression ──┴► posterior, T² ─► verdict ─ causes ─► ImpactOutcome
//! ```
//!
//! A hit is reduced to four numbers that hold no gain: the time from the incident to the returned impulse, the ratio of their peaks, that of
//! their widths, and the width of the incident one (`hit.rs`), which tells of the record's clock and of what the sensor reads. Nothing here knows a drive
//! or its period. The mean ȳ of n hits of one set-up is compared with the model,
//!
//! ȳ ~ N(m(θ), S/n + U + B Bᵀ + C (1 + h(θ))),
//!
//! m the regression of runs, S the scatter of the hits beside a stated floor, U that of set-ups, B what an unknown shared by all hits moves the features
//! by (velocity, bead stiffness, AC coupling, where the sensor reads), C h the regression's own variance. Of G set-ups ȳ is the mean of their means, and
//! U falls to U/G. Left out: what a returned impulse does after it has passed the sensor.

mod cause;
mod foot;
mod hit;
mod likelihood;
mod outcome;
mod parameter;
mod regression;
mod report;
mod run;
pub mod synthetic;

use granchain_calibration::{
    fit::{Estimate, Verdict},
    parameter::ParameterError,
};
use granchain_model::{ModelError, scene::Scene};
use granchain_record::SensorRecord;
use granchain_signal::{Series, number::engineering};

pub use self::{
    cause::{Cause, Finding},
    foot::Foot,
    likelihood::SET_UP,
    outcome::{HitOutcome, ImpactOutcome, ReturnTime},
    parameter::{NAMES, Parameter},
    report::{lines, page},
    run::{Unknown, force, high_passed},
};
use self::{
    hit::{FEATURES, Features, Impulses, levelled, observe},
    likelihood::{Grid, Hits, Likelihood},
    regression::Regression,
    run::{Bench, CORNER, Run, arrival},
};

/// Number of runs of a fit.
const EVALUATIONS: usize = 600;

/// Rounds of a fit: the whole box, then twice around the answer.
const ROUNDS: u32 = 3;

/// Standard deviations about the answer that a round covers, and its least width in unit coordinates.
const REACH: f64 = 5.0;
const LEAST: f64 = 0.08;

/// How often the box is widened where the answer lies at its edge.
const WIDENINGS: usize = 2;

/// Most parameters of a fit: one feature of a hit is left to judge it.
pub(crate) const MOST_PARAMETERS: usize = 3;

/// Relative difference of sampling steps of one experiment.
const SAME_STEP: f64 = 1e-3;

/// Why hits cannot be fitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImpactError {
    #[error(
        "{path}: expected an incident and a returned impulse of at least 15 % of the former, not before {} after it, twice its way to the last bead; found \
         {found}; check the record's clock, chain.beads and chain.sensor, record longer, or leave the record out",
        engineering(*earliest, "s", 2)
    )]
    NoReturn { path: String, earliest: f64, found: String },
    #[error(transparent)]
    Run(#[from] ModelError),
    #[error(
        "{path}: sampled every {found:.4e} s, the first hit every {expected:.4e} s; fit hits of one experiment, sampled alike"
    )]
    Step { path: String, expected: f64, found: f64 },
    #[error("scene `{scene}`: expected {lacks}; begin with the built-in scene `impact`")]
    Scene { scene: String, lacks: &'static str },
    #[error("parameter `{name}`: expected some of {}", NAMES.join(", "))]
    Parameter { name: String },
    #[error(transparent)]
    NotOfScene(#[from] ParameterError),
    #[error("`support_loss` belongs to an elastic foundation, and the scene has none: set support.kind=foundation")]
    NoFoundation,
    #[error("{found} parameters, and a hit has {FEATURES} features; fit at most {MOST_PARAMETERS}")]
    TooMany { found: usize },
    #[error(
        "{finished} of {runs} runs gave an incident and a returned impulse, too few for a fit; most often: {reason}; check the scene, or move the bounds"
    )]
    TooFewRuns { finished: usize, runs: usize, reason: String },
}

/// Share of the median peak of all hits below which a record is noise, no hit.
const NOISE: f64 = 0.1;

/// How long runs last beyond the latest return of a hit, over it: of another modulus it is later.
const LATER: f64 = 1.5;

/// One record and what was measured of it.
#[derive(Debug, Clone)]
pub struct Hit {
    pub record: SensorRecord,
    pub impulses: Impulses,
    /// Name of the set-up that it belongs to, of several.
    pub set_up: Option<String>,
}

impl Hit {
    /// An impulse before `earliest` (s) after the incident one has not returned.
    pub fn of(record: SensorRecord, set_up: Option<String>, earliest: f64) -> Result<Self, ImpactError> {
        let Some(impulses) = observe(&record.series, earliest) else {
            let found = observe(&record.series, 0.0).map_or_else(
                || "no second impulse".into(),
                |early| format!("one {} after it", engineering(early.delay, "s", 2)),
            );
            return Err(ImpactError::NoReturn { path: record.path.display().to_string(), earliest, found });
        };
        Ok(Self { record, impulses, set_up })
    }
}

/// Splits off the records whose largest excursion is below a tenth of the median one.
fn without_noise(records: Vec<(SensorRecord, Option<String>)>) -> [Vec<(SensorRecord, Option<String>)>; 2] {
    let peak = |record: &SensorRecord| levelled(&record.series).peak();
    let mut peaks: Vec<f64> = records.iter().map(|(record, _)| peak(record)).collect();
    peaks.sort_unstable_by(f64::total_cmp);
    let least = NOISE * peaks.get(peaks.len() / 2).copied().unwrap_or_default();
    let (hits, noise) = records.into_iter().partition(|(record, _)| peak(record) >= least);
    [hits, noise]
}

/// Hits of one experiment, and the bench they are compared with.
#[derive(Debug, Clone)]
pub struct Experiment {
    pub hits: Vec<Hit>,
    /// Records without a hit.
    pub noise: Vec<SensorRecord>,
    pub scene: Scene,
    pub parameters: Vec<Parameter>,
    pub unknown: Unknown,
    /// Stress at which the ground gives way, where it is stated, Pa.
    pub strength: Option<f64>,
    evaluations: usize,
    pub seed: u64,
    /// Before this after the incident impulse nothing can have returned, s.
    earliest: f64,
    /// Number of unknowns that were fitted to the hits already.
    fitted: usize,
}

#[derive(Debug, Clone)]
pub struct ImpactFit {
    pub parameters: Vec<Parameter>,
    pub estimates: Vec<Estimate>,
    pub verdict: Verdict,
    pub p_value: f64,
    /// Correlation of the first two parameters.
    pub correlation: f64,
    /// Expected features of the mean, and their deviation from it in standard deviations, at the best point.
    pub expected: Features,
    pub deviations: Features,
    /// Standard deviation of each feature over hits.
    pub scatter: Features,
    /// Mean of ln of the return time over the posterior, and the standard deviation of one hit about it.
    pub return_time: [f64; 2],
    pub freedom: f64,
    /// The contact with the ground at the answer.
    pub foot: Option<Foot>,
    /// Medians of the parameters of each of several set-ups.
    pub set_ups: Vec<(String, Vec<f64>)>,
    pub runs: Vec<Run>,
}

/// Refuse a scene without a striker or a sensor.
///
/// # Errors
/// [`ImpactError::Scene`].
pub fn expect_hits(scene: &Scene) -> Result<(), ImpactError> {
    let lacks = match (scene.drive.kind.striker(), &scene.chain.sensor) {
        (None, _) => "a striker (drive.kind)",
        (_, None) => "a bead with a sensor (chain.sensor)",
        _ => return Ok(()),
    };
    Err(ImpactError::Scene { scene: scene.name.clone(), lacks })
}

impl Experiment {
    /// Of records, each with the name of its set-up where there are several; runs last as long as the latest return asks for.
    ///
    /// # Errors
    /// What does not fit together; a record without a returned impulse.
    pub fn of(
        records: Vec<(SensorRecord, Option<String>)>,
        mut scene: Scene,
        parameters: Vec<Parameter>,
    ) -> Result<Self, ImpactError> {
        expect_hits(&scene)?;
        if parameters.len() > MOST_PARAMETERS {
            return Err(ImpactError::TooMany { found: parameters.len() });
        }
        let [records, noise] = without_noise(records);
        let length = records.iter().map(|(record, _)| record.series.end() - record.series.start).fold(0.0, f64::max);
        let [arrival, earliest] = arrival(&scene, length)?;
        let hits = records
            .into_iter()
            .map(|(record, set_up)| Hit::of(record, set_up, earliest))
            .collect::<Result<Vec<_>, _>>()?;
        let latest = hits.iter().map(|hit| hit.impulses.delay).fold(0.0, f64::max);
        scene.duration = scene.duration.max(arrival + LATER * latest);
        let noise = noise.into_iter().map(|(record, _)| record).collect();
        let (unknown, evaluations, seed) = (Unknown::default(), EVALUATIONS, 1);
        let experiment =
            Self { hits, noise, scene, parameters, unknown, evaluations, seed, earliest, fitted: 0, strength: None };
        let expected = experiment.step();
        let other = |hit: &&Hit| (hit.record.series.step / expected - 1.0).abs() > SAME_STEP;
        if let Some(hit) = experiment.hits.iter().find(other) {
            let path = hit.record.path.display().to_string();
            return Err(ImpactError::Step { path, expected, found: hit.record.series.step });
        }
        Ok(experiment)
    }

    /// The same hits, the time between their samples multiplied by a factor.
    fn with_clock(&self, factor: f64) -> Result<Self, ImpactError> {
        let slower = |Hit { record, set_up, .. }: &Hit| {
            let mut record = record.clone();
            (record.series.start, record.series.step) = (record.series.start * factor, record.series.step * factor);
            Hit::of(record, set_up.clone(), self.earliest)
        };
        let hits = self.hits.iter().map(slower).collect::<Result<Vec<_>, _>>()?;
        let mut scene = self.scene.clone();
        scene.duration *= factor.max(1.0);
        Ok(Self { hits, scene, fitted: self.fitted + 1, ..self.clone() })
    }

    /// All records, those without a hit last; of several hits in one file one.
    pub fn files(&self) -> impl Iterator<Item = &SensorRecord> {
        let all = self.hits.iter().map(|hit| &hit.record).chain(&self.noise);
        let mut known = Vec::new();
        all.filter(move |record| {
            let is_new = !known.contains(&&record.path);
            known.push(&record.path);
            is_new
        })
    }

    fn step(&self) -> f64 {
        self.hits.first().map_or(1e-5, |hit| hit.record.series.step)
    }

    /// The features of the hits, in order.
    pub(crate) fn features(&self) -> Vec<Features> {
        self.hits.iter().map(|hit| hit.impulses.features()).collect()
    }

    /// The names of several set-ups, in order, and the features of their hits.
    fn set_ups(&self) -> (Vec<String>, Vec<Vec<Features>>) {
        let mut found: Vec<(String, Vec<Features>)> = Vec::new();
        for hit in &self.hits {
            let name = hit.set_up.clone().unwrap_or_default();
            let features = hit.impulses.features();
            match found.iter_mut().find(|(known, _)| *known == name) {
                Some((_, hits)) => hits.push(features),
                None => found.push((name, vec![features])),
            }
        }
        found.into_iter().unzip()
    }

    /// Fits the parameters.
    ///
    /// # Errors
    /// Too few runs in which an impulse returns.
    pub fn fit(&self) -> Result<ImpactFit, ImpactError> {
        let hits = Hits::of(&self.set_ups().1);
        let mut parameters = self.parameters.clone();
        let mut left = WIDENINGS;
        loop {
            let fit = self.searched(&parameters, &hits)?;
            let wider = |(parameter, estimate): (&Parameter, &Estimate)| {
                let Estimate { low, value, high, unidentified, .. } = *estimate;
                let [low, value, high] = [low, value, high].map(|x| parameter.coordinate(x));
                parameter.widened(Parameter::pressed(low, value, high)).filter(|_| !unidentified)
            };
            let wider: Vec<Option<Parameter>> = parameters.iter().zip(&fit.estimates).map(wider).collect();
            if left == 0 || wider.iter().all(Option::is_none) {
                let foot = Foot::of(&self.at(&fit), self.strength);
                let doubted = fit.verdict == Verdict::WithinScatter && foot.is_some_and(|foot| foot.gives_way());
                let verdict = if doubted { Verdict::Doubtful } else { fit.verdict };
                return Ok(ImpactFit { foot, verdict, ..fit });
            }
            parameters.iter_mut().zip(wider).for_each(|(own, wider)| *own = wider.unwrap_or_else(|| own.clone()));
            left -= 1;
        }
    }

    /// The scene at the answer of a fit.
    fn at(&self, fit: &ImpactFit) -> Scene {
        let mut scene = self.scene.clone();
        let fitted = fit.parameters.iter().zip(&fit.estimates);
        fitted.for_each(|(parameter, estimate)| parameter.set(&mut scene, estimate.value));
        scene
    }

    /// The sensor force of the scene at the answer of a fit, N, behind an AC coupling in the middle of those that may be.
    pub fn simulated(&self, fit: &ImpactFit) -> Result<Series, ModelError> {
        Ok(high_passed(&force(&self.at(fit), 0.0)?, CORNER.0))
    }

    fn searched(&self, parameters: &[Parameter], hits: &Hits) -> Result<ImpactFit, ImpactError> {
        let Self { scene, unknown, seed, earliest, .. } = self;
        let bench = Bench { scene, parameters, unknown: *unknown, step: self.step(), earliest: *earliest, seed: *seed };
        let size = self.evaluations as u32 / ROUNDS;
        let mut within = vec![[0.0, 1.0]; parameters.len()];
        let (mut runs, mut before): (Vec<Run>, Option<Grid>) = (Vec::new(), None);
        let mut round = 0;
        loop {
            runs.extend(bench.runs(round * size..(round + 1) * size, &within));
            let regression = Regression::of(&runs, &within).ok_or_else(|| too_few(&runs))?;
            let likelihood = Likelihood::new(&regression, hits);
            let grid = Grid::of(&likelihood, &within).ok_or_else(|| too_few(&runs))?;
            if round + 1 == ROUNDS {
                let mut fit = answer(parameters, &likelihood, &grid, before.as_ref(), (&within, runs), self.fitted);
                let (names, hits) = self.set_ups();
                let each = names.into_iter().zip(&hits).filter(|_| hits.len() > 1);
                fit.set_ups = each
                    .filter_map(|(name, hits)| Some((name, medians(parameters, &regression, hits, &within)?)))
                    .collect();
                return Ok(fit);
            }
            within = grid.holds(REACH, LEAST);
            before = Some(grid);
            round += 1;
        }
    }
}

/// Medians of the parameters by the hits of one set-up.
fn medians(
    parameters: &[Parameter],
    regression: &Regression,
    hits: &[Features],
    within: &[[f64; 2]],
) -> Option<Vec<f64>> {
    let hits = Hits::of(&[hits.to_vec()]);
    let grid = Grid::of(&Likelihood::new(regression, &hits), within)?;
    Some(parameters.iter().enumerate().map(|(d, parameter)| parameter.value(grid.quantiles(d, [0.5])[0])).collect())
}

fn too_few(runs: &[Run]) -> ImpactError {
    let reasons: Vec<&String> = runs.iter().filter_map(|run| run.features.as_ref().err()).collect();
    let count = |reason: &&&String| reasons.iter().filter(|other| other == reason).count();
    let reason = reasons.iter().max_by_key(count).map_or_else(|| "none failed".into(), |reason| (*reason).clone());
    ImpactError::TooFewRuns { finished: runs.len() - reasons.len(), runs: runs.len(), reason }
}

/// Unit coordinate from which an end of a round touches a bound, and the share of the box from which an interval tells nothing.
const EDGE: f64 = 0.01;
const WIDE: f64 = 0.8;

fn answer(
    parameters: &[Parameter],
    likelihood: &Likelihood<'_>,
    grid: &Grid,
    before: Option<&Grid>,
    (within, runs): (&[[f64; 2]], Vec<Run>),
    fitted: usize,
) -> ImpactFit {
    let mut settled = true;
    let estimate = |(d, parameter): (usize, &Parameter)| {
        let [low, median, high] = grid.quantiles(d, [0.05, 0.5, 0.95]);
        let [edge, end] = within[d];
        // An interval that the last round's part of the box cuts off, or a median that still moves by more than half of it.
        let cut =
            (low - edge < 0.02 * (end - edge) && edge > EDGE) || (end - high < 0.02 * (end - edge) && end < 1.0 - EDGE);
        let moved = before.is_some_and(|before| (before.quantiles(d, [0.5])[0] - median).abs() > 0.5 * (high - low));
        settled &= !(cut || moved);
        // Where the most likely value lies outside the interval the median is quoted.
        let best = Some(grid.best[d]).filter(|best| (low..=high).contains(best)).unwrap_or(median);
        Estimate {
            name: parameter.name.clone(),
            unit: parameter.unit.clone(),
            value: parameter.value(best),
            median: parameter.value(median),
            low: parameter.value(low),
            high: parameter.value(high),
            at_bound: Parameter::pressed(low, best, high).contains(&true),
            unidentified: high - low > WIDE,
        }
    };
    let estimates: Vec<Estimate> = parameters.iter().enumerate().map(estimate).collect();
    let p_value = likelihood.p_value(grid, parameters.len() + fitted);
    let (mean, covariance) = grid.moments(|at| likelihood.regression.expected(at).mean);
    let of_mean = covariance[(0, 0)] + likelihood.shared()[(0, 0)] + likelihood.hits.set_up[(0, 0)];
    let of_hit = likelihood.scatter[(0, 0)];
    ImpactFit {
        correlation: if parameters.len() > 1 { grid.correlation(0, 1) } else { 0.0 },
        expected: likelihood.regression.expected(&grid.best).mean,
        deviations: likelihood.deviations(&grid.best),
        scatter: likelihood.scatter.diagonal().map(f64::sqrt),
        return_time: [mean[0], (of_mean + of_hit).sqrt()],
        freedom: likelihood.hits.freedom,
        foot: None,
        set_ups: Vec::new(),
        verdict: Verdict::of(p_value, !settled, false),
        parameters: parameters.to_vec(),
        estimates,
        p_value,
        runs,
    }
}
