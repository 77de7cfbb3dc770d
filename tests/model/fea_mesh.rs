//! The meshes of the contact FEA: geometry, symmetry, grading and conformity.

use std::{
    collections::{BTreeMap, BTreeSet},
    f64::consts::PI,
};

use granchain::model::fea::mesh::{
    AnnulusMesh, BeadMesh, Boundary, HalfTorus, Mesh, MeshError, annulus, bead, quality,
};

const RADIUS: f64 = 0.5e-3;
const SPHERE: f64 = 4.0 / 3.0 * PI * RADIUS * RADIUS * RADIUS;

fn bead_of(density: usize) -> Mesh {
    bead(RADIUS, &BeadMesh::of_density(density)).unwrap()
}

fn annulus_of(density: usize) -> Mesh {
    annulus(&HalfTorus::published(), &AnnulusMesh::of_density(density)).unwrap()
}

fn bodies(density: usize) -> [Mesh; 2] {
    [bead_of(density), annulus_of(density)]
}

/// Sides as (smaller corner, larger corner) → the middles the elements give it.
fn sides(mesh: &Mesh) -> BTreeMap<(u32, u32), Vec<u32>> {
    let mut sides = BTreeMap::<_, Vec<u32>>::new();
    for element in &mesh.elements {
        for i in 0..4 {
            let (a, b) = (element[i], element[(i + 1) % 4]);
            sides.entry((a.min(b), a.max(b))).or_default().push(element[4 + i]);
        }
    }
    sides
}

/// Nodal weights ∫ N_i 2πr dr of a boundary under a pressure along z.
fn weights(mesh: &Mesh, boundary: &Boundary) -> Vec<f64> {
    let mut weights = vec![0.0; boundary.nodes.len()];
    let root = (3.0_f64 / 5.0).sqrt();
    for start in (0..boundary.nodes.len() - 1).step_by(2) {
        let r: Vec<f64> = (0..3).map(|i| mesh.nodes[boundary.nodes[start + i] as usize][0]).collect();
        for (x, w) in [(-root, 5.0 / 9.0), (0.0, 8.0 / 9.0), (root, 5.0 / 9.0)] {
            let n = [0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)];
            let d = [x - 0.5, -2.0 * x, x + 0.5];
            let sum = |c: &[f64; 3]| c.iter().zip(&r).map(|(c, r)| c * r).sum::<f64>();
            for i in 0..3 {
                weights[start + i] += w * n[i] * 2.0 * PI * sum(&n) * sum(&d);
            }
        }
    }
    weights
}

#[test]
fn volumes_converge_to_the_exact_ones() {
    // Quadratic sides: the surface errs by O(h⁴) at least; a factor of 8 a doubling is short of the 16 of full order only by the layers' rounding to whole numbers.
    let torus = HalfTorus::published();
    let bead = |n| quality(&bead_of(n)).volume_error(SPHERE).abs();
    let annulus = |n| quality(&annulus_of(n)).volume_error(torus.volume()).abs();
    // From n = 12 on all layers shrink together.
    for errors in [[bead(12), bead(24)], [annulus(12), annulus(24)]] {
        assert!(errors[0] < 3e-5 && errors[0] > 8.0 * errors[1], "{errors:?}");
    }
}

#[test]
fn jacobians_are_positive_at_every_density() {
    for density in 2..=24 {
        for mesh in bodies(density) {
            mesh.check().unwrap();
            let worst = quality(&mesh).worst_jacobian_ratio;
            assert!(worst > 0.08, "density {density}: {worst}");
        }
    }
}

