//! Self-convergence of the contact finite element analysis, and its lead over the chain of Hertz contacts. The whole table: `cargo bench --bench convergence`.

use granchain::{
    model, scene,
    signal::{
        Series,
        convergence::{error, first_pulse, lead, moving_average},
    },
};

/// Filtered velocity of the last bead's centre over 20 µs, s.
fn velocity(overrides: &[&str]) -> Series {
    let overrides: Vec<String> = overrides.iter().chain(&["duration=20.4us"]).map(|text| (*text).to_owned()).collect();
    let scene = scene::load("rigid", &overrides).unwrap();
    let response = model::run(&scene, &mut |_| true).unwrap();
    moving_average(response.bead_velocity.last().unwrap(), 4e-7)
}

fn fea(step: &str) -> Series {
    velocity(&["model.kind=fea", "model.mesh_density=4", &format!("model.step={step}")])
}

#[test]
fn errors_fall_with_the_step_and_the_finite_elements_lead_the_chain_of_hertz_contacts() {
    let [coarse, fine, reference] = ["0.1us", "0.05us", "0.02us"].map(fea);
    let window = (0.0, 10e-6);
    let errors = [&coarse, &fine].map(|run| error(run, &reference, window));
    assert!(errors[1] < 0.5 * errors[0] && errors[0] < 0.02, "{errors:?}");
    // Hertz takes each body for a half-space: the finite elements are stiffer and lead by 0.05 to 0.15 us.
    let chain = velocity(&["model.kind=chain"]);
    let (begin, _, bottom) = first_pulse(&chain);
    let found = lead(&reference, &chain, (begin, bottom));
    assert!((0.05e-6..0.15e-6).contains(&found), "{found:e}");
    let off = error(&chain, &reference, window);
    assert!(off > errors[0], "{off} {errors:?}");
}
