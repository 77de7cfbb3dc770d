//! Free modes: a sphere against its analytic frequencies, a small body against dense algebra, the count that misses none.

use std::f64::consts::TAU;

use faer::{Mat, linalg::solvers::Solve as _};
use granchain::{
    model::fea::{
        assembly::Columns,
        body::Body,
        mesh::{BeadMesh, Mesh, bead},
        modes::{Modes, ModesError, modes, predict},
    },
    scene::Material,
};

/// Spheroidal modes of the free steel sphere of 1 mm, Hz: l = 2, 1, 3, 0, 2, 4 (Lamb's equation), printed to 5 or 6 digits.
const SPHERE: [f64; 6] = [2.646_22e6, 3.529_97e6, 3.9374e6, 4.9955e6, 5.0069e6, 5.0459e6];

/// Boundaries that carry no mass.
const POLES: [&str; 2] = ["front", "back"];

fn sphere(density: usize, contact: &[&str]) -> Body {
    let mesh = bead(0.5e-3, &BeadMesh::of_density(density)).unwrap();
    Body::new(mesh, &Material::chrome_steel(), &[], contact).unwrap()
}

fn errors(modes: &Modes) -> Vec<f64> {
    assert_eq!(modes.frequencies[0], 0.0);
    modes.frequencies[1..].iter().zip(SPHERE).map(|(found, exact)| found / exact - 1.0).collect()
}

fn product(body: &Body, modes: &Modes, stiffness: bool) -> Mat<f64> {
    let count = modes.frequencies.len();
    let mut x = body.columns(count);
    for k in 0..count {
        let shape = &modes.shapes[k];
        x.set_column(k, shape);
    }
    let mut y: Columns = body.columns(count);
    if stiffness {
        body.multiply_stiffness(&x, &mut y)
    } else {
        body.multiply_mass(&x, &mut y)
    }
    Mat::from_fn(count, count, |i, j| (0..x.rows()).map(|row| x.get(row, i) * y.get(row, j)).sum())
}

#[test]
fn a_free_sphere_rings_at_its_analytic_frequencies() {
    for (density, first, all) in [(12, 5e-4, 5e-3), (24, 5e-4, 1e-3)] {
        let body = sphere(density, &[]);
        let modes = modes(&body, 7).unwrap();
        let errors = errors(&modes);
        assert!(errors[..2].iter().all(|error| error.abs() < first), "n = {density}: {errors:?}");
        assert!(errors.iter().all(|error| error.abs() < all), "n = {density}: {errors:?}");
        assert!(modes.residuals.iter().all(|&residual| residual < 1e-9), "{:?}", modes.residuals);
        assert!(modes.sturm.modes >= 7);
    }
}

#[test]
fn modes_are_orthonormal_in_mass_and_diagonal_in_stiffness() {
    for contact in [&[][..], &POLES] {
        let body = sphere(8, contact);
        let modes = modes(&body, 30).unwrap();
        let (weight, stiffness) = (product(&body, &modes, false), product(&body, &modes, true));
        let highest = (TAU * modes.frequencies[29]).powi(2);
        for i in 0..30 {
            for j in 0..30 {
                let unit = f64::from(u8::from(i == j));
                let square = (TAU * modes.frequencies[i]).powi(2) * unit;
                // The residuals allowed, 1e-9, over the gaps between neighbours (from 1e-3); stiffness adds the highest ω².
                assert!((weight[(i, j)] - unit).abs() < 1e-8, "{contact:?} mass {i} {j}: {}", weight[(i, j)]);
                assert!((stiffness[(i, j)] - square).abs() < 1e-8 * highest, "{contact:?} stiffness {i} {j}");
            }
        }
    }
}

#[test]
fn massless_contact_nodes_hardly_change_the_modes() {
    let body = sphere(12, &POLES);
    let errors = errors(&modes(&body, 7).unwrap());
    assert!(errors.iter().all(|error| error.abs() < 5e-3), "{errors:?}");
}

#[test]
fn a_dropped_mode_is_caught_by_the_count() {
    let body = sphere(4, &POLES);
    let modes = modes(&body, 10).unwrap();
    let place = 0.5 * (modes.frequencies[8] + modes.frequencies[9]);
    assert_eq!(predict(&body, &modes.frequencies, place).unwrap().modes, 9);
    for dropped in [0, 3, 8] {
        let mut found = modes.frequencies.clone();
        found.remove(dropped);
        let missed = ModesError::Missed { frequency: place, counted: 9, found: 8 };
        assert_eq!(predict(&body, &found, place).unwrap_err(), missed);
    }
    // A mode found twice is as wrong.
    let mut found = modes.frequencies.clone();
    found.insert(4, found[4]);
    assert!(matches!(predict(&body, &found, place), Err(ModesError::Missed { counted: 9, found: 10, .. })));
}

/// The dense eigenvalues θ = 1/(1 + λ/s) of a clamped body.
fn dense_frequencies(body: &Body, scale: f64) -> Vec<f64> {
    let free = body.dofs().free();
    let mass = |i: usize, j: usize| {
        if free[i] % 2 == free[j] % 2 { scale * body.mass().get(free[i] / 2, free[j] / 2) } else { 0.0 }
    };
    let matrix = Mat::from_fn(free.len(), free.len(), |i, j| body.stiffness().get(free[i], free[j]) + mass(i, j));
    let factor = matrix.llt(faer::Side::Lower).unwrap();
    let inverse = factor.L().partial_piv_lu().solve(Mat::<f64>::identity(free.len(), free.len()));
    let theta = &inverse * Mat::from_fn(free.len(), free.len(), mass) * inverse.transpose();
    let mut theta = theta.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
    theta.reverse();
    theta.iter().map(|theta| (scale * (1.0 / theta - 1.0)).max(0.0).sqrt() / TAU).collect()
}

#[test]
fn modes_of_a_clamped_body_are_those_of_dense_algebra() {
    let mesh: Mesh = bead(0.5e-3, &BeadMesh::of_density(2)).unwrap();
    let body = Body::new(mesh, &Material::chrome_steel(), &["back"], &["front"]).unwrap();
    let found = modes(&body, 12).unwrap();
    let exact = dense_frequencies(&body, 1e14);
    assert!(found.frequencies[0] > 1e5);
    for (found, exact) in found.frequencies.iter().zip(exact) {
        // Rounding of the dense inverse, condition about 1e6.
        assert!((found / exact - 1.0).abs() < 1e-8, "{found} {exact}");
    }
}

#[test]
fn more_modes_than_a_mesh_can_carry_are_refused() {
    let body = sphere(2, &POLES);
    assert!(matches!(modes(&body, 0), Err(ModesError::Count { requested: 0, .. })));
    let Err(ModesError::Count { available, .. }) = modes(&body, 1_000_000) else { panic!("accepted") };
    assert!((10..body.dofs().free().len()).contains(&available));
}
