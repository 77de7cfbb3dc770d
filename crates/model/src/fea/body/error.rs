//! What a body refuses.

use thiserror::Error;

use crate::{
    fea::{element::ElementError, mesh::Mesh},
    scene::Material,
};

/// Why a mesh and its materials make no body.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BodyError {
    /// A boundary that the mesh does not name.
    #[error(
        "boundary `{boundary}`: expected a named boundary of the mesh, which has {known:?}; name it in the mesh or ask for one of these"
    )]
    Boundary {
        /// The name asked for.
        boundary: String,
        /// The names there are.
        known: Vec<String>,
    },
    /// An element of a material that is not given.
    #[error(
        "element {element}: expected one of {count} materials, found number {material} (from 0); give its material"
    )]
    Material {
        /// Which element, from 0.
        element: usize,
        /// Its material's number.
        material: u16,
        /// How many there are.
        count: usize,
    },
    /// A physically void number.
    #[error("material `{material}`: `{quantity}`: expected {expected}, found {found:e}; correct it")]
    Unphysical {
        /// Which material.
        material: String,
        /// Which number.
        quantity: &'static str,
        /// What it should be, with unit.
        expected: &'static str,
        /// What it is, SI.
        found: f64,
    },
    /// An element or a boundary refers to a node that does not exist.
    #[error("{place}: expected nodes below {count}, found {node}; correct the mesh")]
    NodeNumber {
        /// Element or boundary.
        place: String,
        /// The number.
        node: u32,
        /// How many there are.
        count: usize,
    },
    /// A node on the wrong side of the axis, or not a number.
    #[error("node {node} at r = {r:e} m, z = {z:e} m: expected finite numbers with r ≥ 0; move it")]
    NodePlace {
        /// Which node, from 0.
        node: usize,
        /// Place, m.
        r: f64,
        /// Place, m.
        z: f64,
    },
    /// A node that no element holds: nothing would stop it from moving.
    #[error("node {node} belongs to no element; remove it from the mesh")]
    LooseNode {
        /// Which node, from 0.
        node: usize,
    },
    /// A bad element.
    #[error("element {element}: {source}")]
    Element {
        /// Which element, from 0.
        element: usize,
        /// What is wrong with it.
        #[source]
        source: ElementError,
    },
    /// An element with all its nodes on contact boundaries.
    #[error(
        "element {element} has all its nodes on contact boundaries, so none is left to carry its mass; refine the mesh there or \
         choose consistent mass"
    )]
    MasslessElement {
        /// Which element, from 0.
        element: usize,
    },
}

pub(super) fn check(mesh: &Mesh, materials: &[Material]) -> Result<(), BodyError> {
    for material in materials {
        let (modulus, ratio, density) = (material.youngs_modulus, material.poissons_ratio, material.density);
        for (quantity, expected, found, is_sound) in [
            ("youngs_modulus", "a finite number > 0 Pa", modulus, modulus > 0.0 && modulus.is_finite()),
            ("poissons_ratio", "−1 < ν < 0.5", ratio, ratio > -1.0 && ratio < 0.5),
            ("density", "a finite number > 0 kg/m³", density, density > 0.0 && density.is_finite()),
        ] {
            if !is_sound {
                return Err(BodyError::Unphysical { material: material.name.clone(), quantity, expected, found });
            }
        }
    }
    let count = mesh.nodes.len();
    for (node, &[r, z]) in mesh.nodes.iter().enumerate() {
        if !(r >= 0.0 && r.is_finite() && z.is_finite()) {
            return Err(BodyError::NodePlace { node, r, z });
        }
    }
    let mut is_held = vec![false; count];
    for (element, corners) in mesh.elements.iter().enumerate() {
        if usize::from(corners.material) >= materials.len() {
            return Err(BodyError::Material { element, material: corners.material, count: materials.len() });
        }
        for &node in corners.nodes() {
            let place = || format!("element {element}");
            *is_held.get_mut(node as usize).ok_or_else(|| BodyError::NodeNumber { place: place(), node, count })? =
                true;
        }
    }
    for boundary in &mesh.boundaries {
        if let Some(&node) = boundary.nodes.iter().find(|&&node| node as usize >= count) {
            return Err(BodyError::NodeNumber { place: format!("boundary `{}`", boundary.name), node, count });
        }
    }
    is_held.iter().position(|&is_held| !is_held).map_or(Ok(()), |node| Err(BodyError::LooseNode { node }))
}
