//! `--accuracy LEVEL`: model and settings from the front that is kept of a built-in scene.

use anyhow::bail;

use super::arguments::{expected, usage};
use crate::{
    scene::ModelKind,
    validate::accuracy::{ladder::FidelityLevel, stored::Stored},
    validate::page::accuracy::{percent, seconds, setting_of},
};

pub struct Choice {
    /// The overrides, below those of the caller.
    pub sets: Vec<String>,
    /// Which setting, what it is expected to be worth and to cost.
    pub note: String,
}

/// Value parser of a level: `1%` or `0.01`, above 0 and below 1.
pub fn level(text: &str) -> Result<f64, String> {
    let text = text.trim();
    let (number, factor) = text.strip_suffix('%').map_or((text, 1.0), |number| (number.trim_end(), 0.01));
    match number.parse::<f64>() {
        Ok(value) if value > 0.0 && value * factor < 1.0 => Ok(value * factor),
        _ => Err(expected("a level such as `1%` or `0.01`, above 0 and below 100 %", text)),
    }
}

/// The cheapest setting of a built-in scene whose error is shown to be at most `level`.
///
/// - `models`: those that the command can take
/// - `changed`: whether the caller changes the scene
pub fn choose(scene: &str, level: f64, models: &[ModelKind], changed: bool) -> anyhow::Result<Choice> {
    let stored = match Stored::of(scene) {
        Ok(stored) => stored,
        Err(reason) => return Err(usage(format!("--accuracy: {reason}; name the model with --model and --set"))),
    };
    let takes = |fidelity: FidelityLevel| models.contains(&fidelity.model());
    let Some(chosen) = stored.cheapest_within(level, takes) else {
        let best = stored.most_accurate(takes).map_or(String::new(), |best| {
            format!("; the most accurate, {}, is within {}", setting_of(best), percent(stored.known_error(best)))
        });
        bail!(
            "--accuracy {}: no setting of scene `{scene}` is shown to be as accurate{best}; two runs of the same bench differ by {} (chaos floor)",
            percent(level),
            percent(stored.chaos.floor)
        );
    };
    let built_in =
        if changed { ", of the built-in scene as it is: this one is changed, and was not measured" } else { "" };
    let note = format!(
        "{}, by --accuracy {}: expected error {} over the first {:.0} us{built_in}; expected to take {} on {}",
        setting_of(chosen),
        percent(level),
        percent(stored.known_error(chosen)),
        1e6 * stored.window_s,
        seconds(&chosen.cost),
        stored.processor
    );
    Ok(Choice { sets: chosen.setting.sets.clone(), note })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_a_percentage_or_a_fraction() {
        for (text, value) in [("1%", 0.01), ("0.1 %", 0.001), ("0.05", 0.05)] {
            assert!((level(text).unwrap() - value).abs() < 1e-15);
        }
        for text in ["0", "-1%", "1", "100%", "much", "nan", "inf"] {
            assert!(level(text).is_err(), "{text}");
        }
    }
}
