//! The causes that are assumed, each with its scene, a further parameter, or another comparison.

use super::{Case, Cause};
use crate::{comparison::Comparison, engine::STEPS_PER_CYCLE, forward::Uncertainty, parameter::Parameter};
use granchain_model::scene::{
    Bead, DampingCoefficients, DampingKind, DriveKind, FlatContact, Holder, Material, Scene, Support,
};
use granchain_signal::{Series, number::engineering};

/// Factors of a wrong unit or range.
const DECADES: [f64; 4] = [10.0, 0.1, 1e3, 1e-3];

/// Relative change of the bead radius that is tried, both ways.
const RADIUS: f64 = 0.1;

/// Friction of a bead guide that is looked for, over the weight of a bead, and the slip velocity, m/s: small against a bead's, and large enough for the
/// largest friction at the fixed step of runs side by side.
const FRICTION: (f64, f64) = (0.5, 500.0);
const SLIP_VELOCITY: f64 = 2e-4;
const GRAVITY: f64 = 9.81;

/// Scale of the gaps of rough contacts over the fit's.
const ROUGH: f64 = 10.0;

/// Relative difference of constants below which two materials count as the same.
const ALIKE: f64 = 0.08;

fn materials() -> [(&'static str, Material); 7] {
    let other = |name: &'static str, youngs_modulus, poissons_ratio, density| {
        (name, Material { name: name.into(), youngs_modulus, poissons_ratio, density })
    };
    [
        ("chrome steel", Material::chrome_steel()),
        ("aluminium", Material::aluminium()),
        other("brass", 103e9, 0.34, 8500.0),
        ("soda-lime glass", Material::glass()),
        other("zirconia", 205e9, 0.31, 6050.0),
        ("tungsten carbide", Material::tungsten_carbide()),
        ("titanium", Material::titanium()),
    ]
}

/// What horns are made of, softest first.
fn faces() -> [Material; 4] {
    [Material::aluminium(), Material::titanium(), Material::chrome_steel(), Material::tungsten_carbide()]
}

/// A finding and its remedy for fitted values.
type Describe = Box<dyn Fn(&[f64]) -> String + Send + Sync>;

/// A cause that is assumed.
pub(super) struct Suspect {
    pub(super) cause: Cause,
    pub(super) scene: Scene,
    /// A further parameter.
    pub(super) further: Option<Parameter>,
    /// Scale of the gaps in every contact instead of the fit's, m.
    pub(super) gaps: Option<f64>,
    /// What is compared instead of the record's features, and the factor on the record.
    pub(super) compared: Option<(Comparison, f64)>,
    /// Finding and remedy for the fitted values.
    pub(super) describe: Describe,
}

impl Suspect {
    pub(super) fn new(cause: Cause, scene: Scene, describe: impl Fn(&[f64]) -> String + Send + Sync + 'static) -> Self {
        Self { cause, scene, further: None, gaps: None, compared: None, describe: Box::new(describe) }
    }

    /// The record as it is compared.
    pub(super) fn trace(&self, record: &Series) -> Series {
        let factor = self.compared.as_ref().map_or(1.0, |(_, factor)| *factor);
        record.map(|value| factor * value)
    }

    pub(super) fn said(cause: Cause, scene: Scene, text: impl Into<String>) -> Self {
        let text = text.into();
        Self::new(cause, scene, move |_| text.clone())
    }
}

