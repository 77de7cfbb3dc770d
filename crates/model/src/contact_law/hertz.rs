//! Hertz contact of spheres and flats.

use serde::{Deserialize, Serialize};

use super::ElasticLaw;
use crate::scene::{Bead, FlatContact, Material};

/// Effective modulus E*, 1/E* = (1 − ν₁²)/E₁ + (1 − ν₂²)/E₂, Pa; `other` = `None` is a rigid body.
///
/// Johnson (1985), *Contact Mechanics*, eq. (4.11).
pub(crate) fn effective_modulus(material: &Material, other: Option<&Material>) -> f64 {
    let compliance = |m: &Material| (1.0 - m.poissons_ratio.powi(2)) / m.youngs_modulus;
    1.0 / (compliance(material) + other.map_or(0.0, compliance))
}

/// Hertz stiffness k = (4/3) E* √R*, N·m^(-3/2), from the effective modulus E* (Pa) and the effective radius R* (m).
///
/// Johnson (1985), *Contact Mechanics*, eq. (4.23).
pub fn hertz_stiffness(effective_modulus: f64, effective_radius: f64) -> f64 {
    4.0 / 3.0 * effective_modulus * effective_radius.sqrt()
}

/// Effective modulus E* (Pa) and radius R* (m) of a bead on another, 1/R* = 1/a₁ + 1/a₂, or on a flat of that material, R* = a; `None` is rigid.
pub(crate) fn touching(bead: &Bead, other: Result<&Bead, Option<&Material>>) -> (f64, f64) {
    let (material, radius) = match other {
        Ok(other) => (Some(&other.material), bead.radius * other.radius / (bead.radius + other.radius)),
        Err(material) => (material, bead.radius),
    };
    (effective_modulus(&bead.material, material), radius)
}

/// Hertz stiffness of two beads in contact, N·m^(-3/2): E* of both materials, 1/R* = 1/a₁ + 1/a₂. Symmetric in the beads.
pub fn bead_pair_stiffness(bead: &Bead, other: &Bead) -> f64 {
    let (modulus, radius) = touching(bead, Ok(other));
    hertz_stiffness(modulus, radius)
}

/// Hertz stiffness of a bead on a flat, N·m^(-3/2), R* = a.
///
/// - [`FlatContact::Rigid`]: (4/3) E/(1 − ν²) √a, 2√2 times that of two such beads;
/// - [`FlatContact::HalfSpace`]: a half-space of the bead's own material, (2/3) E/(1 − ν²) √a, √2 times that of two such beads.
pub fn bead_flat_stiffness(bead: &Bead, flat: FlatContact) -> f64 {
    bead_face_stiffness(bead, flat.material(&bead.material))
}

/// The same on a half-space of any material; `None` is rigid. N·m^(-3/2).
pub fn bead_face_stiffness(bead: &Bead, face: Option<&Material>) -> f64 {
    let (modulus, radius) = touching(bead, Err(face));
    hertz_stiffness(modulus, radius)
}

/// Normal force of an elastic sphere–sphere contact, F = k δ₊^(3/2).
///
/// - `hertz_stiffness`: k, N·m^(-3/2)
/// - `overlap`: δ, m, positive when pressed
///
/// Returns F in N, never negative: an open gap carries no load.
/// Valid for contact radius ≪ bead radius, quasi-static, no adhesion.
///
/// Johnson (1985), *Contact Mechanics*, §4.2, eq. (4.23).
///
/// ```
/// # use granchain_model::contact_law::hertz_force;
/// assert!((hertz_force(4.0e9, 1.0e-6) - 4.0).abs() < 1e-12); // 1 µm → 4 N
/// ```
pub fn hertz_force(hertz_stiffness: f64, overlap: f64) -> f64 {
    let pressed = overlap.max(0.0);
    hertz_stiffness * pressed * pressed.sqrt()
}

/// Energy stored in a Hertz contact, (2/5) k δ₊^(5/2), J; symbols as in [`hertz_force`].
pub(crate) fn hertz_energy(hertz_stiffness: f64, overlap: f64) -> f64 {
    0.4 * hertz_force(hertz_stiffness, overlap) * overlap.max(0.0)
}

/// The law F = k δ₊^(3/2).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Hertz {
    #[serde(rename = "stiffness_n_per_m1.5")]
    pub stiffness: f64,
}

impl ElasticLaw for Hertz {
    const IS_HERTZ: bool = true;

    fn force(&self, overlap: f64) -> f64 {
        hertz_force(self.stiffness, overlap)
    }

    fn tangent_stiffness(&self, overlap: f64) -> f64 {
        1.5 * self.stiffness * overlap.max(0.0).sqrt()
    }

    fn energy(&self, overlap: f64) -> f64 {
        hertz_energy(self.stiffness, overlap)
    }

    fn overlap(&self, force: f64) -> f64 {
        let root = libm::cbrt(force.max(0.0) / self.stiffness);
        root * root
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bead() -> Bead {
        Bead::sphere(0.5e-3, Material::chrome_steel())
    }

    fn assert_close(found: f64, expected: f64) {
        // The references carry ten digits.
        assert!((found / expected - 1.0).abs() < 1e-9, "found {found:e}, expected {expected:e}");
    }

    #[test]
    fn steel_beads_of_one_millimetre_have_the_tabulated_stiffnesses_and_mass() {
        let pair = bead_pair_stiffness(&bead(), &bead());
        assert_close(pair, 2.328_270_365e9);
        assert_close(bead_flat_stiffness(&bead(), FlatContact::Rigid), 6.585_343_055e9);
        assert_close(bead_flat_stiffness(&bead(), FlatContact::Rigid), 8f64.sqrt() * pair);
        assert_close(bead_flat_stiffness(&bead(), FlatContact::HalfSpace), 2f64.sqrt() * pair);
        assert_close(bead().mass(), 4.101_349_209e-6);
        // θ = 3(1 − ν²)/4E = √(a/2)/2k.
        assert_close((0.25e-3f64).sqrt() / (2.0 * pair), 3.395_522_388e-12);
    }

    #[test]
    fn a_face_of_another_material_has_the_effective_modulus_of_both() {
        // (4/3) √a/((1 − 0.3²)/201 GPa + (1 − 0.34²)/114 GPa) by hand: E* 81.3984 GPa.
        let titanium = bead_face_stiffness(&bead(), Some(&Material::titanium()));
        assert!((titanium / (4.0 / 3.0 * 81.398_4e9 * 0.5e-3f64.sqrt()) - 1.0).abs() < 1e-5, "{titanium:e}");
        let carbide = bead_face_stiffness(&bead(), Some(&Material::tungsten_carbide()));
        let [steel, rigid] =
            [FlatContact::HalfSpace, FlatContact::Rigid].map(|flat| bead_flat_stiffness(&bead(), flat));
        assert!(titanium < steel && steel < carbide && carbide < rigid);
    }

    #[test]
    fn stiffness_is_symmetric_in_the_two_beads_and_tends_to_the_flat() {
        let resin = Material { name: "resin".into(), youngs_modulus: 1.4e9, poissons_ratio: 0.35, density: 1235.0 };
        let other = Bead::sphere(0.8e-3, resin);
        let forth = bead_pair_stiffness(&bead(), &other);
        assert!((bead_pair_stiffness(&other, &bead()) / forth - 1.0).abs() < 1e-15);
        let huge = Bead::sphere(1e6, Material::chrome_steel());
        assert_close(bead_pair_stiffness(&bead(), &huge), bead_flat_stiffness(&bead(), FlatContact::HalfSpace));
    }
}
