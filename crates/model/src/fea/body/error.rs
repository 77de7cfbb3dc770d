use thiserror::Error;

use crate::{
    fea::{element::ElementError, mesh::Mesh},
    scene::Material,
};

/// Why a mesh and its material make no body. Elements and nodes count from 0.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum BodyError {
    #[error(
        "boundary `{boundary}`: expected a named boundary of the mesh, which has {known:?}; name it in the mesh or ask for one of these"
    )]
    Boundary { boundary: String, known: Vec<String> },
    #[error("material `{material}`: `{quantity}`: expected {expected}, found {found:e}; correct it")]
    Unphysical { material: String, quantity: &'static str, expected: &'static str, found: f64 },
    #[error("{place}: expected nodes below {count}, found {node}; correct the mesh")]
    NodeNumber { place: String, node: u32, count: usize },
    #[error("node {node} at r = {r:e} m, z = {z:e} m: expected finite numbers with r ≥ 0; move it")]
    NodePlace { node: usize, r: f64, z: f64 },
    #[error("node {node} belongs to no element; remove it from the mesh")]
    LooseNode { node: usize },
    #[error("element {element}: {source}")]
    Element {
        element: usize,
        #[source]
        source: ElementError,
    },
    #[error(
        "element {element} has all its nodes on contact boundaries, so none is left to carry its mass; refine the mesh there"
    )]
    MasslessElement { element: usize },
}

pub(super) fn check(mesh: &Mesh, material: &Material) -> Result<(), BodyError> {
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
    let count = mesh.nodes.len();
    for (node, &[r, z]) in mesh.nodes.iter().enumerate() {
        if !(r >= 0.0 && r.is_finite() && z.is_finite()) {
            return Err(BodyError::NodePlace { node, r, z });
        }
    }
    let mut is_held = vec![false; count];
    for (element, nodes) in mesh.elements.iter().enumerate() {
        for &node in nodes {
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
