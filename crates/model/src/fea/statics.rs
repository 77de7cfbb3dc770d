//! Static curves of one contact: force against approach, contact radius, pressure.
//!
//! The approach δ is that of the mass-mean motions of the two bodies, as in a collision; a clamped body stays. Two ways to hold a bead:
//!
//! - one-sided: the contact force alone acts on it, balanced by its inertia (K u = f − F M 1/m), as in a collision;
//! - both poles: squeezed between two equal contacts, as in a static chain.
//!
//! Hertz' law knows neither; the finite body is stiffer by a few per cent, more when loaded on one side.

use super::{
    FeaError,
    arrangement::Arrangement,
    contact::{chain::ContactState, complementarity::Scratch},
    equilibrium::Statics,
    operator::Interfaces,
    trace::contact_radius,
};
use crate::{
    contact_law::{bead_flat_stiffness, bead_pair_stiffness, hertz_force},
    scene::{Chain, FlatContact, Scene, Support},
};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touching {
    /// The scene's first bead and another like it.
    BeadBead,
    /// The scene's first bead on a rigid flat.
    BeadFlat,
    /// The scene's last bead on its annulus, or on the resin annulus where the scene has none.
    BeadAnnulus,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Loading {
    /// The contact's force alone, balanced by inertia.
    OneSided,
    /// The same force on the opposite pole.
    BothPoles,
}

#[derive(Debug, Clone, PartialEq)]
pub struct StaticState {
    /// δ, m.
    pub approach: f64,
    /// Axial force F, N.
    pub force: f64,
    /// Contact radius (half width of the band on an annulus), m.
    pub radius: f64,
    /// Distance from the middle of the contact (m), pressure there (Pa), at all points.
    pub pressure: Vec<(f64, f64)>,
    pub sets: u32,
}

#[derive(Debug, Clone)]
pub struct Curve {
    arrangement: Arrangement,
    contact: usize,
    loading: Loading,
    statics: Statics,
    /// k of Hertz' law for this pair, N·m^(-3/2); none on an annulus.
    hertz: Option<f64>,
}

impl Curve {
    pub fn new(scene: &Scene, touching: Touching, loading: Loading) -> Result<Self, FeaError> {
        let beads = &scene.chain.beads;
        let bead = match touching {
            Touching::BeadAnnulus => &beads[beads.len() - 1],
            Touching::BeadBead | Touching::BeadFlat => &beads[0],
        };
        let count = if touching == Touching::BeadBead { 2 } else { 1 };
        let support = match (touching, scene.support.ring()) {
            (Touching::BeadAnnulus, Some(_)) => scene.support.clone(),
            (Touching::BeadAnnulus, None) => Support::resin_annulus(1.0),
            _ => Support::Flat(FlatContact::Rigid),
        };
        let chain = Chain {
            beads: vec![bead.clone(); count],
            gaps: vec![0.0; count + 1],
            precompression: 0.0,
            gravity: 0.0,
            sensor: None,
        };
        let part = Scene { chain, support, piston: FlatContact::Rigid, ..scene.clone() };
        let arrangement = Arrangement::new(&part)?;
        let contact = 1;
        let statics = Statics::new(&arrangement, &Interfaces::new(&arrangement))?;
        let hertz = match touching {
            Touching::BeadBead => Some(bead_pair_stiffness(bead, bead)),
            Touching::BeadFlat => Some(bead_flat_stiffness(bead, FlatContact::Rigid)),
            Touching::BeadAnnulus => None,
        };
        Ok(Self { arrangement, contact, loading, statics, hertz })
    }

    /// Force of Hertz' law at the approach δ (m), N; none on an annulus.
    pub fn hertz_force(&self, approach: f64) -> Option<f64> {
        self.hertz.map(|stiffness| hertz_force(stiffness, approach))
    }

    /// Press the contact to the approach δ (m).
    pub fn at(&self, approach: f64) -> Result<StaticState, FeaError> {
        let pair = &self.arrangement.pairs[self.arrangement.contacts[self.contact]];
        let mut state = ContactState::open(pair.len());
        let mut sets = 0;
        match self.loading {
            Loading::BothPoles => state.forces = self.squeezed(approach)?,
            Loading::OneSided => {
                let free: Vec<f64> =
                    pair.gaps.iter().zip(&pair.axial_before).map(|(gap, axial)| gap - axial * approach).collect();
                let solved = self
                    .statics
                    .compliance(self.contact)
                    .solve(&free, &mut state.forces, &mut state.gaps, &mut Scratch::new(pair.len()))
                    .map_err(|failed| self.beyond(approach, failed.iterations))?;
                sets = solved.iterations;
            }
        }
        let edge = pair.len() - 1;
        if state.forces[edge] > 0.0 || (pair.is_on_ring() && state.forces[0] > 0.0) {
            return Err(self.beyond(approach, sets));
        }
        if state.pressing == 0.0 {
            state.pressing = state.forces.iter().zip(&pair.axial_before).map(|(force, axial)| force * axial).sum();
        }
        Ok(StaticState {
            approach,
            force: state.pressing,
            radius: contact_radius(pair, &state),
            pressure: (0..pair.len()).map(|i| (pair.positions[i], state.forces[i] / pair.areas[i])).collect(),
            sets,
        })
    }

    fn beyond(&self, approach: f64, iterations: u32) -> FeaError {
        let force = self.hertz_force(approach).unwrap_or(f64::NAN);
        FeaError::NoEquilibrium { force, contact: self.contact + 1, iterations }
    }

    /// Forces of the contact when the whole row carries one force and this contact has the approach δ (m); bisection of a monotone
    /// function by the secant.
    fn squeezed(&self, approach: f64) -> Result<Vec<f64>, FeaError> {
        if approach <= 0.0 {
            return Ok(vec![0.0; self.statics.compliance(self.contact).size()]);
        }
        // F ~ δ^1.5 on curved bodies; on the annulus ~ δ^1.14. The logarithms are nearly straight.
        let mut force = self.hertz_force(approach).unwrap_or(0.668 * (approach * 1e6).powf(1.144));
        let mut last: Option<(f64, f64)> = None;
        let mut slope = if self.hertz.is_some() { 1.5 } else { 1.144 };
        for iteration in 0..60 {
            let rest = self.statics.under(&self.arrangement, force)?;
            let reached = rest.approaches[self.contact];
            let error = (reached / approach).ln();
            if error.abs() < 1e-12 || iteration == 59 {
                return Ok(rest.forces[self.contact].clone());
            }
            if let Some((other_force, other)) = last {
                let measured = (force / other_force).ln() / (reached / other).ln();
                if measured.is_finite() && (0.5..3.0).contains(&measured) {
                    slope = measured;
                }
            }
            last = Some((force, reached));
            force *= (-slope * error).exp();
        }
        Err(self.beyond(approach, 60))
    }
}
