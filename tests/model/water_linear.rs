//! What linear answers of disc and water are held against: harmonic motion, added mass, convolution.

use std::f64::consts::TAU;

use faer::{Mat, Side, c64, linalg::solvers::Solve as _};
use granchain::model::water::{
    Water,
    disc::DiscModes,
    rayleigh::{
        field::FieldPoint,
        radiation::{RadiationKernel, Radiator},
    },
};

/// Answer of the disc on the water to F = 1 N e^{iωt} at the pole: displacement of the pole without the indentation, m/N, and pressure at
/// the point, Pa/N. (Λ − ω² + iω Z(ω)) q = φ(0).
pub(crate) fn harmonic(radius: f64, modes: &DiscModes, point: FieldPoint, angular_frequency: f64) -> (c64, c64) {
    let (count, omega, water) = (modes.frequencies.len(), angular_frequency, Water::fresh());
    let radiator = Radiator::of_modes(radius, &modes.back);
    let impedance = radiator.impedance(&water, omega);
    let rate = c64::new(0.0, omega);
    let dynamic = Mat::from_fn(count, count, |j, k| {
        let own = (TAU * modes.frequencies[j]).powi(2) - omega * omega;
        rate * impedance[j * count + k] + if j == k { own } else { 0.0 }
    });
    let load = Mat::from_fn(count, 1, |k, _| c64::new(modes.pole[k], 0.0));
    let solution = dynamic.partial_piv_lu().solve(load);
    let modal: Vec<c64> = (0..count).map(|k| solution[(k, 0)]).collect();
    let transfer = radiator.pressure_spectrum(&water, point, omega).unwrap();
    let pole = modal.iter().zip(&modes.pole).map(|(q, shape)| q * *shape).sum();
    (pole, modal.iter().zip(&transfer).map(|(q, transfer)| rate * q * transfer).sum())
}

/// Lowest frequency of a held disc with incompressible water on its back, Hz: (1 + m) q̈ + Λ q = 0, so that 1/ω² is the largest eigenvalue
/// of Λ^-½ (1 + m) Λ^-½.
pub(crate) fn lowest_wet_frequency(radius: f64, modes: &DiscModes) -> f64 {
    let count = modes.frequencies.len();
    let added = Radiator::of_modes(radius, &modes.back).added_mass(&Water::fresh());
    let omega = |k: usize| TAU * modes.frequencies[k];
    let matrix = Mat::from_fn(count, count, |j, k| {
        (added[j * count + k] + if j == k { 1.0 } else { 0.0 }) / (omega(j) * omega(k))
    });
    let slowest = *matrix.self_adjoint_eigenvalues(Side::Lower).unwrap().last().unwrap();
    1.0 / (TAU * slowest.sqrt())
}

/// Impedance of a kernel on its clock, (1 − e^{−iωΔ}) Σ W_m e^{−iωmΔ}, row by row.
pub(crate) fn impedance_on_the_clock(kernel: &RadiationKernel, angular_frequency: f64) -> Vec<c64> {
    let size = kernel.count * kernel.count;
    let turn = |cells: usize| c64::from_polar(1.0, -angular_frequency * kernel.step * cells as f64);
    let mut sums = vec![c64::new(0.0, 0.0); size];
    for (cell, weights) in kernel.weights.chunks_exact(size).enumerate() {
        sums.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += turn(cell) * *weight);
    }
    sums.into_iter().map(|sum| (c64::new(1.0, 0.0) - turn(1)) * sum).collect()
}

/// Σ r(n − m) F(m) over the instants m ≤ n.
pub(crate) fn convolution(response: &[f64], forces: &[f64]) -> Vec<f64> {
    let sum = |n: usize| response.iter().take(n + 1).enumerate().map(|(m, value)| value * forces[n - m]).sum();
    (0..forces.len()).map(sum).collect()
}
