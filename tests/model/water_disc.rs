//! The disc on the water, dry: thin plates, modes, flexibilities.

use granchain::{
    model::{
        analytical::ThinPlate,
        fea::mesh::quality,
        water::disc::{Disc, DiscMesh, DiscShape, Rim, disc_mesh, half_space_flexibility},
    },
    scene::Material,
};

/// The disc of the source paper.
fn paper(rim: Rim) -> DiscShape {
    DiscShape { radius: 1e-3, thickness: 0.25e-3, material: Material::vitreous_carbon(), rim }
}

#[test]
fn a_thin_clamped_disc_is_kirchhoffs_plate() {
    let shape = DiscShape { thickness: 0.02e-3, ..paper(Rim::Clamped) };
    let disc = Disc::new(&shape, &DiscMesh { radial: 48, through: 2, pole_side: None }).unwrap();
    let plate = ThinPlate { radius: shape.radius, thickness: shape.thickness, material: shape.material };
    let modes = disc.modes(3).unwrap();
    for (mode, frequency) in modes.frequencies.iter().enumerate() {
        let exact = plate.clamped_frequency(mode + 1);
        // Shear and rotary inertia lower mode n by about (λ_n h/a)²/4: 0.1, 0.4, 0.9 %.
        assert!((frequency / exact - 1.0).abs() < [0.002, 0.005, 0.01][mode], "{mode}: {frequency} {exact}");
    }
    // A plate under a point force bends by a²/(16πD); shear adds about (h/a)² ln(a/h).
    let flexibility = disc.structural_flexibility(0.04e-3).unwrap();
    assert!((flexibility / plate.clamped_flexibility() - 1.0).abs() < 0.01, "{flexibility:e}");
}

#[test]
fn a_thin_guided_disc_is_a_simply_supported_plate() {
    // u_r is free, so the lateral face turns.
    let shape = DiscShape { thickness: 0.02e-3, ..paper(Rim::Supported) };
    let disc = Disc::new(&shape, &DiscMesh { radial: 48, through: 2, pole_side: None }).unwrap();
    let plate = ThinPlate { radius: shape.radius, thickness: shape.thickness, material: shape.material };
    let flexibility = disc.structural_flexibility(0.04e-3).unwrap();
    assert!((flexibility / plate.supported_flexibility() - 1.0).abs() < 0.01, "{flexibility:e}");
}

