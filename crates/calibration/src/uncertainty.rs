//! Uncertainties of a bench that the user states by name.

use std::collections::BTreeMap;

use super::{
    drive::RecordedDrive,
    forward::Uncertainty,
    parameter::Parameter,
    plan::Number,
    refusal::{Contradiction, Refusal},
};
use granchain_model::scene::Scene;
use granchain_signal::{
    Dimension, LowPass, Quantity, QuantityError, Unit,
    number::{engineering, significant},
};

impl Number {
    /// Value in SI; a pure number is taken as SI.
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
pub(crate) struct StatedUncertainty(BTreeMap<String, f64>);

impl StatedUncertainty {
    /// By the names of [`Uncertainty::named`].
    pub(crate) fn new(stated: &BTreeMap<String, Number>) -> Result<Self, Refusal> {
        let value = |(name, number): (&String, &Number)| {
            let mut usual = Uncertainty::default();
            let Some((_, unit, most, units, _)) = usual.named().into_iter().find(|(known, ..)| known == name) else {
                return Err(Contradiction::Uncertainty { name: name.clone() }.into());
            };
            let what = || format!("[uncertainty] {name}");
            let not_si = |source| Refusal::NotSi { what: what(), name: name.clone(), source };
            let value = number.in_si(unit).map_err(not_si)?;
            if !(value >= 0.0 && value.is_finite()) {
                return Err(Refusal::Uncertainty { name: name.clone(), value });
            }
            if value > most {
                let dimension = Unit::parse(unit).map_or(Dimension::NONE, |unit| unit.dimension);
                let small = |text: &String| Quantity::parse_as(text, dimension).is_ok_and(|meant| meant <= most);
                return Err(Refusal::ImplausibleUncertainty {
                    name: name.clone(),
                    most: Quantity::new(most, dimension).to_string(),
                    found: Quantity::new(value, dimension).to_string(),
                    meant: units.iter().map(|unit| format!("{value} {unit}")).find(small),
                });
            }
            Ok((name.clone(), value))
        };
        Ok(Self(stated.iter().map(value).collect::<Result<_, _>>()?))
    }

    /// Uncertainty for the runs of `scene`; the horn record adds the error of its baseline and of its vibrometer's
    /// filter.
    pub(crate) fn of(&self, scene: &Scene, drive: Option<&RecordedDrive>) -> Result<Uncertainty, Refusal> {
        let bandwidth = drive.and_then(|drive| drive.bandwidth);
        let mut drawn = Uncertainty {
            baseline: drive.and_then(|drive| drive.baseline_error).unwrap_or(0.0),
            droop: bandwidth.map_or(0.0, |bandwidth| 1.0 - LowPass::gaussian_gain(scene.drive.frequency, bandwidth)),
            ..Uncertainty::default()
        };
        for (name, .., value) in drawn.named() {
            *value = self.0.get(name).copied().unwrap_or(*value);
        }
        if drawn.support_stiffness > 0.0 {
            Parameter::named("support_stiffness", scene).map_err(Refusal::UncertainStiffness)?;
        }
        Ok(drawn)
    }
}

/// Description of the drawn uncertainties; fitted parameters are not drawn.
pub(crate) fn in_words(drawn: &Uncertainty, parameters: &[Parameter]) -> String {
    let fitted = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
    let roughness = if drawn.gap_scale > 0.0 {
        format!(", uncertain by a factor of {:.1}", drawn.gap_scale.exp())
    } else {
        String::new()
    };
    let mut words =
        vec![format!("a gap in every contact (half-normal, scale {}{roughness})", engineering(drawn.gap, "m", 2))];
    words.push(format!("horn scale ±{} %", 100.0 * drawn.drive));
    if drawn.droop > 0.0 {
        words.push(format!("up to {} % drive loss in its vibrometer's filter", significant(100.0 * drawn.droop, 2)));
    }
    let mut shared = Vec::new();
    if drawn.sensitivity > 0.0 {
        shared.push(format!("sensitivity ±{:.2} %", 100.0 * drawn.sensitivity));
    }
    if drawn.mass > 0.0 && parameters.iter().any(|parameter| parameter.target.is_force()) {
        shared.push(format!("mass of the beads ±{:.2} % (where the waveform is fitted)", 100.0 * drawn.mass));
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
        words.push(format!("stiffness of the beads over their mass ±{} %", significant(100.0 * drawn.modulus, 2)));
    }
    let covariance = match &shared[..] {
        [] => String::new(),
        shared => format!(". Added to the covariance: {}", shared.join(", ")),
    };
    format!("varied at random in every run: {}{covariance}", words.join(", "))
}
