//! The pressure field behind `granchain replay`: maps, beam patterns, the face's velocity for a field solver.
//!
//! Nothing here runs unless requested. It is computed by a second pass whose output is on the clock of disc and water.

use std::f64::consts::{FRAC_PI_2, TAU};

use anyhow::Context;
use clap::Args;
use faer::c64;

use crate::{
    cli::{
        arguments::{positive_quantity, usage},
        output::OutputFolder,
        summary,
    },
    feature::{Window, line_phasor, line_weights},
    model::{
        ModelError, Prepared,
        water::{
            field::{amplitude_map, far_field},
            source::FieldSource,
        },
    },
    report::{
        figure::Figure,
        interface::{FaceQuantity, InterfaceGrid},
        page::Files,
        pressure::{Beam, Scenery, beams},
    },
    scene::{Baffle, Scene, Support},
    signal::{Dimension, Series},
};

/// Flags of the pressure field.
#[derive(Debug, Clone, Default, Args)]
pub struct FieldArguments {
    /// If the scene has water: draw the pressure in it at these instants, such as "60us,62us"
    #[arg(long, value_name = "TIMES", value_parser = times, requires = "out", help_heading = "Water")]
    pub pressure_map: Option<List>,
    /// If the scene has water: draw the amplitude of the pressure at these frequencies, such as "73kHz,0.949MHz"
    #[arg(long, value_name = "FREQUENCIES", value_parser = frequencies, requires = "out", help_heading = "Water")]
    pub pressure_map_frequency: Option<List>,
    /// If the scene has water: draw the far-field beam pattern at these frequencies, such as "0.5MHz,0.949MHz"
    #[arg(long, value_name = "FREQUENCIES", value_parser = frequencies, requires = "out", help_heading = "Water")]
    pub beam_pattern: Option<List>,
    /// If the scene has water: write the velocity of the disc's wet side (with a soft baffle: the pressure on it) as CSV and NPY, with advice for the
    /// grid of a field solver such as k-Wave
    #[arg(long, requires = "out", help_heading = "Water")]
    pub export_interface: bool,
}

/// Values of one flag, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct List(pub Vec<f64>);

fn times(text: &str) -> Result<List, String> {
    list(text, Dimension::TIME)
}

fn frequencies(text: &str) -> Result<List, String> {
    list(text, Dimension::FREQUENCY)
}

fn list(text: &str, dimension: Dimension) -> Result<List, String> {
    text.split(',').map(|part| positive_quantity(part.trim(), dimension)).collect::<Result<_, _>>().map(List)
}

impl FieldArguments {
    pub fn is_given(&self) -> bool {
        self.given().is_some()
    }

    /// The first flag given, if any.
    fn given(&self) -> Option<&'static str> {
        let Self { pressure_map, pressure_map_frequency, beam_pattern, export_interface } = self;
        [
            ("--pressure-map", pressure_map.is_some()),
            ("--pressure-map-frequency", pressure_map_frequency.is_some()),
            ("--beam-pattern", beam_pattern.is_some()),
            ("--export-interface", *export_interface),
        ]
        .into_iter()
        .find_map(|(flag, given)| given.then_some(flag))
    }
}

/// Refuse flags of the field for a scene that has none.
pub fn refuse_idle(flags: &FieldArguments, scene: &Scene) -> anyhow::Result<()> {
    match flags.given() {
        Some(flag) if scene.water.is_none() => {
            Err(usage(format!("{flag} needs water behind a disc; scene `{}` has none: try --scene water", scene.name)))
        }
        _ if flags.beam_pattern.is_some() && scene.water.as_ref().is_some_and(|water| water.baffle == Baffle::Soft) => {
            Err(usage(
                "--beam-pattern needs `water.baffle` = \"rigid\"; beside a soft one draw --pressure-map-frequency"
                    .to_owned(),
            ))
        }
        _ => Ok(()),
    }
}

