//! Why a scene was refused: where, what was expected, what was found, what to do.

use std::{fmt, io, path::PathBuf};

use thiserror::Error;

use super::document::MOST_BYTES;
use granchain_signal::{Dimension, QuantityError};

/// Where a value of a scene was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a scene file; line and column count from 1, the column in characters.
    File {
        /// The file as named by its user.
        path: PathBuf,
        /// Line.
        line: usize,
        /// Column.
        column: usize,
    },
    /// In a scene that comes with the program.
    BuiltIn {
        /// Its name.
        name: String,
        /// Line.
        line: usize,
    },
    /// In an override.
    Override {
        /// The text after `--set`.
        text: String,
    },
    /// Nowhere in particular: a default of the scene.
    Scene {
        /// The scene or its file.
        name: String,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line, column } => write!(formatter, "{}:{line}:{column}", path.display()),
            Self::BuiltIn { name, line } => write!(formatter, "built-in scene `{name}`, line {line}"),
            Self::Override { text } => write!(formatter, "--set {text}"),
            Self::Scene { name } => formatter.write_str(name),
        }
    }
}

/// A scene that cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error(
        "{}`{name}` is neither a built-in scene ({}) nor a scene file{}",
        place.as_ref().map(|place| format!("{place}: ")).unwrap_or_default(),
        known.join(", "),
        did_you_mean(nearest.as_deref())
    )]
    UnknownScene {
        /// Where it was asked for, if in a file.
        place: Option<Place>,
        /// What was asked for.
        name: String,
        /// The built-in scene whose name looks most like it.
        nearest: Option<String>,
        /// The built-in scenes.
        known: Vec<&'static str>,
    },
    /// A file that cannot be read.
    #[error("cannot read scene file `{}`: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A folder where a file belongs.
    #[error("`{}` is a folder; give the scene file in it, such as `{}`", path.display(), path.join("scene.toml").display())]
    Folder {
        /// The folder.
        path: PathBuf,
    },
    /// A file much larger than any scene.
    #[error("`{}` has more than {MOST_BYTES} bytes, no scene has; a record belongs to `--measured`, the horn's motion to `drive.file`", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// A file that is no UTF-8 text.
    #[error("`{}` is not a text file (byte {offset} is no UTF-8); expected a scene in TOML, see `granchain scene init`", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// First byte that is no text, from 0.
        offset: usize,
    },
    /// A file that is no TOML.
    #[error("{place}: not readable as TOML: {message}; expected lines such as `radius = \"0.5 mm\"` under `[chain]`")]
    Syntax {
        /// Where.
        place: Place,
        /// What the TOML reader says.
        message: String,
    },
    /// An override that is no `KEY=VALUE`.
    #[error("--set {text}: expected KEY=VALUE such as `damping.coefficient=0.4` or `chain.radius=0.5mm`")]
    Override {
        /// The text after `--set`.
        text: String,
    },
    /// A key nobody knows.
    #[error("{place}: unknown key `{key}`; {}", nearest.as_ref().map_or_else(
        || "`granchain scene show annulus` lists the keys".to_owned(), |nearest| format!("did you mean `{nearest}`?")))]
    UnknownKey {
        /// Where.
        place: Place,
        /// The key with its tables.
        key: String,
        /// The valid key that looks most like it.
        nearest: Option<String>,
    },
    /// A value of another type.
    #[error("{place}: `{key}`: expected {expected}, found {found}")]
    WrongType {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// What belongs there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A number without, or with a wrong or unknown unit.
    #[error("{place}: `{key}`: {source}{}", advice(source))]
    Quantity {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// What is wrong with it.
        source: QuantityError,
    },
    /// A word that is none of those possible.
    #[error("{place}: `{key}`: expected one of {}, found `{found}`{}", quoted(choices), did_you_mean(nearest.as_deref()))]
    UnknownChoice {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// The word found.
        found: String,
        /// The words possible.
        choices: Vec<String>,
        /// The one that looks most like it.
        nearest: Option<String>,
    },
    /// A value that no experiment, or no computation, can have.
    #[error("{place}: `{key}`: expected {expected}, found {found}")]
    OutOfRange {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// What is possible.
        expected: String,
        /// What was found, with its unit.
        found: String,
    },
    /// A key that must be there.
    #[error("{scene}: `{key}` is missing{}", reason.map_or_else(
        || format!("; add `{example}`, or begin the file with `extends = \"annulus\"`"),
        |reason| format!(" ({reason}); add `{example}`, or pass it with --set")))]
    Missing {
        /// The scene or its file.
        scene: String,
        /// The key.
        key: &'static str,
        /// Why it is needed, if it is not always.
        reason: Option<&'static str>,
        /// A line that provides it.
        example: &'static str,
    },
    /// A key that has no effect in this scene.
    #[error("{place}: `{key}` has no effect with `{governor} = \"{choice}\"`, which uses {}; remove it or change `{governor}`{}",
        if used.is_empty() { "no further keys".to_owned() } else { quoted(used) },
        users(governor, users_of_key))]
    NotUsed {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// The key that decides.
        governor: String,
        /// Its value.
        choice: String,
        /// The keys that value uses.
        used: Vec<String>,
        /// The values that do use the key.
        users_of_key: Vec<String>,
    },
    /// A material nobody has defined.
    #[error("{place}: `{key}`: unknown material `{found}` (known: {}){}; define it under `[materials.{found}]`",
        known.join(", "), did_you_mean(nearest.as_deref()))]
    UnknownMaterial {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// The name found.
        found: String,
        /// The known material that looks most like it.
        nearest: Option<String>,
        /// The known materials.
        known: Vec<String>,
    },
    /// A material without one of its properties.
    #[error("{scene}: material `{material}` lacks `{property}`; add `materials.{material}.{property}`, {}", expected.describe())]
    IncompleteMaterial {
        /// The scene or its file.
        scene: String,
        /// The material.
        material: String,
        /// What is missing.
        property: &'static str,
        /// What belongs there.
        expected: Dimension,
    },
    /// A contact that the chain does not have.
    #[error("{place}: `{key}`: expected `contact1` (piston) to `contact{contacts}` (support) or `all`")]
    NoSuchContact {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// Number of contacts.
        contacts: usize,
    },
    /// A list with too few or too many values.
    #[error(
        "{place}: `{key}`: expected one value or {expected} (one for each contact of {beads} beads, from the piston), found {found}"
    )]
    WrongCount {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// Number of beads.
        beads: usize,
        /// Values expected.
        expected: usize,
        /// Values found.
        found: usize,
    },
    /// A bead that the chain does not have.
    #[error("{place}: `{key}`: there is no bead {found}; the chain has beads 1 to {beads}")]
    NoSuchBead {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// Number of beads.
        beads: usize,
        /// The bead asked for.
        found: String,
    },
    /// Two overrides of one bead.
    #[error("{place}: bead {bead} has an override already; put both values into one `[[chain.override]]`")]
    RepeatedBead {
        /// Where.
        place: Place,
        /// The bead.
        bead: usize,
    },
    /// A contact that is closed by more than nothing at the start.
    #[error(
        "{place}: `{key}`: gap {contact} is {gap}: {left} and {right} would overlap at the start; \
        a gap is 0 or more, a chain pressed together is `chain.precompression = \"0.05 N\"`"
    )]
    Overlap {
        /// Where.
        place: Place,
        /// The key.
        key: String,
        /// Number of the contact from 1.
        contact: usize,
        /// The gap found.
        gap: String,
        /// What lies before the contact.
        left: String,
        /// What lies behind it.
        right: String,
    },
    /// A force on a chain that does not hang together.
    #[error(
        "{place}: `chain.precompression`: {force} cannot press a chain whose contact {contact} is open by {gap}; \
        close the gaps (`chain.gaps = 0`) or set `chain.precompression = 0`"
    )]
    PrecompressedGap {
        /// Where.
        place: Place,
        /// The force.
        force: String,
        /// Number of the open contact from 1.
        contact: usize,
        /// Its gap.
        gap: String,
    },
    /// A bead that lies on a ring too flat or too steep.
    #[error(
        "{place}: the last bead touches the ring with a normal {angle} from the axis (sin φ = R/(a + b)), expected {}° to {}°; take a {remedy}",
        between.0, between.1
    )]
    AnnulusAngle {
        /// Where the ring is described.
        place: Place,
        /// φ.
        angle: String,
        /// Least and largest φ, °.
        between: (f64, f64),
        /// What to change.
        remedy: &'static str,
    },
    /// A last bead that the annulus does not hold.
    #[error(
        "{place}: the last bead has radius {radius} and falls through the annulus, whose opening has {opening}; \
        use a larger bead, a smaller ring (`support.ring_radius`), or another `support.kind`"
    )]
    ThroughAnnulus {
        /// Where the support is chosen.
        place: Place,
        /// Radius of the last bead.
        radius: String,
        /// Radius of the opening.
        opening: String,
    },
}

fn did_you_mean(nearest: Option<&str>) -> String {
    nearest.map(|nearest| format!("; did you mean `{nearest}`?")).unwrap_or_default()
}

fn advice(error: &QuantityError) -> &'static str {
    if matches!(error, QuantityError::MissingUnit { .. }) { "; add it, or write a plain number in SI" } else { "" }
}

fn quoted(words: &[String]) -> String {
    words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

fn users(governor: &str, values: &[String]) -> String {
    let values: Vec<_> = values.iter().map(|value| format!("`{governor} = \"{value}\"`")).collect();
    if values.is_empty() { String::new() } else { format!(" (it belongs to {})", values.join(", ")) }
}
