//! Elements and bodies: patch tests, manufactured solutions, mass, refusals.

use std::f64::consts::{PI, TAU};

use faer::{Mat, linalg::solvers::Solve as _};
use granchain::{
    model::fea::{
        assembly::{Columns, DofMap},
        body::{Body, BodyError},
        element::{ElementError, elasticity, interpolate, von_mises},
        factor::Factor,
        mesh::{BeadMesh, Boundary, Mesh, bead},
    },
    scene::Material,
};

fn soft(poissons_ratio: f64) -> Material {
    Material { name: "soft".into(), youngs_modulus: 1.0, poissons_ratio, density: 2.5 }
}

/// The rectangle inner ≤ r ≤ inner + 1, 0 ≤ z ≤ 1 in n × n cells; `place` moves the nodes.
/// Its whole surface is one boundary, its top another.
fn block(n: usize, inner: f64, place: impl Fn(f64, f64) -> [f64; 2]) -> Mesh {
    let side = 2 * n + 1;
    let mut number = vec![u32::MAX; side * side];
    let mut nodes = Vec::new();
    for j in 0..side {
        for i in 0..side {
            if i % 2 == 0 || j % 2 == 0 {
                number[j * side + i] = nodes.len() as u32;
                nodes.push(place(inner + i as f64 / (side - 1) as f64, j as f64 / (side - 1) as f64));
            }
        }
    }
    let at = |i: usize, j: usize| number[j * side + i];
    let mut elements = Vec::new();
    for j in (0..side - 1).step_by(2) {
        for i in (0..side - 1).step_by(2) {
            let nodes = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)];
            elements.push(nodes.map(|(a, b)| at(i + a, j + b)));
        }
    }
    let last = side - 1;
    let run = |name: &str, places: Vec<(usize, usize)>| Boundary {
        name: name.into(),
        nodes: places.into_iter().map(|(i, j)| at(i, j)).collect(),
    };
    let around = (0..last).map(|k| (k, 0)).chain((0..last).map(|k| (last, k)));
    let around = around.chain((0..last).map(|k| (last - k, last))).chain((0..last).map(|k| (0, last - k)));
    let boundaries = vec![run("surface", around.collect()), run("top", (0..side).map(|i| (i, last)).collect())];
    Mesh { nodes, elements, boundaries }
}

/// Nodes moved off their grid, middles too (curved sides), and the outer side bent by `bend`; bottom, top and axis stay straight.
fn distorted(inner: f64, bend: f64) -> impl Fn(f64, f64) -> [f64; 2] {
    move |r, z| {
        let x = r - inner;
        let inside = 4.0 * x * (1.0 - x) * (1.0 - z) * z;
        let wobble = |p: f64, q: f64| (37.0 * p * x + 23.0 * q * z).sin();
        [r + 0.12 * inside * wobble(1.0, 1.3) + bend * x * x * z * (1.0 - z), z + 0.12 * inside * wobble(0.7, 1.1)]
    }
}

fn body(mesh: Mesh, material: Material, clamped: &[&str]) -> Body {
    Body::new(mesh, &material, clamped, &[]).unwrap()
}

fn field(mesh: &Mesh, u: impl Fn(f64, f64) -> [f64; 2]) -> Columns {
    let values: Vec<f64> = mesh.nodes.iter().flat_map(|&[r, z]| u(r, z)).collect();
    Columns::from_vector(&values)
}

fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().fold(0.0, |most, value| most.max(value.abs()))
}

/// u inside from u on the surface and volume forces: K_ii w = f − K u_g with u_g any field of the right surface values.
fn solve_inside(mesh: &Mesh, material: &Material, given: &Columns, force: &Columns) -> Columns {
    let whole = body(mesh.clone(), material.clone(), &[]);
    let held = body(mesh.clone(), material.clone(), &["surface"]);
    let mut load = held.columns(1);
    whole.multiply_stiffness(given, &mut load);
    let rest: Vec<f64> = load.as_slice().iter().zip(force.as_slice()).map(|(load, force)| force - load).collect();
    let factor = Factor::new(&held, 1.0, 0.0, &[]).unwrap();
    let mut u = held.columns(1);
    factor.solve(&Columns::from_vector(&rest), &mut factor.half(1), &mut u);
    let sum: Vec<f64> = u.as_slice().iter().zip(given.as_slice()).map(|(u, given)| u + given).collect();
    Columns::from_vector(&sum)
}

