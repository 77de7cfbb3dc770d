//! Source of the traces: the chain under every record's drive.

use faer::Mat;
use rayon::prelude::*;

use super::{
    columns::Nuisances,
    ensemble::Known,
    record::{RecordTrace, whitened},
};
use crate::{
    drive::HornNoise,
    forward::Forward,
    parameter::{Parameter, Target, reflect},
};
use granchain_signal::feature::fingerprint::SAMPLES_PER_CYCLE;

/// Pairs of runs for the step error.
const PAIRS: usize = 16;

const FEWEST_PAIRS: usize = 4;

/// Error of the chain's step over its difference from one a quarter as long.
const CHAIN_ERROR: f64 = 4.0 / 3.0;

/// One record with its forward model.
#[derive(Clone)]
pub(super) struct Source {
    pub forward: Forward,
    pub noise: Option<HornNoise>,
    pub trace: RecordTrace,
    nuisances: Nuisances,
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

impl Source {
    pub fn new(forward: Forward, noise: Option<HornNoise>, trace: RecordTrace) -> Self {
        let scene = forward.scene();
        let motion = scene.drive.motion(1.0);
        let count = (scene.duration / trace.step) as usize + 1;
        let [mut along, mut across] = [vec![0.0; count], vec![0.0; count]];
        let angular = std::f64::consts::TAU * scene.drive.frequency;
        for i in 0..count {
            let (displacement, velocity) = motion.at(i as f64 * trace.step);
            (along[i], across[i]) = (displacement, velocity / angular);
        }
        let peak = along.iter().fold(f64::MIN_POSITIVE, |most, x| f64::max(most, x.abs()));
        [&mut along, &mut across].into_iter().flatten().for_each(|x| *x /= peak);
        let nuisances = Nuisances::new(forward.uncertainty().sensitivity, [along, across], scene.drive.frequency);
        Self { forward, noise, trace, nuisances }
    }
}

impl Sources {
    pub fn new(records: Vec<Source>) -> Self {
        let forward = &records[0].forward;
        let spans = forward.parameters.iter().map(Parameter::span).collect();
        let modulus = forward.draws_modulus().then(|| forward.uncertainty().modulus);
        Self { records, spans, modulus }
    }

    pub fn records(&self) -> usize {
        self.records.len()
    }

    pub fn known(&self) -> Known<'_> {
        Known {
            records: self.records.iter().map(|source| &source.trace).collect(),
            nuisances: self.records.iter().map(|source| source.nuisances.clone()).collect(),
            prior: self.modulus,
            level: self.level(),
            correction: Vec::new(),
        }
    }

    /// Number of the parameter that scales with the drive level, if fitted.
    pub fn alpha(&self) -> Option<usize> {
        self.records[0].forward.parameters.iter().position(|parameter| parameter.target == Target::Alpha)
    }

    /// See [`Known::level`].
    fn level(&self) -> Option<(usize, Vec<f64>)> {
        let alpha = self.alpha().filter(|_| self.records.len() > 1)?;
        let deviation = |source: &Source| super::level(source.forward.uncertainty()).1;
        Some((alpha, self.records.iter().map(deviation).collect()))
    }

    /// A point in ln, reflected into the box.
    pub fn inside(&self, mut at: Vec<f64>) -> Vec<f64> {
        for (x, span) in at.iter_mut().zip(&self.spans) {
            *x = span * reflect(*x / span);
        }
        at
    }

    /// Unit coordinates and factor on the stiffness of a point in ln.
    fn point(&self, at: &[f64]) -> (Vec<f64>, f64) {
        let unit = at.iter().zip(&self.spans).map(|(x, span)| x / span).collect();
        let stiffness = self.modulus.and_then(|_| at.last()).map_or(1.0, |x| x.exp());
        (unit, stiffness)
    }

    /// ln of a point in unit coordinates, at the scene's own stiffness.
    pub fn of_unit(&self, at: &[f64]) -> Vec<f64> {
        let fitted = at.iter().zip(&self.spans).map(|(u, span)| u * span);
        fitted.chain(self.modulus.map(|_| 0.0)).collect()
    }

    /// Unit coordinates of a point in ln.
    pub fn unit(&self, at: &[f64]) -> Vec<f64> {
        self.point(at).0
    }

