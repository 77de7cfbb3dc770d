//! Scene files: layers of keys (built-in scene, file, overrides) → a checked [`Scene`].

use std::path::{Path, PathBuf};

use super::{
    BuiltIn, ModelKind, Scene, builtin,
    condition::CHAIN_INTEGRATORS,
    document::{Document, Value, read_text},
    error::SceneError,
    read::scene,
    reader::Reader,
    source::Author,
};

#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Loaded {
    pub scene: Scene,
    /// Values that were chosen rather than read, one sentence each.
    pub notes: Vec<String>,
    /// Whether nothing states `drive.frequency`, which is then that of the record that drives: `UNREAD_FREQUENCY` until it is read.
    pub lacks_frequency: bool,
}

/// Load a built-in scene by name or a scene file by path, changed by overrides `KEY=VALUE`.
///
/// A name that is both is the built-in scene; write `./rigid` for a file called so. A drive of kind `record` is not
/// read here: see [`Scene::pending_record`].
///
/// ```
/// use granchain_model::scene::{DampingTerm, load};
///
/// let scene = load("annulus", &["damping.coefficient=0.4".into(), "chain.beads=8".into()])?;
/// assert_eq!((scene.damping.coefficients[DampingTerm::Linear], scene.chain.beads.len()), (0.4, 8));
/// # Ok::<(), granchain_model::scene::SceneError>(())
/// ```
pub fn load(name_or_path: &str, overrides: &[String]) -> Result<Scene, SceneError> {
    load_with_notes(name_or_path, overrides).map(|loaded| loaded.scene)
}

pub fn load_with_notes(name_or_path: &str, overrides: &[String]) -> Result<Loaded, SceneError> {
    load_preferring(name_or_path, overrides, ModelKind::Chain)
}

/// As [`load_with_notes`], where a scene that names no model is computed by `preferred`. Half-spaces of steel and keys of its integrators and contact laws
/// belong to the chain: a scene with them takes it instead, and a note says so.
///
/// ```
/// use granchain_model::scene::{ModelKind, load_preferring};
///
/// let kind = |name, set: &str| load_preferring(name, &[set.into()], ModelKind::Reduced).map(|loaded| loaded.scene.model.kind);
/// assert_eq!(kind("rigid", "alpha=1")?, ModelKind::Reduced);
/// assert_eq!(kind("rigid", "support.kind=half-space")?, ModelKind::Chain);
/// assert_eq!(kind("chain", "alpha=1")?, ModelKind::Chain);
/// # Ok::<(), granchain_model::scene::SceneError>(())
/// ```
pub fn load_preferring(name_or_path: &str, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
    SceneText::read(name_or_path)?.load(overrides, preferred)
}

/// Read a scene from TOML text; `path` names it in messages, and what it points to is relative to the folder of `path`.
pub fn load_text(text: &str, path: &Path, overrides: &[String]) -> Result<Loaded, SceneError> {
    parse(text, path, overrides, ModelKind::Chain)
}

fn parse(text: &str, path: &Path, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
    let own = Document::parse(text, Author::File(path))?;
    let document = match own.entries.get("extends") {
        None => own,
        Some(entry) => {
            let name = own.text("extends").ok_or_else(|| SceneError::WrongType {
                place: entry.place.clone(),
                key: "extends".into(),
                expected: "the name of a built-in scene, in quotes".into(),
                found: entry.value.describe(),
            })?;
            let base = builtin::find(name, Some(entry.place.clone()))?;
            let mut document = Document::parse(base.toml, Author::BuiltIn(base.name))?;
            document.entries.remove("name");
            document.entries.remove("description");
            document.overlay(own);
            document
        }
    };
    let stem = path.file_stem().map_or_else(|| "scene".into(), |stem| stem.to_string_lossy());
    assemble(document, overrides, &path.display().to_string(), &stem, preferred)
}

