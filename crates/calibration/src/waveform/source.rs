//! Where the traces come from: the chain under every record's drive, with what the model above it changes where there is one.

use std::{ops::Range, sync::Arc};

use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::{
    BETWEEN,
    columns::Nuisances,
    difference::{Difference, Mesh, differences},
    ensemble::{BEFORE, Known, beside},
    record::{RecordTrace, whitened},
    rounds::diagonal,
    start::Start,
};
use crate::{
    discrepancy::{CHAIN_ERROR, Discrepancy, FIDELITY_PAIRS, LEFT, MESH_ERROR},
    drive::HornNoise,
    fidelity::{FidelityLevel, Pair},
    forward::{Forward, Point, Run, Show},
    parameter::{Parameter, Target, reflect},
};
use granchain_signal::feature::fingerprint::SAMPLES_PER_CYCLE;

/// Pairs of runs that tell what a finer step changes.
const PAIRS: usize = 16;

/// Pairs that tell what the model above the chain changes, in every turn; those of two turns correct the features.
const PAIRS_ABOVE: usize = 24;

/// Those that tell what a finer mesh changes too: with the middle stiffness.
const MESHED: Range<usize> = FIDELITY_PAIRS..2 * FIDELITY_PAIRS;

/// Runs of the model above that a fit usually makes: two turns, and those that tell what a finer mesh changes.
pub(crate) const USUAL_RUNS: u64 = (2 * PAIRS_ABOVE + FIDELITY_PAIRS) as u64;

const FEWEST_PAIRS: usize = 4;

/// Share of a mesh's change that is not known for the whole trace; as much differs from part to part.
pub(super) const LEFT_STEADY: f64 = LEFT * std::f64::consts::FRAC_1_SQRT_2;

/// Cycles over which the error of a correction for the mesh keeps its sign.
const STEADY: f64 = 4.0;

/// One record and what makes its runs.
#[derive(Clone)]
pub(super) struct Source {
    pub forward: Forward,
    pub noise: Option<HornNoise>,
    pub trace: RecordTrace,
    nuisances: Nuisances,
    /// The model above the chain that answers, and what it changes near a point.
    pub above: Option<FidelityLevel>,
    pub difference: Option<Arc<Difference>>,
    /// What a finer mesh changes of the features.
    pub mesh: Option<Discrepancy>,
}

#[derive(Clone)]
pub(super) struct Sources {
    pub records: Vec<Source>,
    /// ln(high/low) of every fitted parameter.
    spans: Vec<f64>,
    /// Standard deviation of ln of stiffness over mass, if that is a parameter after the fitted ones.
    pub modulus: Option<f64>,
}

/// Change of one record's trace with a finer step: the mean, and columns of its uncertainty.
pub(super) type Correction = (Vec<f64>, Mat<f64>);

/// Traces of runs as they are compared; `None` for a failed run.
type Traces = Vec<Option<Vec<f64>>>;

/// Traces of runs and their features.
type WithFeatures = (Traces, Vec<Run>);

impl Source {
    pub(crate) fn new(forward: Forward, noise: Option<HornNoise>, trace: RecordTrace, clock: f64) -> Self {
        let scene = forward.scene();
        let nuisances = Nuisances { clock, ..Nuisances::of_scene(forward.comparison.sensitivity, scene, trace.step) };
        Self { forward, noise, trace, nuisances, above: None, difference: None, mesh: None }
    }
}

impl Sources {
    pub(crate) fn new(records: Vec<Source>) -> Self {
        let forward = &records[0].forward;
        let spans = forward.parameters.iter().map(Parameter::span).collect();
        let modulus = forward.draws_modulus().then(|| forward.uncertainty().modulus);
        Self { records, spans, modulus }
    }

    pub(crate) fn records(&self) -> usize {
        self.records.len()
    }