    /// Spans of the fitted parameters.
    pub fn spans(&self) -> &[f64] {
        &self.spans
    }

    /// Traces of every record, one run per point, numbered from `first`; each lasts `cycles`, or as long as is
    /// compared.
    pub fn traces(&self, first: u64, at: &[Vec<f64>], cycles: Option<f64>) -> Option<Vec<Vec<Option<Vec<f64>>>>> {
        let points: Vec<(Vec<f64>, f64)> = at.iter().map(|at| self.point(at)).collect();
        self.records.iter().map(|source| source.runs(NUMBERED + first, &points, cycles)).collect()
    }

    /// Whether any record may still leave samples out.
    pub fn may_leave_out(&self) -> bool {
        self.records.iter().any(|source| source.trace.may_leave_out())
    }

    /// Whether the fit may go on.
    pub fn goes_on(&self) -> bool {
        self.records[0].forward.report(0)
    }

    /// Leaves out outliers of records that have drop-outs, if few are left out; returns whether any was.
    pub fn leave_out(&mut self, outliers: &[Vec<usize>]) -> bool {
        let mut any = false;
        for (source, outliers) in self.records.iter_mut().zip(outliers) {
            any |= source.trace.leave_out(outliers);
        }
        any
    }

    /// Change with a finer step at a point, with runs numbered from `first`; empty if too few pairs finished.
    pub fn finer(&self, first: u64, at: &[f64]) -> Vec<Correction> {
        let of = |source: &Source| source.finer(NUMBERED + first, self.point(at));
        self.records.par_iter().map(of).collect::<Option<Vec<_>>>().unwrap_or_default()
    }
}

/// Mean of the differences and its uncertainty, a column per difference.
fn correction(own: Vec<Option<Vec<f64>>>, finer: Vec<Option<Vec<f64>>>) -> Option<Correction> {
    let both = own.into_iter().zip(finer).filter_map(|(own, finer)| own.zip(finer));
    let apart: Vec<Vec<f64>> = both
        .map(|(own, finer)| finer.iter().zip(&own).map(|(finer, own)| CHAIN_ERROR * (finer - own)).collect())
        .collect();
    let count = apart.len() as f64;
    let len = apart.iter().map(Vec::len).min().filter(|_| apart.len() >= FEWEST_PAIRS)?;
    let mean: Vec<f64> = (0..len).map(|t| apart.iter().map(|one| one[t]).sum::<f64>() / count).collect();
    let scale = (count * (count - 1.0)).sqrt().recip();
    let columns = Mat::from_fn(len, apart.len(), |t, i| scale * (apart[i][t] - mean[t]));
    Some((mean, columns))
}

impl Source {
    /// Conditioned runs of `cycles`, or as long as is compared.
    fn runs(&self, first: u64, points: &[(Vec<f64>, f64)], cycles: Option<f64>) -> Option<Vec<Option<Vec<f64>>>> {
        let (scene, noise) = (self.forward.scene(), self.noise.as_ref());
        let made = match cycles.map(|cycles| cycles / scene.drive.frequency).filter(|it| *it < scene.duration) {
            Some(duration) => self.forward.lasting(duration).ok()?.waveforms(first, points, noise),
            None => self.forward.waveforms(first, points, noise),
        };
        Some(made.into_par_iter().map(|trace| Some(whitened(&trace?, self.trace.step, self.trace.corner))).collect())
    }

    /// Change with a finer step at a point.
    fn finer(&self, first: u64, point: (Vec<f64>, f64)) -> Option<Correction> {
        let finer = Self { forward: self.forward.refined()?, ..self.clone() };
        let points = vec![point; PAIRS];
        let (own, finer) = rayon::join(|| self.runs(first, &points, None), || finer.runs(first, &points, None));
        correction(own?, finer?)
    }
}

/// Number of the first run of this stage: above all others.
const NUMBERED: u64 = 1 << 34;

/// Least mean square of record minus run over six cycles from the record's onset, over the record's own, for any
/// alignment; and the sample of the record at the run's first there.
pub(super) fn misfit(record: &RecordTrace, run: &[f64]) -> (f64, f64) {
    const COMPARED: usize = 6;
    let before = SAMPLES_PER_CYCLE.min(record.onset);
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
