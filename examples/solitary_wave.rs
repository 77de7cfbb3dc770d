//! How does a strike travel along an uncompressed chain of two to a thousand beads, and how does that depend on its strength?
//!
//! The first of N free steel beads is struck. Behind a transient the pulse is a solitary wave; there is no speed of sound: it runs at
//!
//! V = 2a κ (k/m)^(2/5) v_m^(1/5),
//!
//! v_m being the largest velocity of a bead, κ = 0.9075 in the discrete chain and 0.9146 in Nesterenko's long-wave limit, whose pulse is
//! cos⁴ and five beads long at any strength. Speed, width and shape of what runs through a thousand beads are held against both.
//!
//! ```text
//! cargo run --release --example solitary_wave [-- DIR]
//! ```
//!
//! writes `solitary-wave.svg` and `solitary-wave.png` into DIR, `out/solitary-wave` by default.

use std::{
    error::Error,
    fs,
    path::{Path, PathBuf},
};

use granchain::{
    model::{
        analytical::{
            DISCRETE_SPEED_FACTOR, DiscretePulse, NESTERENKO_SPEED_FACTOR, nesterenko_profile, nesterenko_width,
            solitary_wave_speed,
        },
        chain::{ChainModel, InitialState},
        contact_law::bead_pair_stiffness,
    },
    report::figure::{Axis, Colour, Dash, Figure, Marker, PAGE_WIDTH_MM, Panel, Stroke},
    response::Response,
    scene::{self, Bead},
    signal::Series,
};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).map_or_else(|| PathBuf::from("out/solitary-wave"), PathBuf::from);
    let pulse = DiscretePulse::solve();
    println!(
        "κ of the discrete chain, solved for: {:.9}; tabulated {DISCRETE_SPEED_FACTOR:.9}\n",
        pulse.speed_factor()
    );

    println!("fifty beads; speed between beads 20 and 40");
    println!("strike m/s   peak m/s   speed m/s   discrete   Nesterenko   difference to discrete");
    let mut speeds = Vec::new();
    for strike in [0.01, 0.03, 0.1, 0.3, 1.0] {
        let (bead, run) = struck(50, strike, 1.0)?;
        let (start, _) = crest(&run.bead_velocity[19]);
        let (end, peak) = crest(&run.bead_velocity[39]);
        let speed = 2.0 * bead.radius * 20.0 / (end - start);
        let (discrete, long) =
            (speed_of(&bead, DISCRETE_SPEED_FACTOR, peak), speed_of(&bead, NESTERENKO_SPEED_FACTOR, peak));
        println!(
            "{strike:>10} {peak:>10.5} {speed:>11.4} {discrete:>10.4} {long:>12.4} {:>24.1e}",
            speed / discrete - 1.0
        );
        speeds.push((peak, speed));
    }
    let ((slow, least), (fast, most)) = (speeds[0], speeds[speeds.len() - 1]);
    println!("speed ∝ peak velocity to the power {:.6}; theory 0.2\n", (most / least).ln() / (fast / slow).ln());

    println!("two to a thousand free beads struck at 0.1 m/s");
    println!("   N   last bead over strike   momentum   speed over discrete   steps a bead   events a bead");
    let mut thousand = None;
    for beads in [2, 3, 5, 10, 20, 50, 100, 200, 500, 1000] {
        let (bead, run) = struck(beads, 0.1, 1.15)?;
        let last = |series: &Series| series.values[series.len() - 1];
        let momentum: f64 = run.bead_velocity.iter().map(last).sum();
        let speed = (beads >= 50).then(|| {
            let (from, to) = (2 * beads / 5, 4 * beads / 5);
            let ((start, _), (end, peak)) = (crest(&run.bead_velocity[from]), crest(&run.bead_velocity[to]));
            2.0 * bead.radius * (to - from) as f64 / (end - start) / speed_of(&bead, DISCRETE_SPEED_FACTOR, peak)
        });
        println!(
            "{beads:>4} {:>23.6} {:>10.8} {:>21} {:>14.1} {:>15.2}",
            last(&run.pole_velocity) / 0.1,
            momentum / 0.1,
            speed.map_or_else(|| "–".into(), |speed| format!("{speed:.7}")),
            run.work.steps as f64 / beads as f64,
            run.work.events as f64 / beads as f64,
        );
        thousand = Some((bead, run));
    }
    let Some((bead, run)) = thousand else { return Ok(()) };
    let seen = profile(&run, 500);
    println!("\nthe pulse at bead 500 of 1000");
    println!("                            run   discrete   Nesterenko");
    let half = |of: &dyn Fn(f64) -> f64| 2.0 * half_width(of);
    let long_force = |x: f64| nesterenko_profile(x).powf(1.5);
    println!(
        "width of the velocity at half its height, diameters  {:.5}  {:.5}  {:.5}",
        half_width_of(&seen.velocity),
        half(&|x| pulse.velocity(x)),
        half(&nesterenko_profile)
    );
    println!(
        "width of the force at half its height, diameters     {:.5}  {:.5}  {:.5}",
        half_width_of(&seen.force),
        half(&|x| pulse.force(x)),
        half(&long_force)
    );
    println!(
        "beads that hold 99 % of the kinetic energy           {}  (Nesterenko's pulse is {:.3} long)",
        seen.beads,
        nesterenko_width(0.5)
    );
    let apart = |points: &[(f64, f64)], of: &dyn Fn(f64) -> f64| {
        points.iter().map(|(x, value)| (value - of(*x)).abs()).fold(0.0, f64::max)
    };
    println!(
        "largest difference of the velocity's shape, of its crest: discrete {:.1e}, cos⁴ {:.1e}",
        apart(&seen.velocity, &|x| pulse.velocity(x)),
        apart(&seen.velocity, &nesterenko_profile)
    );
    println!(
        "largest difference of the force's shape, of its crest: discrete {:.1e}, cos⁶ {:.1e}",
        apart(&seen.force, &|x| pulse.force(x)),
        apart(&seen.force, &long_force)
    );
    draw(&folder, &pulse, &seen, &bead, &speeds)
}