    pub(crate) fn known(&self) -> Known<'_> {
        Known {
            records: self.records.iter().map(|source| &source.trace).collect(),
            nuisances: self.records.iter().map(|source| source.nuisances.clone()).collect(),
            prior: self.modulus,
            level: self.level(),
            correction: self.differing(|difference| difference.columns.as_ref()),
            meshes: self.meshes(),
        }
    }

    fn meshes(&self) -> Vec<Option<&Mesh>> {
        self.records.iter().map(|source| source.difference.as_ref()?.mesh.as_ref()).collect()
    }

    /// What is known but for the mesh of a model above the chain.
    pub(crate) fn without_mesh(&self) -> Known<'_> {
        Known { correction: self.differing(Difference::of_pairs), ..self.known() }
    }

    /// What is not known of the model above the chain, of every record; empty where there is none.
    fn differing(&self, columns: impl Fn(&Difference) -> MatRef<'_, f64>) -> Vec<Correction> {
        let of = |source: &Source| {
            let columns = columns(source.difference.as_deref()?).to_owned();
            Some((vec![0.0; columns.nrows()], columns))
        };
        self.records.iter().map(of).collect::<Option<_>>().unwrap_or_default()
    }

    /// The same with what the model above the chain changes, by pairs numbered from `first` where rounds would begin, and these pairs; `None` where too
    /// few finish.
    pub(crate) fn paired(&self, first: u64, start: &Start, seed: u64) -> Option<(Self, Vec<Pair>)> {
        let lower = diagonal(&start.half.iter().map(|half| 0.5 * half).collect::<Vec<f64>>());
        let mut at = start.drawn(self, PAIRS_ABOVE, (seed as u32).wrapping_add(first as u32));
        self.in_levels(start, &mut at);
        let points: Vec<Point> = at.iter().map(|at| self.point(at)).collect();
        let (mut sources, mut pairs) = (self.clone(), Vec::new());
        for source in &mut sources.records {
            let noise = source.noise.as_ref();
            let show: Show<_> = &Forward::shown_with_features;
            let own = source.forward.waveforms(NUMBERED + first, &points, noise, show);
            let (own, lower_runs) = source.with_features(&points, own);
            let (above, upper_runs) = source.runs_above(source.above.as_ref()?, NUMBERED + first, &points);
            // The first pairs only say where the answer lies.
            let finer =
                (first > 0).then(|| source.meshed(NUMBERED + first, &points, (&above[MESHED], &upper_runs[MESHED])));
            let mut difference = Difference::of((&start.centre, &lower), &at, own, above)?;
            if let Some((mesh, unknown, features)) = finer.flatten() {
                source.trace.sigma = source.trace.sigma.hypot(UNLIKE * usual(&mesh.change));
                source.mesh = features;
                difference = difference.with(mesh, &unknown);
            }
            source.difference = Some(Arc::new(difference));
            pairs = lower_runs.into_iter().zip(upper_runs).map(|(lower, upper)| Pair { lower, upper }).collect();
        }
        Some((sources, pairs))
    }

    /// Gives one stiffness, where it is drawn, to the pairs that the model above runs side by side.
    fn in_levels(&self, start: &Start, at: &mut [Vec<f64>]) {
        let above = self.records.iter().filter_map(|source| source.above.as_ref());
        let together = above.map(|above| above.prepared().together()).max().filter(|together| *together > 1);
        let stiffness = self.modulus.and_then(|_| start.centre.last().zip(start.half.last()));
        let (Some(together), Some((centre, half))) = (together, stiffness) else { return };
        let blocks = at.chunks_mut(together);
        for (level, block) in levels(blocks.len()).into_iter().zip(blocks) {
            block.iter_mut().filter_map(|at| at.last_mut()).for_each(|x| *x = centre + 0.5 * half * level);
        }
    }

    /// Largest distance of a point from the middle of the pairs, in their spread.
    pub(crate) fn distance(&self, at: &[f64]) -> f64 {
        let each = self.records.iter().filter_map(|source| Some(source.difference.as_ref()?.distance(at)));
        each.fold(0.0, f64::max)
    }

    /// Number of the parameter that the drive's level multiplies, where that is fitted.
    pub(crate) fn alpha(&self) -> Option<usize> {
        self.records[0].forward.parameters.iter().position(|parameter| parameter.target == Target::Alpha)
    }

    /// Whether there is one record, or several shots of one experiment.
    pub(crate) fn shares_level(&self) -> bool {
        self.records.len() == self.records[0].forward.uncertainty().repeats
    }

    /// See [`Known::level`].
    fn level(&self) -> Option<(usize, Vec<f64>)> {
        let alpha = self.alpha().filter(|_| !self.shares_level())?;
        let deviation = |source: &Source| super::level(source.forward.uncertainty()).1;
        Some((alpha, self.records.iter().map(deviation).collect()))
    }

    /// A point in ln, reflected into the box.
    pub(crate) fn inside(&self, mut at: Vec<f64>) -> Vec<f64> {
        for (x, span) in at.iter_mut().zip(&self.spans) {
            *x = span * reflect(*x / span);
        }
        at
    }

    /// Unit coordinates and factor on the stiffness of a point in ln.
    fn point(&self, at: &[f64]) -> Point {
        let unit = at.iter().zip(&self.spans).map(|(x, span)| x / span).collect();
        let stiffness = self.modulus.and_then(|_| at.last()).map_or(1.0, |x| x.exp());
        (unit, stiffness)
    }

    /// ln of a point in unit coordinates, at the scene's own stiffness.
    pub(crate) fn of_unit(&self, at: &[f64]) -> Vec<f64> {
        let fitted = at.iter().zip(&self.spans).map(|(u, span)| u * span);
        fitted.chain(self.modulus.map(|_| 0.0)).collect()
    }

    /// Unit coordinates of a point in ln.
    pub(crate) fn unit(&self, at: &[f64]) -> Vec<f64> {
        self.point(at).0
    }

    /// Spans of the fitted parameters.
    pub(crate) fn spans(&self) -> &[f64] {
        &self.spans
    }

    /// Traces of every record, one run per point, numbered from `first`; each lasts `cycles`, or as long as is
    /// compared.
    pub(crate) fn traces(&self, first: u64, at: &[Vec<f64>], cycles: Option<f64>) -> Option<Vec<Traces>> {
        let points: Vec<Point> = at.iter().map(|at| self.point(at)).collect();
        let of = |source: &Source| {
            let mut runs = source.runs(NUMBERED + first, &points, cycles)?;
            let both = runs.iter_mut().zip(at).filter_map(|(run, at)| Some((run.as_mut()?, at)));
            both.for_each(|(run, at)| source.raise(run, at));
            Some(runs)
        };
        self.records.iter().map(of).collect()
    }

    /// Whether any record may still leave samples out.
    pub(crate) fn may_leave_out(&self) -> bool {
        self.records.iter().any(|source| source.trace.may_leave_out())
    }

    /// Mean square residual from which outliers are looked for.
    pub(crate) fn clean(&self) -> f64 {
        self.records.iter().map(|source| source.trace.outlying().1).fold(f64::INFINITY, f64::min)
    }

    /// Whether the fit may go on.
    pub(crate) fn goes_on(&self) -> bool {
        self.records[0].forward.report(0)
    }

    /// Leaves out outliers of records that have drop-outs, if few are left out; returns whether any was.
    pub(crate) fn leave_out(&mut self, outliers: &[Vec<usize>]) -> bool {
        let mut any = false;
        for (source, outliers) in self.records.iter_mut().zip(outliers) {
            any |= source.trace.leave_out(outliers);
        }
        any
    }

    /// What a finer step changes at a point, by runs numbered from `first`, with what is not known of a model above the chain, whose difference holds that
    /// of a finer mesh. Empty where nothing is known of it.
    pub(crate) fn finer(&self, first: u64, at: &[f64]) -> Vec<Correction> {
        let differing = self.differing(|difference| difference.columns.as_ref());
        if self.records.iter().any(|source| source.above.is_some()) {
            return differing;
        }
        let of = |source: &Source| source.finer(NUMBERED + first, self.point(at));
        let finer = self.records.par_iter().map(of).collect::<Option<Vec<_>>>().unwrap_or_default();
        if finer.is_empty() || differing.is_empty() {
            return if finer.is_empty() { differing } else { finer };
        }
        let both = |((mean, finer), (_, differing)): (Correction, Correction)| {
            let rows = mean.len().min(differing.nrows());
            let columns = beside(&[finer.as_ref().subrows(0, rows), differing.as_ref().subrows(0, rows)]);
            (mean[..rows].to_vec(), columns)
        };
        finer.into_iter().zip(differing).map(both).collect()
    }
}