#[test]
fn patch_tests_hold_on_distorted_curved_meshes() {
    let material = soft(0.3);
    for (radial, axial) in [(0.0, 1.0), (1.0, 0.0), (0.7, -0.4)] {
        let strain = [radial, axial, radial, 0.0];
        let d = elasticity(&material);
        let stress = d.map(|row| row.iter().zip(strain).map(|(d, e)| d * e).sum::<f64>());
        for (inner, bend) in [(0.0, 0.0), (0.0, 0.3), (0.4, 0.0), (0.4, 0.3)] {
            let mesh = block(3, inner, distorted(inner, bend));
            let whole = body(mesh.clone(), material.clone(), &[]);
            let exact = field(&mesh, |r, z| [radial * r, 0.1 + axial * z]);

            // Surface given, inside solved from a start that is wrong inside.
            let surface = &mesh.boundary("surface").unwrap().nodes;
            let mut given = field(&mesh, |_, _| [0.0; 2]);
            for &node in surface {
                for dof in [2 * node as usize, 2 * node as usize + 1] {
                    given.set(dof, 0, exact.get(dof, 0));
                }
            }
            let u = solve_inside(&mesh, &material, &given, &whole.columns(1));
            let error = largest(u.as_slice().iter().zip(exact.as_slice()).map(|(a, b)| a - b));
            // Rounding times a condition number of about 1e2.
            assert!(error < 1e-13, "{inner}: displacement {error:e}");

            let mut force = whole.columns(1);
            whole.multiply_stiffness(&u, &mut force);
            let area = PI * ((1.0 + inner).powi(2) - inner.powi(2));
            let pull: f64 =
                mesh.boundary("top").unwrap().nodes.iter().map(|&node| force.get(2 * node as usize + 1, 0)).sum();
            // A bent side leans on the top's outermost node too.
            let is_sound = (pull - stress[1] * area).abs() < 1e-12;
            assert!(is_sound || bend != 0.0, "{inner}: reaction {pull}");

            let recovered = whole.stress(&u, 0);
            for (node, at) in recovered.iter().enumerate() {
                let error = largest(at.iter().zip(stress).map(|(a, b)| a - b));
                assert!(error < 1e-12, "{inner}: stress at node {node} {error:e}");
            }
            assert!((von_mises(recovered[0]) - (stress[1] - stress[0]).abs()).abs() < 1e-12);
        }
    }
}

/// Four-point Gauss rule, exact to degree 7: unlike the elements' own points it sees the cubic part of the error.
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Calls `visit` at 16 points of each element: its nodes, the shape functions, (r, z) and the volume they stand for.
fn at_points(mesh: &Mesh, mut visit: impl FnMut(&[u32], &[f64; 8], [f64; 2], f64)) {
    for element in &mesh.elements {
        for (x, along) in GAUSS_4 {
            for (y, across) in GAUSS_4 {
                let at = interpolate(x, y);
                let mut place = [0.0; 2];
                let mut map = [[0.0; 2]; 2];
                for (node, &number) in element.iter().enumerate() {
                    for (a, x) in mesh.nodes[number as usize].into_iter().enumerate() {
                        place[a] += at.value[node] * x;
                        map[a][0] += at.slope[node][0] * x;
                        map[a][1] += at.slope[node][1] * x;
                    }
                }
                let jacobian = map[0][0] * map[1][1] - map[0][1] * map[1][0];
                visit(element, &at.value, place, along * across * jacobian * TAU * place[0]);
            }
        }
    }
}

/// L2 error of the displacement with the exact one given on the surface, ∫|u − u_exact|² 2πr dr dz.
fn error_inside(
    mesh: &Mesh,
    material: &Material,
    exact: impl Fn(f64, f64) -> [f64; 2],
    force: impl Fn(f64, f64) -> [f64; 2],
) -> f64 {
    let mut load = Columns::new(2 * mesh.nodes.len(), 1);
    at_points(mesh, |nodes, values, [r, z], volume| {
        let force = force(r, z);
        for (&node, value) in nodes.iter().zip(values) {
            for (d, force) in force.into_iter().enumerate() {
                load.row_mut(2 * node as usize + d)[0] += volume * value * force;
            }
        }
    });
    let u = solve_inside(mesh, material, &field(mesh, &exact), &load);
    let mut square = 0.0;
    at_points(mesh, |nodes, values, [r, z], volume| {
        let exact = exact(r, z);
        for (d, exact) in exact.into_iter().enumerate() {
            let found: f64 =
                nodes.iter().zip(values).map(|(&node, value)| value * u.get(2 * node as usize + d, 0)).sum();
            square += volume * (found - exact).powi(2);
        }
    });
    square.sqrt()
}

