//! Beads, drive, horn, bead guide, dashpots and losses.

use crate::scene::{
    Bead, Chain, DEFAULT_SLIP_VELOCITY, Damping, DampingCoefficients, DampingKind, Drive, DriveKind, Holder, Horn,
    MaterialLoss, Relaxation, Sensor, TermDescription, UNREAD_FREQUENCY, document::resolved, error::SceneError,
    key::Bound, reader::Reader, shown::length,
};
use granchain_signal::{Dimension, Quantity};

pub(super) fn chain(reader: &Reader<'_>) -> Result<Chain, SceneError> {
    let count = reader.beads()?;
    let radius = reader.number("chain.radius")?;
    let material = reader.material("chain.material")?;
    let mut beads = vec![Bead { radius, material }; count];
    reader.override_beads(&mut beads)?;
    let gaps = reader.gaps(count, radius)?;
    let precompression = reader.number("chain.precompression")?;
    // Overlaps of 7 % of the radius: far beyond Hertz' small contacts, and beyond the yield of any steel.
    let softest =
        beads.iter().map(|bead| bead.material.youngs_modulus * bead.radius.powi(2)).fold(f64::INFINITY, f64::min);
    if precompression > 0.01 * softest {
        let force = |value| Quantity::new(value, Dimension::FORCE).to_string();
        let limit = format!("{:.2e}", 0.01 * softest).parse().unwrap_or(softest);
        let expected = format!("at most {} (E a²/100), where contacts are still small", force(limit));
        return Err(reader.out_of_range("chain.precompression", expected, force(precompression)));
    }
    if precompression > 0.0
        && let Some(open) = gaps.iter().position(|gap| *gap > 0.0)
    {
        return Err(SceneError::PrecompressedGap {
            place: reader.place("chain.precompression"),
            force: Quantity::new(precompression, Dimension::FORCE).to_string(),
            contact: open + 1,
            gap: length(gaps[open]),
        });
    }
    let gravity = reader.given("chain.gravity")?.unwrap_or(0.0);
    Ok(Chain { beads, gaps, precompression, gravity, sensor: sensor(reader, count)? })
}

fn sensor(reader: &Reader<'_>, beads: usize) -> Result<Option<Sensor>, SceneError> {
    let (key, share) = ("chain.sensor", "chain.sensor_share");
    let Some(bead) = reader.count(key)?.map(|number| number as usize) else {
        reader.refuse_alone(&[share], key)?;
        return Ok(None);
    };
    if bead > beads {
        return Err(reader.out_of_range(key, format!("a bead from 1 to {beads}"), bead.to_string()));
    }
    Ok(Some(Sensor { bead, share: reader.number(share)? }))
}

/// Acceleration with which a striker falls, m/s².
const FALL: f64 = 9.81;

/// A striker, by default a bead like the first.
fn striker(reader: &Reader<'_>, first: &Bead) -> Result<Drive, SceneError> {
    let velocity = match (reader.given("drive.velocity")?, reader.given("drive.height")?) {
        (Some(velocity), None) => velocity,
        (None, Some(height)) => (2.0 * FALL * height).sqrt(),
        (None, None) => return Err(reader.missing("drive.velocity", Some("or `drive.height`, from which it falls"))),
        (Some(_), Some(height)) => {
            let expected = "`drive.velocity` or `drive.height`, not both".to_owned();
            return Err(reader.out_of_range("drive.height", expected, length(height)));
        }
    };
    let mut bead = Bead::sphere(reader.given("drive.radius")?.unwrap_or(first.radius), first.material.clone());
    if let Some(name) = reader.text("drive.material")? {
        bead.material = reader.material_named(name, "drive.material", || reader.place("drive.material"))?;
    }
    if let Some(entry) = reader.entry("drive.mass") {
        reader.set_mass(&mut bead, entry, "drive.mass", "striker")?;
    }
    let frequency = 1.0 / bead.collision_duration(first, velocity);
    Ok(Drive { kind: DriveKind::Striker { bead, velocity }, amplitude: 0.0, frequency })
}

pub(super) fn drive(reader: &Reader<'_>, chain: &Chain) -> Result<Drive, SceneError> {
    let kind = reader.required_choice("drive.kind")?;
    if kind == "striker" {
        return striker(reader, &chain.beads[0]);
    }
    if kind == "record" {
        let frequency = reader.given("drive.frequency")?.unwrap_or(UNREAD_FREQUENCY);
        let reason = Some("a drive of kind `record` is read from a file");
        let file = reader.required_text("drive.file", reason)?;
        let file = resolved(file, &reader.place("drive.file"));
        return Ok(Drive { kind: DriveKind::UnreadRecord { file }, amplitude: 1.0, frequency });
    }
    let frequency = reader.number("drive.frequency")?;
    let (amplitude, cycles) = (reader.number("drive.amplitude")?, reader.number("drive.cycles")?);
    // Elsewhere the burst would begin or end away from zero, and the piston would have to jump.
    let must_close = |parts: f64, expected: &str| {
        if (cycles * parts).fract() == 0.0 {
            return Ok(());
        }
        let expected = format!("{expected}, where the sine passes zero; else the piston would jump");
        Err(reader.out_of_range("drive.cycles", expected, cycles.to_string()))
    };
    let kind = match kind {
        "sine" => {
            must_close(2.0, "a whole or half number of cycles")?;
            DriveKind::SineCycles { cycles }
        }
        "gaussian-burst" => {
            must_close(1.0, "a whole number of cycles")?;
            DriveKind::GaussianBurst { cycles }
        }
        _ => {
            let ring_up = reader.number("drive.ring_up")?;
            if ring_up == 0.0 {
                must_close(2.0, "a whole or half number of cycles (with ring_up = 0)")?;
            }
            DriveKind::ToneBurst { cycles, ring_up }
        }
    };
    Ok(Drive { kind, amplitude, frequency })
}

