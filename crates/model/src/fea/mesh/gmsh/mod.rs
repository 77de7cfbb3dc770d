//! Bodies of the user's own: meshes from Gmsh.
//!
//! Format MSH 4.1, text or binary, of a section in the plane x = r, y = z (third coordinate 0), r ≥ 0, z positive from piston to support.
//! Triangles of 6 and quadrilaterals of 8 nodes, either way round. Physical curves name the boundaries: `front` and `back` (poles of a
//! bead), `contact` and `clamped` (a support); others are kept too. Physical surfaces name materials.
//!
//! ```text
//! Mesh.ElementOrder = 2;  Mesh.SecondOrderIncomplete = 1;  Mesh.MshFileVersion = 4.1;
//! Physical Curve("front") = {1};  Physical Surface("chrome-steel") = {1};
//! ```
//!
//! Geuzaine & Remacle, *Gmsh Reference Manual*, section MSH file format.

mod curve;
mod error;
mod file;
mod section;

use std::{
    collections::{BTreeMap, HashMap},
    path::Path,
};

pub use error::GmshError;
use mshio::ElementType;

use self::{curve::Line, file::File};
use super::{Boundary, CONTACT_BOUNDARIES, Element, Mesh, MeshError, Shape};

/// A node this close to the axis, over the size of the body, lies on it.
const ON_AXIS: f64 = 1e-9;

/// Read a mesh made by Gmsh, and the names of its materials, in the order of [`Element::material`].
///
/// - `path`: the file
/// - `unit`: length of its unit, m; 1 where it is in metres
///
/// A boundary runs from its end at smaller r (at smaller z, where both have the same) to the other. A surface in no physical group, or in
/// one without name, has the empty name: it is made of the body's own material. Nodes within 1e-9 of the body's size of the axis are put
/// on it; nodes of no element are dropped. Nodes need not lie on a sphere.
pub fn import(path: impl AsRef<Path>, unit: f64) -> Result<(Mesh, Vec<String>), MeshError> {
    let path = path.as_ref();
    let read = || {
        let bytes = std::fs::read(path).map_err(|error| GmshError::Unreadable { kind: error.kind() })?;
        parse(&bytes, unit)
    };
    read().map_err(|source| MeshError::Gmsh { path: path.to_owned(), source: Box::new(source) })
}

/// As [`import`], from the bytes of a file.
pub fn parse(bytes: &[u8], unit: f64) -> Result<(Mesh, Vec<String>), GmshError> {
    if !(unit > 0.0 && unit.is_finite()) {
        return Err(GmshError::Unit { found: unit });
    }
    let File { msh, names } = File::parse(bytes)?;
    let missing = |section| GmshError::MissingSection { section };
    let entities = msh.data.entities.ok_or(missing("Entities"))?;
    let blocks = msh.data.elements.ok_or(missing("Elements"))?.element_blocks;
    let places = places(&msh.data.nodes.ok_or(missing("Nodes"))?.node_blocks, unit);
    let mut nodes = Nodes { places: &places, index: HashMap::new(), numbers: Vec::new() };

    // Surfaces: material by physical group, in the order of the groups' numbers.
    let mut groups = BTreeMap::new();
    for surface in &entities.surfaces {
        if surface.physical_tags.len() > 1 {
            let groups = surface.physical_tags.clone();
            return Err(GmshError::AmbiguousMaterial { surface: surface.tag, groups });
        }
        groups.insert(surface.tag, surface.physical_tags.first().map(|group| group.abs()));
    }
    let mut found: Vec<(String, Element)> = Vec::new();
    let mut numbers = Vec::new();
    for block in blocks.iter().filter(|block| block.entity_dim >= 2) {
        let group = groups.get(&block.entity_tag).copied().flatten();
        let material = group.and_then(|group| names.get(&(2, group))).cloned().unwrap_or_default();
        for element in &block.elements {
            let shape = shape(block.element_type, block.entity_dim, element, &nodes)?;
            let mut indices = [0; 8];
            for (index, number) in indices.iter_mut().zip(&element.nodes) {
                *index = nodes.index(element.element_tag, *number)?;
            }
            found.push((material.clone(), Element { shape, nodes: indices, material: 0 }));
            numbers.push(element.element_tag);
        }
    }
    if found.is_empty() {
        return Err(GmshError::NoElements);
    }
    let mut materials: Vec<String> = found.iter().map(|(name, _)| name.clone()).collect();
    materials.sort();
    materials.dedup();
    if materials.len() > usize::from(u16::MAX) {
        let most = usize::from(u16::MAX);
        return Err(GmshError::TooMany { what: "materials", most, found: materials.len() });
    }
    let number_of = |name: &String| materials.binary_search(name).map_or(0, |index| index as u16);
    let elements = found.into_iter().map(|(name, element)| Element { material: number_of(&name), ..element }).collect();

    // Curves: boundaries by physical group.
    let mut curves: BTreeMap<i32, Vec<Line>> = BTreeMap::new();
    let mut curve_groups: HashMap<i32, Vec<i32>> = HashMap::new();
    for curve in &entities.curves {
        curve_groups.insert(curve.tag, curve.physical_tags.iter().map(|group| group.abs()).collect());
    }
    for block in blocks.iter().filter(|block| block.entity_dim == 1) {
        for group in curve_groups.get(&block.entity_tag).into_iter().flatten() {
            for element in &block.elements {
                let number = element.element_tag;
                let [a, b, middle] = element.nodes[..] else {
                    let ([r, z, _], count) = (nodes.first(element)?, element.nodes.len());
                    return Err(GmshError::Linear { element: number, r, z, nodes: count });
                };
                let [a, middle, b] = [a, middle, b].map(|node| nodes.index(number, node));
                curves.entry(*group).or_default().push(Line { number, nodes: [a?, middle?, b?] });
            }
        }
    }
    let mut mesh = Mesh { nodes: nodes.finish()?, elements, boundaries: Vec::new() };
    let numbers = section::Numbers { nodes: nodes.numbers, elements: numbers };
    section::turn_anticlockwise(&mut mesh);
    section::check(&mesh, &numbers)?;
    let sides = curve::Sides::of(&mesh);
    for (group, lines) in curves {
        let Some(name) = names.get(&(1, group)).filter(|name| !name.is_empty()) else {
            let [r, z] = mesh.nodes[lines[0].nodes[0] as usize];
            return Err(GmshError::UnnamedBoundary { group, r, z });
        };
        let nodes = curve::in_order(&mesh, name, &lines, &sides)?;
        mesh.boundaries.push(Boundary { name: name.clone(), nodes });
    }
    if !mesh.boundaries.iter().any(|boundary| CONTACT_BOUNDARIES.contains(&boundary.name.as_str())) {
        let found = mesh.boundaries.iter().map(|boundary| boundary.name.clone()).collect();
        return Err(GmshError::NoContactBoundary { found });
    }
    Ok((mesh, materials))
}

