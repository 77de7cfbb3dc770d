//! Seeded white noise for the tests of this folder.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

pub(super) struct Normal(ChaCha8Rng);

impl Normal {
    pub(super) fn seeded(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(super) fn draw(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }
}
