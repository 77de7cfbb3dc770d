//! By how much α and damping of a fit move where the model's trace is off: δ = (JᵀΣ⁻¹J)⁻¹JᵀΣ⁻¹Δv.
//!
//! J is the derivative of the trace in ln α and ln c on the chain, by differences. Σ is the covariance of the likelihood: white noise, what is drawn in the
//! runs of a fit (gaps, stiffness over mass, precompression, support), and the instrument's further columns (shift, clock, coupling, drift, crosstalk).

use crate::{
    engine::trace,
    forward::Uncertainty,
    waveform::{Nuisances, QUANTILE, inverse},
};
use granchain_model::{
    ModelError, Prepared,
    chain::ensemble::Variation,
    scene::{DampingTerm, Scene},
};
use granchain_signal::{Series, feature::Measurand};

/// Change of ln α, ln c and of ln of stiffness over mass from which slopes are taken.
const BY: f64 = 0.01;
/// Standard deviation of a half-normal gap over its scale.
const HALF_NORMAL: f64 = 0.603;

/// What a trace says of α and damping.
#[derive(Debug)]
pub(super) struct Sensitivity {
    /// J, then the nuisances each times its standard deviation; over σ.
    columns: Vec<Vec<f64>>,
    /// Of the least squares with these columns.
    covariance: Vec<Vec<f64>>,
    sigma: f64,
    /// Whether the scene has dampers.
    damped: bool,
    /// Variances of ln that no waveform can lower: of the drive level, of the mass.
    level: f64,
    mass: f64,
}

/// Trace of a scene's variation as it is compared.
pub(super) type Trace<'a> = &'a dyn Fn(&Variation) -> Result<Vec<f64>, ModelError>;

impl Sensitivity {
    /// On prepared bodies of the chain, whose `trace` is sampled at `step` (s), under white noise of that σ.
    pub fn of(
        scene: &Scene,
        trace: Trace,
        (step, sigma): (f64, f64),
        uncertainty: &Uncertainty,
    ) -> Result<Self, ModelError> {
        let own = Variation::of(scene);
        let base = trace(&own)?;
        let slope = |change: &dyn Fn(&mut Variation, f64)| -> Result<Vec<f64>, ModelError> {
            let at = |by: f64| {
                let mut variation = own.clone();
                change(&mut variation, by);
                trace(&variation)
            };
            let (up, down) = (at(BY.exp())?, at((-BY).exp())?);
            Ok(up.iter().zip(&down).map(|(up, down)| (up - down) / (2.0 * BY)).collect())
        };
        let damped = !scene.damping.coefficients.are_absent();
        let mut columns = vec![slope(&|variation, factor| variation.amplitude_scale *= factor)?];
        if damped {
            columns.push(slope(&|variation, factor| {
                DampingTerm::ALL.iter().for_each(|term| variation.damping[*term] *= factor)
            })?);
        }
        let fitted = columns.len();
        let times = |column: Vec<f64>, by: f64| column.into_iter().map(|x| by * x).collect::<Vec<f64>>();
        let mut nuisances =
            vec![times(slope(&|variation, factor| variation.modulus_factor *= factor)?, uncertainty.modulus)];
        if uncertainty.support_stiffness > 0.0 && scene.support.stiffness().is_some() {
            let support = slope(&|variation, factor| variation.support_stiffness_factor *= factor)?;
            nuisances.push(times(support, uncertainty.support_stiffness));
        }
        let pressed = scene.chain.precompression > 0.0 || scene.chain.gravity > 0.0;
        if uncertainty.precompression > 0.0 && pressed {
            let force = slope(&|variation, factor| variation.precompression *= factor)?;
            nuisances.push(times(force, uncertainty.precompression / scene.chain.precompression));
        }
        for contact in 0..if pressed { 0 } else { own.gap_offsets.len() } {
            let baseline = if contact == 0 { uncertainty.baseline } else { 0.0 };
            let size = (HALF_NORMAL * uncertainty.gap).hypot(baseline);
            if size > 0.0 {
                let mut variation = own.clone();
                variation.gap_offsets[contact] += size;
                let opened = trace(&variation)?;
                nuisances.push(opened.iter().zip(&base).map(|(opened, base)| opened - base).collect());
            }
        }
        let instrument = Nuisances::of_scene(uncertainty.sensitivity, scene, step);
        let rows: Vec<usize> = (0..base.len()).collect();
        let peak = base.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        for further in [instrument.columns((step, peak), &base, &rows), instrument.shift_column(step, &base, &rows)] {
            nuisances.extend((0..further.ncols()).map(|j| (0..further.nrows()).map(|i| further[(i, j)]).collect()));
        }
        columns.append(&mut nuisances);
        columns.iter_mut().flatten().for_each(|x| *x /= sigma);
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let information: Vec<Vec<f64>> = columns
            .iter()
            .enumerate()
            .map(|(i, a)| {
                let prior = |j: usize| f64::from(u8::from(i == j && i >= fitted));
                columns.iter().enumerate().map(|(j, b)| product(a, b) + prior(j)).collect()
            })
            .collect();
        let covariance = inverse(&information);
        let level = uncertainty.drive * uncertainty.drive / 3.0;
        Ok(Self { columns, covariance, sigma, damped, level, mass: uncertainty.mass * uncertainty.mass })
    }

    /// Changes of ln α and ln c in a fit of a model whose trace is the record's less `difference`; of c none without dampers.
    pub fn shift(&self, difference: &[f64]) -> [Option<f64>; 2] {
        let along = |column: &Vec<f64>| column.iter().zip(difference).map(|(a, v)| a * v / self.sigma).sum::<f64>();
        let right: Vec<f64> = self.columns.iter().map(along).collect();
        let solved = |row: usize| self.covariance[row].iter().zip(&right).map(|(a, b)| a * b).sum::<f64>();
        [Some(solved(0)), self.damped.then(|| solved(1))]
    }

    /// Half of the 90 % interval that a fit of this trace would state, of ln.
    pub fn half_widths(&self) -> [Option<f64>; 2] {
        let half = |row: usize, more: f64| QUANTILE * (self.covariance[row][row] + more).sqrt();
        [Some(half(0, self.level)), self.damped.then(|| half(1, self.mass))]
    }
}

/// Trace of the chain as it is compared, of variations of a scene on prepared bodies.
pub(super) fn chain_trace(
    (prepared, scene): (&Prepared, &Scene),
    variation: &Variation,
    measurand: Measurand,
) -> Result<Series, ModelError> {
    let count = scene.samples();
    let scene = variation.written_over(scene, |gap| gap.max(0.0));
    let response = prepared.run(&scene, &mut |_| true)?;
    Ok(variation.on_the_record(trace(response, measurand)?, count))
}
