//! At which drive levels does the chain answer at a third of the drive frequency, at a half, or at no fraction at all?
//!
//! Six beads on the resin annulus at 73 kHz, both damping laws of the source paper, α from 0.3 to 1.5. Each entry is the mean
//! over perturbed runs with its scatter: at weak damping the motion is chaotic and a single run tells little. The last column
//! names the strongest of the three lines, if it reaches a twentieth of the line at the drive.
//!
//! ```text
//! cargo run --release --example subharmonics
//! ```

use std::error::Error;

use granchain::{
    scene,
    study::{Bodies, EnsemblePlan, ensemble, observation::watched},
};

const LAWS: [(&str, &str); 2] = [("linear", "0.3 N s/m"), ("kuwabara-kono", "3660 N s m^-3/2")];
const RATIOS: [&str; 3] = ["ratio_1/3", "ratio_1/2", "ratio_2/3"];
const LEVELS: [f64; 7] = [0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5];
/// Perturbed runs a level.
const REPLICATES: usize = 8;
/// Ratio to the drive line above which a line is named.
const NAMED: f64 = 0.05;

fn main() -> Result<(), Box<dyn Error>> {
    let keys = watched();
    for (law, coefficient) in LAWS {
        println!("{law} {coefficient}");
        println!("  alpha   A(f0/3)/A(f0)   A(f0/2)/A(f0)  A(2f0/3)/A(f0)   strongest");
        for alpha in LEVELS {
            let overrides =
                [format!("alpha={alpha}"), format!("damping.kind={law}"), format!("damping.coefficient={coefficient}")];
            let outcome = ensemble::run_on(
                &Bodies::new(None),
                &scene::load("annulus", &overrides)?,
                &EnsemblePlan::new(REPLICATES, 1),
            )?;
            print!("  {alpha:>5}");
            let mut strongest = ("none", NAMED);
            for ratio in RATIOS {
                let spread =
                    keys.iter().position(|key| key.key == ratio).and_then(|index| outcome.spreads[index].as_ref());
                match spread {
                    Some(spread) => {
                        print!("   {:>5.3} ± {:>5.3}", spread.mean, spread.scatter);
                        if spread.mean > strongest.1 {
                            strongest = (ratio.trim_start_matches("ratio_"), spread.mean);
                        }
                    }
                    None => print!("   {:>13}", "–"),
                }
            }
            println!("   {}", strongest.0);
        }
    }
    Ok(())
}
