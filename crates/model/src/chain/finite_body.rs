//! Contact laws of a chain's own bodies, fitted to their static finite element solutions.

use serde::{Deserialize, Serialize};

use super::laws::{ContactLaws, need_law};
use crate::{
    ModelError,
    contact_law::{
        Annulus, ElasticLaw, FiniteHertz, Hertz, HertzOnSpring, Law, Spring, bead_face_stiffness, bead_flat_stiffness,
        bead_pair_stiffness,
    },
    fea::{
        FeaError,
        arrangement::Arrangement,
        contact::{complementarity::Scratch, pair::Pair},
        equilibrium::Statics,
        operator::Interfaces,
    },
    scene::{ContactLaw, FlatContact, Scene, Support},
    tally,
};

/// Contact radii between which laws of curved bodies are fitted, in parts of the finely meshed patch.
const CONTACT_RADII: (f64, f64) = (0.2, 0.75);
/// Approaches between which the law of an annulus is fitted, m.
const ANNULUS_APPROACHES: (f64, f64) = (0.05e-6, 5e-6);
const POINTS: usize = 160;

/// The laws of all contacts of a chain of finite bodies, and how its beads couple them.
///
/// Every bead, and an annulus, is meshed as the finite element analysis meshes it (`model.mesh_density`) and pressed statically, held by
/// its inertia alone as in a collision. To each different pair of bodies
///
/// ```text
/// F = k δ^(3/2) (1 + c₁ √δ + c₂ δ)        bead on bead, bead on rigid flat
/// w = F (C − D ln(F/1 N))                 bead on annulus
/// ```
///
/// is fitted by least squares of the relative error in F, k being Hertz' own. The coupling s_i of bead i is λᵀ V λ′/(F F′), the work that the pressure
/// at one contact does on the displacement by the other.
///
/// A half-space has no body; a bead on it keeps the law of Hertz. A spring carries a rigid flat, on which the last bead is pressed: its law is that of
/// bead on flat in series with the spring. A run may differ from the scene fitted to in all
/// that no body knows of: drive, α, damping, gaps, precompression, duration, factor of the annulus, stiffness of the spring. Plain data.
///
/// ```
/// use granchain_model::{chain::FiniteBodyLaws, scene};
///
/// let scene = scene::load("rigid", &["contact.law=finite-body".into(), "model.mesh_density=8".into()])?;
/// let laws = FiniteBodyLaws::fit(&scene)?;
/// assert_eq!(laws.contacts.len(), 7);
/// assert_eq!(laws.fits.len(), 2); // a bead on a flat, two beads
/// assert!(laws.fits.iter().filter_map(|fit| fit.quality).all(|quality| quality.largest_error < 0.02));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FiniteBodyLaws {
    pub fits: Vec<ContactFit>,
    /// Law of each of the N + 1 contacts: an index into `fits`.
    pub contacts: Vec<usize>,
    /// s of each of the N beads, m/N; none with the law of Hertz.
    #[serde(rename = "couplings_m_per_n")]
    pub couplings: Vec<f64>,
    pub mesh_density: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ContactFit {
    /// What touches, such as `bead 1 – bead 2`.
    pub between: String,
    /// The law; for an annulus and a spring with the factor and the stiffness of the scene fitted to.
    pub law: Law,
    /// How well it follows the static solutions; none where nothing was fitted.
    pub quality: Option<FitQuality>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FitQuality {
    /// Largest |F/F_static − 1|, 1.
    pub largest_error: f64,
    /// Root mean square of F/F_static − 1, 1.
    pub rms_error: f64,
    /// Smallest and largest force fitted to, N.
    pub forces_n: (f64, f64),
    /// Smallest and largest approach fitted to, m.
    pub approaches_m: (f64, f64),
}

/// A static solution: approach, m, and force, N.
type Point = (f64, f64);

impl FiniteBodyLaws {
    /// Mesh the bodies of a scene, press them, and fit. Takes about a fifth of a second at the default density of 12.
    ///
    /// Where the scene asks for the law of Hertz, that of a ring which is not the paper's is fitted alone, and no contact feels another.
    pub fn fit(scene: &Scene) -> Result<Self, ModelError> {
        if scene.contact_law == ContactLaw::Hertz && scene.has_own_ring() {
            return Self::of_ring(scene);
        }
        let beads = &scene.chain.beads;
        let last = beads.len();
        // A half-space cannot be meshed and a spring has no mesh: the bead's own statics are those on a rigid flat.
        need_law(&scene.support)?;
        let support =
            if scene.support.ring().is_some() { scene.support.clone() } else { Support::Flat(FlatContact::Rigid) };
        let meshed = Scene { support, piston: FlatContact::Rigid, ..scene.clone() };
        let arrangement = Arrangement::new(&meshed)?;
        let interfaces = Interfaces::new(&arrangement);
        let statics = Statics::new(&arrangement, &interfaces)?;

        let mut fits: Vec<ContactFit> = Vec::new();
        let mut known: Vec<Option<[Option<usize>; 2]>> = Vec::new();
        let mut contacts = Vec::with_capacity(last + 1);
        for contact in 0..=last {
            let mut kinds = [arrangement.kind(contact), arrangement.kind(contact + 1)];
            // A law does not know which of its two bodies is nearer to the piston.
            kinds.sort_unstable();
            // A flat at the support may stand on a spring.
            let on_spring = contact == last && scene.support.spring().is_some();
            let key = (fitted_to_bodies(scene, contact) && !on_spring).then_some(kinds);
            let index = match known.iter().position(|other| key.is_some() && *other == key) {
                Some(index) => index,
                None => {
                    known.push(key);
                    fits.push(fit_contact(scene, &arrangement, &statics, contact)?);
                    fits.len() - 1
                }
            };
            contacts.push(index);
        }
        let keys: Vec<_> = (0..last)
            .map(|bead| (arrangement.contacts[bead], arrangement.contacts[bead + 1], arrangement.kind(bead + 1)))
            .collect();
        let mut couplings: Vec<f64> = Vec::with_capacity(last);
        for (bead, key) in keys.iter().enumerate() {
            couplings.push(match keys[..bead].iter().position(|other| other == key) {
                Some(same) => couplings[same],
                None => coupling(&arrangement, &statics, bead)?,
            });
        }
        Ok(Self { fits, contacts, couplings, mesh_density: scene.model.fea.density })
    }

    /// The law of Hertz for every contact but the last, that of the ring fitted to its statics under the last bead.
    fn of_ring(scene: &Scene) -> Result<Self, ModelError> {
        let mut laws = ContactLaws::hertz(scene)?.laws;
        laws.pop();
        let mut pressed = scene.clone();
        // A factor on its stiffness is applied by a run.
        if let Some(factor) = pressed.support.stiffness_mut() {
            *factor = 1.0;
        }
        pressed.piston = FlatContact::Rigid;
        pressed.chain.beads.drain(..laws.len() - 1);
        pressed.chain.gaps = vec![0.0; 2];
        let arrangement = Arrangement::new(&pressed)?;
        let statics = Statics::new(&arrangement, &Interfaces::new(&arrangement))?;
        let ring = fit_contact(&pressed, &arrangement, &statics, 1)?;
        let between = |contact: usize| format!("contact {}", contact + 1);
        let hertz = |(contact, law)| ContactFit { between: between(contact), law, quality: None };
        let mut fits: Vec<ContactFit> = laws.into_iter().enumerate().map(hertz).collect();
        fits.push(ContactFit { between: format!("bead {} – annulus", fits.len()), ..ring });
        let contacts = (0..fits.len()).collect();
        Ok(Self { fits, contacts, couplings: Vec::new(), mesh_density: scene.model.meshing().density })
    }

    /// The same without what a force at one pole of a bead does to the other: to see what it is worth.
    #[must_use]
    pub fn without_coupling(mut self) -> Self {
        self.couplings.fill(0.0);
        self
    }

    pub(crate) fn is_of(&self, scene: &Scene) -> bool {
        self.contacts.iter().all(|&fit| fit < self.fits.len()) && self.contact_laws(scene).is_ok()
    }

    pub(super) fn contact_laws(&self, scene: &Scene) -> Result<ContactLaws, ModelError> {
        let contacts = scene.chain.beads.len() + 1;
        let coupled = scene.contact_law == ContactLaw::FiniteBody;
        let couplings = if coupled { contacts - 1 } else { 0 };
        if self.contacts.len() != contacts || self.couplings.len() != couplings {
            let found = self.contacts.len();
            return Err(ModelError::Count { quantity: "fitted contact laws", expected: contacts, found });
        }
        let mut laws: Vec<Law> = self.contacts.iter().map(|&fit| self.fits[fit].law).collect();
        let (ring, spring, flat) = (scene.support.ring(), scene.support.spring(), scene.support.flat());
        let support = match laws[contacts - 1] {
            Law::Annulus(law) => ring.map(|(_, factor, _)| Law::Annulus(law.unscaled().times(factor))),
            Law::Spring(_) => spring.map(|stiffness| Law::Spring(Spring { stiffness })),
            Law::HertzOnSpring(law) => spring.map(|spring| Law::HertzOnSpring(HertzOnSpring { spring, ..law })),
            law @ (Law::Hertz(_) | Law::FiniteHertz(_)) => flat.filter(|_| spring.is_none()).map(|_| law),
        };
        let Some(support) = support else {
            let reason = "the fitted contact laws are those of another support; fit them to this scene".into();
            return Err(ModelError::Unsupported { model: "chain", reason });
        };
        laws[contacts - 1] = support;
        Ok(ContactLaws { laws, couplings: coupled.then(|| self.couplings.clone()) })
    }
}

/// Whether both bodies of a contact are meshed or rigid: not so a half-space.
fn fitted_to_bodies(scene: &Scene, contact: usize) -> bool {
    let half_space = FlatContact::HalfSpace;
    let at_support = contact == scene.chain.beads.len();
    !(contact == 0 && scene.piston == half_space || at_support && scene.support.flat() == Some(half_space))
}

fn fit_contact(
    scene: &Scene,
    arrangement: &Arrangement,
    statics: &Statics,
    contact: usize,
) -> Result<ContactFit, ModelError> {
    let beads = &scene.chain.beads;
    let last = beads.len();
    let named = |slot: usize| {
        let flat = match slot {
            0 => Some(scene.piston),
            _ if slot <= last => return format!("bead {slot}"),
            _ => scene.support.flat().filter(|_| scene.support.spring().is_none()),
        };
        match flat {
            Some(FlatContact::HalfSpace) => "elastic half-space".to_owned(),
            Some(FlatContact::Rigid) => "rigid flat".to_owned(),
            None => scene.support.name().to_owned(),
        }
    };
    let between = format!("{} – {}", named(contact), named(contact + 1));
    let unfitted = |law| Ok(ContactFit { between: between.clone(), law, quality: None });
    let touching = &beads[contact.saturating_sub(1)];
    let face = if contact == 0 { scene.piston_face() } else { Some(&touching.material) };
    let half_space = |bead| unfitted(Law::Hertz(Hertz { stiffness: bead_face_stiffness(bead, face) }));
    if !fitted_to_bodies(scene, contact) {
        return half_space(touching);
    }
    let pair = &arrangement.pairs[arrangement.contacts[contact]];
    let (law, points) = if pair.is_on_ring() {
        let points = press(statics, pair, contact, ANNULUS_APPROACHES)?;
        (fit_annulus(&points, arrangement.stiffness_factor).map(Law::Annulus), points)
    } else {
        let (stiffness, radius) = if contact == 0 || contact == last {
            (bead_flat_stiffness(touching, FlatContact::Rigid), touching.radius)
        } else {
            let other = &beads[contact];
            let radius = touching.radius * other.radius / (touching.radius + other.radius);
            (bead_pair_stiffness(touching, other), radius)
        };
        let patch = pair.positions.last().copied().unwrap_or(0.0);
        let approach = |part: f64| (part * patch).powi(2) / radius;
        let points = press(statics, pair, contact, (approach(CONTACT_RADII.0), approach(CONTACT_RADII.1)))?;
        let spring = scene.support.spring().filter(|_| contact == last);
        let law = |contact| match spring {
            Some(spring) => Law::HertzOnSpring(HertzOnSpring { contact, spring }),
            None => Law::FiniteHertz(contact),
        };
        (fit_spheres(stiffness, &points).map(law), points)
    };
    let Some(law) = law else {
        let reason = format!(
            "no contact law follows the static solutions of {between}; refine `model.mesh_density`, or use \
             `contact.law = \"hertz\"`"
        );
        return Err(ModelError::Unsupported { model: "chain", reason });
    };
    tally::add(|made| made.fitted_laws += 1);
    let pressed = match law {
        Law::HertzOnSpring(law) => Law::FiniteHertz(law.contact),
        law => law,
    };
    let quality = Some(quality(&pressed, &points));
    Ok(ContactFit { between, law, quality })
}

/// Press a contact at approaches evenly spread in √δ, as far as its patch reaches.
fn press(statics: &Statics, pair: &Pair, contact: usize, (least, most): (f64, f64)) -> Result<Vec<Point>, ModelError> {
    let compliance = statics.compliance(contact);
    let (mut forces, mut gaps) = (vec![0.0; pair.len()], vec![0.0; pair.len()]);
    let mut scratch = Scratch::new(pair.len());
    let mut points = Vec::with_capacity(POINTS);
    for index in 0..POINTS {
        let part = (index as f64 + 0.5) / POINTS as f64;
        let approach = (least.sqrt() + part * (most.sqrt() - least.sqrt())).powi(2);
        let free: Vec<f64> = pair.gaps.iter().zip(&pair.axial_before).map(|(gap, a)| gap - a * approach).collect();
        compliance.solve(&free, &mut forces, &mut gaps, &mut scratch).map_err(|failed| FeaError::NoEquilibrium {
            force: f64::NAN,
            contact: contact + 1,
            iterations: failed.iterations,
        })?;
        let edge = pair.len() - 1;
        if forces[edge] > 0.0 || pair.is_on_ring() && forces[0] > 0.0 {
            break;
        }
        let force = forces.iter().zip(&pair.axial_before).map(|(force, a)| force * a).sum::<f64>();
        points.push((approach, force));
    }
    Ok(points)
}

/// c₁ and c₂ of spheres of Hertz stiffness k by least squares of F/F_H − 1; a negative one is left out.
fn fit_spheres(stiffness: f64, points: &[Point]) -> Option<FiniteHertz> {
    let excess = |&(approach, force): &Point| force / (stiffness * approach.powf(1.5)) - 1.0;
    let rows: Vec<[f64; 3]> = points.iter().map(|point| [point.0.sqrt(), point.0, excess(point)]).collect();
    let moment = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let (a, b, c, p, q) = (moment(0, 0), moment(0, 1), moment(1, 1), moment(0, 2), moment(1, 2));
    let determinant = a * c - b * b;
    let (mut first, mut second) = ((p * c - q * b) / determinant, (q * a - p * b) / determinant);
    if second < 0.0 {
        (first, second) = (p / a, 0.0);
    } else if first < 0.0 {
        (first, second) = (0.0, q / c);
    }
    (first >= 0.0 && second >= 0.0).then_some(FiniteHertz { stiffness, first, second })
}

/// C and D of an annulus by least squares of (C − D ln F) F/w − 1, F being the force over the stiffness factor.
fn fit_annulus(points: &[Point], factor: f64) -> Option<Annulus> {
    let rows: Vec<[f64; 2]> = points
        .iter()
        .map(|(w, force)| (w, force / factor))
        .map(|(w, force)| [force / w, -force / w * libm::log(force)])
        .collect();
    let moment = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<f64>();
    let sum = |i: usize| rows.iter().map(|row| row[i]).sum::<f64>();
    let (a, b, c, p, q) = (moment(0, 0), moment(0, 1), moment(1, 1), sum(0), sum(1));
    let determinant = a * c - b * b;
    let (constant, slope) = ((p * c - q * b) / determinant, (q * a - p * b) / determinant);
    // Up to the largest point the force has to grow: C − D − D ln F > 0.
    let largest = points.iter().map(|(_, force)| force / factor).fold(0.0, f64::max);
    let grows = slope > 0.0 && constant - slope * (1.0 + libm::log(largest)) > 0.0;
    grows.then(|| Annulus::fitted(constant, slope).times(factor))
}

fn quality(law: &Law, points: &[Point]) -> FitQuality {
    let errors: Vec<f64> = points.iter().map(|(approach, force)| law.force(*approach) / force - 1.0).collect();
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0f64), |(least, most), value| (least.min(value), most.max(value)))
    };
    FitQuality {
        largest_error: errors.iter().fold(0.0, |largest, error| f64::max(largest, error.abs())),
        rms_error: (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt(),
        forces_n: range(&mut points.iter().map(|(_, force)| *force)),
        approaches_m: range(&mut points.iter().map(|(approach, _)| *approach)),
    }
}

