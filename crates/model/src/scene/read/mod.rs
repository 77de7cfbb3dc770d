//! A checked [`Scene`] from the keys of a document.

mod bench;
mod model;
mod support;
mod water;

use super::{
    DEFAULT_VIBROMETER_BANDWIDTH, DriveKind, Scene, Support,
    error::SceneError,
    holder,
    reader::Reader,
    shown::{frequency, length, time},
};

const MOST_SAMPLES: f64 = 2e7;
/// Drive frequency below which the unit was probably forgotten, Hz.
const SLOWEST_HORN: f64 = 1e3;

pub(super) fn scene(reader: &Reader<'_>, name: &str, notes: &mut Vec<String>) -> Result<Scene, SceneError> {
    let chain = bench::chain(reader)?;
    let drive = bench::drive(reader, &chain)?;
    if drive.frequency < SLOWEST_HORN && drive.kind.striker().is_none() {
        notes.push(format!(
            "`drive.frequency` is {}: a plain number is in Hz, and no horn is as slow as that; write it with its unit, such as \"73 kHz\"",
            frequency(drive.frequency)
        ));
    }
    let amplitude_scale = reader.number("alpha")?;
    if !matches!(drive.kind, DriveKind::UnreadRecord { .. }) {
        let motion = amplitude_scale * drive.amplitude;
        let radius = chain.beads[0].radius;
        if motion >= radius {
            let expected = format!("α × amplitude below the bead radius {}", length(radius));
            return Err(reader.out_of_range("drive.amplitude", expected, length(motion)));
        }
    }
    let duration = reader.number("duration")?;
    let output_step = reader.number("output_step")?;
    if output_step > duration {
        let expected = format!("at most the duration {}", time(duration));
        let key = if reader.has("output_step") { "output_step" } else { "duration" };
        return Err(reader.out_of_range(key, expected, time(output_step)));
    }
    if duration / output_step > MOST_SAMPLES {
        let expected = format!("at most {MOST_SAMPLES} samples in {}", time(duration));
        return Err(reader.out_of_range("output_step", expected, time(output_step)));
    }
    let bandwidth = reader.given("vibrometer.bandwidth")?;
    let vibrometer_bandwidth = bandwidth.unwrap_or(f64::max(DEFAULT_VIBROMETER_BANDWIDTH, 4.0 * drive.frequency));
    if vibrometer_bandwidth <= drive.frequency {
        let expected = format!("above the drive frequency {}", frequency(drive.frequency));
        return Err(reader.out_of_range("vibrometer.bandwidth", expected, frequency(vibrometer_bandwidth)));
    }
    let support = support::support(reader, &chain)?;
    let water = match &support {
        Support::Disc { shape, .. } => water::water(reader, shape)?,
        _ => None,
    };
    let kind = model::kind(reader)?;
    let exact_friction = holder::is_exact(kind, &support);
    let least_radius = chain.beads.iter().map(|bead| bead.radius).fold(f64::INFINITY, f64::min);
    Ok(Scene {
        name: reader.text("name")?.unwrap_or(name).to_owned(),
        description: reader.text("description")?.unwrap_or("").to_owned(),
        piston: reader.word("piston.contact")?,
        piston_material: support::piston_material(reader, &chain)?,
        support,
        water,
        damping: bench::damping(reader, notes)?,
        contact_law: model::contact_law(reader)?,
        yield_strength: reader.given("contact.yield_strength")?,
        horn: bench::horn(reader, drive.frequency)?,
        holder: bench::holder(reader, (exact_friction, kind.is_meshed()), least_radius)?,
        loss: bench::loss(reader)?,
        model: model::settings(reader, drive.frequency, output_step, notes)?,
        chain,
        drive,
        amplitude_scale,
        duration,
        output_step,
        vibrometer_bandwidth,
    })
}
