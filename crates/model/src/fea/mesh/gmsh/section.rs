//! What makes elements one body: anticlockwise, not inside out, each place covered once, all connected.

use std::collections::HashMap;

use super::{GmshError, Mesh};
use crate::fea::{
    element::interpolate,
    mesh::{Element, MeshError, Shape, quality},
};

pub(super) struct Numbers {
    pub nodes: Vec<u64>,
    pub elements: Vec<u64>,
}

pub(super) fn turn_anticlockwise(mesh: &mut Mesh) {
    let nodes = &mesh.nodes;
    for element in &mut mesh.elements {
        let corners = element.shape.corners();
        let place = |i: usize| nodes[element.nodes[i % corners] as usize];
        let twice_area: f64 =
            (0..corners).map(|i| (place(i), place(i + 1))).map(|([r0, z0], [r1, z1])| r0 * z1 - r1 * z0).sum();
        if twice_area < 0.0 {
            let before = element.nodes;
            for i in 0..corners {
                element.nodes[i] = before[(corners - i) % corners];
                element.nodes[corners + i] = before[2 * corners - 1 - i];
            }
        }
    }
}

pub(super) fn check(mesh: &Mesh, numbers: &Numbers) -> Result<(), GmshError> {
    duplicates(mesh, numbers)?;
    if let Err(MeshError::NegativeJacobian { element, r, z, determinant }) = mesh.check() {
        // `check` counts from 1.
        let element = numbers.elements[element as usize - 1];
        return Err(GmshError::NegativeJacobian { element, r, z, determinant });
    }
    overlaps(mesh, numbers)?;
    coincidences(mesh, numbers)?;
    connected(mesh, numbers)
}

fn middle(mesh: &Mesh, element: &Element) -> [f64; 2] {
    let functions = match element.shape {
        Shape::Quadrilateral8 => interpolate(element.shape, 0.0, 0.0),
        Shape::Triangle6 => interpolate(element.shape, 1.0 / 3.0, 1.0 / 3.0),
    };
    let nodes = || element.nodes().iter().zip(&functions.value);
    [0, 1].map(|d| nodes().map(|(node, value)| value * mesh.nodes[*node as usize][d]).sum())
}

fn duplicates(mesh: &Mesh, numbers: &Numbers) -> Result<(), GmshError> {
    let mut seen = HashMap::new();
    for (element, number) in mesh.elements.iter().zip(&numbers.elements) {
        let mut corners = element.nodes()[..element.shape.corners()].to_vec();
        corners.sort_unstable();
        if let Some(other) = seen.insert(corners, *number) {
            let [r, z] = middle(mesh, element);
            return Err(GmshError::Overlap { element: *number, other, r, z });
        }
    }
    Ok(())
}

fn overlaps(mesh: &Mesh, numbers: &Numbers) -> Result<(), GmshError> {
    let middles: Vec<[f64; 2]> = mesh.elements.iter().map(|element| middle(mesh, element)).collect();
    let mut order: Vec<usize> = (0..middles.len()).collect();
    order.sort_by(|a, b| middles[*a][0].total_cmp(&middles[*b][0]));
    for (index, element) in mesh.elements.iter().enumerate() {
        let corners = element.shape.corners();
        // Corner, middle of the side, corner, …
        let around =
            |i: usize| mesh.nodes[element.nodes[if i.is_multiple_of(2) { i / 2 } else { corners + i / 2 }] as usize];
        let outline: Vec<[f64; 2]> = (0..2 * corners).map(around).collect();
        let ends = |d: usize| {
            outline
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), place| (low.min(place[d]), high.max(place[d])))
        };
        let ((left, right), (low, high)) = (ends(0), ends(1));
        let first = order.partition_point(|other| middles[*other][0] < left);
        for &other in order[first..].iter().take_while(|other| middles[**other][0] <= right) {
            let at = middles[other];
            if other != index && at[1] >= low && at[1] <= high && inside(&outline, at) {
                let (element, other) = (numbers.elements[index], numbers.elements[other]);
                return Err(GmshError::Overlap { element, other, r: at[0], z: at[1] });
            }
        }
    }
    Ok(())
}

/// Whether a point lies inside a polygon: a ray from it crosses the outline an odd number of times.
fn inside(outline: &[[f64; 2]], [r, z]: [f64; 2]) -> bool {
    let mut inside = false;
    for (i, [r0, z0]) in outline.iter().enumerate() {
        let [r1, z1] = outline[(i + 1) % outline.len()];
        if (*z0 > z) != (z1 > z) && r < r0 + (z - z0) / (z1 - z0) * (r1 - r0) {
            inside = !inside;
        }
    }
    inside
}

/// Two nodes closer than a millionth of the shortest side.
fn coincidences(mesh: &Mesh, numbers: &Numbers) -> Result<(), GmshError> {
    let apart = 1e-6 * quality(mesh).shortest_side;
    let mut order: Vec<usize> = (0..mesh.nodes.len()).collect();
    order.sort_by(|a, b| mesh.nodes[*a][0].total_cmp(&mesh.nodes[*b][0]).then(a.cmp(b)));
    for (place, &a) in order.iter().enumerate() {
        let [r, z] = mesh.nodes[a];
        for &b in order[place + 1..].iter().take_while(|b| mesh.nodes[**b][0] - r <= apart) {
            if (mesh.nodes[b][1] - z).abs() <= apart {
                let (node, other) = (numbers.nodes[a.min(b)], numbers.nodes[a.max(b)]);
                return Err(GmshError::Coincident { node, other, r, z });
            }
        }
    }
    Ok(())
}

fn connected(mesh: &Mesh, numbers: &Numbers) -> Result<(), GmshError> {
    let mut of_node: Vec<Vec<usize>> = vec![Vec::new(); mesh.nodes.len()];
    for (index, element) in mesh.elements.iter().enumerate() {
        for node in &element.nodes()[..element.shape.corners()] {
            of_node[*node as usize].push(index);
        }
    }
    let mut reached = vec![false; mesh.elements.len()];
    let mut open = vec![0];
    reached[0] = true;
    while let Some(index) = open.pop() {
        let element = &mesh.elements[index];
        for node in &element.nodes()[..element.shape.corners()] {
            for &next in &of_node[*node as usize] {
                if !reached[next] {
                    reached[next] = true;
                    open.push(next);
                }
            }
        }
    }
    match reached.iter().position(|reached| !reached) {
        None => Ok(()),
        Some(index) => {
            let [r, z] = mesh.nodes[mesh.elements[index].nodes[0] as usize];
            let (element, other) = (numbers.elements[index], numbers.elements[0]);
            Err(GmshError::Separate { element, other, r, z })
        }
    }
}