#[test]
fn the_bead_is_its_own_mirror_image_to_the_last_bit() {
    let mesh = bead_of(12);
    // Adding 0 makes −0 the same as 0.
    let bits = |node: u32, sign: f64| {
        let [r, z] = mesh.nodes[node as usize];
        [r.to_bits(), (sign * z + 0.0).to_bits()]
    };
    let set = |sign: f64| -> BTreeSet<Vec<[u64; 2]>> {
        mesh.elements
            .iter()
            .map(|element| {
                let mut nodes: Vec<_> = element.iter().map(|node| bits(*node, sign)).collect();
                nodes.sort();
                nodes
            })
            .collect()
    };
    assert_eq!(set(1.0), set(-1.0));
    let along = |name: &str, sign| -> Vec<_> {
        mesh.boundary(name).unwrap().nodes.iter().map(|node| bits(*node, sign)).collect()
    };
    assert_eq!(along("front", 1.0), along("back", -1.0));
    let mut turned = along("side", -1.0);
    turned.reverse();
    assert_eq!(along("side", 1.0), turned);
}

#[test]
fn surface_nodes_lie_on_the_circle_to_rounding() {
    let mesh = bead_of(12);
    for boundary in ["front", "side", "back"].map(|name| mesh.boundary(name).unwrap()) {
        for node in &boundary.nodes {
            let [r, z] = mesh.nodes[*node as usize];
            assert!((r.hypot(z) / RADIUS - 1.0).abs() < 4.0 * f64::EPSILON, "{}: {r} {z}", boundary.name);
        }
    }
    let torus = HalfTorus::published();
    let mesh = annulus_of(12);
    for node in &mesh.boundary("contact").unwrap().nodes {
        let [r, z] = mesh.nodes[*node as usize];
        let distance = (r - torus.ring_radius).hypot(z) / torus.section_radius;
        // R is 2.2 section radii: its rounding is too.
        assert!((distance - 1.0).abs() < 8.0 * f64::EPSILON, "{r} {z}");
    }
    assert!(mesh.boundary("clamped").unwrap().nodes.iter().all(|n| mesh.nodes[*n as usize][0] == torus.ring_radius));
}

#[test]
fn boundaries_begin_at_the_pole_and_cover_the_surface_without_a_gap() {
    let mesh = bead_of(12);
    let place = |node: u32| mesh.nodes[node as usize];
    let (front, back, side) =
        (mesh.boundary("front").unwrap(), mesh.boundary("back").unwrap(), mesh.boundary("side").unwrap());
    assert_eq!(place(front.nodes[0]), [0.0, -RADIUS]);
    assert_eq!(place(back.nodes[0]), [0.0, RADIUS]);
    assert_eq!((front.nodes.len(), back.nodes.len()), (49, 49));
    assert_eq!(front.nodes.last(), side.nodes.first());
    assert_eq!(back.nodes.last(), side.nodes.last());
    for boundary in [front, back] {
        assert!(boundary.nodes.windows(2).all(|pair| place(pair[0])[0] < place(pair[1])[0]));
    }
    assert!(side.nodes.windows(2).all(|pair| place(pair[0])[1] < place(pair[1])[1]));
    // Every side of one element only lies on the axis or on a boundary.
    let named: BTreeSet<u32> = mesh.boundaries.iter().flat_map(|boundary| boundary.nodes.iter().copied()).collect();
    for (_, middles) in sides(&mesh).iter().filter(|(_, middles)| middles.len() == 1) {
        assert!(named.contains(&middles[0]) || place(middles[0])[0] == 0.0);
    }

    let torus = HalfTorus::published();
    let mesh = annulus_of(12);
    let contact = &mesh.boundary("contact").unwrap().nodes;
    assert_eq!(contact.len(), 49);
    assert!(contact.windows(2).all(|pair| mesh.nodes[pair[0] as usize][0] < mesh.nodes[pair[1] as usize][0]));
    let middle = mesh.nodes[contact[24] as usize];
    let [r, z] = torus.contact_point();
    assert!((middle[0] - r).hypot(middle[1] - z) < 1e-15 * 1e-3 * 10.0);
    // The published reading: on the circle r = 0.367 mm, 0.510 mm below the plane of the torus, 47.2° from the axis.
    assert!((r - 0.367e-3).abs() < 0.5e-6 && (torus.bead_centre() + 0.510e-3).abs() < 0.5e-6);
    assert!(((-torus.normal()[0]).atan2(-torus.normal()[1]).to_degrees() - 47.2).abs() < 0.05);
    let reach = |node: u32| (mesh.nodes[node as usize][0] - r).hypot(mesh.nodes[node as usize][1] - z);
    for end in [contact[0], contact[48]] {
        // 30 µm is along the arc: the chord is shorter by (0.12)²/24.
        assert!((reach(end) / 30e-6 - 1.0).abs() < 1e-3, "{}", reach(end));
    }
    let clamped = &mesh.boundary("clamped").unwrap().nodes;
    let ends = [clamped[0], clamped[clamped.len() - 1]].map(|node| mesh.nodes[node as usize]);
    assert_eq!(ends, [[0.55e-3, -0.25e-3], [0.55e-3, 0.25e-3]]);
    assert!(clamped.windows(2).all(|pair| mesh.nodes[pair[0] as usize][1] < mesh.nodes[pair[1] as usize][1]));
}

