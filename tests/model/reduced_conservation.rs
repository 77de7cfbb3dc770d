//! The stepping of the reduced model: its order, its energy over long times, and what modes are worth.

use granchain::{
    model,
    response::Response,
    scene::{self, Scene},
};

fn scene(name: &str, overrides: &[&str]) -> Scene {
    let base = ["model.kind=reduced", "model.mesh_density=6", "output_step=0.2 us"];
    let all: Vec<String> = base.iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    scene::load(name, &all).unwrap()
}

fn run(scene: &Scene) -> Response {
    model::run(scene, &mut |_| true).unwrap()
}

/// Rms difference of all beads' displacements over the rms of the other's.
fn difference(one: &Response, other: &Response) -> f64 {
    let (mut error, mut norm) = (0.0, 0.0);
    for (one, other) in one.bead_displacement.iter().zip(&other.bead_displacement) {
        for (a, b) in one.values.iter().zip(&other.values) {
            (error, norm) = (error + (a - b).powi(2), norm + b * b);
        }
    }
    f64::sqrt(error / norm)
}

fn at_step(nanoseconds: &str, overrides: &[&str], name: &str) -> Response {
    let step = format!("model.step={nanoseconds} ns");
    run(&scene(name, &[overrides, &[&step]].concat()))
}

#[test]
fn a_chain_that_stays_in_contact_is_integrated_to_second_order() {
    // 5 N: a drive of 0.2 µm opens nothing.
    let pressed = ["chain.precompression=5 N", "alpha=0.2", "duration=40 us", "model.modes=0"];
    let fine = at_step("2", &pressed, "rigid");
    assert!(fine.contact_force.iter().all(|force| force.values.iter().all(|value| *value > 0.5)));
    let error = |step: &str| difference(&at_step(step, &pressed, "rigid"), &fine);
    let (coarse, half) = (error("40"), error("20"));
    println!("40 ns {coarse:.2e}, 20 ns {half:.2e}");
    // (40² − 2²)/(20² − 2²) = 4.03.
    assert!((coarse / half - 4.03).abs() < 0.25, "{coarse:e} {half:e}");
}

#[test]
fn energy_unaccounted_for_falls_with_the_square_of_the_step() {
    let residual = |step: &str| {
        let energy = at_step(step, &["duration=400 us"], "annulus").energy;
        energy.residual_j.abs() / energy.largest_j
    };
    let (coarse, half) = (residual("50"), residual("25"));
    println!("50 ns {coarse:.2e}, 25 ns {half:.2e}");
    // Dashpots by the mean of old and new forces; a chain that opens and closes keeps the ratio only roughly.
    assert!(coarse < 1e-2 && (2.5..6.5).contains(&(coarse / half)), "{coarse:e} {half:e}");
}

/// Every opening and closing leaves an energy of either sign that is of the step's order: the sum walks at random, and the last digit decides where to.
/// So of many drives: it grows as the root of time, and has no sign.
#[test]
fn energy_does_not_drift_over_long_times() {
    let rigid = |alpha: f64, microseconds: u32| {
        let [alpha, duration] = [format!("alpha={alpha}"), format!("duration={microseconds} us")];
        scene("rigid", &["model.step=50 ns", &alpha, &duration])
    };
    let prepared = model::prepare(&rigid(1.0, 582)).unwrap();
    let residuals = |microseconds: u32| -> Vec<f64> {
        let alphas = (0..24).map(|k| 0.9 + 0.009 * f64::from(k));
        let energies = alphas.map(|alpha| prepared.run(&rigid(alpha, microseconds), &mut |_| true).unwrap().energy);
        energies.map(|energy| energy.residual_j / energy.largest_j).collect()
    };
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let rms = |values: &[f64]| mean(&values.iter().map(|value| value * value).collect::<Vec<f64>>()).sqrt();
    // Up to 0.6 ms, and up to 2.4 ms: 160 periods of the drive, which lasted five.
    let (early, late) = (residuals(582), residuals(2328));
    println!("early {:.2e}, late {:.2e}, mean {:.2e}", rms(&early), rms(&late), mean(&late));
    // 7.5e-4 and 1.8e-3 of sixty drives; three standard errors of a mean.
    assert!(rms(&early) < 1.5e-3 && rms(&late) < 3.6e-3, "{early:?} {late:?}");
    assert!(mean(&late).abs() < 3.0 * rms(&late) / f64::sqrt(24.0), "{late:?}");
}

#[test]
fn the_error_falls_with_every_doubling_of_the_modes() {
    let with = |modes: u32| {
        let overrides = ["duration=30 us", "model.step=5 ns", &format!("model.modes={modes}")];
        run(&scene("rigid", &overrides))
    };
    let all = with(40);
    let errors: Vec<f64> = [0, 2, 4, 8, 16].map(|modes| difference(&with(modes), &all)).to_vec();
    println!("{errors:?}");
    // 3.2, 2.2, 1.3, 0.75, 0.38 e-4 measured: a load on a point needs all modes alike, so the rest falls as their number to −1.
    assert!(errors.windows(2).all(|pair| pair[1] < 0.75 * pair[0]), "{errors:?}");
    assert!(errors[0] < 1e-3, "{errors:?}");
}

#[test]
fn modes_beyond_the_step_are_left_to_statics() {
    // ω h ≤ 2 at 0.1 µs is 3.18 MHz: one mode of a free sphere.
    let unknowns = |step: &str| {
        let work = at_step(step, &["duration=1 us", "model.modes=8"], "rigid").work;
        (work.unknowns - 6) / 6
    };
    assert_eq!((unknowns("100"), unknowns("20")), (1, 8));
}