/// Mean square of every cycle of a trace.
fn squares(trace: &[f64]) -> impl Iterator<Item = f64> {
    trace.chunks_exact(SAMPLES_PER_CYCLE).map(|cycle| cycle.iter().map(|v| v * v).sum::<f64>() / cycle.len() as f64)
}

/// Median of a trace's root mean squares over a cycle.
fn usual(trace: &[f64]) -> f64 {
    let mut squares: Vec<f64> = squares(trace).collect();
    squares.sort_by(f64::total_cmp);
    squares.get(squares.len() / 2).map_or(0.0, |square| square.sqrt())
}

/// Evenly spaced numbers of mean 0 and mean square 1.
fn levels(count: usize) -> Vec<f64> {
    let last = count.saturating_sub(1) as f64;
    // −1 … 1 have the mean square (n + 1)/(3 (n − 1)).
    let deviation = ((last + 2.0) / (3.0 * last)).sqrt();
    (0..count).map(|number| if count > 1 { (2.0 * number as f64 / last - 1.0) / deviation } else { 0.0 }).collect()
}

/// What is not known of a mesh's change: a share of it for the whole trace, and one that differs every [`STEADY`] cycles.
fn left(mean: &[f64]) -> Mat<f64> {
    let length = STEADY * SAMPLES_PER_CYCLE as f64;
    let parts = (mean.len() as f64 / length).ceil() as usize + 1;
    // At every instant the squares of both add up to LEFT².
    let share = |t: usize, part: Option<usize>| {
        let apart = part.map_or(0.0, |part| (t as f64 / length - part as f64).abs().min(1.0));
        LEFT_STEADY * (std::f64::consts::FRAC_PI_2 * apart).cos()
    };
    Mat::from_fn(mean.len(), parts + 1, |t, column| share(t, column.checked_sub(1)) * mean[t])
}