/// Places of all nodes of the file by their numbers, m.
fn places(blocks: &[mshio::NodeBlock<u64, i32, f64>], unit: f64) -> HashMap<u64, [f64; 3]> {
    let mut places = HashMap::new();
    for block in blocks {
        for (number, index) in block.node_tags.iter().flatten() {
            if let Some(node) = block.nodes.get(*index) {
                places.insert(*number, [node.x, node.y, node.z].map(|length| unit * length));
            }
        }
    }
    places
}

struct Nodes<'a> {
    places: &'a HashMap<u64, [f64; 3]>,
    index: HashMap<u64, u32>,
    numbers: Vec<u64>,
}

impl Nodes<'_> {
    fn index(&mut self, element: u64, number: u64) -> Result<u32, GmshError> {
        if let Some(index) = self.index.get(&number) {
            return Ok(*index);
        }
        if !self.places.contains_key(&number) {
            return Err(GmshError::UnknownNode { element, node: number });
        }
        let index = self.numbers.len() as u32;
        self.index.insert(number, index);
        self.numbers.push(number);
        Ok(index)
    }

    fn first(&self, element: &mshio::Element<u64>) -> Result<[f64; 3], GmshError> {
        let (number, node) = (element.element_tag, element.nodes.first().copied().unwrap_or_default());
        self.places.get(&node).copied().ok_or(GmshError::UnknownNode { element: number, node })
    }

    /// The places (r, z), those within rounding of the axis put on it.
    fn finish(&self) -> Result<Vec<[f64; 2]>, GmshError> {
        let of = |number: &u64| self.places.get(number).copied().unwrap_or_default();
        let size = self.numbers.iter().flat_map(of).map(f64::abs).fold(0.0, f64::max);
        let most = u32::MAX as usize;
        if self.numbers.len() > most {
            return Err(GmshError::TooMany { what: "nodes", most, found: self.numbers.len() });
        }
        let place = |&node: &u64| {
            let [r, z, third] = of(&node);
            if !(third.abs() <= ON_AXIS * size) {
                return Err(GmshError::OffPlane { node, r, z, third });
            }
            if !(r >= -ON_AXIS * size) || !z.is_finite() {
                return Err(GmshError::BeyondAxis { node, r, z });
            }
            Ok([if r <= ON_AXIS * size { 0.0 } else { r }, z])
        };
        self.numbers.iter().map(place).collect()
    }
}

fn shape(
    kind: ElementType,
    dimension: i32,
    element: &mshio::Element<u64>,
    nodes: &Nodes<'_>,
) -> Result<Shape, GmshError> {
    let ([r, z, _], number) = (nodes.first(element)?, element.element_tag);
    match kind {
        ElementType::Tri6 => Ok(Shape::Triangle6),
        ElementType::Qua8 => Ok(Shape::Quadrilateral8),
        ElementType::Tri3 | ElementType::Qua4 => {
            Err(GmshError::Linear { element: number, r, z, nodes: element.nodes.len() })
        }
        ElementType::Qua9 => Err(GmshError::NineNodes { element: number, r, z }),
        other => {
            let found = format!("{other:?} of dimension {dimension}");
            Err(GmshError::Unsupported { element: number, r, z, found })
        }
    }
}
