//! From a scene to bodies, how they stand, and the geometry of their contacts.

use super::{
    FeaError,
    body::Body,
    contact::pair::{Pair, Pole, Profile},
    factor::FactorError,
    loss::BodyLoss,
    mesh::{self, AnnulusMesh, BeadMesh, HalfTorus, Mesh, MeshError},
    modes::ModesError,
};
use crate::{
    contact_law::{Dashpot, dashpots},
    scene::{AnnulusShape, Bead, FlatContact, Material, Scene, Support},
    water::{
        disc::{Disc, DiscError},
        front::Front,
    },
};

#[derive(Debug, Clone)]
pub struct Arrangement {
    /// The different bodies; equal beads share one.
    pub kinds: Vec<Body>,
    pub beads: Vec<usize>,
    /// Kind of the support; none where it is rigid.
    pub support: Option<usize>,
    pub pairs: Vec<Pair>,
    /// Geometry of every contact, N + 1.
    pub contacts: Vec<usize>,
    /// Stiffness of the spring behind the last contact's flat, N/m; infinite where the flat is rigid.
    pub spring: f64,
    /// Whether nothing is within reach behind the last contact.
    pub free: bool,
    /// Factor on the support's stiffness, 1.
    pub stiffness_factor: f64,
    /// The front of the disc, where the support is a disc on water; none of the bodies then.
    pub front: Option<Front>,
    pub dashpots: Vec<Dashpot>,
    /// What every kind of body loses in drag and material; none where nothing.
    pub(crate) losses: Vec<Option<BodyLoss>>,
    /// z of the origin of every body's coordinates while all just touch, m: beads, then the support; the piston's face lies at 0.
    pub origins: Vec<f64>,
}

impl Arrangement {
    /// Mesh the bodies of a scene and lay them side by side.
    pub fn new(scene: &Scene) -> Result<Self, FeaError> {
        let beads = &scene.chain.beads;
        if scene.piston == FlatContact::HalfSpace {
            return Err(FeaError::HalfSpace { key: "piston.contact" });
        }
        let mut kinds = Vec::new();
        let mut known: Vec<&Bead> = Vec::new();
        let mut of_bead = Vec::with_capacity(beads.len());
        for (i, bead) in beads.iter().enumerate() {
            let kind = match known.iter().position(|other| *other == bead) {
                Some(kind) => kind,
                None => {
                    known.push(bead);
                    kinds.push(bead_body(bead, i + 1, scene)?);
                    kinds.len() - 1
                }
            };
            of_bead.push(kind);
        }
        let last = beads.len() - 1;
        let names: Vec<String> = (1..=beads.len()).map(|bead| format!("bead {bead}")).collect();
        let pole = |bead: usize, boundary: &'static str| Pole {
            name: &names[bead],
            body: &kinds[of_bead[bead]],
            boundary,
            normal: if boundary == "back" { 1.0 } else { -1.0 },
            profile: Profile::Sphere { radius: beads[bead].radius },
        };
        let mut pairs = vec![Pair::on_flat(pole(0, "front"), true)?];
        let mut keys = vec![None];
        let mut contacts = vec![0];
        for i in 0..last {
            let key = Some((of_bead[i], of_bead[i + 1]));
            let pair = match keys.iter().position(|other| *other == key) {
                Some(pair) => pair,
                None => {
                    keys.push(key);
                    pairs.push(Pair::of_poles(pole(i, "back"), pole(i + 1, "front"))?);
                    pairs.len() - 1
                }
            };
            contacts.push(pair);
        }
        let mut origins = Vec::with_capacity(beads.len() + 1);
        let mut face = 0.0;
        for &kind in &of_bead {
            let (front, back) = kinds[kind].mesh().poles();
            origins.push(face - front);
            face += back - front;
        }
        let (mut stiffness_factor, mut front) = (1.0, None);
        let support = match &scene.support {
            Support::Flat(FlatContact::Rigid) | Support::Free | Support::Spring { .. } => {
                pairs.push(Pair::on_flat(pole(last, "back"), false)?);
                None
            }
            Support::Flat(FlatContact::HalfSpace) | Support::Foundation { .. } => {
                return Err(FeaError::HalfSpace { key: "support.kind" });
            }
            Support::Disc { shape, mesh_density } => {
                let failed = |source: DiscError| FeaError::Front(Box::new(source.into()));
                let disc = Disc::for_contact(shape, *mesh_density as usize).map_err(failed)?;
                let touched = Pole {
                    name: "the disc",
                    body: disc.body(),
                    boundary: "front",
                    normal: -1.0,
                    profile: Profile::Meshed,
                };
                let pair = Pair::of_poles(pole(last, "back"), touched)?;
                origins.push(face);
                // On water it is no body by itself: both step together.
                let dry = match &scene.water {
                    None => Some(disc.into_body()),
                    Some(water) => {
                        front = Some(Front::new(disc, &pair.after, water).map_err(failed)?);
                        None
                    }
                };
                pairs.push(pair);
                dry
            }
            Support::Annulus { shape, stiffness_factor: factor, material, .. } => {
                stiffness_factor = *factor;
                let torus = under_last(shape, scene);
                let (mesh, material) = ring_mesh(&torus, *factor, material, scene)?;
                let named = |source| FeaError::Body { body: "support".into(), source };
                let body = Body::new(mesh, &material, &["clamped"], &["contact"]).map_err(named)?;
                let pair = Pair::on_ring(&kinds[of_bead[last]], beads[last].radius, &body, &torus)?;
                origins.extend(pair.ring_centre.map(|centre| origins[last] - centre));
                pairs.push(pair);
                Some(body)
            }
        };
        contacts.push(pairs.len() - 1);
        let support = support.map(|body| {
            kinds.push(body);
            kinds.len() - 1
        });
        Ok(Self {
            losses: BodyLoss::of(&kinds, support, scene),
            kinds,
            beads: of_bead,
            support,
            pairs,
            contacts,
            spring: scene.support.spring().unwrap_or(f64::INFINITY),
            free: scene.support.is_free(),
            stiffness_factor,
            front,
            dashpots: dashpots(&scene.damping, beads.len() + 1),
            origins,
        })
    }

    /// Kind of the body in slot 0…N + 1 (piston, beads, support); none where it is rigid.
    pub(crate) fn kind(&self, slot: usize) -> Option<usize> {
        match slot.checked_sub(1) {
            None => None,
            Some(bead) if bead < self.beads.len() => Some(self.beads[bead]),
            Some(_) => self.support,
        }
    }

    /// Energy (J) of the spring behind the last contact under its force (N); 0 where there is none.
    pub(crate) fn spring_energy(&self, force: f64) -> f64 {
        0.5 * force * force / self.spring
    }

    pub(crate) fn name(&self, slot: usize) -> String {
        match slot {
            0 => "piston".into(),
            slot if slot <= self.beads.len() => format!("bead {slot}"),
            _ => "support".into(),
        }
    }

    /// What reports call the first body of a kind.
    fn name_of_kind(&self, kind: usize) -> String {
        let slot = (0..self.beads.len() + 2).find(|&slot| self.kind(slot) == Some(kind)).unwrap_or(0);
        self.name(slot)
    }

    pub(crate) fn modes_error(&self, kind: usize, source: ModesError) -> FeaError {
        FeaError::Modes { body: self.name_of_kind(kind), source }
    }

    pub(crate) fn factor_error(&self, kind: usize, source: FactorError) -> FeaError {
        FeaError::Factor { body: self.name_of_kind(kind), source }
    }

    /// Something made of every kind of body and its interface, which may have no factor.
    pub(crate) fn of_kinds<T>(
        &self,
        interfaces: &[Vec<u32>],
        make: impl Fn(usize, &Body, &[u32]) -> Result<T, FactorError>,
    ) -> Result<Vec<T>, FeaError> {
        let made = self.kinds.iter().zip(interfaces).enumerate().map(|(kind, (body, interface))| {
            make(kind, body, interface).map_err(|source| self.factor_error(kind, source))
        });
        made.collect()
    }

    /// Unknowns of all bodies, without those of a disc on water.
    pub fn unknowns(&self) -> usize {
        self.beads.iter().chain(&self.support).map(|&kind| self.kinds[kind].dofs().free().len()).sum()
    }

    /// Unknowns of one kind that any contact measures, ascending.
    pub(crate) fn interface(&self, kind: usize) -> Vec<u32> {
        let mut unknowns = Vec::new();
        for (contact, &pair) in self.contacts.iter().enumerate() {
            let pair = &self.pairs[pair];
            for (slot, face) in [(contact, &pair.before), (contact + 1, &pair.after)] {
                if self.kind(slot) == Some(kind) {
                    unknowns.extend(face.unknowns());
                }
            }
        }
        unknowns.sort_unstable();
        unknowns.dedup();
        unknowns
    }
}

