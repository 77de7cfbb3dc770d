//! Nuisances: what of a bench and its record is not known and is drawn in every run.

use serde::{Deserialize, Serialize};

/// Uncertainty of the bench, drawn in every run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Uncertainty {
    /// Scale of each contact's initial gap, m: half-normal, since beads cannot overlap at rest. The mean gap is 0.8 of
    /// the scale; the mean sum over the seven contacts of six beads is 5.6 times the scale.
    pub gap: f64,
    /// Standard deviation of the logarithm of that scale, drawn once a run: the roughness is unknown.
    #[serde(default)]
    pub gap_scale: f64,
    /// Additional standard deviation of the first gap, m: the uncertainty of the horn's baseline.
    pub baseline: f64,
    /// Half-width of a uniform factor on the drive, 1.
    pub drive: f64,
    /// Standard deviation of the logarithm of the record's scale factor, 1: the sensitivity. Part of the covariance, not drawn.
    #[serde(default)]
    pub sensitivity: f64,
    /// Standard deviation of the precompression about the scene's value, N; negative values are reflected.
    #[serde(default)]
    pub precompression: f64,
    /// Standard deviation of the logarithm of the support's stiffness about the scene's own, 1.
    #[serde(default)]
    pub support_stiffness: f64,
    /// Standard deviation of the logarithm of the beads' stiffness over their mass, 1.
    #[serde(default)]
    pub modulus: f64,
    /// Standard deviation of the logarithm of the beads' mass, 1. A record determines forces over mass only: a waveform adds it to every force.
    #[serde(default)]
    pub mass: f64,
    /// Largest loss of drive amplitude in the vibrometer's filter, whose shape is unknown. Drawn uniformly from zero
    /// to this value.
    #[serde(default)]
    pub droop: f64,
    /// Number n of shots of one experiment that are fitted together. They share bench, horn and instruments, so each is taken to know these √n times
    /// worse: all together then know them as well as one.
    #[serde(default = "single")]
    pub repeats: usize,
}

fn single() -> usize {
    1
}

impl Default for Uncertainty {
    /// Half-normal gaps of scale 0.3 nm, itself known to a factor of 1.5, an exact baseline, ±0.5 % of drive, 0.3 % of sensitivity. 1.2 % of stiffness
    /// over mass and of mass: what 0.35 % of radius, 0.5 % of density and 0.7 % of Young's modulus make together.
    fn default() -> Self {
        Self {
            gap: 3e-10,
            gap_scale: 0.4,
            baseline: 0.0,
            drive: 0.005,
            sensitivity: 0.003,
            precompression: 0.0,
            support_stiffness: 0.0,
            modulus: 0.012,
            mass: 0.012,
            droop: 0.0,
            repeats: 1,
        }
    }
}

/// Baseline error that affects a record, m: a few times the roughness of every run.
const FELT: f64 = 1e-9;

/// Factor on the tempering exponent if a drawn quantity moves all features together: the shrunk covariance would count
/// them as independent evidence.
const TOGETHER: f64 = 0.6;

/// Name, SI unit, largest plausible value (SI), the units that are left out where it is exceeded (0.5 m of gap is none of a chain, 0.5 nm is), and
/// value.
pub(crate) type Named<'a> = (&'static str, &'static str, f64, &'static [&'static str], &'a mut f64);

impl Uncertainty {
    /// What may be stated.
    pub fn named(&mut self) -> [Named<'_>; 9] {
        [
            ("gap", "m", 1e-5, &["nm", "um"], &mut self.gap),
            ("gap_scale", "1", 3.0, &[], &mut self.gap_scale),
            ("baseline", "m", 1e-5, &["nm", "um"], &mut self.baseline),
            ("drive", "1", 0.5, &["%"], &mut self.drive),
            ("sensitivity", "1", 0.5, &["%"], &mut self.sensitivity),
            ("precompression", "N", 10.0, &["mN"], &mut self.precompression),
            ("support_stiffness", "1", 2.0, &["%"], &mut self.support_stiffness),
            ("modulus", "1", 0.5, &["%"], &mut self.modulus),
            ("mass", "1", 0.5, &["%"], &mut self.mass),
        ]
    }

    /// Factor on the standard deviation of what all shots of an experiment share: √n.
    pub(super) fn shared(&self) -> f64 {
        (self.repeats as f64).sqrt()
    }

    /// Factor on the tempering exponent β of the likelihood.
    pub(super) fn discount(&self) -> f64 {
        let felt = self.baseline > FELT || self.precompression > 0.0 || self.support_stiffness > 0.0;
        if felt { TOGETHER } else { 1.0 }
    }
}