impl Case<'_> {
    /// Scene, further parameter and text of each cause.
    pub(super) fn suspects(&self) -> Vec<Suspect> {
        let all = [self.other_beads(), self.other_ends(), self.other_constants(), self.other_laws(), self.decades()];
        all.into_iter().flatten().collect()
    }

    /// Another number of beads, or beads of another size or material.
    fn other_beads(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        let beads = own.chain.beads.len();
        for count in [beads.saturating_sub(1), beads + 1] {
            if count == 0 || own.chain.gaps.iter().any(|gap| *gap != own.chain.gaps[0]) {
                continue;
            }
            let mut scene = own.clone();
            let (bead, gap) = (own.chain.beads[beads - 1].clone(), own.chain.gaps[0]);
            scene.chain.beads.resize(count, bead);
            scene.chain.gaps.resize(count + 1, gap);
            let text = format!("{count} beads instead of {beads} (chain.beads={count})");
            suspects.push(Suspect::said(Cause::Beads, scene, text));
        }
        for factor in [1.0 - RADIUS, 1.0 + RADIUS] {
            let mut scene = own.clone();
            scene.chain.beads.iter_mut().for_each(|bead| bead.radius *= factor);
            let text = format!("beads of a radius of about {:.3} mm (chain.radius)", scene.chain.beads[0].radius * 1e3);
            suspects.push(Suspect::said(Cause::Radius, scene, text));
        }
        let first = own.chain.beads[0].material.clone();
        for (name, material) in materials() {
            if is_alike(&first, &material) {
                continue;
            }
            let mut scene = own.clone();
            for bead in &mut scene.chain.beads {
                bead.material = Material { name: bead.material.name.clone(), ..material.clone() };
            }
            let text = format!(
                "beads of {name} instead of {} (materials.{}.youngs_modulus, .poissons_ratio, .density)",
                first.name, first.name
            );
            suspects.push(Suspect::said(Cause::Material, scene, text));
        }
        let describe = move |values: &[f64]| {
            let factor = values.last().copied().unwrap_or(f64::NAN);
            format!(
                "beads of E = {:.3} GPa instead of {:.3} GPa (materials.{2}.youngs_modulus), or of a density of {3:.0} kg/m^3 \
                 (materials.{2}.density)",
                1e-9 * factor * first.youngs_modulus,
                1e-9 * first.youngs_modulus,
                first.name,
                first.density / factor
            )
        };
        let suspect = Suspect::new(Cause::Modulus, own.clone(), describe);
        suspects.push(Suspect { further: Parameter::modulus(own), ..suspect });
        suspects
    }

    /// A horn of the other sign, other faces of piston and support, another kind of support.
    fn other_ends(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        let mut suspect = |cause: Cause, text: &str, change: &dyn Fn(&mut Scene)| {
            let mut scene = own.clone();
            change(&mut scene);
            suspects.push(Suspect::said(cause, scene, text));
        };
        if let DriveKind::Record { .. } = own.drive.kind {
            let text = "the horn's sign: its record with --drive-read invert=true; displacements are positive from piston to support";
            suspect(Cause::HornSign, text, &|scene| {
                if let DriveKind::Record { displacement, .. } = &mut scene.drive.kind {
                    displacement.values.iter_mut().for_each(|value| *value = -*value);
                }
            });
        }
        let bead = &own.chain.beads[0].material;
        let face = |face: Option<Material>| {
            move |scene: &mut Scene| (scene.piston, scene.piston_material) = (FlatContact::HalfSpace, face.clone())
        };
        if own.piston != FlatContact::Rigid {
            suspect(Cause::Ends, "a rigid face of the piston (piston.contact=rigid)", &|scene| {
                (scene.piston, scene.piston_material) = (FlatContact::Rigid, None);
            });
        }
        if own.piston_face() != Some(bead) {
            let text = "a face of the piston of the beads' material (piston.contact=half-space)";
            suspect(Cause::Ends, text, &face(None));
        }
        for material in faces() {
            if is_alike(bead, &material) || own.piston_face().is_some_and(|known| is_alike(known, &material)) {
                continue;
            }
            let text = format!("a horn's face of {0} (piston.contact=half-space, piston.material={0})", material.name);
            suspect(Cause::HornFace, &text, &face(Some(material)));
        }
        if own.support != Support::Flat(FlatContact::Rigid) {
            suspect(Cause::Support, "a rigid wall as the support (support.kind=rigid)", &|scene| {
                scene.support = Support::Flat(FlatContact::Rigid);
            });
        }
        if own.support != Support::Flat(FlatContact::HalfSpace) {
            suspect(
                Cause::Ends,
                "a half-space of the bead's material as the support (support.kind=half-space)",
                &|scene| {
                    scene.support = Support::Flat(FlatContact::HalfSpace);
                },
            );
            suspect(
                Cause::Ends,
                "half-spaces at both ends (piston.contact=half-space, support.kind=half-space)",
                &|scene| {
                    (scene.piston, scene.piston_material) = (FlatContact::HalfSpace, None);
                    scene.support = Support::Flat(FlatContact::HalfSpace);
                },
            );
        }
        if !matches!(own.support, Support::Annulus { .. } | Support::Disc { .. }) {
            suspect(Cause::Support, "a resin annulus as the support (support.kind=annulus)", &|scene| {
                scene.support = Support::resin_annulus(1.0);
            });
        }
        suspects
    }

    /// Another stiffness of the support, a gap, friction in the guide.
    fn other_constants(&self) -> Vec<Suspect> {
        let own = self.scene;
        let mut suspects: Vec<Suspect> = Vec::new();
        for (cause, name) in [(Cause::Support, "support_stiffness"), (Cause::Gap, "gap")] {
            let fitted = self.parameters.iter().any(|parameter| parameter.name == name);
            let Some(parameter) =
                Parameter::named(name, own).ok().and_then(|mut named| named.pop()).filter(|_| !fitted)
            else {
                continue;
            };
            let unit = if parameter.unit == "1" { "times the stiffness".to_owned() } else { parameter.unit.clone() };
            let describe = move |values: &[f64]| {
                let value = values.last().copied().unwrap_or(f64::NAN);
                match cause {
                    Cause::Gap => {
                        format!(
                            "a gap or roughness: as with a gap of about {:.0} nm before the first bead (--fit alpha,damping,gap)",
                            value * 1e9
                        )
                    }
                    _ => format!(
                        "a support of {value:.2} {unit} instead of what the scene has (--fit alpha,damping,support_stiffness)"
                    ),
                }
            };
            suspects.push(Suspect { further: Some(parameter), ..Suspect::new(cause, own.clone(), describe) });
        }
        suspects.extend(self.friction());
        suspects.push(self.roughness());
        suspects
    }

    /// Gaps in every contact that differ by more than the fit takes for granted, as rough or dirty beads have them.
    fn roughness(&self) -> Suspect {
        let gaps = ROUGH * self.uncertainty.gap.max(Uncertainty::default().gap);
        let size = engineering(gaps, "m", 2);
        let text = format!("rough contacts: gaps of {size} or so in all of them (--uncertainty gap='{size}')");
        Suspect { gaps: Some(gaps), ..Suspect::said(Cause::Gap, self.scene.clone(), text) }
    }

    /// Friction in the bead guide, by the regularised law, which runs go side by side with.
    fn friction(&self) -> Option<Suspect> {
        let mut scene = self.scene.clone();
        let holder = scene.holder.get_or_insert_with(Holder::default);
        if holder.has_friction() || holder.clearance > 0.0 {
            return None;
        }
        let step = 1.0 / (scene.drive.frequency * STEPS_PER_CYCLE as f64);
        holder.slip_velocity = SLIP_VELOCITY.max(0.5 * FRICTION.1 * GRAVITY * step);
        let weight = GRAVITY * scene.chain.beads.first().map_or(0.0, Bead::mass);
        let fitted = Parameter::named("friction", &scene).ok()?.pop()?;
        let describe = |values: &[f64]| {
            format!(
                "friction of about {} on every bead in its guide (--fit alpha,damping,friction)",
                engineering(values.last().copied().unwrap_or(f64::NAN), "N", 2)
            )
        };
        let suspect = Suspect::new(Cause::Friction, scene, describe);
        Some(Suspect { further: Some(fitted.between(FRICTION.0 * weight, FRICTION.1 * weight)), ..suspect })
    }

    /// Every other damping law.
    fn other_laws(&self) -> Vec<Suspect> {
        let own = self.scene;
        let laws = [DampingKind::Linear, DampingKind::KuwabaraKono, DampingKind::LinearAndKuwabaraKono];
        let other = |kind: DampingKind| {
            let text = format!("the damping law `{0}` (--damping {0})", kind.name());
            Suspect::said(Cause::DampingLaw, with_law(own, kind), text)
        };
        laws.into_iter().filter(|kind| *kind != own.damping.kind).map(other).collect()
    }

    /// Powers of ten in all amplitudes, which are too far for the runs of the fit.
    fn decades(&self) -> Vec<Suspect> {
        let of = |factor: f64| {
            // A record ten times too large is compared as a tenth of it.
            let comparison = self.comparison.scaled(1.0 / factor);
            let text = format!(
                "amplitudes {factor} times as large as they should be (the peak is {}); check the unit of the column and the sensitivity \
                 (--unit, --scale)",
                self.peak()
            );
            let suspect = Suspect::said(Cause::Scale, self.scene.clone(), text);
            Some(Suspect { compared: Some((comparison, 1.0 / factor)), ..suspect })
        };
        DECADES.into_iter().filter_map(of).collect()
    }
}

fn is_alike(first: &Material, second: &Material) -> bool {
    let alike = |a: f64, b: f64| (a / b - 1.0).abs() < ALIKE;
    alike(first.youngs_modulus, second.youngs_modulus) && alike(first.density, second.density)
}

/// The scene with a damping law, no coefficient set.
fn with_law(scene: &Scene, kind: DampingKind) -> Scene {
    let mut scene = scene.clone();
    scene.damping.kind = kind;
    scene.damping.coefficients = DampingCoefficients::default();
    scene
}