#[test]
fn a_manufactured_solution_converges_with_the_third_power_of_the_element_size() {
    // u = (r cos r sin z, cos r cos z); forces from −div σ by hand.
    let material = soft(0.3);
    let [[on, lame, ..], _, _, [_, _, _, shear]] = elasticity(&material);
    let exact = |r: f64, z: f64| [r * r.cos() * z.sin(), r.cos() * z.cos()];
    let force = |r: f64, z: f64| {
        let slope = r.cos() - r * r.sin();
        let bend = -2.0 * r.sin() - r * r.cos();
        let radial = on * bend - shear * (r * r.cos() - r.sin()) - 2.0 * shear * r.sin();
        let axial = shear * (r.cos() - r.sin() / r - r * r.sin()) + lame * slope - 2.0 * shear * r.cos();
        [-z.sin() * radial, -z.cos() * axial]
    };
    for inner in [0.0, 0.3] {
        let errors: Vec<f64> = [6, 12, 24]
            .map(|n| error_inside(&block(n, inner, |r, z| [r, 0.8 * z + 0.25 * r]), &material, exact, force))
            .to_vec();
        for pair in errors.windows(2) {
            let slope = (pair[0] / pair[1]).log2();
            assert!((slope - 3.0).abs() < 0.1, "from r = {inner}: slope {slope}, errors {errors:?}");
        }
    }
}

#[test]
fn nearly_incompressible_material_costs_no_accuracy() {
    // u = (−2 r³ z, 4 r² z²) changes no volume, so its forces −μ ∇²u and its error without locking do not depend on ν but through μ.
    let exact = |r: f64, z: f64| [-2.0 * r * r * r * z, 4.0 * r * r * z * z];
    let error = |n: usize, ratio: f64| {
        let shear = 0.5 / (1.0 + ratio);
        let force = |r: f64, z: f64| [16.0 * shear * r * z, -shear * (16.0 * z * z + 8.0 * r * r)];
        error_inside(&block(n, 0.0, |r, z| [r, 0.8 * z + 0.25 * r]), &soft(ratio), exact, force)
    };
    let (usual, near) = (error(12, 0.3), error(12, 0.4999));
    let slope = (error(6, 0.4999) / near).log2();
    let ratios = (error(12, 0.45) / usual, near / usual);
    // Measured: 1.002 and 1.001, converging with h³. With full integration it were 3.9 and
    // 9.2, converging with h²; locking would be a factor of 1/(1 − 2ν) = 5000.
    assert!(ratios.0 < 1.03 && (ratios.1 - 1.0).abs() < 0.02, "{ratios:?}");
    assert!((slope - 3.0).abs() < 0.1, "slope {slope}");
}

#[test]
fn mass_and_rigid_translation_are_exact() {
    let material = soft(0.3);
    for contact in [&[][..], &["top"]] {
        let mesh = block(4, 0.0, |r, z| [1.3 * r, z + 0.1 * r * z * (1.0 - z)]);
        let body = Body::new(mesh, &material, &[], contact).unwrap();
        let exact = PI * 1.3 * 1.3 * material.density;
        assert!((body.total_mass() / exact - 1.0).abs() < 1e-14);
        let rigid = Columns::from_vector(&body.rigid());
        let mut out = body.columns(1);
        body.multiply_stiffness(&rigid, &mut out);
        // Rounding of entries of order one.
        assert!(largest(out.as_slice().iter().copied()) < 1e-13);
        body.multiply_mass(&rigid, &mut out);
        let weight: f64 = out.as_slice().iter().sum();
        assert!((weight / exact - 1.0).abs() < 1e-14);
        let mut mean = [0.0];
        body.mass_mean(&rigid, &mut mean);
        assert!((mean[0] - 1.0).abs() < 1e-14);
        let top = body.mesh().boundary("top").unwrap().nodes[3];
        assert_eq!(body.node_mass()[top as usize] == 0.0, !contact.is_empty());
        assert!(body.is_free() && !body.dofs().is_free(0) && body.dofs().is_free(1));
    }
}

