//! Cost of a body's factor: analysis and factorisation once, then the solves of every step, against faer's own.
//!
//! `cargo bench --bench fea_factor [-- MOST_UNKNOWNS]` prints the least of repeated timings on one thread: beads of growing density with both contact
//! patches as interface, 1, 6 and 32 right-hand sides, the product with the mass, and the time of a step (solve and mass, 6 columns) over the
//! factor's non-zeros.

#![allow(clippy::unwrap_used, reason = "a bench stops at the first surprise")]

use std::{hint::black_box, time::Instant};

use faer::{
    Conj, MatMut, Par, Side,
    dyn_stack::{MemBuffer, MemStack},
    linalg::cholesky::llt::factor::LltRegularization,
    prelude::Reborrow as _,
    sparse::{
        SparseColMat, Triplet,
        linalg::{
            SupernodalThreshold,
            cholesky::{
                CholeskySymbolicParams, LltRef, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
            },
        },
    },
};
use granchain::{
    model::fea::{
        body::Body,
        factor::Factor,
        mesh::{BeadMesh, bead},
    },
    scene::Material,
};

/// 4/Δt² at 0.1 µs, 1/s².
const MASS_SCALE: f64 = 4e14;

/// A steel bead with massless contact patches.
fn steel_bead(density: usize) -> Body {
    let mesh = bead(0.5e-3, &BeadMesh::of_density(density)).unwrap();
    Body::new(mesh, &Material::chrome_steel(), &[], &["front", "back"]).unwrap()
}

/// Least time of repeated calls, s.
fn least(repeats: usize, mut call: impl FnMut()) -> f64 {
    call();
    (0..repeats)
        .map(|_| {
            let start = Instant::now();
            call();
            start.elapsed().as_secs_f64()
        })
        .fold(f64::MAX, f64::min)
}

/// faer's own factor of the same matrix, its own order, its own solves.
struct Peer {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    order: usize,
}

impl Peer {
    fn new(body: &Body) -> Self {
        let mut place = vec![u32::MAX; body.dofs().len()];
        for (k, &dof) in (0..).zip(body.dofs().free()) {
            place[dof as usize] = k;
        }
        let order = body.dofs().free().len();
        let mut entries = Vec::new();
        for &dof in body.dofs().free() {
            let (rows, values) = body.stiffness().column(dof as usize);
            for (&row, &value) in rows.iter().zip(values) {
                let mass = if row % 2 == dof % 2 { body.mass().get(row / 2, dof / 2) } else { 0.0 };
                entries.push(Triplet::new(place[row as usize], place[dof as usize], value + MASS_SCALE * mass));
            }
        }
        let matrix = SparseColMat::<u32, f64>::try_new_from_triplets(order, order, &entries).unwrap();
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let symbolic =
            factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, SymmetricOrdering::Amd, parameters).unwrap();
        let mut values = vec![0.0; symbolic.len_val()];
        let needed = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, faer::Spec::default());
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix.rb(),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(needed)),
                faer::Spec::default(),
            )
            .unwrap();
        Self { symbolic, values, order }
    }

    fn time(&self, columns: usize, repeats: usize) -> f64 {
        let factor = LltRef::new(&self.symbolic, &self.values);
        let mut memory = MemBuffer::new(self.symbolic.solve_in_place_scratch::<f64>(columns, Par::Seq));
        let load: Vec<f64> = (0..self.order * columns).map(|k| (k as f64).sin()).collect();
        let mut u = load.clone();
        least(repeats, || {
            u.copy_from_slice(&load);
            let rhs = MatMut::from_column_major_slice_mut(&mut u, self.order, columns);
            factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut memory));
            black_box(&u);
        })
    }
}

fn main() {
    let most = std::env::args().skip(1).find_map(|word| word.parse().ok()).unwrap_or(200_000.0);
    println!(
        "unknowns    non-zeros  per unknown | factor ms | solve ms: 1 col     6 cols    32 cols | faer's: 1 col     6 cols    32 cols | \
         mass ms 6 cols | step ns/non-zero"
    );
    let mut costs = Vec::new();
    for density in [8, 12, 18, 28, 42, 60] {
        let body = steel_bead(density);
        let unknowns = body.dofs().free().len() as f64;
        if unknowns > most {
            break;
        }
        let interface: Vec<u32> = ["front", "back"]
            .iter()
            .flat_map(|name| &body.mesh().boundary(name).unwrap().nodes)
            .map(|node| 2 * node + 1)
            .collect();
        let repeats = (4e6 / unknowns) as usize;
        let factor_time = least(repeats / 100 + 1, || {
            black_box(Factor::new(&body, 1.0, MASS_SCALE, &interface).unwrap());
        });
        let factor = Factor::new(&body, 1.0, MASS_SCALE, &interface).unwrap();
        let peer = Peer::new(&body);
        let mut solve = [0.0; 3];
        let mut own = [0.0; 3];
        let mut mass = 0.0;
        for (k, columns) in [1, 6, 32].into_iter().enumerate() {
            let (mut load, mut y, mut u) = (body.columns(columns), factor.half(columns), body.columns(columns));
            for &dof in body.dofs().free() {
                load.row_mut(dof as usize)[..columns].fill((f64::from(dof)).sin());
            }
            solve[k] = 1e3 * least(repeats, || factor.solve(black_box(&load), &mut y, &mut u));
            own[k] = 1e3 * peer.time(columns, repeats.min(100));
            if columns == 6 {
                mass = 1e3 * least(repeats, || body.multiply_mass(&load, &mut u));
            }
        }
        let cost = 1e6 * (solve[1] + mass) / factor.nonzeros() as f64;
        costs.push(cost);
        println!(
            "{:8} {:12} {:12.1} | {:9.1} | {:15.3} {:10.3} {:10.3} | {:13.3} {:10.3} {:10.3} | {:14.3} | {:16.3}",
            factor.unknowns(),
            factor.nonzeros(),
            factor.nonzeros() as f64 / factor.unknowns() as f64,
            1e3 * factor_time,
            solve[0],
            solve[1],
            solve[2],
            own[0],
            own[1],
            own[2],
            mass,
            cost
        );
    }
    let spread = costs.iter().copied().fold(0.0, f64::max) / costs.iter().copied().fold(f64::MAX, f64::min);
    println!(
        "time of a step over non-zeros varies by {spread:.2}: up to about 3 million non-zeros L stays in the cache, beyond it is read from memory twice a step"
    );
}
