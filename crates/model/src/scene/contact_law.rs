//! The elastic law of the chain's contacts.

use super::{ModelKind, error::SceneError, key::CONTACT_LAWS, reader::Reader, settings};

/// Elastic law of the contacts where `model.kind = "chain"`; the other models compute their contacts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ContactLaw {
    /// Hertz: two half-spaces.
    #[default]
    Hertz,
    /// F = k δ^(3/2) (1 + c₁ √δ + c₂ δ), fitted to the bodies' own static finite element solutions, and the coupling through each bead.
    FiniteBody,
}

impl ContactLaw {
    /// Its name in scene files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hertz => "hertz",
            Self::FiniteBody => "finite-body",
        }
    }
}

/// Which law a scene asks for.
pub(super) fn read(reader: &Reader<'_>) -> Result<ContactLaw, SceneError> {
    let finite = reader.choice("contact.law", CONTACT_LAWS)? == Some(ContactLaw::FiniteBody.name());
    Ok(if finite && settings::kind(reader)? == ModelKind::Chain { ContactLaw::FiniteBody } else { ContactLaw::Hertz })
}
