//! The factor of a body: solves, interface, static loads, against dense algebra.

use faer::{Mat, linalg::solvers::Solve as _};
use granchain::{
    model::fea::{
        assembly::{Columns, DofMap},
        body::Body,
        factor::{Factor, FactorError, StaticFactor, eigenvalues_below},
        mesh::{Boundary, Mesh},
    },
    scene::Material,
};

/// A cylinder of unit radius and height 2 in n × 2n quadrilaterals of a wavy grid, with its top and bottom as boundaries.
fn cylinder(n: usize) -> Mesh {
    let (columns, rows) = (2 * n + 1, 4 * n + 1);
    let mut number = vec![u32::MAX; columns * rows];
    let mut nodes = Vec::new();
    for j in 0..rows {
        for i in 0..columns {
            if i % 2 == 0 || j % 2 == 0 {
                number[j * columns + i] = nodes.len() as u32;
                let (x, y) = (i as f64 / (columns - 1) as f64, 2.0 * j as f64 / (rows - 1) as f64);
                let wave = 0.03 * (3.0 * x).sin() * (2.0 * y).sin();
                nodes.push([x * (1.0 + wave), y + wave]);
            }
        }
    }
    let at = |i: usize, j: usize| number[j * columns + i];
    let mut elements = Vec::new();
    for j in (0..rows - 1).step_by(2) {
        for i in (0..columns - 1).step_by(2) {
            let nodes = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)].map(|(a, b)| at(i + a, j + b));
            elements.push(nodes);
        }
    }
    let run = |name: &str, j| Boundary { name: name.into(), nodes: (0..columns).map(|i| at(i, j)).collect() };
    Mesh { nodes, elements, boundaries: vec![run("bottom", 0), run("top", rows - 1)] }
}

fn soft() -> Material {
    Material { name: "soft".into(), youngs_modulus: 1.0, poissons_ratio: 0.3, density: 1.0 }
}

/// Boundaries that carry no mass.
const ENDS: [&str; 2] = ["bottom", "top"];

fn free_body(n: usize, contact: &[&str]) -> Body {
    Body::new(cylinder(n), &soft(), &[], contact).unwrap()
}

/// Axial unknowns of both ends, with two radial ones among them, in no order.
fn interface(body: &Body) -> Vec<u32> {
    let mut dofs = Vec::new();
    for name in ["top", "bottom"] {
        dofs.extend(body.mesh().boundary(name).unwrap().nodes.iter().rev().map(|node| 2 * node + 1));
        dofs.push(2 * body.mesh().boundary(name).unwrap().nodes[2]);
    }
    dofs
}

/// κ K + σ M, dense, with a unit diagonal on fixed unknowns.
fn dense(body: &Body, stiffness_scale: f64, mass_scale: f64) -> Mat<f64> {
    Mat::from_fn(body.dofs().len(), body.dofs().len(), |row, column| {
        let (i, j) = (row as u32, column as u32);
        if !body.dofs().is_free(i) || !body.dofs().is_free(j) {
            return f64::from(u8::from(i == j));
        }
        let mass = if i % 2 == j % 2 { body.mass().get(i / 2, j / 2) } else { 0.0 };
        stiffness_scale * body.stiffness().get(i, j) + mass_scale * mass
    })
}

fn loads(body: &Body, count: usize) -> Columns {
    let mut load = body.columns(count);
    for &dof in body.dofs().free() {
        for column in 0..count {
            load.set(dof as usize, column, (f64::from(dof) * 0.37 + column as f64).sin());
        }
    }
    load
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most, value| most.max(value.abs()))
}

