//! Whether the numbers of a scene can be run. A scene that was read has them within the bounds of its keys; one that a program made may have any.

use crate::{
    ModelError, need_drive,
    scene::{
        Chain, ContactLaw, DampingCoefficients, DampingTerm, Holder, Horn, ModelKind, Relaxation, Scene, Sensor,
        Support, TermDescription,
    },
};

/// `Ok` where a number is as expected.
pub(crate) fn need(holds: bool, quantity: &str, expected: &'static str, found: f64) -> Result<(), ModelError> {
    if holds { Ok(()) } else { Err(ModelError::Unphysical { quantity: quantity.into(), expected, found }) }
}

pub(crate) fn positive(quantity: &str, expected: &'static str, found: f64) -> Result<(), ModelError> {
    need(found > 0.0 && found.is_finite(), quantity, expected, found)
}

pub(crate) fn not_negative(quantity: &str, expected: &'static str, found: f64) -> Result<(), ModelError> {
    need(found >= 0.0 && found.is_finite(), quantity, expected, found)
}

pub(crate) fn finite(quantity: &str, expected: &'static str, found: f64) -> Result<(), ModelError> {
    need(found.is_finite(), quantity, expected, found)
}

pub(crate) fn damping(coefficients: &DampingCoefficients) -> Result<(), ModelError> {
    for term in DampingTerm::ALL {
        let TermDescription { key, expected, .. } = *term.description();
        not_negative(key.trim_end_matches("_coefficient"), expected, coefficients[term])?;
    }
    Ok(())
}

impl Chain {
    /// Refuse a gap that a static force (N) leaves open.
    pub(crate) fn refuse_open_gap(&self, force: f64) -> Result<(), ModelError> {
        match self.first_open_gap() {
            Some((contact, gap)) if force > 0.0 => Err(ModelError::OpenGapUnderPrecompression { force, contact, gap }),
            _ => Ok(()),
        }
    }
}

impl Scene {
    pub(crate) fn refuse_free_end(&self) -> Result<(), ModelError> {
        let force = self.chain.precompression;
        let holds = !self.support.is_free() || force == 0.0;
        need(holds, "chain.precompression", "0 N before a free end", force)
    }

    /// Refuse what no chain can be run with.
    pub(crate) fn validate(&self) -> Result<(), ModelError> {
        need_drive(self, "chain")?;
        let chain = &self.chain;
        let beads = chain.beads.len();
        if !(1..=1000).contains(&beads) {
            let reason = format!("it runs 1 to 1000 beads, found {beads}; change `chain.beads`");
            return Err(ModelError::Unsupported { model: "chain", reason });
        }
        if chain.gaps.len() != beads + 1 {
            let found = chain.gaps.len();
            return Err(ModelError::Count { quantity: "chain.gaps", expected: beads + 1, found });
        }
        for bead in chain.beads.iter().chain(self.drive.kind.striker().map(|(bead, _)| bead)) {
            positive("radius", "a positive length, m", bead.radius)?;
            let material = &bead.material;
            positive("youngs_modulus", "a positive modulus, Pa", material.youngs_modulus)?;
            positive("density", "a positive density, kg/m³", material.density)?;
            let ratio = material.poissons_ratio;
            need(ratio > -1.0 && ratio <= 0.5, "poissons_ratio", "a number between −1 and 0.5", ratio)?;
        }
        for (contact, &gap) in chain.gaps.iter().enumerate() {
            let expected = "a gap ≥ 0, m: bodies may not overlap at the start";
            need(gap >= 0.0, &format!("chain.gaps[{contact}]"), expected, gap)?;
        }
        chain.refuse_open_gap(chain.precompression)?;
        not_negative("chain.precompression", "a force ≥ 0, N", chain.precompression)?;
        self.refuse_free_end()?;
        if let Some((_, factor, _)) = self.support.ring() {
            positive("support.stiffness_factor", "a positive factor", factor)?;
        }
        if let Some(stiffness) = self.support.spring() {
            positive("support.stiffness", "a positive stiffness, N/m", stiffness)?;
        }
        if let Support::Foundation { youngs_modulus, poissons_ratio, loss_time, plate } = &self.support {
            positive("support.youngs_modulus", "a positive modulus, Pa", *youngs_modulus)?;
            let holds = *poissons_ratio > -1.0 && *poissons_ratio <= 0.5;
            need(holds, "support.poissons_ratio", "a number between −1 and 0.5", *poissons_ratio)?;
            not_negative("support.loss_time", "a time ≥ 0, s", *loss_time)?;
            if let Some(plate) = plate {
                positive("support.plate_thickness", "a positive length, m", plate.thickness)?;
            }
        }
        self.validate_impact()?;
        damping(&self.damping.coefficients)?;
        finite("alpha", "a finite factor", self.amplitude_scale)?;
        not_negative("duration", "a time ≥ 0, s", self.duration)?;
        positive("output_step", "a positive time, s", self.output_step)?;
        self.validate_effects()
    }

