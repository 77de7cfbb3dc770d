//! Beads that differ in the chain of the contact finite element analysis.

use granchain::{
    model::{self, ModelError},
    response::Response,
    scene,
};

fn run(name: &str, overrides: &[&str]) -> Result<Response, ModelError> {
    let all: Vec<String> = ["model.kind=fea"].iter().chain(overrides).map(|text| (*text).to_owned()).collect();
    model::run(&scene::load(name, &all).unwrap(), &mut |_| true)
}

#[test]
fn a_lighter_bead_in_the_middle_is_the_same_on_both_models() {
    let pick = ["duration=25 us", "output_step=0.1 us", "chain.beads=3"];
    let other = "chain.override=[{ bead = 2, radius = \"0.4 mm\" }]";
    let chain = scene::load("rigid", &[pick[0], pick[1], pick[2], other].map(String::from)).unwrap();
    let chain = model::run(&chain, &mut |_| true).unwrap();
    let fea = run("rigid", &[pick[0], pick[1], pick[2], other, "model.mesh_density=8", "model.step=0.05 us"]).unwrap();
    // The first pulse of the last bead, before it meets the flat: only its height is compared, since stiffer finite bodies lead Hertz' chain.
    let peak = |response: &Response| response.bead_velocity[2].values[..100].iter().copied().fold(0.0, f64::max);
    let plain = run("rigid", &[pick[0], pick[1], pick[2], "model.mesh_density=8"]).unwrap();
    let (found, wanted, equal) = (peak(&fea), peak(&chain), peak(&plain));
    // 1.5 % measured: a few per cent of force change the height by less.
    assert!((found / wanted - 1.0).abs() < 0.02, "{found} {wanted}");
    assert!((equal / wanted - 1.0).abs() > 0.03, "the lighter bead makes a difference: {equal} {wanted}");
}