#[test]
fn a_middle_node_of_a_pole_patch_has_the_mean_radius_of_its_neighbours() {
    let mesh = bead_of(12);
    for name in ["front", "back"] {
        let nodes = &mesh.boundary(name).unwrap().nodes;
        for start in (0..nodes.len() - 1).step_by(2) {
            let r = |i: usize| mesh.nodes[nodes[start + i] as usize][0];
            assert_eq!(r(1), 0.5 * (r(0) + r(2)));
        }
    }
}

#[test]
fn nodal_weights_of_a_pole_patch_are_as_one_to_four_and_zero_at_the_pole() {
    let mesh = bead_of(12);
    let back = mesh.boundary("back").unwrap();
    let weights = weights(&mesh, back);
    let r = |i: usize| mesh.nodes[back.nodes[i] as usize][0];
    let patch = PI * r(48) * r(48);
    // ∫ N 2πr dr with the middle at the mean radius: 2π L (r₁, 2 (r₁ + r₂), r₂)/6 with L the edge's length.
    assert!(weights[0].abs() < 1e-15 * patch, "{}", weights[0]);
    for i in (1..48).step_by(2) {
        let edge = r(i + 1) - r(i - 1);
        assert!((weights[i] / (4.0 / 6.0 * 2.0 * PI * r(i) * edge) - 1.0).abs() < 1e-12);
    }
    for i in (2..48).step_by(2) {
        let edges = r(i + 2) - r(i - 2);
        assert!((weights[i] / (1.0 / 6.0 * 2.0 * PI * r(i) * edges) - 1.0).abs() < 1e-12);
    }
    assert!((weights.iter().sum::<f64>() / patch - 1.0).abs() < 1e-12);
}

#[test]
fn surface_vertices_follow_the_power_law_and_grow_smoothly_into_the_strip() {
    for density in [8, 12, 16, 24] {
        let mesh = bead_of(density);
        let r = |node: u32| mesh.nodes[node as usize][0];
        let back: Vec<u32> = mesh.boundary("back").unwrap().nodes.iter().copied().step_by(2).collect();
        for (i, node) in back.iter().enumerate() {
            let expected = 0.1 * RADIUS * (i as f64 / (2 * density) as f64).powf(1.6);
            assert!((r(*node) - expected).abs() <= 4.0 * f64::EPSILON * expected, "{i}");
        }
        // Along the surface s = artanh(z/a): layers of the strip.
        let side: Vec<u32> = mesh.boundary("side").unwrap().nodes.iter().copied().step_by(2).collect();
        let s: Vec<f64> = side.iter().map(|node| (mesh.nodes[*node as usize][1] / RADIUS).atanh()).collect();
        assert_eq!(s[s.len() / 2], 0.0, "no vertex on the equator");
        let layers: Vec<f64> = s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let last = (r(back[2 * density]) / r(back[2 * density - 1])).ln();
        assert!(layers[0] < 1.16 * last && layers[0] > 0.85 * last, "{} after {last}", layers[0]);
        for pair in layers.windows(2) {
            let growth = (pair[1] / pair[0]).max(pair[0] / pair[1]);
            assert!(growth < 1.15 + 1e-6, "{growth}");
        }
    }
}

