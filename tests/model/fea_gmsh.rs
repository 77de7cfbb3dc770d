//! Bodies meshed by Gmsh: files of Gmsh itself (`tests/meshes/make.py`) and small ones written here to be broken.

use std::{collections::BTreeSet, f64::consts::PI, fmt::Write, path::PathBuf};

use granchain::model::fea::mesh::{
    Mesh, MeshError, Shape,
    gmsh::{GmshError, import, parse},
    quality,
};

const MILLIMETRE: f64 = 1e-3;

fn file(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests", "meshes", name].iter().collect()
}

fn read(name: &str) -> (Mesh, Vec<String>) {
    import(file(name), MILLIMETRE).unwrap()
}

fn refused(name: &str) -> GmshError {
    let MeshError::Gmsh { path, source } = import(file(name), MILLIMETRE).unwrap_err() else { panic!() };
    assert_eq!(path, file(name));
    *source
}

fn along(mesh: &Mesh, name: &str) -> Vec<[f64; 2]> {
    mesh.boundary(name).unwrap().nodes.iter().map(|node| mesh.nodes[*node as usize]).collect()
}

#[test]
fn text_and_binary_files_of_a_bead_have_its_volume_and_its_boundaries() {
    let exact = 4.0 / 3.0 * PI * (0.5e-3_f64).powi(3);
    for (name, quadrilaterals) in [("bead-triangles.msh", false), ("bead-quadrilaterals-binary.msh", true)] {
        let (mesh, materials) = read(name);
        assert_eq!(materials, ["chrome-steel"]);
        let found = quality(&mesh);
        // Sides of 0.12 mm turn by 0.24: an arc of three points errs by (0.12)⁴/8 × 2/15 of its radius.
        assert!(found.volume_error(exact).abs() < 2e-4, "{name}: {}", found.volume_error(exact));
        assert!(found.worst_jacobian_ratio > 0.05, "{name}: {found:?}");
        let has_quadrilaterals = mesh.elements.iter().any(|element| element.shape == Shape::Quadrilateral8);
        assert_eq!(has_quadrilaterals, quadrilaterals);
        for (boundary, sign) in [("front", -1.0), ("back", 1.0)] {
            let places = along(&mesh, boundary);
            assert_eq!(places[0], [0.0, sign * 0.5e-3]);
            assert!(places.len() >= 5 && places.len() % 2 == 1);
            assert!(places.windows(2).all(|pair| pair[0][0] < pair[1][0]));
            let [r, z] = places[places.len() - 1];
            assert!((r - 0.3e-3).abs() < 1e-15 && (z - sign * 0.4e-3).abs() < 1e-15);
            // The middle is the middle of its edge, not any other node.
            for edge in places.windows(3).step_by(2) {
                let off =
                    (edge[1][0] - 0.5 * (edge[0][0] + edge[2][0])).hypot(edge[1][1] - 0.5 * (edge[0][1] + edge[2][1]));
                let length = (edge[2][0] - edge[0][0]).hypot(edge[2][1] - edge[0][1]);
                assert!(off < 0.1 * length);
            }
        }
    }
}

#[test]
fn surfaces_take_their_materials_from_physical_groups() {
    let (mesh, materials) = read("ring.msh");
    assert_eq!(materials, ["chrome-steel", "resin"]);
    for element in &mesh.elements {
        let z: f64 = element.nodes().iter().map(|node| mesh.nodes[*node as usize][1]).sum();
        assert_eq!(materials[usize::from(element.material)], if z < 0.0 { "resin" } else { "chrome-steel" });
    }
    let clamped = along(&mesh, "clamped");
    assert_eq!((clamped[0], clamped[clamped.len() - 1]), ([0.55e-3, -0.25e-3], [0.55e-3, 0.25e-3]));
    // From the inner side to the outer.
    let contact = along(&mesh, "contact");
    assert!((contact[0][0] - 0.3e-3).abs() < 1e-12 && contact[contact.len() - 1] == [0.55e-3, -0.25e-3]);
    let (plain, _) = import(file("ring.msh"), 1.0).unwrap();
    assert_eq!(plain.nodes[7].map(|length| length * MILLIMETRE), mesh.nodes[7]);
}

