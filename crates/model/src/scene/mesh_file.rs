//! Bodies of the user's own, meshed elsewhere.

use std::path::PathBuf;

use super::{
    Chain, Material, Scene, Support,
    document::{Value, resolved},
    error::SceneError,
    reader::Reader,
};

/// A Gmsh file (.msh) with the mesh of a body, in place of the program's own.
///
/// Its physical groups name materials and contact boundaries; what none names is made of the material that the scene gives the body.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshFile {
    pub path: PathBuf,
    /// Length of its unit, m.
    pub unit: f64,
}

pub(super) fn read(reader: &Reader<'_>, key: &str, unit_key: &'static str) -> Result<Option<MeshFile>, SceneError> {
    let unit = reader.number(unit_key)?;
    let path = reader.text(key)?.map(|file| resolved(file, &reader.place(key)));
    Ok(path.map(|path| MeshFile { path, unit }))
}

/// The unit given for meshes, if any of them uses it.
pub(super) fn refuse_idle_unit(reader: &Reader<'_>, chain: &Chain) -> Result<(), SceneError> {
    let key = "chain.mesh_unit";
    if reader.has(key) && chain.beads.iter().all(|bead| bead.mesh.is_none()) {
        let expected = "this key beside `chain.mesh` or a `mesh` in `[[chain.override]]`".to_owned();
        return Err(reader.out_of_range(key, expected, "no mesh file".to_owned()));
    }
    Ok(())
}

/// Materials that the physical groups of mesh files may name: all that are defined or come with the program, by name. Empty where
/// no body is a mesh file.
pub(super) fn materials(reader: &Reader<'_>, chain: &Chain, support: &Support) -> Result<Vec<Material>, SceneError> {
    let meshed = chain.beads.iter().any(|bead| bead.mesh.is_some()) || matches!(support, Support::Body { .. });
    if meshed { reader.all_materials() } else { Ok(Vec::new()) }
}

/// Remove what only the finite element analysis reads from the overrides of single beads.
pub(super) fn strip_overrides(value: &mut Value) {
    let Value::List(list) = value else { return };
    for item in list {
        if let Value::Table(table) = &mut item.value {
            table.retain(|(word, _)| !matches!(word.as_str(), "mesh" | "mesh_unit"));
        }
    }
}

impl Scene {
    pub fn mesh_files(&self) -> Vec<PathBuf> {
        let beads = self.chain.beads.iter().filter_map(|bead| bead.mesh.as_ref());
        let mut paths: Vec<PathBuf> = beads.map(|mesh| mesh.path.clone()).collect();
        if let Support::Body { mesh, .. } = &self.support {
            paths.push(mesh.path.clone());
        }
        paths.sort();
        paths.dedup();
        paths
    }
}