fn assemble(
    mut document: Document,
    overrides: &[String],
    origin: &str,
    name: &str,
    preferred: ModelKind,
) -> Result<Loaded, SceneError> {
    document.entries.remove("extends");
    let overrides = Document::from_overrides(overrides)?;
    if let Some(entry) = overrides.entries.get("extends") {
        return Err(SceneError::OutOfRange {
            place: entry.place.clone(),
            key: "extends".into(),
            expected: "this key in scene files only".into(),
            found: "an override; use --scene NAME".into(),
        });
    }
    document.overlay(overrides);
    let mut notes = Vec::new();
    for key in FLATS.into_iter().filter(|key| document.text(key) == Some("steel")).collect::<Vec<_>>() {
        notes.push(format!(
            "`{key}` = \"steel\" is called \"half-space\" now: of the bead's own material, whichever that is"
        ));
        if let Some(entry) = document.entries.get_mut(key) {
            entry.value = Value::Text("half-space".into());
        }
    }
    if preferred != ModelKind::Chain && document.text("model.kind").is_none() {
        match of_the_chain(&document) {
            Some(reason) => notes.push(format!("`model.kind` is not given; taken as chain, since {reason}")),
            None => document.insert_default("model.kind", preferred.name(), origin),
        }
    }
    let reader = Reader::new(&document, origin);
    reader.refuse_unused()?;
    let scene = scene(&reader, name, &mut notes)?;
    reader.check_materials()?;
    notes.extend(reader.defined_materials().into_iter().filter(|name| !scene.materials_in_use().iter().any(|material| material.name == *name)).map(|name| {
        format!("no body is of `{name}`, which `[materials.{name}]` defines: name it as `chain.material` or another `material`")
    }));
    let lacks_frequency = scene.pending_record().is_some() && !reader.has("drive.frequency");
    Ok(Loaded { scene, notes, lacks_frequency })
}

const FLATS: [&str; 2] = ["piston.contact", "support.kind"];

fn of_the_chain(document: &Document) -> Option<String> {
    if let Some(key) = FLATS.into_iter().find(|key| document.text(key) == Some("half-space")) {
        return Some(format!("the half-space of `{key}` has no body that could be meshed"));
    }
    if document.text("support.kind") == Some("foundation") {
        return Some("the foundation of `support.kind` has a force law and no mesh".to_owned());
    }
    if document.text("support.kind") == Some("disc") {
        return Some(
            "it is the usual model before the disc of `support.kind` = \"disc\"; reduced and fea run there when named"
                .to_owned(),
        );
    }
    let is_own = document.entries.contains_key("model.tolerance")
        || document.text("model.integrator").is_some_and(|word| CHAIN_INTEGRATORS.contains(&word));
    if is_own {
        return Some("its integrator is asked for".into());
    }
    ["contact.law", "contact.yield_strength", "chain.gravity"]
        .into_iter()
        .find(|key| document.entries.contains_key(*key))
        .map(|key| format!("`{key}` is of the chain"))
}

/// The text of a scene: of a file as it was when it was read, or a built-in one. Whatever becomes of the file, all scenes loaded from it are of these
/// bytes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SceneText(Origin);

#[derive(Debug, Clone, PartialEq, Eq)]
enum Origin {
    BuiltIn(&'static BuiltIn),
    File { path: PathBuf, text: String },
}

impl SceneText {
    /// Of a built-in scene by name or a file by path; a name that is both is the built-in scene.
    pub fn read(name_or_path: &str) -> Result<Self, SceneError> {
        let path = Path::new(name_or_path);
        let looks_like_path = name_or_path.contains(['/', '\\', '.']) || path.exists();
        match builtin::find(name_or_path, None) {
            Err(SceneError::UnknownScene { .. }) if looks_like_path => {
                Ok(Self(Origin::File { path: path.into(), text: read_text(path)? }))
            }
            found => Ok(Self(Origin::BuiltIn(found?))),
        }
    }

    pub fn of_file(path: &Path, text: String) -> Self {
        Self(Origin::File { path: path.into(), text })
    }

    pub fn load(&self, overrides: &[String], preferred: ModelKind) -> Result<Loaded, SceneError> {
        match &self.0 {
            Origin::BuiltIn(scene) => {
                let document = Document::parse(scene.toml, Author::BuiltIn(scene.name))?;
                assemble(document, overrides, &format!("built-in scene `{}`", scene.name), scene.name, preferred)
            }
            Origin::File { path, text } => parse(text, path, overrides, preferred),
        }
    }

    /// The file and its text; none of a built-in scene.
    pub fn file(&self) -> Option<(&Path, &str)> {
        match &self.0 {
            Origin::BuiltIn(_) => None,
            Origin::File { path, text } => Some((path, text)),
        }
    }
}