#[test]
fn solves_of_any_number_of_columns_are_the_dense_solution() {
    for mass in [&ENDS[..], &[]] {
        let body = free_body(3, mass);
        let factor = Factor::new(&body, 1.0, 2.0, &interface(&body)).unwrap();
        let matrix = dense(&body, 1.0, 2.0);
        let inverse = matrix.partial_piv_lu();
        for count in [1, 2, 3, 6, 8, 13] {
            let load = loads(&body, count);
            let (mut y, mut u) = (factor.half(count), body.columns(count));
            factor.solve(&load, &mut y, &mut u);
            for column in 0..count {
                let exact = inverse.solve(Mat::from_fn(load.rows(), 1, |row, _| load.get(row, column)));
                let scale = largest((0..load.rows()).map(|row| exact[(row, 0)]));
                let error = largest((0..load.rows()).map(|row| u.get(row, column) - exact[(row, 0)]));
                // Condition number about 1e3 times rounding of the two factors.
                assert!(error < 1e-12 * scale, "{count} columns: {:e}", error / scale);
            }
        }
    }
}

#[test]
fn interface_forces_between_the_two_halves_act_as_if_loaded_from_the_start() {
    let body = free_body(3, &ENDS);
    let interface = interface(&body);
    let factor = Factor::new(&body, 0.5, 3.0, &interface).unwrap();
    let inverse =
        dense(&body, 0.5, 3.0).partial_piv_lu().solve(Mat::<f64>::identity(body.dofs().len(), body.dofs().len()));
    let compliance = factor.interface_compliance();
    for (i, &row) in interface.iter().enumerate() {
        for (j, &column) in interface.iter().enumerate() {
            let exact = inverse[(row as usize, column as usize)];
            assert!(
                (compliance[i * interface.len() + j] - exact).abs() < 1e-12 * inverse[(row as usize, row as usize)]
            );
        }
    }

    let count = 5;
    let (mut load, mut y, mut u) = (loads(&body, count), factor.half(count), body.columns(count));
    let (mut free, mut force) = (factor.interface_columns(count), factor.interface_columns(count));
    let width = force.width();
    for (k, value) in force.as_mut_slice().iter_mut().enumerate() {
        *value = if k % width < count { (k as f64).cos() } else { 0.0 };
    }
    factor.solve(&load, &mut y, &mut u);
    let without = u.clone();
    factor.forward(&load, &mut y);
    factor.interface_displacement(&mut y, &mut free);
    let scale = largest(without.as_slice().iter().copied());
    for (k, &dof) in interface.iter().enumerate() {
        for column in 0..count {
            assert!((free.get(k, column) - without.get(dof as usize, column)).abs() < 1e-12 * scale);
            load.row_mut(dof as usize)[column] += force.get(k, column);
        }
    }
    factor.add_interface_force(&force, &mut y);
    factor.backward(&mut y, &mut u);
    let mut whole = body.columns(count);
    factor.solve(&load, &mut y, &mut whole);
    let error = largest(u.as_slice().iter().zip(whole.as_slice()).map(|(a, b)| a - b));
    assert!(error < 1e-12 * scale && error > 0.0 && scale > 0.1);
}

#[test]
fn a_free_body_under_a_push_is_strained_about_its_accelerated_mean() {
    let body = free_body(4, &ENDS);
    let interface = interface(&body);
    let statics = StaticFactor::new(&body, &interface).unwrap();
    let (mut load, mut y, mut u) = (body.columns(2), statics.factor().half(2), body.columns(2));
    let push = interface[1] as usize;
    load.set(push, 0, 1.0);
    load.set(interface[3] as usize, 1, 0.5);
    load.set(interface[12] as usize, 1, -0.5);
    statics.solve(&mut load, &mut y, &mut u);
    let mut mean = [f64::NAN; 2];
    body.mass_mean(&u, &mut mean);
    let scale = largest(u.as_slice().iter().copied());
    assert!(mean[0].abs() < 1e-13 * scale && mean[1].abs() < 1e-13 * scale);
    // K u is the load less the inertia of the common acceleration, at the pinned unknown too.
    let mut force = body.columns(2);
    body.multiply_stiffness(&u, &mut force);
    for &dof in body.dofs().free() {
        let inertia = if dof % 2 == 1 { body.node_mass()[dof as usize / 2] / body.total_mass() } else { 0.0 };
        let exact = f64::from(u8::from(dof as usize == push)) - inertia;
        assert!((force.get(dof as usize, 0) - exact).abs() < 1e-11, "unknown {dof}");
    }
    // Reciprocity, and the same numbers as the solve.
    let compliance = statics.interface_compliance(&body);
    for (row, &dof) in interface.iter().enumerate() {
        let entry = compliance[row * interface.len() + 1];
        assert!((entry - u.get(dof as usize, 0)).abs() < 1e-12 * scale);
        assert_eq!(entry, compliance[interface.len() + row]);
    }
}

