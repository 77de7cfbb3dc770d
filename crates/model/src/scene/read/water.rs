//! The water behind the disc.

use super::model;
use crate::scene::{
    Absorption, Baffle, DiscShape, FieldPoint, Medium, ModelKind, Water, WaterMesh, WaterMethod, WaterSettings,
    document::Value,
    error::{Place, SceneError},
    key::Bound,
    reader::{Reader, quantity, wrong_type},
    shown::length,
};
use granchain_signal::Dimension;

const MOST_POINTS: usize = 100;

pub(super) fn water(reader: &Reader<'_>, disc: &DiscShape) -> Result<Option<WaterSettings>, SceneError> {
    let medium = match reader.choice("water.medium")? {
        Some("none") => return Ok(None),
        Some("tissue") => Medium::Tissue,
        _ => Medium::Water,
    };
    let named = medium.liquid();
    let liquid = Water {
        density: reader.given("water.density")?.unwrap_or(named.density),
        sound_speed: reader.given("water.sound_speed")?.unwrap_or(named.sound_speed),
    };
    let baffle: Baffle = reader.word("water.baffle")?;
    // A method that a built-in scene names is of its own baffle.
    let of_built_in = baffle == Baffle::Soft && matches!(reader.place("water.method"), Place::BuiltIn { .. });
    let meshed = match reader.choice("water.method")?.filter(|_| !of_built_in) {
        Some(word) => word == "elements",
        None => baffle == Baffle::Soft || model::kind(reader)? == ModelKind::Fea,
    };
    if baffle == Baffle::Soft && !meshed {
        let expected =
            "`elements` where `water.baffle` is \"soft\": the Rayleigh integral is of a rigid baffle".to_owned();
        return Err(reader.out_of_range("water.method", expected, "`rayleigh`".to_owned()));
    }
    let field_points = points(reader)?;
    let method = if meshed { WaterMethod::Elements(mesh(reader, disc, &field_points)?) } else { WaterMethod::Rayleigh };
    Ok(Some(WaterSettings { medium, liquid, absorption: absorption(reader)?, baffle, method, field_points }))
}

fn absorption(reader: &Reader<'_>) -> Result<Option<Absorption>, SceneError> {
    let key = "water.absorption";
    let at_1_mhz = reader.number(key)?;
    let exponent = reader.given("water.absorption_exponent")?;
    if at_1_mhz == 0.0 {
        if exponent.is_some() {
            let expected = format!("this key beside a `{key}` such as \"0.5 dB/cm\" at 1 MHz");
            return Err(reader.out_of_range("water.absorption_exponent", expected, "no absorption".to_owned()));
        }
        return Ok(None);
    }
    let exponent = exponent.ok_or_else(|| reader.missing("water.absorption_exponent", Some("its frequency law")))?;
    Ok(Some(Absorption { at_1_mhz, exponent }))
}

fn mesh(reader: &Reader<'_>, disc: &DiscShape, points: &[FieldPoint]) -> Result<WaterMesh, SceneError> {
    let own = |key, default| Ok(reader.given(key)?.unwrap_or(default));
    // The proportions of the default to the paper's disc.
    let default = WaterMesh { radius: 2.5 * disc.radius, side: disc.radius / 20.0 };
    let mesh =
        WaterMesh { radius: own("water.mesh_radius", default.radius)?, side: own("water.mesh_side", default.side)? };
    if mesh.radius <= disc.radius {
        let expected = format!("beyond the disc's radius {}", length(disc.radius));
        return Err(reader.out_of_range("water.mesh_radius", expected, length(mesh.radius)));
    }
    if mesh.side > 0.5 * disc.radius || mesh.radius / mesh.side >= 1000.0 {
        let (most, least) = (length(0.5 * disc.radius), length(mesh.radius / 1000.0));
        let expected = format!("at most half the disc's radius, {most}, and above a thousandth of the mesh's, {least}");
        return Err(reader.out_of_range("water.mesh_side", expected, length(mesh.side)));
    }
    for FieldPoint { radius, distance } in points {
        if radius.hypot(*distance) > mesh.radius {
            let expected = format!(
                "points within the mesh of `water.mesh_radius` = {}; enlarge it, or take `water.method = \"rayleigh\"`",
                length(mesh.radius)
            );
            let found = format!("r = {}, z = {}", length(*radius), length(*distance));
            return Err(reader.out_of_range("water.field_points", expected, found));
        }
    }
    Ok(mesh)
}

fn points(reader: &Reader<'_>) -> Result<Vec<FieldPoint>, SceneError> {
    let key = "water.field_points";
    let Some(entry) = reader.entry(key) else { return Ok(WaterSettings::default().field_points) };
    let expected = "a list of points such as `[{ r = \"0 mm\", z = \"1 mm\" }]`";
    let Value::List(list) = &entry.value else { return Err(wrong_type(entry, key, expected)) };
    if list.is_empty() || list.len() > MOST_POINTS {
        return Err(reader.out_of_range(key, format!("1 to {MOST_POINTS} points"), list.len().to_string()));
    }
    let mut out = Vec::new();
    for item in list {
        let Value::Table(table) = &item.value else { return Err(wrong_type(item, key, expected)) };
        if let Some((word, entry)) = table.iter().find(|(word, _)| word != "r" && word != "z") {
            let (place, key) = (entry.place.clone(), format!("{key}.{word}"));
            return Err(SceneError::UnknownKey { place, key, nearest: Some("water.field_points.z".to_owned()) });
        }
        let of = |word: &str| table.iter().find(|(name, _)| name == word).map(|(_, entry)| entry);
        let Some(along) = of("z") else { return Err(wrong_type(item, key, "`z`, the depth, in every point")) };
        let distance = quantity(along, "water.field_points.z", Dimension::LENGTH, Bound::Finite)?;
        if distance < 0.0 {
            return Err(SceneError::OutOfRange {
                place: along.place.clone(),
                key: "water.field_points.z".to_owned(),
                expected: "0 or more: z counts from the disc's back into the water; before it is the disc".to_owned(),
                found: length(distance),
            });
        }
        let radius =
            of("r").map(|entry| quantity(entry, "water.field_points.r", Dimension::LENGTH, Bound::NotNegative));
        out.push(FieldPoint { radius: radius.transpose()?.unwrap_or(0.0), distance });
    }
    Ok(out)
}
