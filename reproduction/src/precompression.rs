//! At which static force along the chain the impulses vanish.

use serde::Serialize;

use crate::{
    failure::StudyError,
    paper::{LAWS, Law},
    trend::{self, Setting, TrendPoint, Varied},
};

/// Static forces, N: none, then from far below to far above what the companion work names.
pub const FORCES: [f64; 11] = [0.0, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2, 1e-1];

/// The order of magnitude at and below which the companion work finds impulses, N.
pub const COMPANION_FORCE: f64 = 0.01;

/// Mesh density of meshed bodies: 12 does not feel the overlap of 1.2 nm under the smallest force.
const MESH_DENSITY: u32 = 16;

/// One law over the static force.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Precompressions {
    pub law: Law,
    pub points: Vec<TrendPoint>,
}

impl Precompressions {
    /// The largest force with a train of impulses and the next one, from which on there is none, N; none where no force, or the largest
    /// one, has impulses.
    #[must_use]
    pub fn vanishing(&self) -> Option<(f64, f64)> {
        let last = self.points.iter().rposition(|point| point.moments.is_impulsive())?;
        Some((self.points[last].value, self.points.get(last + 1)?.value))
    }
}

/// Both laws at the paper's α over the static force.
pub type Study = trend::Study<Precompressions>;

impl Varied for Precompressions {
    fn settings() -> Vec<Setting> {
        let setting = |force: &f64| Setting { value: *force, overrides: vec![format!("chain.precompression={force}")] };
        FORCES.iter().map(setting).collect()
    }

    /// A finer mesh for meshed bodies.
    fn overrides(given: &[String]) -> Result<Vec<String>, StudyError> {
        let meshed = LAWS[0].scene(given)?.model.kind.is_meshed();
        let finer = meshed.then(|| format!("model.mesh_density={MESH_DENSITY}"));
        Ok(finer.into_iter().chain(given.iter().cloned()).collect())
    }

    fn of(law: Law, points: Vec<TrendPoint>) -> Self {
        Self { law, points }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::portrait::{PortraitMoments, Trait};
    use granchain_calibration::predict::ensemble::Moments;

    fn law(crests: &[f64]) -> Precompressions {
        let point = |(index, crest): (usize, &f64)| {
            let of = |what| (what == Trait::Crest).then_some(Moments { mean: *crest, deviation: 0.1, count: 4 });
            let moments = PortraitMoments(Trait::all().into_iter().map(of).collect());
            TrendPoint { value: FORCES[index], moments, failed: 0, spectrum_m_per_s: Vec::new() }
        };
        Precompressions { law: LAWS[0], points: crests.iter().enumerate().map(point).collect() }
    }

    #[test]
    fn the_smallest_force_is_felt_by_the_meshes_that_are_taken_and_a_mesh_that_is_given_wins() {
        let felt = |given: &[String]| {
            let mut all = Precompressions::overrides(given).unwrap();
            all.extend([format!("chain.precompression={}", FORCES[1]), "duration=10us".into()]);
            let scene = LAWS[0].scene(&all).unwrap();
            (scene.model.meshing().density, granchain_model::run(&scene, &mut |_| true).map(|_| ()))
        };
        let reduced = "model.kind=reduced".to_owned();
        assert_eq!(felt(std::slice::from_ref(&reduced)).1, Ok(()));
        let (density, refused) = felt(&[reduced, "model.mesh_density=12".into()]);
        assert!(density == 12 && refused.unwrap_err().to_string().contains("model.mesh_density"));
        assert_eq!(Precompressions::overrides(&["model.kind=chain".into()]).unwrap(), ["model.kind=chain"]);
    }

    #[test]
    fn impulses_vanish_behind_the_last_force_that_has_them() {
        assert_eq!(law(&[4.0, 3.5, 2.0, 3.0, 1.8, 1.5]).vanishing(), Some((FORCES[3], FORCES[4])));
        assert_eq!(law(&[1.5, 1.5]).vanishing(), None);
        assert_eq!(law(&[1.5, 4.0]).vanishing(), None);
    }
}
