//! Prepared bodies, shared by the runs of a study.

use std::sync::{Arc, Mutex, PoisonError};

use granchain_model::{self as model, ModelError, Prepared, reduced::Cache, scene::Scene};

/// Most bodies held at once; a study of the radius needs each for one run only.
const MOST_HELD: usize = 32;

/// Bodies prepared so far. The result does not depend on which run prepared them.
#[derive(Debug, Default)]
pub struct Bodies {
    cache: Option<Cache>,
    held: Mutex<Vec<Arc<Prepared>>>,
}

impl Bodies {
    /// Empty; `cache` keeps bodies from one program run to the next.
    pub fn new(cache: Option<Cache>) -> Self {
        Self { cache, held: Mutex::default() }
    }

    /// The same with bodies that are already prepared.
    #[must_use]
    pub(crate) fn holding(mut self, prepared: Arc<Prepared>) -> Self {
        self.held.get_mut().unwrap_or_else(PoisonError::into_inner).push(prepared);
        self
    }

    /// The bodies of a scene.
    pub fn prepared(&self, scene: &Scene) -> Result<Arc<Prepared>, ModelError> {
        let held = || self.held.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = held().iter().find(|prepared| prepared.fits(scene)) {
            return Ok(Arc::clone(found));
        }
        // Not under the lock: two runs that begin together may make the same bodies, but never wait for others.
        let prepared = Arc::new(model::prepare_with(scene, self.cache.as_ref())?);
        let mut held = held();
        if held.len() == MOST_HELD {
            held.remove(0);
        }
        held.push(Arc::clone(&prepared));
        Ok(prepared)
    }

    /// Why bodies could not be cached, if so.
    pub fn warning(&self) -> Option<String> {
        let held = self.held.lock().unwrap_or_else(PoisonError::into_inner);
        held.iter().find_map(|prepared| prepared.warning().map(str::to_owned))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use granchain_model::scene;

    #[test]
    fn bodies_are_made_once_for_all_scenes_that_have_them() {
        let bodies = Bodies::default();
        let scene = |set: &str| {
            let base = ["model.kind=reduced", "model.mesh_density=3", "model.modes=0", set];
            scene::load("rigid", &base.map(str::to_owned)).unwrap()
        };
        let first = bodies.prepared(&scene("alpha=1")).unwrap();
        assert!(Arc::ptr_eq(&first, &bodies.prepared(&scene("alpha=2")).unwrap()));
        let other = bodies.prepared(&scene("chain.beads=3")).unwrap();
        assert!(!Arc::ptr_eq(&first, &other));
        assert!(Arc::ptr_eq(&first, &bodies.prepared(&scene("damping.kind=linear")).unwrap()));
    }
}
