//! How a run is computed.

use super::{
    ContactLaw, ContactMass, DEFAULT_FEA_STEP, DEFAULT_REDUCED_STEP, DEFAULT_WATER_STEP, Elements, FeaSettings, Limits,
    ReducedSettings,
    condition::CHAIN_INTEGRATORS,
    contact_law,
    error::SceneError,
    fea,
    model_kind::{self, ModelKind, check_step},
    reader::Reader,
    reduced,
};

/// Relative tolerance of the adaptive chain where nothing else is asked for.
pub const DEFAULT_TOLERANCE: f64 = 1e-10;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Integrator {
    /// Adaptive Dormand–Prince 8(5,3) with contact events located on the dense output.
    DormandPrince853 {
        /// Relative tolerance of a step, 1.
        tolerance: f64,
    },
    /// Fixed-step symplectic stepper (velocity Verlet), for searches. Error of the last bead's velocity over its peak, undamped, first 70 µs of
    /// the rigid scene: 6e-3 at 0.05 µs, 2e-4 at 0.01 µs; with linear dashpots 1.5e-2 and 6e-3.
    Symplectic {
        /// Step, s.
        step: f64,
    },
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModelSettings {
    pub kind: ModelKind,
    pub integrator: Integrator,
    pub reduced: ReducedSettings,
    pub fea: FeaSettings,
    /// What a run may ask for; no scene file says so.
    pub limits: Limits,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meshing {
    /// Mesh density, 1.
    pub density: u32,
    pub elements: Elements,
    /// Radius of the finely meshed patch at a bead's pole over the bead's, 1.
    pub contact_patch: f64,
    pub contact_mass: ContactMass,
}

impl Integrator {
    pub const fn name(&self) -> &'static str {
        match self {
            Self::DormandPrince853 { .. } => "dormand-prince-853",
            Self::Symplectic { .. } => "symplectic",
        }
    }
}

impl ModelSettings {
    pub fn chain(integrator: Integrator) -> Self {
        let (reduced, fea) = (ReducedSettings::default(), FeaSettings::default());
        Self { kind: ModelKind::Chain, integrator, reduced, fea, limits: Limits::default() }
    }

    /// How the bodies of this model are meshed; for the chain, which has none, as for the finite element analysis.
    pub fn meshing(&self) -> Meshing {
        match self.kind {
            ModelKind::Reduced => {
                let ReducedSettings { density, elements, contact_patch, .. } = self.reduced;
                Meshing { density, elements, contact_patch, contact_mass: ContactMass::Massless }
            }
            ModelKind::Chain | ModelKind::Fea => {
                let FeaSettings { density, elements, contact_patch, contact_mass, .. } = self.fea;
                Meshing { density, elements, contact_patch, contact_mass }
            }
        }
    }
}

pub(super) fn read(
    reader: &Reader<'_>,
    frequency: f64,
    output_step: f64,
    notes: &mut Vec<String>,
) -> Result<ModelSettings, SceneError> {
    let kind = model_kind::kind(reader)?;
    let mut settings = ModelSettings {
        kind,
        integrator: Integrator::DormandPrince853 { tolerance: DEFAULT_TOLERANCE },
        reduced: ReducedSettings::default(),
        fea: FeaSettings::default(),
        limits: Limits::default(),
    };
    if contact_law::read(reader)? == ContactLaw::FiniteBody {
        let default = FeaSettings::default();
        let density = reader.count("model.mesh_density")?.unwrap_or(default.density);
        let (elements, contact_patch) = (reader.word("model.elements")?, fea::contact_patch(reader)?);
        settings.fea = FeaSettings { density, elements, contact_patch, ..default };
    }
    let has_disc = reader.text("support.kind")? == Some("disc");
    if kind == ModelKind::Fea {
        let step = if has_disc { DEFAULT_WATER_STEP } else { DEFAULT_FEA_STEP };
        settings.fea = fea::read(reader, frequency, (step, output_step), notes)?;
    } else if kind == ModelKind::Reduced {
        let step = if has_disc { DEFAULT_WATER_STEP } else { DEFAULT_REDUCED_STEP };
        settings.reduced = reduced::read(reader, frequency, (step, output_step), notes)?;
    } else if has_disc {
        let integrator = reader.choice_of("model.integrator", CHAIN_INTEGRATORS)?;
        if let Some(other) = integrator.filter(|name| *name != "symplectic") {
            let expected = "`symplectic` in front of a disc, whose clock has a fixed step".to_owned();
            return Err(reader.out_of_range("model.integrator", expected, format!("`{other}`")));
        }
        let step = reader.given("model.step")?.unwrap_or(DEFAULT_WATER_STEP);
        check_step(reader, step, frequency)?;
        settings.integrator = Integrator::Symplectic { step: fea::dividing(step, output_step, notes) };
    } else if reader.choice_of("model.integrator", CHAIN_INTEGRATORS)? == Some("symplectic") {
        let step = reader.required("model.step", Some("the fixed-step integrator needs it"))?;
        check_step(reader, step, frequency)?;
        settings.integrator = Integrator::Symplectic { step };
    } else {
        settings.integrator = Integrator::DormandPrince853 { tolerance: reader.number("model.tolerance")? };
    }
    Ok(settings)
}
