//! `--uncertainty` and `[uncertainty]`: how well the bench is known.

use std::collections::BTreeMap;

use anyhow::{Context, bail};

use super::definition::in_si;
use crate::{
    calibration::{forward::Uncertainty, parameter::Parameter, plan::Number},
    cli::arguments::usage,
    report::number::engineering,
    scene::Scene,
};

/// What was told, by name, SI.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Told(BTreeMap<String, f64>);

impl Told {
    /// What the plan says, and the flags in its place.
    ///
    /// # Errors
    /// A usage error for an unknown name or a text that is no `NAME=VALUE`; a value that is negative, not finite or of another unit.
    pub fn new(plan: BTreeMap<String, Number>, flags: &[String]) -> anyhow::Result<Self> {
        let mut told = plan;
        for text in flags {
            let Some((name, value)) = text.split_once('=') else {
                return Err(usage(format!("--uncertainty {text}: expected NAME=VALUE such as \"gap=0.5 nm\"")));
            };
            told.insert(name.trim().into(), Number::Text(value.trim().into()));
        }
        let value = |(name, number): (String, Number)| {
            let drawn = Uncertainty::default().named();
            let Some((_, unit, _)) = drawn.iter().find(|(known, ..)| *known == name) else {
                let known: Vec<&str> = drawn.iter().map(|(name, ..)| *name).collect();
                return Err(usage(format!("uncertainty of `{name}`: expected one of {}", known.join(", "))));
            };
            let value = in_si(&number, unit).with_context(|| format!("uncertainty of {name}"))?;
            if !(value >= 0.0 && value.is_finite()) {
                bail!("uncertainty of {name}: expected a finite number ≥ 0, found {value}");
            }
            Ok((name, value))
        };
        Ok(Self(told.into_iter().map(value).collect::<anyhow::Result<_>>()?))
    }

    /// What is drawn into the runs of `scene`, whose horn's baseline is known to `baseline` (m) by its record.
    ///
    /// # Errors
    /// A stiffness of a support that has none.
    pub fn of(&self, scene: &Scene, baseline: Option<f64>) -> anyhow::Result<Uncertainty> {
        let usual = Uncertainty::default();
        let told = |name: &str| self.0.get(name).copied();
        let drawn = Uncertainty {
            gap: told("gap").unwrap_or(usual.gap),
            gap_scale: told("gap_scale").unwrap_or(usual.gap_scale),
            baseline: told("baseline").or(baseline).unwrap_or(usual.baseline),
            drive: told("drive").unwrap_or(usual.drive),
            sensitivity: told("sensitivity").unwrap_or(usual.sensitivity),
            precompression: told("precompression").unwrap_or(usual.precompression),
            support_stiffness: told("support_stiffness").unwrap_or(usual.support_stiffness),
        };
        if drawn.support_stiffness > 0.0 {
            Parameter::named("support_stiffness", scene).with_context(|| "uncertainty of support_stiffness")?;
        }
        Ok(drawn)
    }
}

/// What is drawn, in words; what is fitted is not drawn.
pub fn said(drawn: &Uncertainty, parameters: &[Parameter]) -> String {
    let fitted = |name: &str| parameters.iter().any(|parameter| parameter.name == name);
    let roughness = if drawn.gap_scale > 0.0 {
        format!(", that scale known to a factor of {:.1}", drawn.gap_scale.exp())
    } else {
        String::new()
    };
    let mut said = vec![format!("gaps of {} (half-normal{roughness}) in every contact", engineering(drawn.gap, "m", 2))];
    said.push(format!("the drive's level ±{} %", 100.0 * drawn.drive));
    if drawn.sensitivity > 0.0 {
        said.push(format!("the instrument's sensitivity ±{:.2} %", 100.0 * drawn.sensitivity));
    }
    if drawn.baseline > 0.0 && !fitted("gap") {
        said.push(format!("the horn's baseline ±{}", engineering(drawn.baseline, "m", 2)));
    }
    if drawn.precompression > 0.0 && !fitted("precompression") {
        said.push(format!("the precompression ±{}", engineering(drawn.precompression, "N", 2)));
    }
    if drawn.support_stiffness > 0.0 && !fitted("support_stiffness") {
        said.push(format!("the support's stiffness ±{} %", 100.0 * drawn.support_stiffness));
    }
    format!("drawn into every run: {}", said.join(", "))
}