/// Mean of `error` times the differences, and what a run differs from it by: a column a difference.
fn correction(own: Vec<Option<Vec<f64>>>, finer: Vec<Option<Vec<f64>>>, error: f64) -> Option<Correction> {
    let finished = differences(own, finer).into_iter().flatten();
    let apart: Vec<Vec<f64>> = finished.map(|apart| apart.into_iter().map(|apart| error * apart).collect()).collect();
    let count = apart.len() as f64;
    let len = apart.iter().map(Vec::len).min().filter(|_| apart.len() >= FEWEST_PAIRS)?;
    let mean: Vec<f64> = (0..len).map(|t| apart.iter().map(|one| one[t]).sum::<f64>() / count).collect();
    // The record is one run of its own.
    let scale = ((1.0 + 1.0 / count) / (count - 1.0)).sqrt();
    let columns = Mat::from_fn(len, apart.len(), |t, i| scale * (apart[i][t] - mean[t]));
    Some((mean, columns))
}

impl Source {
    /// Turns a run of the chain at a point (ln) into one of the model above, where there is one.
    fn raise(&self, run: &mut Vec<f64>, at: &[f64]) {
        if let Some(difference) = &self.difference {
            difference.add_times(1.0, run, at);
            run.truncate(difference.columns.nrows());
        }
    }