#[test]
fn the_mass_mean_is_the_mass_weighted_mean_of_each_column() {
    let body = body(block(6, 0.2, |r, z| [r, z]), soft(0.3), &[]);
    let mut u = body.columns(3);
    u.set_column(0, field(body.mesh(), |r, z| [r, z]).as_slice());
    u.set_column(2, field(body.mesh(), |_, z| [5.0, z * z]).as_slice());
    let mut mean = vec![f64::NAN; u.width()];
    body.mass_mean(&u, &mut mean);
    // ∫z and ∫z² over 0…1: quadratics are in the space and its products are integrated exactly on rectangles.
    for (column, exact) in [0.5, 0.0, 1.0 / 3.0, 0.0].into_iter().enumerate() {
        assert!((mean[column] - exact).abs() < 1e-14, "column {column}: {}", mean[column]);
    }
}

#[test]
fn the_mass_of_a_bead_is_that_of_the_sphere() {
    for (density, within) in [(8, 3e-4), (12, 3e-4), (24, 3e-4)] {
        let mesh = bead(0.5e-3, &BeadMesh::of_density(density)).unwrap();
        let bead = Body::new(mesh, &Material::chrome_steel(), &[], &["front", "back"]).unwrap();
        let error = bead.total_mass() / 4.101_349_209e-6 - 1.0;
        assert!(error.abs() < within, "n = {density}: {error:e}");
    }
}

#[test]
fn meshes_and_materials_that_make_no_body_are_refused_with_the_place() {
    let sound = block(3, 0.0, |r, z| [r, z]);
    let make = |mesh: &Mesh, material: &Material, clamped: &[&str], contact: &[&str]| {
        Body::new(mesh.clone(), material, clamped, contact).unwrap_err()
    };

    let mut folded = sound.clone();
    let corner = folded.elements[4][2] as usize;
    folded.nodes[corner] = [0.05, 0.05];
    let refusal = make(&folded, &soft(0.3), &[], &[]);
    let BodyError::Element { element: 4, source: ElementError::Jacobian { r, z, jacobian } } = refusal else {
        panic!("{refusal}")
    };
    assert!(jacobian <= 0.0 && (0.0..0.7).contains(&r) && (0.0..0.7).contains(&z));
    assert!(refusal.to_string().contains("element 4: at r = "), "{refusal}");

    let mut across = sound.clone();
    across.nodes[0] = [-0.1, 0.0];
    assert!(matches!(make(&across, &soft(0.3), &[], &[]), BodyError::NodePlace { node: 0, .. }));
    let mut loose = sound.clone();
    loose.nodes.push([0.5, 0.5]);
    assert!(matches!(make(&loose, &soft(0.3), &[], &[]), BodyError::LooseNode { .. }));

    for (clamped, contact) in [(["rim"].as_slice(), [].as_slice()), (&[], &["rim"])] {
        let refusal = make(&sound, &soft(0.3), clamped, contact);
        assert!(matches!(&refusal, BodyError::Boundary { boundary, known } if boundary == "rim" && known.len() == 2));
    }
    for void in [0.5, 0.7, -1.0, f64::NAN] {
        assert!(matches!(
            make(&sound, &soft(void), &[], &[]),
            BodyError::Unphysical { quantity: "poissons_ratio", .. }
        ));
    }
    // One cell: all its nodes lie on the surface.
    let cell = block(1, 0.0, |r, z| [r, z]);
    assert_eq!(make(&cell, &soft(0.3), &[], &["surface"]), BodyError::MasslessElement { element: 0 });
}

#[test]
fn the_assembled_matrices_are_symmetric_and_definite_where_they_should_be() {
    let mesh = block(2, 0.0, distorted(0.0, 0.3));
    let body = body(mesh, soft(0.3), &["top"]);
    let free = body.dofs().free();
    let stiffness = Mat::from_fn(free.len(), free.len(), |i, j| body.stiffness().get(free[i], free[j]));
    let least = stiffness.self_adjoint_eigenvalues(faer::Side::Lower).unwrap()[0];
    assert!(least > 1e-4, "held at the top, it has no motion without strain: {least}");
    let load = Mat::from_fn(free.len(), 1, |i, _| f64::from(free[i]).sin());
    let exact = stiffness.llt(faer::Side::Lower).unwrap().solve(&load);
    let mut given = body.columns(1);
    free.iter().enumerate().for_each(|(i, &dof)| given.set(dof as usize, 0, load[(i, 0)]));
    let factor = Factor::new(&body, 1.0, 0.0, &[]).unwrap();
    let mut u = body.columns(1);
    factor.solve(&given, &mut factor.half(1), &mut u);
    for (i, &dof) in free.iter().enumerate() {
        assert!((u.get(dof as usize, 0) - exact[(i, 0)]).abs() < 1e-12 * exact.norm_max());
    }
    assert_eq!(DofMap::dof(3, DofMap::place(7).1), 7);
}
