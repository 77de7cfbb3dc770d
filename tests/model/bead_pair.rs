//! Two beads in a collision, on every fidelity level of the ladder: what the fidelity levels leave out is what they differ by.

use granchain::{
    model::{
        self,
        contact_law::{FiniteBody, bead_pair_stiffness},
    },
    response::Response,
    scene::{self, Scene},
    signal::Series,
};

/// The piston kicks bead 1 across a gap of 4 µm at bead 2; nothing else touches while they collide.
fn collision(model: &[&str]) -> (Scene, Response) {
    let common = ["chain.beads=2", "chain.gaps.contact1=0 m", "duration=14 us", "output_step=0.02 us"];
    let gaps = ["chain.gaps.contact2=4 um", "chain.gaps.contact3=40 um"];
    let overrides: Vec<String> = common.iter().chain(&gaps).chain(model).map(|text| (*text).to_owned()).collect();
    let scene = scene::load("rigid", &overrides).unwrap();
    let response = model::run(&scene, &mut |_| true).unwrap();
    (scene, response)
}

/// ∫F dt, N s.
fn impulse(force: &Series) -> f64 {
    force.values.iter().sum::<f64>() * force.step
}

/// Largest force, N, by a parabola through the three largest samples.
fn peak(force: &Series) -> f64 {
    let values = &force.values;
    let at = (1..values.len() - 1).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap();
    let (left, middle, right) = (values[at - 1], values[at], values[at + 1]);
    let shift = 0.5 * (left - right) / (left - 2.0 * middle + right);
    middle - 0.25 * (left - right) * shift
}

/// Largest force (N) of two equal beads meeting at the relative speed `speed` (m/s), from the balance ½ (m/2) v² = ∫F dδ with
/// F = k δ^1.5 (1 + excess(δ)); c₁ and c₂ are those of [`FiniteBody`] in powers of √(δ/1 µm).
fn predicted(scene: &Scene, speed: f64, excess: Option<FiniteBody>) -> f64 {
    let [bead, other] = [0, 1].map(|i| &scene.chain.beads[i]);
    let k = bead_pair_stiffness(bead, other);
    let force =
        |overlap: f64| k * overlap.powf(1.5) * (1.0 + excess.map_or(0.0, |law| law.excess(overlap, bead.radius)));
    // Simpson in √δ, exact to rounding for a polynomial in it of degree five with this many panels.
    let energy = |overlap: f64| {
        let (panels, root) = (200, overlap.sqrt());
        (0..=panels)
            .map(|i| {
                let at = root * f64::from(i) / f64::from(panels);
                let weight = if i == 0 || i == panels { 1.0 } else { 2.0 + 2.0 * f64::from(i % 2) };
                weight * force(at * at) * 2.0 * at
            })
            .sum::<f64>()
            * root
            / (3.0 * f64::from(panels))
    };
    let wanted = 0.25 * bead.mass() * speed * speed;
    let (mut low, mut high) = (0.0, 1e-5);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if energy(middle) < wanted { low = middle } else { high = middle }
    }
    force(high)
}

/// Of a run: speed (m/s) at which bead 1 met bead 2, from the impulse of the piston's kick; largest force over Hertz' and over the finite
/// body's at that speed, less 1; restitution.
struct Collision {
    speed: f64,
    over_hertz: f64,
    over_finite_body: f64,
    restitution: f64,
}

fn collide(model: &[&str]) -> Collision {
    let (scene, response) = collision(model);
    let mass = scene.chain.beads[0].mass();
    let speed = impulse(&response.contact_force[0]) / mass;
    let force = peak(&response.contact_force[1]);
    Collision {
        speed,
        over_hertz: force / predicted(&scene, speed, None) - 1.0,
        over_finite_body: force / predicted(&scene, speed, Some(FiniteBody::BeadsColliding)) - 1.0,
        restitution: impulse(&response.contact_force[1]) / (0.5 * mass * speed) - 1.0,
    }
}

#[test]
fn the_force_of_a_collision_differs_between_the_levels_by_what_they_leave_out() {
    let chain = collide(&["model.kind=chain"]);
    // Samples every 0.02 µs of a force 4.5 µs long; the law itself is exact.
    assert!(chain.over_hertz.abs() < 1e-5, "{}", chain.over_hertz);
    let fea = collide(&["model.kind=fea", "model.mesh_density=12", "model.step=0.01 us"]);
    let reduced = collide(&["model.kind=reduced", "model.mesh_density=12"]);
    for (name, fidelity, tolerance) in [("fea", &fea, 3e-4), ("reduced", &reduced, 1e-3)] {
        let Collision { over_hertz, over_finite_body, .. } = *fidelity;
        // 1.2 % above Hertz at 0.8 µm; explained by the static excess of whole beads but for the steps' and the mesh's error.
        assert!((over_hertz - 0.0120).abs() < 2e-3, "{name}: {over_hertz}");
        assert!(over_finite_body.abs() < tolerance, "{name}: {over_finite_body}");
        // Ringing takes next to nothing: the collision lasts twelve periods of the lowest mode.
        assert!((fidelity.restitution - 1.0).abs() < 1e-3, "{name}: {}", fidelity.restitution);
    }
    // The kick off the rigid piston, on the same mesh: what the steps leave.
    assert!((reduced.speed / fea.speed - 1.0).abs() < 1e-3, "{} {}", reduced.speed, fea.speed);
    // A moving rigid wall gives a bead from rest twice its speed less what it slows down meanwhile: stiffer bodies leave earlier, faster.
    assert!((1.001..1.008).contains(&(fea.speed / chain.speed)), "{} {}", fea.speed, chain.speed);
}
