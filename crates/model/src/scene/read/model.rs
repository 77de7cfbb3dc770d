//! How a run is computed.

use crate::scene::{
    ContactLaw, DEFAULT_FEA_STEP, DEFAULT_REDUCED_STEP, DEFAULT_TOLERANCE, DEFAULT_WATER_STEP, FeaSettings, Integrator,
    Limits, ModelKind, ModelSettings, ReducedSettings, Scheme,
    condition::{CHAIN_INTEGRATORS, FEA_INTEGRATORS},
    error::SceneError,
    reader::Reader,
    shown::time,
};

pub(super) fn settings(
    reader: &Reader<'_>,
    frequency: f64,
    output_step: f64,
    notes: &mut Vec<String>,
) -> Result<ModelSettings, SceneError> {
    let kind = kind(reader)?;
    let mut settings = ModelSettings {
        kind,
        integrator: Integrator::DormandPrince853 { tolerance: DEFAULT_TOLERANCE },
        reduced: ReducedSettings::default(),
        fea: FeaSettings::default(),
        limits: Limits::default(),
    };
    if contact_law(reader)? == ContactLaw::FiniteBody {
        let (density, contact_patch) = mesh(reader, settings.fea.density)?;
        settings.fea = FeaSettings { density, contact_patch, ..settings.fea };
    }
    let has_disc = reader.text("support.kind")? == Some("disc");
    if kind == ModelKind::Fea {
        let step = if has_disc { DEFAULT_WATER_STEP } else { DEFAULT_FEA_STEP };
        settings.fea = fea(reader, frequency, (step, output_step), notes)?;
    } else if kind == ModelKind::Reduced {
        let step = if has_disc { DEFAULT_WATER_STEP } else { DEFAULT_REDUCED_STEP };
        settings.reduced = reduced(reader, frequency, (step, output_step), notes)?;
    } else if has_disc {
        let integrator = reader.choice_of("model.integrator", CHAIN_INTEGRATORS)?;
        if let Some(other) = integrator.filter(|name| *name != "symplectic") {
            let expected = "`symplectic` in front of a disc, whose clock has a fixed step".to_owned();
            return Err(reader.out_of_range("model.integrator", expected, format!("`{other}`")));
        }
        let step = reader.given("model.step")?.unwrap_or(DEFAULT_WATER_STEP);
        check_step(reader, step, frequency)?;
        settings.integrator = Integrator::OnDisc { step: dividing(step, output_step, notes) };
    } else {
        if reader.choice_of("model.integrator", CHAIN_INTEGRATORS)? == Some("symplectic") {
            let expected =
                "`dormand-prince-853`, or neither it nor `model.step`: steps are fixed before a disc only".to_owned();
            return Err(reader.out_of_range("model.integrator", expected, "`symplectic`".to_owned()));
        }
        settings.integrator = Integrator::DormandPrince853 { tolerance: reader.number("model.tolerance")? };
    }
    Ok(settings)
}

fn fea(
    reader: &Reader<'_>,
    frequency: f64,
    (default_step, output_step): (f64, f64),
    notes: &mut Vec<String>,
) -> Result<FeaSettings, SceneError> {
    let (density, contact_patch) = mesh(reader, FeaSettings::default().density)?;
    let scheme = match reader.choice_of("model.integrator", FEA_INTEGRATORS)? {
        Some("hht") => {
            let reason = Some("a scheme with numerical damping needs it");
            Scheme::HilberHughesTaylor { dissipation: reader.required("model.numerical_dissipation", reason)? }
        }
        _ => Scheme::Trapezoid,
    };
    let step = reader.given("model.step")?.unwrap_or(default_step);
    check_step(reader, step, frequency)?;
    let step = dividing(step, output_step, notes);
    Ok(FeaSettings { density, contact_patch, step, scheme })
}

/// Mesh density and contact patch of meshed bodies.
fn mesh(reader: &Reader<'_>, default_density: u32) -> Result<(u32, f64), SceneError> {
    let density = reader.count("model.mesh_density")?.unwrap_or(default_density);
    let key = "model.contact_patch";
    let patch = reader.number(key)?;
    if patch > 0.5 {
        return Err(reader.out_of_range(key, "a value above 0 and at most 0.5".to_owned(), patch.to_string()));
    }
    Ok((density, patch))
}

/// `step`, shortened where it does not divide the output step: every output sample is a computed state, none is interpolated.
fn dividing(step: f64, output_step: f64, notes: &mut Vec<String>) -> f64 {
    let ratio = output_step / step;
    // Rounding of two decimal numbers and their quotient, with room.
    if ratio.round() >= 1.0 && (ratio - ratio.round()).abs() <= 1e-9 * ratio {
        return step;
    }
    let shortened = output_step / ratio.ceil();
    notes.push(format!(
        "`model.step` {} does not divide `output_step` {}; taken as {}, so that every sample is a computed state",
        time(step),
        time(output_step),
        time(shortened)
    ));
    shortened
}

fn reduced(
    reader: &Reader<'_>,
    frequency: f64,
    (default_step, output_step): (f64, f64),
    notes: &mut Vec<String>,
) -> Result<ReducedSettings, SceneError> {
    let default = ReducedSettings::default();
    let step = reader.given("model.step")?.unwrap_or(default_step);
    check_step(reader, step, frequency)?;
    let (density, contact_patch) = mesh(reader, default.density)?;
    let modes = reader.count("model.modes")?.unwrap_or(default.modes);
    Ok(ReducedSettings { density, contact_patch, step: dividing(step, output_step, notes), modes })
}

pub(super) fn contact_law(reader: &Reader<'_>) -> Result<ContactLaw, SceneError> {
    let law = reader.word("contact.law")?;
    Ok(if kind(reader)? == ModelKind::Chain { law } else { ContactLaw::Hertz })
}

pub(super) fn kind(reader: &Reader<'_>) -> Result<ModelKind, SceneError> {
    reader.word("model.kind")
}

fn check_step(reader: &Reader<'_>, step: f64, frequency: f64) -> Result<(), SceneError> {
    // Five steps through the shortest half period of motion that the drive's own period leaves are no integration.
    let longest = 1.0 / (20.0 * frequency);
    if step <= longest {
        return Ok(());
    }
    let longest = time((longest * 1e9).floor() / 1e9);
    Err(reader.out_of_range("model.step", format!("at most {longest}, a twentieth of a drive period"), time(step)))
}