/// Figures by name, and tables.
pub type Field = (Vec<(&'static str, Figure)>, Files);

/// Everything requested.
///
/// - `prepared`: the bodies of the scene, prepared only if something is computed
/// - `window`: where the drive is on, s
pub fn make(
    flags: &FieldArguments,
    scene: &Scene,
    prepared: impl FnOnce() -> Result<Prepared, ModelError>,
    window: Window,
) -> anyhow::Result<Field> {
    let (mut figures, mut files) = (Vec::new(), Files::new());
    let (Some(_), Some(water), Support::Disc { shape, .. }) = (flags.given(), &scene.water, &scene.support) else {
        return Ok((figures, files));
    };
    let source = FieldSource::new(scene)?;
    let on_clock = Scene { output_step: source.step(), ..scene.clone() };
    let mut response =
        prepared()?.run(&on_clock, &mut |_| true).context("the second pass, on the clock of disc and water, failed")?;
    let force = response.contact_force.pop().unwrap_or_else(|| Series::new(0.0, source.step(), Vec::new()));
    let scenery =
        Scenery { radius: shape.radius, thickness: shape.thickness, grid: source.grid(), method: source.method() };
    if let Some(List(times)) = &flags.pressure_map {
        let maps = source.maps(&force, &scenery.grid, times)?;
        let maps: Vec<(f64, Vec<f64>)> = times.iter().copied().zip(maps).collect();
        figures.push(("pressure_map", scenery.instants(&maps)));
    }
    let radiator = source.radiator();
    if let Some(List(frequencies)) = &flags.pressure_map_frequency {
        let weights = |&frequency: &f64| {
            let weights = line_weights(&force, window, frequency);
            weights.into_iter().map(|(re, im)| c64::new(re, im)).collect::<Vec<_>>()
        };
        let meshed = match source.is_soft() {
            true => {
                source.weighted_maps(&force, &scenery.grid, &frequencies.iter().map(weights).collect::<Vec<_>>())?
            }
            false => None,
        };
        let (maps, method) = match meshed {
            Some(maps) => (maps, source.method()),
            None => {
                let motion = source.motion(&force)?;
                let map = |&frequency: &f64| {
                    let velocities = phasors(motion.velocity(), window, frequency);
                    amplitude_map(&radiator, &water.liquid, &scenery.grid, &velocities, TAU * frequency)
                };
                (frequencies.iter().map(map).collect::<Result<_, _>>()?, "Rayleigh integral")
            }
        };
        let sizes = maps.iter().map(|map| map.iter().map(|value| value.norm()).collect());
        let maps: Vec<(f64, Vec<f64>)> = frequencies.iter().copied().zip(sizes).collect();
        let scenery = Scenery { method, ..scenery };
        figures.push(("pressure_map_frequency", scenery.frequencies(&maps)));
    }
    if let Some(List(frequencies)) = &flags.beam_pattern {
        let angles: Vec<f64> = (0..=180).map(|half| f64::from(half) / 180.0 * FRAC_PI_2).collect();
        let motion = source.motion(&force)?;
        let pattern = |&frequency: &f64| {
            let velocities = phasors(motion.velocity(), window, frequency);
            let found = far_field(&radiator, &water.liquid, &angles, &velocities, TAU * frequency);
            Beam { frequency, amplitudes: found.iter().map(|value| value.norm()).collect() }
        };
        let patterns: Vec<Beam> = frequencies.iter().map(pattern).collect();
        figures.push(("beam_pattern", beams(&angles, &patterns, None)));
    }
    if flags.export_interface {
        let grid = |held| {
            let duration = scene.duration.min(force.end());
            InterfaceGrid::new((summary::program(), held), shape.radius, &water.liquid, water.baffle.name(), duration)
        };
        // What radiates behind a soft baffle; behind a rigid one the face's velocity does.
        let face = if source.is_soft() { source.face_pressure(&force)? } else { None };
        let (grid, rows) = match face {
            Some(face) => {
                let grid = grid(FaceQuantity::Pressure);
                let rows = face.face(&grid.radii(), &grid.times());
                (grid, rows)
            }
            None => {
                let grid = grid(FaceQuantity::Velocity);
                let rows = source.motion(&force)?.face(&radiator, &grid.radii(), &grid.times());
                (grid, rows)
            }
        };
        files.extend(grid.files(&rows).context("the tables of the disc's back cannot be written")?);
    }
    Ok((figures, files))
}

/// Amplitude and phase of every shape's velocity at a frequency (Hz), Hann's window over the drive.
fn phasors(velocities: &[Series], window: Window, frequency: f64) -> Vec<c64> {
    let of = |velocity: &Series| {
        let found = line_phasor(velocity, window, frequency);
        c64::new(found.amplitude * found.phase.cos(), found.amplitude * found.phase.sin())
    };
    velocities.iter().map(of).collect()
}

/// Writes what was requested.
pub fn write(folder: &OutputFolder, (figures, files): Field) -> anyhow::Result<()> {
    for (name, figure) in figures {
        folder.write(format!("{name}.svg"), figure.to_svg()?)?;
        folder.write(format!("{name}.png"), figure.to_png()?)?;
    }
    folder.write_all(files)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_carry_their_units_and_refuse_plain_numbers() {
        assert_eq!(times("60 us, 62us"), Ok(List(vec![60e-6, 62e-6])));
        let found = frequencies("72.5kHz,0.95 MHz").unwrap().0;
        assert!((found[0] - 72.5e3).abs() < 1e-9 && (found[1] - 0.95e6).abs() < 1e-6);
        assert!(times("60").is_err() && times("60us,").is_err() && frequencies("-1kHz").is_err());
    }
}