    /// The same for a run that another difference was added to.
    pub(super) fn raise_anew(&self, before: &Self, run: &mut Vec<f64>, at: &[f64]) {
        if let Some(difference) = &before.difference {
            difference.add_times(-1.0, run, at);
        }
        self.raise(run, at);
    }

    /// Runs, as the record is compared with them, of so many cycles or of as many as are compared.
    fn runs(&self, first: u64, points: &[Point], cycles: Option<f64>) -> Option<Traces> {
        let (scene, noise) = (self.forward.scene(), self.noise.as_ref());
        let made = match cycles.map(|cycles| cycles / scene.drive.frequency).filter(|it| *it < scene.duration) {
            Some(duration) => self.forward.lasting(duration).ok()?.waveforms(first, points, noise, &Forward::shown),
            None => self.forward.waveforms(first, points, noise, &Forward::shown),
        };
        Some(self.whitened(made))
    }

    fn whitened(&self, made: Traces) -> Traces {
        made.into_par_iter().map(|trace| Some(whitened(&trace?, self.trace.step, self.trace.corner))).collect()
    }

    /// The same runs of a model above the chain, with their features.
    fn runs_above(&self, above: &FidelityLevel, first: u64, points: &[Point]) -> WithFeatures {
        self.with_features(points, above.waveforms(first, points, self.noise.as_ref(), &Forward::shown_with_features))
    }

    fn with_features(&self, points: &[Point], made: Vec<Option<(Vec<f64>, Run)>>) -> WithFeatures {
        let failed = |at: &Vec<f64>| Run { position: at.clone(), outcome: Err("the run failed".into()) };
        let each = made.into_iter().zip(points).map(|(made, (at, _))| match made {
            Some((trace, run)) => (Some(trace), run),
            None => (None, failed(at)),
        });
        let (traces, runs) = each.unzip();
        (self.whitened(traces), runs)
    }

    /// What a finer mesh of the model above changes of some of its runs at these points, numbered from `first`; columns of what is not known of that, and
    /// what it changes of the features.
    fn meshed(
        &self,
        first: u64,
        points: &[Point],
        (own, runs): (&[Option<Vec<f64>>], &[Run]),
    ) -> Option<(Mesh, Mat<f64>, Option<Discrepancy>)> {
        let finer = self.above.as_ref()?.finer()?;
        let (finer, finer_runs) = self.runs_above(finer, first + MESHED.start as u64, &points[MESHED]);
        let features = Discrepancy::of(runs, &finer_runs, MESH_ERROR);
        let one = own.iter().flatten().next()?;
        let (change, columns) = correction(own.to_vec(), finer, MESH_ERROR)?;
        let noise = (self.trace.sigma / LEFT).powi(2);
        let cycles = squares(&change).zip(squares(one));
        let coarse = cycles.map(|(change, signal)| change > COARSE * COARSE * signal + noise).collect();
        let unknown = beside(&[columns.as_ref(), left(&change).as_ref()]);
        Some((Mesh { change, coarse }, unknown, features))
    }

    /// What a finer step of the chain changes at a point.
    fn finer(&self, first: u64, point: Point) -> Option<Correction> {
        let finer = Self { forward: self.forward.refined()?, ..self.clone() };
        let points = vec![point; PAIRS];
        let (own, finer) = rayon::join(|| self.runs(first, &points, None), || finer.runs(first, &points, None));
        correction(own?, finer?, CHAIN_ERROR)
    }
}

/// Error of the mesh that is unlike the change by a finer one, over that change; taken as noise.
const UNLIKE: f64 = 0.15;