#[test]
fn a_clamped_body_needs_no_balance() {
    let body = Body::new(cylinder(3), &soft(), &["bottom"], &["top"]).unwrap();
    let top: Vec<u32> = body.mesh().boundary("top").unwrap().nodes.iter().map(|node| 2 * node + 1).collect();
    let statics = StaticFactor::new(&body, &top).unwrap();
    let static_compliance = statics.interface_compliance(&body);
    let compliance = Factor::new(&body, 1.0, 0.0, &top).unwrap().interface_compliance();
    let largest = compliance.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
    let pairs = || static_compliance.iter().zip(&compliance);
    assert!(pairs().len() == top.len().pow(2) && pairs().all(|(one, other)| (one - other).abs() < 1e-12 * largest));
    assert!(!body.is_free() && body.dofs().fixed().len() > 2 * 7);
}

#[test]
fn what_cannot_be_factored_is_refused_with_the_place() {
    let body = free_body(2, &[]);
    assert!(matches!(Factor::new(&body, 1.0, 0.0, &[]), Err(FactorError::NotPositiveDefinite { .. })));
    assert!(matches!(Factor::new(&body, -1.0, 1.0, &[]), Err(FactorError::NotPositiveDefinite { .. })));
    // u_r of the node on the axis is fixed.
    let axis = 2 * body.mesh().boundary("top").unwrap().nodes[0];
    assert_eq!(
        Factor::new(&body, 1.0, 1.0, &[axis]).unwrap_err(),
        FactorError::Interface { dof: axis, node: axis / 2 }
    );
    assert!(matches!(Factor::new(&body, 1.0, 1.0, &[axis + 1, axis + 1]), Err(FactorError::Interface { .. })));
    assert!(matches!(Factor::new(&body, 1.0, 1.0, &[1_000_000]), Err(FactorError::Interface { .. })));
    assert_eq!(DofMap::place(axis).0, body.mesh().boundary("top").unwrap().nodes[0]);
}

#[test]
fn inertia_counts_the_eigenvalues_below_a_shift() {
    for mass in [&ENDS[..], &[]] {
        let body = free_body(1, mass);
        // Eigenvalues of the dense pencil M x = θ (K + M) x, θ = 1 / (1 + λ); massless unknowns have θ = 0.
        let lower = dense(&body, 1.0, 1.0).llt(faer::Side::Lower).unwrap();
        let inverse = lower.L().partial_piv_lu().solve(Mat::<f64>::identity(body.dofs().len(), body.dofs().len()));
        let mut mass = dense(&body, 0.0, 1.0);
        for &dof in body.dofs().fixed() {
            mass[(dof as usize, dof as usize)] = 0.0;
        }
        let theta = (&inverse * &mass * inverse.transpose()).self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
        let lambda: Vec<f64> = theta.iter().filter(|&&theta| theta > 1e-9).map(|theta| 1.0 / theta - 1.0).collect();
        for shift in [-1.0, 0.5, 3.0, 10.0, 60.0, 400.0, 1e7] {
            let exact = lambda.iter().filter(|&&lambda| lambda < shift).count();
            assert_eq!(eigenvalues_below(&body, shift).unwrap(), exact, "below {shift}: {lambda:?}");
        }
        assert!(eigenvalues_below(&body, 1e7).unwrap() > 10);
    }
}
