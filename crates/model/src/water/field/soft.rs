//! The pressure on the disc's back, which is all that radiates behind a soft baffle: beside the disc the plane moves.

use granchain_signal::{
    Series,
    spline::{Ends, Spline},
};

/// Pressure on the disc's back over time, at radii from the axis to the rim, straight in between.
#[derive(Debug, Clone)]
pub struct FacePressure {
    radii: Vec<f64>,
    pressure: Vec<Series>,
}

impl FacePressure {
    /// Of the pressures (Pa) at ascending radii (m), the first on the axis and the last at the rim.
    pub(crate) fn new(radii: Vec<f64>, pressure: Vec<Series>) -> Self {
        Self { radii, pressure }
    }

    /// One series a radius, Pa.
    pub fn pressure(&self) -> &[Series] {
        &self.pressure
    }

    pub fn radii(&self) -> &[f64] {
        &self.radii
    }

    /// Pressure (Pa) at many radii (m) and times (s): one list over the times each radius; 0 beyond the rim.
    pub fn face(&self, radii: &[f64], times: &[f64]) -> Vec<Vec<f64>> {
        let splines: Vec<Spline> = self.pressure.iter().map(|series| Spline::new(series, Ends::Natural)).collect();
        radii
            .iter()
            .map(|&radius| {
                let shares = shares(&self.radii, radius);
                times
                    .iter()
                    .map(|&time| shares.iter().map(|&(node, share)| share * splines[node].at(time).0).sum())
                    .collect()
            })
            .collect()
    }
}

/// Neighbours of a radius with their shares; none beyond the last.
fn shares(radii: &[f64], radius: f64) -> Vec<(usize, f64)> {
    let after = radii.partition_point(|&own| own < radius);
    match after {
        0 => vec![(0, 1.0)],
        // Rounding of the rim itself.
        after if after == radii.len() => {
            let rim = radii.len() - 1;
            if radius <= radii[rim] * (1.0 + 1e-9) { vec![(rim, 1.0)] } else { Vec::new() }
        }
        after => {
            let share = (radius - radii[after - 1]) / (radii[after] - radii[after - 1]);
            vec![(after - 1, 1.0 - share), (after, share)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_radii_it_is_straight_and_beyond_the_rim_nothing() {
        let clock = |scale: f64| Series::new(0.0, 1e-7, (0..50).map(|i| scale * f64::from(i)).collect());
        let face = FacePressure::new(vec![0.0, 1e-3], vec![clock(1.0), clock(3.0)]);
        let found = face.face(&[0.0, 0.5e-3, 1e-3, 1.1e-3], &[1e-6]);
        for (found, exact) in found.iter().zip([10.0, 20.0, 30.0, 0.0]) {
            assert!((found[0] - exact).abs() < 1e-9, "{} {exact}", found[0]);
        }
    }
}
