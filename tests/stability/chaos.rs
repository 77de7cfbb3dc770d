//! Two regimes, distinguished by what perturbations do.

use super::{Limit, room::Room};
use granchain_calibration::predict::{
    ensemble::{EnsemblePlan, Moments, STEPS_PER_PERIOD},
    replicates::perturbations,
};
use granchain_signal::{Series, feature::FeatureError};

pub(super) fn examine(room: &mut Room<'_>) {
    let chaotic = scatter(room, &["damping.kind=linear", "damping.coefficient=0.3 N s/m", "alpha=0.5"]);
    let regular = scatter(room, &["damping.kind=kuwabara-kono", "damping.coefficient=3660 N s/m^1.5", "alpha=1.5"]);
    match (chaotic, regular) {
        (Ok(chaotic), Ok(regular)) => {
            let name = "Kuwabara–Kono dampers at α = 1.5: scatter of the positive peak over its mean";
            room.check(name, regular, Limit::AtMost(0.015), "1");
            let name = "linear dampers at α = 0.5: scatter of the positive peak over its mean";
            room.check(name, chaotic, Limit::AtLeast(0.015), "1");
            room.check("scatter of the one over that of the other", chaotic / regular, Limit::AtLeast(4.0), "1");
        }
        (Err(reason), _) | (_, Err(reason)) => room.failed("ensemble", reason),
    }
}

/// Scatter of the positive peak over its mean.
fn scatter(room: &Room<'_>, sets: &[&str]) -> Result<f64, String> {
    let scene = room.scene("annulus", sets)?;
    let variations = perturbations(&scene, &EnsemblePlan::new(16, 1));
    let see = |_: usize, velocity: &Series| -> Result<f64, FeatureError> {
        Ok(velocity.values.iter().copied().fold(0.0, f64::max))
    };
    let peaks = room.replicates(&scene, &variations, STEPS_PER_PERIOD, see)?;
    let moments = Moments::of(peaks.into_iter().map(Result::ok)).ok_or("fewer than two runs could be measured")?;
    Ok(moments.deviation / moments.mean)
}
