//! The water behind the disc.

use super::{
    DiscShape, ModelKind,
    document::Value,
    error::Place,
    error::SceneError,
    model_kind,
    reader::{Bound, Reader, quantity, wrong_type},
    shown::length,
    word::words,
};
use granchain_signal::{Dimension, Quantity};

/// Default step of a chain, reduced model or finite element analysis in front of a disc, s.
pub const DEFAULT_WATER_STEP: f64 = 2.5e-8;
const MOST_POINTS: usize = 100;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Water {
    /// Density ρ, kg/m³.
    pub density: f64,
    /// Speed of sound c, m/s.
    pub sound_speed: f64,
}

impl Water {
    /// Water of the source paper: ρ 1000 kg/m³, c 1500 m/s.
    pub fn fresh() -> Self {
        Self { density: 1000.0, sound_speed: 1500.0 }
    }

    /// Soft tissue on average: ρ 1050 kg/m³, c 1540 m/s, the speed that diagnostic scanners assume.
    ///
    /// Duck (1990), *Physical Properties of Tissue*, ch. 4.
    pub fn tissue() -> Self {
        Self { density: 1050.0, sound_speed: 1540.0 }
    }
}

/// What is behind the disc, by name; density and speed of sound may differ from what the name stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Medium {
    Water,
    Tissue,
}

words!(Medium { Water = "water", Tissue = "tissue" });

impl Medium {
    pub fn liquid(self) -> Water {
        match self {
            Self::Water => Water::fresh(),
            Self::Tissue => Water::tissue(),
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Baffle {
    Rigid,
    /// It carries no pressure: a free surface.
    Soft,
}

words!(Baffle { Rigid = "rigid", Soft = "soft" });

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WaterMesh {
    /// Radius R of the hemisphere, m: beyond the disc and every field point.
    pub radius: f64,
    /// Side h of an element along the radius, m, and half of it in front of the disc, whose bending has a near field; along the arc it is π/2 h
    /// at R and less inside.
    pub side: f64,
}

impl Default for WaterMesh {
    /// R 2.5 mm, h 0.05 mm: for the 2 mm disc to 1 MHz.
    fn default() -> Self {
        Self { radius: 2.5e-3, side: 0.05e-3 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum WaterMethod {
    /// Baffled Rayleigh integral in the disc's shapes; rigid baffle only.
    Rayleigh,
    /// Acoustic finite elements in a hemisphere with an absorbing boundary.
    Elements(WaterMesh),
}

impl WaterMethod {
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rayleigh => "rayleigh",
            Self::Elements(_) => "elements",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FieldPoint {
    /// Distance r from the axis, m.
    pub radius: f64,
    /// Distance z from the plane of the disc's back, m.
    pub distance: f64,
}

impl FieldPoint {
    /// A point on the axis at the distance z (m).
    pub fn on_axis(distance: f64) -> Self {
        Self { radius: 0.0, distance }
    }
}

/// Loss of amplitude along a path, e^(−α d) with α(f) = α₁ (f/1 MHz)^y.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Absorption {
    /// α₁, the attenuation of amplitude at 1 MHz, Np/m (1 dB = ln 10/20 Np).
    pub at_1_mhz: f64,
    /// y, 1.
    pub exponent: f64,
}

/// The half-space of water behind the disc, how it is computed and where it is heard.
#[derive(Debug, Clone, PartialEq)]
pub struct WaterSettings {
    pub medium: Medium,
    pub liquid: Water,
    /// Losses between the disc and a field point; none by default.
    pub absorption: Option<Absorption>,
    pub baffle: Baffle,
    pub method: WaterMethod,
    /// Where the pressure is heard; at least one point.
    pub field_points: Vec<FieldPoint>,
}

impl Default for WaterSettings {
    /// Water by the Rayleigh integral with a rigid baffle, heard on the axis at 1 mm.
    fn default() -> Self {
        Self {
            medium: Medium::Water,
            liquid: Water::fresh(),
            absorption: None,
            baffle: Baffle::Rigid,
            method: WaterMethod::Rayleigh,
            field_points: vec![FieldPoint::on_axis(1e-3)],
        }
    }
}

pub(super) fn read(reader: &Reader<'_>, disc: &DiscShape) -> Result<Option<WaterSettings>, SceneError> {
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
        None => baffle == Baffle::Soft || model_kind::kind(reader)? == ModelKind::Fea,
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

/// A point as it stands in messages and labels: `r = 0 m, z = 1 mm`.
impl std::fmt::Display for FieldPoint {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let show = |value| Quantity::new(value, Dimension::LENGTH);
        write!(formatter, "r = {}, z = {}", show(self.radius), show(self.distance))
    }
}