#[test]
fn linear_elements_are_refused_with_the_option_to_set() {
    let refused = refused("ring-linear.msh");
    let GmshError::Linear { nodes: 3, .. } = refused else { panic!("{refused}") };
    assert!(refused.to_string().ends_with("mesh with `Mesh.ElementOrder = 2`"));
}

#[test]
fn elements_with_a_ninth_node_are_refused_with_the_option_to_set() {
    let refused = refused("bead-nine-nodes.msh");
    assert!(matches!(refused, GmshError::NineNodes { .. }), "{refused}");
}

#[test]
fn a_boundary_without_name_is_refused_with_its_place() {
    let refused = refused("ring-unnamed.msh");
    let GmshError::UnnamedBoundary { group: 1, r, z } = refused else { panic!("{refused}") };
    assert!(((r - 0.55e-3).hypot(z) - 0.25e-3).abs() < 1e-9);
}

#[test]
fn a_section_beyond_the_axis_is_refused_with_its_node() {
    let refused = refused("ring-beyond-axis.msh");
    let GmshError::BeyondAxis { r, .. } = refused else { panic!("{refused}") };
    assert!(r < -1e-6);
}

#[test]
fn overlapping_surfaces_are_refused_with_both_elements() {
    let refused = refused("overlap.msh");
    let GmshError::Overlap { element, other, r, z } = refused else { panic!("{refused}") };
    assert_ne!(element, other);
    assert!((0.0..0.1e-3).contains(&r) && (0.03e-3..0.1e-3).contains(&z));
}

#[test]
fn other_versions_and_other_files_are_refused() {
    let expected =
        "expected a Gmsh file of format 4.1, found `$MeshFormat 2.2 0 8`; save it with `Mesh.MshFileVersion = 4.1`";
    assert_eq!(refused("bead-version-2.msh").to_string(), expected);
    assert!(matches!(refused("make.py"), GmshError::Version { .. }));
    assert!(matches!(refused("none.msh"), GmshError::Unreadable { kind: std::io::ErrorKind::NotFound }));
    let whole = std::fs::read(file("bead-quadrilaterals-binary.msh")).unwrap();
    for length in (0..whole.len() - 20).step_by(97) {
        let error = parse(&whole[..length], MILLIMETRE).unwrap_err();
        let expected =
            matches!(error, GmshError::Version { .. } | GmshError::Syntax { .. } | GmshError::MissingSection { .. });
        assert!(expected, "{length}: {error}");
    }
    assert!(matches!(parse(&whole, 0.0), Err(GmshError::Unit { .. })));
}

/// A strip of two squares of side 1 on the axis, written by hand: nodes by number, elements and lines by nodes.
#[derive(Clone)]
struct Strip {
    nodes: Vec<(u64, [f64; 3])>,
    squares: Vec<[u64; 8]>,
    front: Vec<[u64; 3]>,
}

fn strip() -> Strip {
    // Corners 1…6 bottom to top, left then right; middles after them.
    let nodes = [
        (1, [0.0, 0.0]),
        (2, [1.0, 0.0]),
        (3, [0.0, 1.0]),
        (4, [1.0, 1.0]),
        (5, [0.0, 2.0]),
        (6, [1.0, 2.0]),
        (7, [0.5, 0.0]),
        (8, [1.0, 0.5]),
        (9, [0.5, 1.0]),
        (10, [0.0, 0.5]),
        (11, [1.0, 1.5]),
        (12, [0.5, 2.0]),
        (13, [0.0, 1.5]),
    ];
    Strip {
        nodes: nodes.map(|(number, [r, z])| (number, [r, z, 0.0])).to_vec(),
        squares: vec![[1, 2, 4, 3, 7, 8, 9, 10], [3, 4, 6, 5, 9, 11, 12, 13]],
        front: vec![[1, 2, 7]],
    }
}