/// N free beads, the first struck at `strike` m/s, until the pulse has run `lengths` lengths of the chain: the bead and the run.
fn struck(beads: usize, strike: f64, lengths: f64) -> Result<(Bead, Response), Box<dyn Error>> {
    let keys = [format!("chain.beads={beads}"), "damping.kind=none".into()];
    let mut scene = scene::load("rigid", &keys)?;
    let bead = scene.chain.beads[0].clone();
    // No piston and no wall: gaps without end.
    scene.chain.gaps[0] = f64::INFINITY;
    scene.chain.gaps[beads] = f64::INFINITY;
    scene.amplitude_scale = 0.0;
    let passing = 2.0 * bead.radius / speed_of(&bead, DISCRETE_SPEED_FACTOR, 0.68 * strike);
    // A pulse is five beads long; two beads part after some four passages.
    scene.duration = passing * (lengths * beads as f64 + 6.0);
    scene.output_step = passing / 6.0;
    let mut initial = InitialState::at_rest(beads);
    initial.velocities[0] = strike;
    Ok((bead, ChainModel.run_from(&scene, &initial, &mut |_| true)?))
}

fn speed_of(bead: &Bead, factor: f64, peak: f64) -> f64 {
    solitary_wave_speed(factor, bead.radius, bead.mass(), bead_pair_stiffness(bead, bead), peak)
}

/// Instant (s) and height of the largest value: a bell through the three samples around it.
fn crest(series: &Series) -> (f64, f64) {
    let values = &series.values;
    let highest = (1..values.len() - 1).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap_or(1);
    let [before, at, after] =
        [highest - 1, highest, highest + 1].map(|index| values[index].max(f64::MIN_POSITIVE).ln());
    let shift = 0.5 * (before - after) / (before - 2.0 * at + after);
    (series.time(highest) + shift * series.step, (at - 0.25 * (before - after) * shift).exp())
}

/// A pulse over its crest, against the distance from there in bead diameters.
struct Profile {
    velocity: Vec<(f64, f64)>,
    force: Vec<(f64, f64)>,
    /// Beads that hold 99 % of the kinetic energy as the pulse passes.
    beads: usize,
}