/// s of a bead, m/N, from the pressures of its two contacts in the middle of their ranges.
fn coupling(arrangement: &Arrangement, statics: &Statics, bead: usize) -> Result<f64, ModelError> {
    let pressed = |contact: usize| -> Result<(Vec<f64>, f64), ModelError> {
        let pair = &arrangement.pairs[arrangement.contacts[contact]];
        // Points with a gap below that of the middle one: a contact of half the patch.
        let mut gaps = pair.gaps.clone();
        gaps.sort_by(f64::total_cmp);
        let approach = gaps[gaps.len() / 2].max(gaps[1]);
        let free: Vec<f64> = pair.gaps.iter().zip(&pair.axial_before).map(|(gap, a)| gap - a * approach).collect();
        let (mut forces, mut open) = (vec![0.0; pair.len()], vec![0.0; pair.len()]);
        statics.compliance(contact).solve(&free, &mut forces, &mut open, &mut Scratch::new(pair.len())).map_err(
            |failed| FeaError::NoEquilibrium { force: f64::NAN, contact: contact + 1, iterations: failed.iterations },
        )?;
        let axial = forces.iter().zip(&pair.axial_before).map(|(force, a)| force * a).sum();
        Ok((forces, axial))
    };
    let ((earlier, earlier_axial), (later, later_axial)) = (pressed(bead)?, pressed(bead + 1)?);
    let matrix = statics.coupling(bead + 1).unwrap_or(&[]);
    let work: f64 = matrix
        .chunks_exact(earlier.len())
        .zip(&later)
        .map(|(row, force)| force * row.iter().zip(&earlier).map(|(v, other)| v * other).sum::<f64>())
        .sum();
    Ok(work / (earlier_axial * later_axial))
}