impl Strip {
    fn text(&self) -> String {
        let mut text =
            "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n1 1 \"front\"\n$EndPhysicalNames\n".to_owned();
        text += "$Entities\n0 1 1 0\n1 0 0 0 1 0 0 1 1 0\n1 0 0 0 1 2 0 0 0\n$EndEntities\n";
        let numbers: Vec<u64> = self.nodes.iter().map(|(number, _)| *number).collect();
        let (low, high) = (numbers.iter().min().unwrap(), numbers.iter().max().unwrap());
        writeln!(text, "$Nodes\n1 {} {low} {high}\n2 1 0 {}", numbers.len(), numbers.len()).unwrap();
        numbers.iter().for_each(|number| writeln!(text, "{number}").unwrap());
        self.nodes.iter().for_each(|(_, [x, y, z])| writeln!(text, "{x} {y} {z}").unwrap());
        let count = self.front.len() + self.squares.len();
        writeln!(text, "$EndNodes\n$Elements\n2 {count} 1 {count}\n1 1 8 {}", self.front.len()).unwrap();
        let mut number = 0;
        let mut line = |text: &mut String, nodes: &[u64]| {
            number += 1;
            let nodes: Vec<String> = nodes.iter().map(u64::to_string).collect();
            writeln!(text, "{number} {}", nodes.join(" ")).unwrap();
        };
        self.front.iter().for_each(|nodes| line(&mut text, nodes));
        writeln!(text, "2 1 16 {}", self.squares.len()).unwrap();
        self.squares.iter().for_each(|nodes| line(&mut text, nodes));
        text + "$EndElements\n"
    }

    fn read(&self) -> Result<(Mesh, Vec<String>), GmshError> {
        parse(self.text().as_bytes(), 1.0)
    }

    fn place(&mut self, number: u64) -> &mut [f64; 3] {
        &mut self.nodes.iter_mut().find(|(other, _)| *other == number).unwrap().1
    }
}

/// Places of an element's nodes, to compare meshes whatever the numbering.
fn outlines(mesh: &Mesh) -> BTreeSet<Vec<[u64; 2]>> {
    let bits = |node: &u32| mesh.nodes[*node as usize].map(f64::to_bits);
    mesh.elements.iter().map(|element| element.nodes().iter().map(bits).collect()).collect()
}

#[test]
fn a_surface_without_group_is_of_the_body_s_own_material() {
    let (mesh, materials) = strip().read().unwrap();
    assert_eq!(materials, [""]);
    assert_eq!((mesh.nodes.len(), mesh.elements.len()), (13, 2));
    assert!((quality(&mesh).volume - 2.0 * PI).abs() < 1e-13);
}

#[test]
fn dense_node_numbers_out_of_order_are_taken_as_written() {
    let mut shuffled = strip();
    shuffled.nodes.reverse();
    shuffled.nodes.swap(2, 8);
    let (mesh, _) = shuffled.read().unwrap();
    assert_eq!(outlines(&mesh), outlines(&strip().read().unwrap().0));
}

#[test]
fn clockwise_elements_are_turned_round() {
    let mut turned = strip();
    turned.squares[1] = [3, 5, 6, 4, 13, 12, 11, 9];
    let (mesh, _) = turned.read().unwrap();
    assert_eq!(outlines(&mesh), outlines(&strip().read().unwrap().0));
}

#[test]
fn nodes_within_rounding_of_the_axis_are_put_on_it() {
    let mut near = strip();
    near.place(10)[0] = -1e-12;
    near.place(3)[0] = 1e-12;
    let (mesh, _) = near.read().unwrap();
    assert_eq!(mesh.nodes.iter().filter(|[r, _]| *r == 0.0).count(), 5);
    near.place(10)[0] = -1e-6;
    assert!(matches!(near.read(), Err(GmshError::BeyondAxis { node: 10, .. })));
}