fn profile(run: &Response, number: usize) -> Profile {
    let (start, _) = crest(&run.bead_velocity[number - 100]);
    let (now, _) = crest(&run.bead_velocity[number]);
    let (end, _) = crest(&run.bead_velocity[number + 100]);
    let speed = 200.0 / (end - start);
    let around = |series: &Series| {
        let (at, height) = crest(series);
        let places = (0..series.len()).map(|index| (speed * (series.time(index) - at), series.values[index] / height));
        places.filter(|(place, _)| place.abs() <= 4.0).collect::<Vec<_>>()
    };
    let sample = ((now - run.pole_velocity.start) / run.pole_velocity.step).round() as usize;
    let mut energies: Vec<f64> = run.bead_velocity.iter().map(|series| series.values[sample].powi(2)).collect();
    energies.sort_by(|a, b| b.total_cmp(a));
    let total: f64 = energies.iter().sum();
    let mut held = 0.0;
    let beads = energies.iter().take_while(|energy| {
        let before = held;
        held += **energy;
        before < 0.99 * total
    });
    Profile {
        velocity: around(&run.bead_velocity[number]),
        force: around(&run.contact_force[number]),
        beads: beads.count(),
    }
}

/// Distance from the crest at which a shape has fallen to one half.
fn half_width(of: &dyn Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 2.4);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if of(middle) > 0.5 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Full width at half height of a shape sampled evenly: cubics through the logarithms of four samples.
fn half_width_of(points: &[(f64, f64)]) -> f64 {
    let logarithm = |index: usize| points[index].1.max(1e-12).ln();
    let crossing = |index: usize| {
        let [a, b, c, d] = [index - 1, index, index + 1, index + 2].map(logarithm);
        let within = |t: f64| {
            b + t * ((c - b) - (1.0 - t) * ((1.0 + t) * (d - 2.0 * c + b) + (2.0 - t) * (c - 2.0 * b + a)) / 6.0)
        };
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle: f64 = 0.5 * (low + high);
            if (within(middle) > 0.5f64.ln()) == (b > 0.5f64.ln()) { low = middle } else { high = middle }
        }
        points[index].0 + low * (points[index + 1].0 - points[index].0)
    };
    let crossings: Vec<f64> = (1..points.len() - 2)
        .filter(|index| (points[*index].1 > 0.5) != (points[index + 1].1 > 0.5))
        .map(crossing)
        .collect();
    crossings.last().unwrap_or(&0.0) - crossings.first().unwrap_or(&0.0)
}

fn draw(
    folder: &Path,
    pulse: &DiscretePulse,
    seen: &Profile,
    bead: &Bead,
    speeds: &[(f64, f64)],
) -> Result<(), Box<dyn Error>> {
    let curve = |of: &dyn Fn(f64) -> f64| {
        (0..=320).map(|i| -4.0 + 8.0 * f64::from(i) / 320.0).map(|x| (x, of(x))).collect::<Vec<_>>()
    };
    let shape = Panel::new(Axis::new("Distance from the crest", "bead diameters"), Axis::new("Over the crest", "1"))
        .titled("(a) the pulse at bead 500 of 1000")
        .height(58.0)
        .line("velocity, discrete chain", curve(&|x| pulse.velocity(x)), Stroke::new(Colour::Blue))
        .line("velocity, Nesterenko's cos⁴", curve(&nesterenko_profile), Stroke::new(Colour::Black).dash(Dash::Dashed))
        .points("velocity, run", seen.velocity.clone(), Colour::Blue, Marker::Ring)
        .line("force, discrete chain", curve(&|x| pulse.force(x)), Stroke::new(Colour::Orange))
        .points("force, run", seen.force.clone(), Colour::Orange, Marker::Cross);
    let law = (0..=50).map(|i| 0.004 * 250f64.powf(f64::from(i) / 50.0));
    let law = law.map(|peak| (peak, speed_of(bead, DISCRETE_SPEED_FACTOR, peak))).collect();
    let speed = Panel::new(
        Axis::new("Largest velocity of a bead", "m/s").logarithmic(),
        Axis::new("Speed of the pulse", "m/s").logarithmic(),
    )
    .titled("(b) no speed of sound")
    .height(58.0)
    .line("closed form, power 1/5", law, Stroke::new(Colour::Black))
    .points("run, fifty beads", speeds.to_vec(), Colour::Blue, Marker::Disc);
    let figure =
        Figure::new("Solitary wave of an uncompressed chain: shape after 500 of 1000 beads, and speed over strength.")
            .sized(PAGE_WIDTH_MM, 2)
            .panel(shape)
            .panel(speed);
    fs::create_dir_all(folder)?;
    fs::write(folder.join("solitary-wave.svg"), figure.to_svg()?)?;
    fs::write(folder.join("solitary-wave.png"), figure.to_png()?)?;
    println!("\nfigure: {}", folder.join("solitary-wave.svg").display());
    Ok(())
}