    /// Striker, gravity and sensor.
    fn validate_impact(&self) -> Result<(), ModelError> {
        let chain = &self.chain;
        if let Some((_, velocity)) = self.drive.kind.striker() {
            positive("drive.velocity", "a positive velocity, m/s", velocity)?;
            not_negative("alpha", "a factor ≥ 0 on the velocity of a striker", self.amplitude_scale)?;
            let expected = "0 N where a striker drives: nothing presses on the first bead";
            need(chain.precompression == 0.0, "chain.precompression", expected, chain.precompression)?;
            need(
                self.horn.is_none(),
                "horn.mass",
                "no horn where a striker drives",
                self.horn.map_or(0.0, |horn| horn.mass),
            )?;
        }
        if let Some(Sensor { bead, share }) = chain.sensor {
            need((1..=chain.beads.len()).contains(&bead), "chain.sensor", "the number of a bead", bead as f64)?;
            need((0.0..=1.0).contains(&share), "chain.sensor_share", "a share from 0 to 1", share)?;
        }
        not_negative("chain.gravity", "an acceleration ≥ 0, m/s²", chain.gravity)?;
        if chain.gravity == 0.0 {
            return Ok(());
        }
        need(
            !self.support.is_free(),
            "chain.gravity",
            "0 m/s² before a free end, which carries no weight",
            chain.gravity,
        )?;
        let open = chain.first_open_gap().map_or(0.0, |(_, gap)| gap);
        need(open == 0.0, "chain.gaps", "0 m under gravity, which closes every contact", open)
    }

    /// The first of striker, gravity and foundation that its model does not have, behind the model's name.
    pub(crate) fn beyond_model(&self) -> Option<(&'static str, &'static str)> {
        let (model, knows_striker) = match self.model.kind {
            ModelKind::Chain if self.support.disc().is_some() => ("chain before a disc", false),
            ModelKind::Chain if self.contact_law == ContactLaw::FiniteBody => ("chain with fitted contact laws", false),
            ModelKind::Chain => return None,
            ModelKind::Reduced => ("reduced", true),
            ModelKind::Fea => ("fea", false),
        };
        [
            (self.is_struck() && !knows_striker, "a striker (`drive.kind`)"),
            (self.chain.gravity > 0.0, "gravity (`chain.gravity`)"),
            (matches!(self.support, Support::Foundation { .. }), "a foundation (`support.kind`)"),
        ]
        .into_iter()
        .find_map(|(is_asked, what)| is_asked.then_some((model, what)))
    }

    pub(crate) fn refuse_beyond_model(&self) -> Result<(), ModelError> {
        let Some((model, what)) = self.beyond_model() else { return Ok(()) };
        let reason =
            format!("it does not have {what}; use `model.kind` = \"chain\", `contact.law` = \"hertz\" and no disc");
        Err(ModelError::Unsupported { model, reason })
    }

    fn validate_effects(&self) -> Result<(), ModelError> {
        if let Some(Horn { mass, frequency, quality }) = self.horn {
            positive("horn.mass", "a positive mass, kg", mass)?;
            positive("horn.frequency", "a positive frequency, Hz", frequency)?;
            need(quality > 0.0, "horn.quality", "a positive number", quality)?;
        }
        if let Some(Holder { drag, friction_force, friction_coefficient, slip_velocity, clearance, .. }) = self.holder {
            not_negative("holder.drag", "a coefficient ≥ 0, N·s/m", drag)?;
            not_negative("holder.friction_force", "a force ≥ 0, N", friction_force)?;
            not_negative("holder.friction_coefficient", "a number ≥ 0", friction_coefficient)?;
            not_negative("holder.slip_velocity", "a velocity ≥ 0, m/s", slip_velocity)?;
            let least = self.chain.beads.iter().map(|bead| bead.radius).fold(f64::INFINITY, f64::min);
            let expected = "a length ≥ 0, at most half a bead's radius, m";
            need((0.0..=0.5 * least).contains(&clearance), "holder.clearance", expected, clearance)?;
        }
        if let Some(strength) = self.yield_strength {
            positive("contact.yield_strength", "a positive pressure, Pa", strength)?;
        }
        if let Some(Relaxation { strength, time }) = self.loss.relaxation {
            not_negative("loss.relaxation", "a number ≥ 0", strength)?;
            positive("loss.relaxation_time", "a positive time, s", time)?;
        }
        Ok(())
    }
}