#[test]
fn nodes_of_no_element_are_dropped() {
    let mut orphan = strip();
    orphan.nodes.push((14, [7.0, 7.0, 0.0]));
    assert_eq!(orphan.read().unwrap().0.nodes.len(), 13);
}

#[test]
fn what_is_no_body_is_refused_with_its_numbers() {
    // Elements 2 and 3 are the squares, 1 is the line.
    let refused = |change: &dyn Fn(&mut Strip)| {
        let mut strip = strip();
        change(&mut strip);
        strip.read().unwrap_err()
    };
    let error = refused(&|strip| strip.place(9)[1] = 2.2);
    assert!(
        matches!(error, GmshError::NegativeJacobian { element: 3, determinant, .. } if determinant <= 0.0),
        "{error}"
    );
    let error = refused(&|strip| strip.squares.push([3, 4, 6, 5, 9, 11, 12, 13]));
    assert!(matches!(error, GmshError::Overlap { element: 4, other: 3, r: 0.5, z: 1.5 }), "{error}");
    let error = refused(&|strip| strip.place(8)[2] = 0.1);
    assert!(matches!(error, GmshError::OffPlane { node: 8, third: 0.1, .. }), "{error}");
    let error = refused(&|strip| strip.squares[1][2] = 99);
    assert!(matches!(error, GmshError::UnknownNode { element: 3, node: 99 }), "{error}");
    let error = refused(&|strip| strip.squares.clear());
    assert!(matches!(error, GmshError::NoElements), "{error}");

    // The upper square on nodes of its own: touching, then apart.
    let apart = |gap: f64| {
        refused(&|strip| {
            for (new, old) in [(14, 3), (15, 4), (16, 9)] {
                let mut place = *strip.place(old);
                place[1] += gap;
                strip.nodes.push((new, place));
            }
            strip.squares[1] = [14, 15, 6, 5, 16, 11, 12, 13];
        })
    };
    let error = apart(0.0);
    assert!(matches!(error, GmshError::Coincident { z: 1.0, .. }), "{error}");
    let error = apart(0.2);
    assert!(matches!(error, GmshError::Separate { element: 3, other: 2, .. }), "{error}");
}

#[test]
fn curves_that_are_no_boundary_are_refused_with_their_line() {
    let refused = |front: &[[u64; 3]]| Strip { front: front.to_vec(), ..strip() }.read().unwrap_err();
    let error = refused(&[[3, 4, 9]]);
    assert!(
        matches!(&error, GmshError::NotOnSurface { boundary, element: 1, sides: 2, .. } if boundary == "front"),
        "{error}"
    );
    // Corners of one side, middle of another.
    let error = refused(&[[1, 2, 8]]);
    assert!(matches!(error, GmshError::NotOnSurface { sides: 0, .. }), "{error}");
    let error = refused(&[[1, 2, 7], [5, 6, 12]]);
    assert!(matches!(error, GmshError::NotOneCurve { found: "several pieces", .. }), "{error}");
    let round = [[1, 2, 7], [2, 4, 8], [4, 6, 11], [6, 5, 12], [5, 3, 13], [3, 1, 10]];
    let error = refused(&round);
    assert!(matches!(error, GmshError::NotOneCurve { found: "a closed curve", .. }), "{error}");
    let named = strip().text().replace("front", "somewhere");
    let error = parse(named.as_bytes(), 1.0).unwrap_err();
    assert!(matches!(&error, GmshError::NoContactBoundary { found } if found == &["somewhere"]), "{error}");
}

#[test]
fn lines_in_any_order_and_direction_make_one_boundary_from_the_axis_outwards() {
    let front = vec![[4, 2, 8], [2, 1, 7], [4, 6, 11]];
    let (mesh, _) = Strip { front, ..strip() }.read().unwrap();
    let expected = [[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0], [1.0, 1.5], [1.0, 2.0]];
    assert_eq!(along(&mesh, "front"), expected);
}