/// Mesh of a bead of a scene.
pub fn bead_mesh(bead: &Bead, scene: &Scene) -> Result<Mesh, MeshError> {
    let settings = scene.model.meshing();
    mesh::bead(bead.radius, &BeadMesh { density: settings.density as usize, patch_radius: settings.contact_patch })
}

/// Mesh of the support of a scene and its material; none where it is a flat.
pub(crate) fn support_mesh(scene: &Scene) -> Result<Option<(Mesh, Material)>, FeaError> {
    match &scene.support {
        Support::Flat(_) | Support::Free | Support::Spring { .. } | Support::Foundation { .. } => Ok(None),
        Support::Disc { shape, mesh_density } => {
            let disc = Disc::for_contact(shape, *mesh_density as usize)
                .map_err(|source| FeaError::Front(Box::new(source.into())))?;
            Ok(Some((disc.into_body().mesh().clone(), shape.material.clone())))
        }
        Support::Annulus { shape, stiffness_factor, material, .. } => {
            Ok(Some(ring_mesh(&under_last(shape, scene), *stiffness_factor, material, scene)?))
        }
    }
}

/// Mesh of a ring and its material: a stiffer or softer support is the same body of another modulus.
fn ring_mesh(
    torus: &HalfTorus,
    factor: f64,
    material: &Material,
    scene: &Scene,
) -> Result<(Mesh, Material), MeshError> {
    let form = AnnulusMesh::on(torus, scene.model.meshing().density as usize);
    let material = Material { youngs_modulus: factor * material.youngs_modulus, ..material.clone() };
    Ok((mesh::annulus(torus, &form)?, material))
}

/// The ring of a scene with the bead that lies on it, where there is one.
pub fn torus(scene: &Scene) -> Option<HalfTorus> {
    scene.support.ring().map(|(shape, ..)| under_last(shape, scene))
}

fn under_last(shape: &AnnulusShape, scene: &Scene) -> HalfTorus {
    HalfTorus::under(shape, scene.chain.beads.last().map_or(0.0, |bead| bead.radius))
}

fn bead_body(bead: &Bead, number: usize, scene: &Scene) -> Result<Body, FeaError> {
    let named = |source| FeaError::Body { body: format!("bead {number}"), source };
    Body::new(bead_mesh(bead, scene)?, &bead.material, &[], &["front", "back"]).map_err(named)
}
