//! A contact on a spring, for eight runs side by side.

use crate::{
    contact_law::Law,
    number::{Lane, Mask, Number},
};

/// A contact on a spring, of every run.
#[derive(Debug, Clone, Copy)]
pub(super) struct OnSpring {
    /// k/K, m^(-1/2).
    ratio: Lane,
    /// c₁, m^(-1/2), and c₂, 1/m.
    first: f64,
    second: f64,
}

impl OnSpring {
    pub(super) fn new(law: &Law) -> Self {
        let contact = if let Law::HertzOnSpring(law) = law { Some(law.contact) } else { None };
        let (first, second) = contact.map_or((0.0, 0.0), |contact| (contact.first, contact.second));
        Self { ratio: Lane::ZERO, first, second }
    }

    /// Take the stiffnesses of one run.
    pub(super) fn put(&mut self, place: usize, law: &Law) {
        if let Law::HertzOnSpring(law) = law {
            self.ratio.0[place] = law.contact.stiffness / law.spring;
        }
    }

    /// Force over k where contact and spring together have the overlap δ ≥ 0 (m), as [`HertzOnSpring`](crate::contact_law::HertzOnSpring) has it.
    #[inline(always)]
    pub(super) fn force(&self, overlap: Lane) -> Lane {
        let mut root = overlap.root();
        for _ in 0..ROOTS {
            let force = self.of_root(root);
            let bracket = root * (root * (5.0 * self.second) + 4.0 * self.first) + 3.0;
            let slope = root * (self.ratio * root * bracket + 2.0);
            let change = (root * root + self.ratio * force - overlap) / slope;
            let change = change.or_where_not(root.above(Lane::ZERO), Lane::ZERO);
            root = root - change;
            if change.magnitude().within(root * ROOT_SETTLED).every() {
                break;
            }
        }
        self.of_root(root)
    }

    /// x³ (1 + c₁ x + c₂ x²).
    #[inline(always)]
    fn of_root(&self, root: Lane) -> Lane {
        root * root * root * (root * (root * self.second + self.first) + 1.0)
    }
}

/// Most steps of Newton's method for a contact on a spring, and the relative change at which they end: squared, it is below rounding.
const ROOTS: usize = 60;
const ROOT_SETTLED: f64 = 1e-8;
