//! What holds the far end.

use crate::scene::{
    AnnulusShape, Chain, DEFAULT_DISC_DENSITY, DiscShape, FlatContact, Material, Plate, Support, error::SceneError,
    reader::Reader, shown::length,
};
use granchain_signal::{Dimension, Quantity};

/// Least and largest angle of the contact normal from the axis, °: flatter, the bead lies too near the clamped corner to be meshed at any
/// density; steeper, it is a wedge, whose travel is a multiple of what the ring gives way.
const CONTACT_ANGLES: (f64, f64) = (25.0, 80.0);

pub(super) fn support(reader: &Reader<'_>, chain: &Chain) -> Result<Support, SceneError> {
    let kind = reader.required_choice("support.kind")?;
    Ok(match kind {
        "annulus" => {
            let radius = chain.beads.last().map_or(0.0, |bead| bead.radius);
            let stiffness_factor = reader.number("support.stiffness_factor")?;
            let (shape, material) = (annulus(reader, radius)?, support_material(reader)?);
            Support::Annulus { shape, stiffness_factor, material }
        }
        "spring" => {
            let reason = Some("a support of kind `spring` needs it");
            Support::Spring { stiffness: reader.required("support.stiffness", reason)? }
        }
        "foundation" => Support::Foundation {
            youngs_modulus: reader
                .required("support.youngs_modulus", Some("a support of kind `foundation` needs it"))?,
            poissons_ratio: reader.number("support.poissons_ratio")?,
            loss_time: reader.number("support.loss_time")?,
            plate: plate(reader)?,
        },
        "disc" => disc(reader)?,
        "free" => {
            if chain.precompression > 0.0 {
                let force = Quantity::new(chain.precompression, Dimension::FORCE).to_string();
                let expected =
                    "0 N before a free end (`support.kind` = \"free\"), which holds no static force".to_owned();
                return Err(reader.out_of_range("chain.precompression", expected, force));
            }
            Support::Free
        }
        "half-space" => Support::Flat(FlatContact::HalfSpace),
        _ => Support::Flat(FlatContact::Rigid),
    })
}

/// Read the ring of a scene that holds a bead of that radius, m.
fn annulus(reader: &Reader<'_>, bead_radius: f64) -> Result<AnnulusShape, SceneError> {
    let shape = AnnulusShape {
        ring_radius: reader.number("support.ring_radius")?,
        section_radius: reader.number("support.section_radius")?,
    };
    let key = if reader.has("support.section_radius") { "support.section_radius" } else { "support.ring_radius" };
    if shape.opening() <= 0.0 {
        let expected = format!(
            "a section radius below the ring radius {}, which leaves an opening; change one of both",
            length(shape.ring_radius)
        );
        return Err(reader.out_of_range(key, expected, length(shape.section_radius)));
    }
    if bead_radius <= shape.opening() {
        let place = reader.place("support.kind");
        return Err(SceneError::ThroughAnnulus {
            place,
            radius: length(bead_radius),
            opening: length((1e9 * shape.opening()).round() / 1e9),
        });
    }
    let angle = shape.contact_angle(bead_radius).to_degrees();
    if !(CONTACT_ANGLES.0..=CONTACT_ANGLES.1).contains(&angle) {
        return Err(SceneError::AnnulusAngle {
            place: reader.place(if reader.has(key) { key } else { "support.kind" }),
            angle: format!("{angle:.1}°"),
            between: CONTACT_ANGLES,
            remedy: if angle > CONTACT_ANGLES.1 {
                "smaller ring or a larger bead"
            } else {
                "larger ring or a smaller bead"
            },
        });
    }
    Ok(shape)
}

fn disc(reader: &Reader<'_>) -> Result<Support, SceneError> {
    let (radius, thickness) = (reader.number("disc.radius")?, reader.number("disc.thickness")?);
    if thickness >= radius {
        let expected = format!("a thickness below the disc's radius {}: a plate, no rod", length(radius));
        let key = if reader.has("disc.thickness") { "disc.thickness" } else { "disc.radius" };
        return Err(reader.out_of_range(key, expected, length(thickness)));
    }
    let key = "disc.material";
    let name = reader.text(key)?.map_or_else(|| Material::vitreous_carbon().name, str::to_owned);
    let material = reader.material_named(&name, key, || reader.place(key))?;
    let rim = reader.word("disc.rim")?;
    let mesh_density = reader.count("disc.mesh_density")?.unwrap_or(DEFAULT_DISC_DENSITY);
    Ok(Support::Disc { shape: DiscShape { radius, thickness, material, rim }, mesh_density })
}

fn plate(reader: &Reader<'_>) -> Result<Option<Plate>, SceneError> {
    let key = "support.plate_material";
    let Some(thickness) = reader.given("support.plate_thickness")? else {
        reader.refuse_alone(&[key], "support.plate_thickness")?;
        return Ok(None);
    };
    let name = reader.required_text(key, Some("`support.plate_thickness` needs it"))?;
    Ok(Some(Plate { thickness, material: reader.material_named(name, key, || reader.place(key))? }))
}

/// The material of the piston's face, where it is another than the first bead's.
pub(super) fn piston_material(reader: &Reader<'_>, chain: &Chain) -> Result<Option<Material>, SceneError> {
    let key = "piston.material";
    let Some(name) = reader.text(key)? else { return Ok(None) };
    let material = reader.material_named(name, key, || reader.place(key))?;
    Ok(Some(material).filter(|material| chain.beads.first().is_none_or(|bead| bead.material != *material)))
}

fn support_material(reader: &Reader<'_>) -> Result<Material, SceneError> {
    let key = "support.material";
    let name = reader.text(key)?.map_or_else(|| Material::resin().name, str::to_owned);
    reader.material_named(&name, key, || reader.place(key))
}
