//! Fields as files: read back value by value by an XML parser of another crate.

use std::sync::Arc;

use base64::{Engine, engine::general_purpose::STANDARD};
use granchain::{
    model::fea::mesh::{BeadMesh, bead},
    response::{Field, FieldBody, FieldError, FieldMesh, VtuError, write_pvd, write_vtu},
};
use roxmltree::Document;

fn two_cells() -> FieldMesh {
    FieldMesh {
        points: (0..13).map(|i| [0.1 * f64::from(i), 1.0 / 3.0 - f64::from(i)]).collect(),
        cells: vec![[0, 1, 2, 3, 4, 5, 6, 7], [1, 8, 9, 2, 10, 11, 12, 5]],
    }
}

fn field() -> Field {
    let mesh = Arc::new(two_cells());
    let body = |name: &str, offset: f64| FieldBody {
        displacement: (0..13).map(|i| [f64::from(i) * 1e-7, -offset]).collect(),
        velocity: vec![[0.5, 0.25]; 13],
        stress: (0..13).map(|i| [f64::from(i), 2.0, 3.0, 4.0e9]).collect(),
        von_mises: vec![1e9 / 3.0; 13],
        ..FieldBody::at_rest(name, mesh.clone(), offset)
    };
    Field { time: 1.1e-6, bodies: vec![body("bead1", 0.0005), body("bead2", 0.0015)] }
}

fn text(field: &Field) -> String {
    let mut bytes = Vec::new();
    write_vtu(field, &mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// The bytes of an array after its header, which must count them.
fn array(document: &Document<'_>, name: &str) -> Vec<u8> {
    let is_it = |node: &roxmltree::Node<'_, '_>| node.attribute("Name") == Some(name);
    let node = document.descendants().find(is_it).unwrap();
    let bytes = STANDARD.decode(node.text().unwrap().trim()).unwrap();
    assert_eq!(u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize, bytes.len() - 8, "{name}");
    bytes[8..].to_vec()
}

fn floats(document: &Document<'_>, name: &str) -> Vec<f64> {
    array(document, name).chunks_exact(8).map(|chunk| f64::from_le_bytes(chunk.try_into().unwrap())).collect()
}

fn integers(document: &Document<'_>, name: &str) -> Vec<i64> {
    array(document, name).chunks_exact(8).map(|chunk| i64::from_le_bytes(chunk.try_into().unwrap())).collect()
}

#[test]
fn every_value_reads_back_to_the_same_bits() {
    let field = field();
    let text = text(&field);
    let document = Document::parse(&text).unwrap();
    let root = document.root_element();
    assert_eq!(root.attribute("byte_order"), Some("LittleEndian"));
    assert_eq!(root.attribute("header_type"), Some("UInt64"));
    let piece = document.descendants().find(|node| node.has_tag_name("Piece")).unwrap();
    assert_eq!((piece.attribute("NumberOfPoints"), piece.attribute("NumberOfCells")), (Some("26"), Some("4")));
    assert_eq!(floats(&document, "TimeValue"), [1.1e-6]);
    let flat = |list: &dyn Fn(&FieldBody) -> Vec<f64>| field.bodies.iter().flat_map(list).collect::<Vec<f64>>();
    let vectors = |values: &[[f64; 2]]| values.iter().flat_map(|[r, z]| [*r, *z, 0.0]).collect::<Vec<f64>>();
    assert_eq!(floats(&document, "displacement"), flat(&|body| vectors(&body.displacement)));
    assert_eq!(floats(&document, "velocity"), flat(&|body| vectors(&body.velocity)));
    assert_eq!(floats(&document, "stress"), flat(&|body| body.stress.concat()));
    assert_eq!(floats(&document, "von_mises"), flat(&|body| body.von_mises.clone()));
    let moved =
        |body: &FieldBody| vectors(&body.mesh.points.iter().map(|[r, z]| [*r, z + body.offset]).collect::<Vec<_>>());
    assert_eq!(floats(&document, "Points"), flat(&moved));
    let both: Vec<i64> = [0, 13]
        .iter()
        .flat_map(|first| two_cells().cells.concat().into_iter().map(move |p| first + i64::from(p)))
        .collect();
    assert_eq!(integers(&document, "connectivity"), both);
    assert_eq!(integers(&document, "offsets"), [8, 16, 24, 32]);
    assert_eq!(array(&document, "types"), [23; 4]);
    let small = |name: &str| -> Vec<i32> {
        array(&document, name).chunks_exact(4).map(|chunk| i32::from_le_bytes(chunk.try_into().unwrap())).collect()
    };
    assert_eq!(small("body"), [1, 1, 2, 2]);
}

#[test]
fn the_same_field_gives_the_same_bytes() {
    assert_eq!(text(&field()), text(&field()));
}

#[test]
fn quantities_that_were_not_computed_are_left_out() {
    let mesh = bead(0.5e-3, &BeadMesh::of_density(4)).unwrap();
    let cells = Arc::new(mesh.to_field_mesh());
    let at_rest = Field { time: 0.0, bodies: vec![FieldBody::at_rest("bead", cells, 0.0)] };
    let text = text(&at_rest);
    let document = Document::parse(&text).unwrap();
    let data = document.descendants().find(|node| node.has_tag_name("PointData")).unwrap();
    assert!(!data.has_children() || data.children().all(|child| child.is_text()));
    assert_eq!(array(&document, "types").len(), mesh.elements.len());
    assert_eq!(floats(&document, "Points").len(), 3 * mesh.nodes.len());
}

#[test]
fn lists_that_do_not_fit_together_are_refused_by_name() {
    let mut wrong = field();
    wrong.bodies[1].velocity.pop();
    let refused = write_vtu(&wrong, Vec::new()).unwrap_err();
    let VtuError::Field(FieldError::Count { body, quantity, expected: 13, found: 12 }) = &refused else {
        panic!("{refused}")
    };
    assert_eq!((body.as_str(), *quantity), ("bead2", "velocity"));
    let mut wrong = two_cells();
    wrong.cells[0][3] = 13;
    let wrong = Field { time: 0.0, bodies: vec![FieldBody::at_rest("bead", Arc::new(wrong), 0.0)] };
    assert_eq!(wrong.check().unwrap_err().to_string(), "cells of `bead`: expected point numbers below 13, found 13");
}

#[test]
fn a_collection_names_every_frame_with_its_time() {
    let mut bytes = Vec::new();
    write_pvd([(0.0, "field/0000.vtu"), (1e-7, "field/a&b.vtu")], &mut bytes).unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let document = Document::parse(&text).unwrap();
    let frames: Vec<_> = document.descendants().filter(|node| node.has_tag_name("DataSet")).collect();
    let read: Vec<_> =
        frames.iter().map(|node| (node.attribute("timestep").unwrap(), node.attribute("file").unwrap())).collect();
    assert_eq!(read, [("0.0", "field/0000.vtu"), ("1e-7", "field/a&b.vtu")]);
    assert_eq!(document.root_element().attribute("type"), Some("Collection"));
}