#[test]
fn dry_modes_are_as_tabulated() {
    for (rim, expected) in [
        (Rim::Clamped, [0.500_28e6, 1.5899e6, 2.9316e6]),
        (Rim::Supported, [0.250_31e6, 1.324_37e6, 1.4964e6]),
        (Rim::Free, [0.444_08e6, 1.496_11e6, 1.621_41e6]),
    ] {
        let disc = Disc::new(&paper(rim), &DiscMesh::default()).unwrap();
        let rigid = usize::from(rim == Rim::Free);
        let modes = disc.modes(3 + rigid).unwrap();
        for (found, expected) in modes.frequencies[rigid..].iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 0.002, "{rim:?}: {:?}", modes.frequencies);
        }
        if rim == Rim::Free {
            let mass = disc.body().total_mass();
            assert_eq!(modes.frequencies[0], 0.0);
            assert!((modes.pole[0] * mass.sqrt() - 1.0).abs() < 1e-12);
            assert!((modes.back[0].at(0.7e-3) * mass.sqrt() - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn the_clamped_edge_converges_from_above() {
    let first = |radial, through| {
        let mesh = DiscMesh { radial, through, pole_side: None };
        Disc::new(&paper(Rim::Clamped), &mesh).unwrap().modes(1).unwrap().frequencies[0]
    };
    let (coarse, middle, fine) = (first(16, 3), first(32, 6), first(64, 12));
    // Fixed to free at a right angle, ν 0.15: a singular corner, so the order is below 2.
    assert!(coarse > middle && middle > fine);
    assert!(middle / fine - 1.0 < 1e-3, "{coarse} {middle} {fine}");
}

#[test]
fn flexibilities_are_as_tabulated() {
    for (rim, structural, patch_stiffness) in
        [(Rim::Clamped, 0.4435e-6, 1.3496e6), (Rim::Supported, 1.180e-6, 0.6777e6)]
    {
        let disc = Disc::new(&paper(rim), &DiscMesh { radial: 40, through: 20, pole_side: Some(2e-6) }).unwrap();
        let stiffness = 1.0 / disc.flexibility(50e-6).unwrap();
        assert!((stiffness / patch_stiffness - 1.0).abs() < 0.005, "{rim:?}: {stiffness}");
        // The patch takes (b/h)² or so off; two patches give the limit.
        let (wide, narrow) = (disc.structural_flexibility(40e-6).unwrap(), disc.structural_flexibility(20e-6).unwrap());
        let limit = narrow + (narrow - wide) / 3.0;
        assert!((limit / structural - 1.0).abs() < 0.005, "{rim:?}: {wide:e} {narrow:e} {limit:e}");
    }
}

#[test]
fn modes_and_static_shapes_hold_the_whole_flexibility_and_stay_orthogonal() {
    for rim in [Rim::Clamped, Rim::Supported, Rim::Free] {
        let disc = Disc::new(&paper(rim), &DiscMesh::default()).unwrap();
        let rigid = usize::from(rim == Rim::Free);
        for patch in [0.0, 50e-6] {
            let basis = disc.basis(4, patch).unwrap();
            assert_eq!(basis.frequencies.len(), 8);
            assert!(basis.frequencies.windows(2).all(|pair| pair[0] < pair[1]), "{:?}", basis.frequencies);
            let share = |k: usize| (basis.pole[k] / (std::f64::consts::TAU * basis.frequencies[k])).powi(2);
            let sum: f64 = (rigid..8).map(share).sum();
            let whole = disc.flexibility(patch).unwrap();
            // Residuals of the modes, 1e-9, and the condition of the static solve.
            assert!((sum / whole - 1.0).abs() < 1e-6, "{rim:?} {patch}: {sum:e} {whole:e}");
            let few: f64 = (rigid..4).map(share).sum();
            assert!(few < 0.99 * whole, "the modes alone are softer");
        }
    }
}

#[test]
fn a_large_block_under_a_small_patch_is_a_half_space() {
    let shape = DiscShape { thickness: 0.9e-3, ..paper(Rim::Clamped) };
    let disc = Disc::new(&shape, &DiscMesh { radial: 40, through: 40, pole_side: Some(1e-6) }).unwrap();
    let patch = 8e-6;
    let ratio = disc.flexibility(patch).unwrap() / half_space_flexibility(&shape.material, patch);
    // The block's own size takes about b/a; the mesh at the pole is an eighth of the patch.
    assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
}

#[test]
fn a_graded_disc_keeps_its_volume_and_grows_from_the_pole() {
    for (radial, through, side) in [(40, 20, Some(2e-6)), (32, 6, None), (1, 1, None)] {
        let mesh = disc_mesh(1e-3, 0.25e-3, &DiscMesh { radial, through, pole_side: side }).unwrap();
        mesh.check().unwrap();
        let exact = std::f64::consts::PI * 0.25e-9;
        assert!(quality(&mesh).volume_error(exact).abs() < 1e-12);
        let front = &mesh.boundary("front").unwrap().nodes;
        let sides: Vec<f64> =
            front.windows(3).step_by(2).map(|n| mesh.nodes[n[2] as usize][0] - mesh.nodes[n[0] as usize][0]).collect();
        assert!((sides[0] / side.unwrap_or(1e-3 / radial as f64) - 1.0).abs() < 1e-9);
        assert!(sides.windows(2).all(|pair| pair[1] > (1.0 - 1e-9) * pair[0]));
        let back = &mesh.boundary("back").unwrap().nodes;
        assert!(back.iter().all(|&node| mesh.nodes[node as usize][1] == 0.25e-3) && back.len() == 2 * radial + 1);
    }
}

#[test]
fn an_evenly_pressed_patch_carries_one_newton_wherever_it_ends() {
    let disc = Disc::new(&paper(Rim::Free), &DiscMesh { radial: 7, through: 2, pole_side: None }).unwrap();
    for patch in [0.0, 1e-5, 1e-3 / 7.0, 3.3e-4, 1e-3] {
        let load = disc.patch_load(patch);
        assert!((load.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{patch}");
    }
    // Half the radius: ∫ r² dF/F = b²/2, exact for quadratic edges.
    let load = disc.patch_load(0.5e-3);
    let moment: f64 =
        disc.front().iter().map(|&n| disc.body().mesh().nodes[n as usize][0].powi(2) * load[2 * n as usize + 1]).sum();
    assert!((moment / 0.125e-6 - 1.0).abs() < 1e-12, "{moment:e}");
}

#[test]
fn shapes_that_are_no_disc_are_refused_with_the_number() {
    let refusal = |shape: DiscShape, mesh: DiscMesh| Disc::new(&shape, &mesh).unwrap_err().to_string();
    let thick = refusal(DiscShape { thickness: 1.2e-3, ..paper(Rim::Clamped) }, DiscMesh::default());
    assert!(thick.contains("below the radius") && thick.contains("1.2e-3"), "{thick}");
    let coarse = refusal(paper(Rim::Clamped), DiscMesh { pole_side: Some(1e-4), ..DiscMesh::default() });
    assert!(coarse.contains("side of the element at the pole"), "{coarse}");
    let none = refusal(paper(Rim::Clamped), DiscMesh { radial: 0, ..DiscMesh::default() });
    assert!(none.contains("elements along r"), "{none}");
}