#[test]
fn a_node_stands_at_the_centre_of_the_bead() {
    assert!(bead_of(12).nodes.contains(&[0.0, 0.0]));
}

#[test]
fn no_two_nodes_coincide_and_every_node_is_used() {
    for mesh in bodies(12) {
        let apart = 1e-3 * quality(&mesh).shortest_side;
        let mut order: Vec<_> = mesh.nodes.clone();
        order.sort_by(|a, b| a[0].total_cmp(&b[0]));
        for (i, a) in order.iter().enumerate() {
            for b in order[i + 1..].iter().take_while(|b| b[0] - a[0] < apart) {
                assert!((b[1] - a[1]).abs() > apart, "{a:?} {b:?}");
            }
        }
        let used: BTreeSet<u32> = mesh.elements.iter().flat_map(|element| element.to_vec()).collect();
        assert_eq!(used.len(), mesh.nodes.len());
    }
}

#[test]
fn every_inner_side_is_shared_by_two_elements_with_one_middle() {
    for mesh in bodies(12) {
        let mut outer = 0;
        for (side, middles) in sides(&mesh) {
            assert!(middles.iter().all(|middle| *middle == middles[0]), "{side:?}");
            match middles.len() {
                1 => outer += 1,
                2 => {}
                count => panic!("{count} elements on side {side:?}"),
            }
        }
        // Euler: a disc has V − E + F = 1 with corners, sides and elements.
        let corners: BTreeSet<u32> = mesh.elements.iter().flat_map(|element| element[..4].to_vec()).collect();
        let count = sides(&mesh).len();
        assert_eq!(corners.len() + mesh.elements.len(), count + 1);
        assert!(outer > 0 && corners.len() + count == mesh.nodes.len());
    }
}

#[test]
fn the_default_bead_has_the_size_it_was_designed_for() {
    let found = quality(&bead_of(12));
    // About 1,600 elements and 10,000 unknowns; 49 contact nodes a pole.
    assert!((1500..1750).contains(&found.elements), "{}", found.elements);
    assert!((9_000..10_600).contains(&found.unknowns), "{}", found.unknowns);
    assert_eq!(found.contact_nodes, 98);
}

#[test]
fn settings_out_of_range_are_refused_with_what_was_found() {
    let refused = bead(RADIUS, &BeadMesh::of_density(1)).unwrap_err();
    assert!(matches!(refused, MeshError::Parameter { body: "bead", found: 1.0, .. }), "{refused}");
    let refused = bead(-1.0, &BeadMesh::of_density(8)).unwrap_err();
    assert_eq!(refused.to_string(), "mesh of the bead: expected a radius (m) above 0, found -1e0");
    let small = HalfTorus { bead_radius: 0.2e-3, ..HalfTorus::published() };
    let refused = annulus(&small, &AnnulusMesh::of_density(8)).unwrap_err();
    assert!(matches!(refused, MeshError::Parameter { found: 0.2e-3, .. }), "{refused}");
}

#[test]
fn an_element_inside_out_is_named_with_its_place() {
    let mut mesh = bead_of(4);
    mesh.elements[7][..4].reverse();
    let MeshError::NegativeJacobian { element, r, z, determinant } = mesh.check().unwrap_err() else { panic!() };
    assert_eq!(element, 8);
    assert!(determinant < 0.0 && r >= 0.0 && r.hypot(z) < 1.001 * RADIUS);
}