/// The horn that a scene asks for; its resonance lies at the drive unless it says otherwise.
pub(super) fn horn(reader: &Reader<'_>, drive_frequency: f64) -> Result<Option<Horn>, SceneError> {
    let Some(mass) = reader.given("horn.mass")? else {
        reader.refuse_alone(&["horn.frequency", "horn.quality"], "horn.mass")?;
        return Ok(None);
    };
    let frequency = reader.given("horn.frequency")?.unwrap_or(drive_frequency);
    Ok(Some(Horn { mass, frequency, quality: reader.given("horn.quality")?.unwrap_or(f64::INFINITY) }))
}

const KEYS: [&str; 4] = ["holder.drag", "holder.friction_force", "holder.friction_coefficient", "holder.clearance"];

/// Largest sine of the angle between lines of centres and the axis in models whose contacts are along the axis.
const STRAIGHT: f64 = 0.05;

/// The bead guide that a scene asks for; `exact` where the model can do the exact law of friction, `meshed` where bodies are.
pub(super) fn holder(
    reader: &Reader<'_>,
    (exact, meshed): (bool, bool),
    least_radius: f64,
) -> Result<Option<Holder>, SceneError> {
    if !KEYS.iter().any(|key| reader.has(key)) {
        reader.refuse_alone(&["holder.slip_velocity"], "holder.friction_force")?;
        return Ok(None);
    }
    let number = |key| Ok::<_, SceneError>(reader.given(key)?.unwrap_or(0.0));
    let slip_velocity = reader.given("holder.slip_velocity")?;
    let holder = Holder {
        drag: number(KEYS[0])?,
        friction_force: number(KEYS[1])?,
        friction_coefficient: number(KEYS[2])?,
        clearance: number(KEYS[3])?,
        slip_velocity: slip_velocity.unwrap_or(if exact { 0.0 } else { DEFAULT_SLIP_VELOCITY }),
    };
    if !exact && holder.has_friction() && holder.slip_velocity == 0.0 {
        let expected = "a positive velocity: the exact law (0) is of the chain (`model.kind` = \"chain\") before anything but a disc".to_owned();
        return Err(reader.out_of_range("holder.slip_velocity", expected, "0 m/s".to_owned()));
    }
    if holder.friction_coefficient > 0.0 && holder.clearance == 0.0 {
        let key = "holder.friction_coefficient";
        let expected = "`holder.clearance` beside it: straight chains do not press on the wall".to_owned();
        return Err(reader.out_of_range(key, expected, holder.friction_coefficient.to_string()));
    }
    // Half the radius is 14° between equal beads: what is left out is no longer small.
    if holder.clearance > 0.5 * least_radius {
        let expected = format!("at most half the least radius of a bead, {}", length(0.5 * least_radius));
        return Err(reader.out_of_range("holder.clearance", expected, length(holder.clearance)));
    }
    // Contacts of meshed bodies are along the axis: what the obliquity does to their compliance is left out, 0.3 % at this angle.
    if meshed && holder.clearance > STRAIGHT * 2.0 * least_radius {
        let expected = format!(
            "at most {}, an angle of {STRAIGHT} between equal beads: the models with meshed bodies leave out what the angle does to a contact's stiffness; \
             use model.kind=chain",
            length(STRAIGHT * 2.0 * least_radius)
        );
        return Err(reader.out_of_range("holder.clearance", expected, length(holder.clearance)));
    }
    // What is stated as none is none, and costs nothing.
    let acts = holder.acts() || holder.clearance > 0.0;
    Ok(Some(holder).filter(|_| acts))
}

pub(super) fn damping(reader: &Reader<'_>, notes: &mut Vec<String>) -> Result<Damping, SceneError> {
    let kind = reader.required_choice("damping.kind")?;
    let mut coefficient = |key: &str, dimension, default| {
        let given = reader.quantity(key, dimension, Bound::NotNegative)?;
        Ok(given.unwrap_or_else(|| {
            let value = Quantity::new(default, dimension);
            notes.push(format!("`{key}` is not given for `damping.kind = \"{kind}\"`; taken as the paper's {value}"));
            default
        }))
    };
    let kind = DampingKind::named(kind).unwrap_or(DampingKind::None);
    let mut coefficients = DampingCoefficients::default();
    for term in kind.terms() {
        let TermDescription { dimension, default, .. } = *term.description();
        coefficients[*term] = coefficient(kind.key_of(*term), dimension, default)?;
    }
    let placement = reader.word("damping.at")?;
    Ok(Damping { kind, coefficients, placement, tension: reader.flag("damping.tension")?.unwrap_or(false) })
}

pub(super) fn loss(reader: &Reader<'_>) -> Result<MaterialLoss, SceneError> {
    let strength = reader.given("loss.relaxation")?;
    let time = reader.given("loss.relaxation_time")?;
    let relaxation = match (strength, time) {
        (Some(strength), Some(time)) => (strength > 0.0).then_some(Relaxation { strength, time }),
        (Some(_), None) => return Err(reader.missing("loss.relaxation_time", Some("`loss.relaxation` needs it"))),
        (None, _) => {
            reader.refuse_alone(&["loss.relaxation_time"], "loss.relaxation")?;
            None
        }
    };
    let number = |key| Ok::<_, SceneError>(reader.given(key)?.unwrap_or(0.0));
    Ok(MaterialLoss { beads: number("loss.beads")?, support: number("loss.support")?, relaxation })
}
