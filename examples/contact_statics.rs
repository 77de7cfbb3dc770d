//! What force, contact radius and pressure has one contact, pressed together by so much, and how far are they from Hertz?
//!
//! Each body is meshed and solved at rest. Squeezed at both poles, as in a static chain, and loaded on one side, where the force is balanced by
//! inertia as in a collision, a whole sphere is stiffer than Hertz's half-space by a few per cent.
//!
//! ```text
//! cargo run --release --example contact_statics
//! ```

use std::error::Error;

use granchain::{
    model::{
        contact_law::{Annulus, ElasticLaw, Hertz, bead_flat_stiffness, bead_pair_stiffness},
        fea::statics::{Curve, Loading, Touching},
    },
    scene::{self, FlatContact},
};

/// Approaches of the mass means of both bodies, m.
const APPROACHES: [f64; 6] = [0.1e-6, 0.3e-6, 0.5e-6, 1e-6, 2e-6, 3e-6];

fn main() -> Result<(), Box<dyn Error>> {
    for (touching, name, scene) in [
        (Touching::BeadBead, "bead on bead", "rigid"),
        (Touching::BeadFlat, "bead on rigid flat", "rigid"),
        (Touching::BeadAnnulus, "bead on annulus", "annulus"),
    ] {
        let scene = scene::load(scene, &["model.kind=fea".into()])?;
        let bead = &scene.chain.beads[0];
        let law = |approach: f64| match touching {
            Touching::BeadBead => Hertz { stiffness: bead_pair_stiffness(bead, bead) }.force(approach),
            Touching::BeadFlat => Hertz { stiffness: bead_flat_stiffness(bead, FlatContact::Rigid) }.force(approach),
            Touching::BeadAnnulus => Annulus::new(1.0).force(approach),
        };
        for (loading, how) in
            [(Loading::BothPoles, "squeezed at both poles"), (Loading::OneSided, "loaded on one side")]
        {
            println!("\n{name}, {how}\napproach µm  force N  over law %  radius µm  peak MPa");
            let curve = Curve::new(&scene, touching, loading)?;
            for approach in APPROACHES {
                let state = curve.at(approach)?;
                let peak = state.pressure.iter().map(|(_, pressure)| *pressure).fold(0.0, f64::max);
                println!(
                    "{:>11.2}{:>9.4}{:>12.2}{:>11.2}{:>10.0}",
                    1e6 * approach,
                    state.force,
                    100.0 * (state.force / law(approach) - 1.0),
                    1e6 * state.radius,
                    1e-6 * peak
                );
            }
        }
    }
    Ok(())
}
