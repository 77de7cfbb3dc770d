//! Uncertainties of a bench that the user states by name.

use std::collections::BTreeMap;

use super::{
    drive::RecordedDrive,
    forward::Uncertainty,
    impact::run::Unknown,
    parameter::Parameter,
    plan::Number,
    refusal::{Contradiction, Refusal},
};
use granchain_model::scene::Scene;
use granchain_signal::{
    LowPass, Quantity, QuantityError, Unit,
    number::{engineering, significant},
};

impl Number {
    /// Value in SI; a pure number is taken as SI.
    ///
    /// # Errors
    /// When the text is no quantity of that unit.
    pub(crate) fn in_si(&self, unit: &str) -> Result<f64, QuantityError> {
        let text = match self {
            Self::Plain(value) => return Ok(*value),
            Self::Text(text) => text,
        };
        match text.parse() {
            Ok(value) => Ok(value),
            Err(_) => Quantity::parse_as(text, Unit::parse(unit)?.dimension),
        }
    }
}

/// Stated values by name, SI; others keep their defaults.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct StatedUncertainty(BTreeMap<String, f64>);

impl StatedUncertainty {
    /// By the names of [`Uncertainty::named`].
    ///
    /// # Errors
    /// An unknown name; a value that is negative, not finite or of another unit.
    pub fn new(stated: &BTreeMap<String, Number>) -> Result<Self, Refusal> {
        let value = |(name, number): (&String, &Number)| {
            let drawn = Uncertainty::default().named();
            let Some((_, unit, _)) = drawn.iter().find(|(known, ..)| known == name) else {
                return Err(Contradiction::Uncertainty { name: name.clone() }.into());
            };
            let what = || format!("uncertainty of {name}");
            let value = number.in_si(unit).map_err(|source| Refusal::NotSi { what: what(), source })?;
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Refusal::Uncertainty { name: name.clone(), value });
            }
            Ok((name.clone(), value))
        };
        Ok(Self(stated.iter().map(value).collect::<Result<_, _>>()?))
    }

    /// Uncertainty for the runs of `scene`; the horn record adds the error of its baseline and of its vibrometer's
    /// filter.
    ///
    /// # Errors
    /// A stiffness of a support that has none.
    pub fn of(&self, scene: &Scene, drive: Option<&RecordedDrive>) -> Result<Uncertainty, Refusal> {
        let baseline = drive.and_then(|drive| drive.baseline_error);
        let bandwidth = drive.and_then(|drive| drive.bandwidth);
        let usual = Uncertainty::default();
        let stated = |name: &str| self.0.get(name).copied();
        let drawn = Uncertainty {
            gap: stated("gap").unwrap_or(usual.gap),
            gap_scale: stated("gap_scale").unwrap_or(usual.gap_scale),
            baseline: stated("baseline").or(baseline).unwrap_or(usual.baseline),
            drive: stated("drive").unwrap_or(usual.drive),
            sensitivity: stated("sensitivity").unwrap_or(usual.sensitivity),
            precompression: stated("precompression").unwrap_or(usual.precompression),
            support_stiffness: stated("support_stiffness").unwrap_or(usual.support_stiffness),
            modulus: stated("modulus").unwrap_or(usual.modulus),
            droop: bandwidth.map_or(0.0, |bandwidth| 1.0 - LowPass::gaussian_gain(scene.drive.frequency, bandwidth)),
            repeats: 1,
        };
        if drawn.support_stiffness > 0.0 {
            Parameter::named("support_stiffness", scene).map_err(Refusal::UncertainStiffness)?;
        }
        Ok(drawn)
    }
}

/// What is stated of a bench with a striker: `drive`, the standard deviation of its velocity, and `modulus`; others keep their defaults.
///
/// # Errors
/// Another name; a value that is negative, not finite or of another unit.
pub fn striker(stated: &BTreeMap<String, Number>) -> Result<Unknown, Refusal> {
    if let Some(name) = stated.keys().find(|name| !["drive", "modulus"].contains(&name.as_str())) {
        return Err(Contradiction::StrikerUncertainty { name: name.clone() }.into());
    }
    let StatedUncertainty(stated) = StatedUncertainty::new(stated)?;
    let usual = Unknown::default();
    let or = |name: &str, usual: f64| stated.get(name).copied().unwrap_or(usual);
    Ok(Unknown { velocity: or("drive", usual.velocity), modulus: or("modulus", usual.modulus) })
}

/// Description of the drawn uncertainties; fitted parameters are not drawn.
#[must_use]
pub(crate) fn in_words(drawn: &Uncertainty, parameters: &[Parameter]) -> String {
    let fitted = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
    let roughness = if drawn.gap_scale > 0.0 {
        format!(", that scale known to a factor of {:.1}", drawn.gap_scale.exp())
    } else {
        String::new()
    };
    let mut words =
        vec![format!("gaps of {} (half-normal{roughness}) in every contact", engineering(drawn.gap, "m", 2))];
    words.push(format!("the drive's level ±{} %", 100.0 * drawn.drive));
    if drawn.droop > 0.0 {
        words.push(format!("up to {} % drive loss in its vibrometer's filter", significant(100.0 * drawn.droop, 2)));
    }
    if drawn.sensitivity > 0.0 {
        words.push(format!("the instrument's sensitivity ±{:.2} %", 100.0 * drawn.sensitivity));
    }
    if drawn.baseline > 0.0 && !fitted("gap") {
        words.push(format!("the horn's baseline ±{}", engineering(drawn.baseline, "m", 2)));
    }
    if drawn.precompression > 0.0 && !fitted("precompression") {
        words.push(format!("the precompression ±{}", engineering(drawn.precompression, "N", 2)));
    }
    if drawn.support_stiffness > 0.0 && !fitted("support_stiffness") {
        words.push(format!("the support's stiffness ±{} %", 100.0 * drawn.support_stiffness));
    }
    if drawn.modulus > 0.0 {
        words.push(format!("the beads' stiffness over their mass ±{} %", significant(100.0 * drawn.modulus, 2)));
    }
    format!("drawn into every run: {}", words.join(", "))
}