/// Largest change by a finer mesh, over the trace, that a correction describes; one that is lost in the noise may be larger.
const COARSE: f64 = 0.2;

/// Number of the first run of this stage: above all others.
const NUMBERED: u64 = 1 << 34;

/// Pairs made before run `number` of a model above the chain; `None` for a run of another stage.
pub(crate) fn pairs_before(number: u64) -> Option<u64> {
    let own = number.checked_sub(NUMBERED)?;
    let pairs = PAIRS_ABOVE as u64;
    Some(own / BETWEEN * pairs + (own % BETWEEN).min(pairs))
}

/// Least mean square of record minus run over six cycles from the record's onset, and a slow rise before it, over the record's own, for any
/// alignment; and the sample of the record at the run's first there.
pub(super) fn misfit(record: &RecordTrace, run: &[f64]) -> (f64, f64) {
    const COMPARED: usize = 6;
    // A beginning that is not compared tells where a record lies whose motion repeats after two periods or three.
    let rise = if record.rise > BEFORE * SAMPLES_PER_CYCLE { record.rise } else { 0 };
    let before = (rise + SAMPLES_PER_CYCLE).min(record.onset);
    let (window, valid) = record.around_onset(before, COMPARED * SAMPLES_PER_CYCLE);
    let weights: Vec<f64> = valid.iter().map(|valid| f64::from(u8::from(*valid))).collect();
    let own: f64 = window.iter().zip(&weights).map(|(y, weight)| weight * y * y).sum();
    let start = record.onset - before;
    // A run may answer sooner after its beginning than the window begins before the onset: it was at rest.
    let run: Vec<f64> = std::iter::repeat_n(0.0, before).chain(run.iter().copied()).collect();
    let places = (run.len() + 1).saturating_sub(window.len());
    let squares = |place: usize| {
        let each = window.iter().zip(&run[place..]).zip(&weights);
        each.map(|((y, v), weight)| weight * (y - v) * (y - v)).sum::<f64>()
    };
    let all: Vec<f64> = (0..places).map(squares).collect();
    let Some((place, least)) = all.iter().copied().enumerate().min_by(|a, b| a.1.total_cmp(&b.1)) else {
        return (f64::INFINITY, 0.0);
    };
    // Between samples by the parabola through three.
    let (mut least, mut part) = (least, 0.0);
    if place > 0 && place + 1 < places {
        let (before, behind) = (all[place - 1], all[place + 1]);
        let bend = before + behind - 2.0 * least;
        if bend > 0.0 {
            part = 0.5 * (before - behind) / bend;
            least = (least - 0.125 * (before - behind).powi(2) / bend).max(0.0);
        }
    }
    (least / own.max(f64::MIN_POSITIVE), (start + before) as f64 - (place as f64 + part))
}

#[cfg(test)]
mod tests {
    use super::{left, levels};
    use crate::discrepancy::LEFT;

    #[test]
    fn as_much_of_a_meshs_change_is_unknown_at_every_instant() {
        let change: Vec<f64> = (0..500).map(|t| 1.0 + f64::from(t)).collect();
        let columns = left(&change);
        for (t, change) in change.iter().enumerate() {
            let variance: f64 = (0..columns.ncols()).map(|j| columns[(t, j)].powi(2)).sum();
            assert!((variance / (LEFT * change).powi(2) - 1.0).abs() < 1e-12, "{t}");
        }
    }

    #[test]
    fn levels_of_the_stiffness_are_even_and_have_the_deviation_of_draws() {
        for count in [2, 3, 7] {
            let levels = levels(count);
            let mean = |of: fn(&f64) -> f64| levels.iter().map(of).sum::<f64>() / count as f64;
            assert!(mean(|z| *z).abs() < 1e-12 && (mean(|z| z * z) - 1.0).abs() < 1e-12, "{levels:?}");
        }
        assert_eq!(levels(1), [0.0]);
    }
}
