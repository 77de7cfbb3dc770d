//! Why a scene was refused: where, what was expected, what was found, what to do.

use std::{fmt, io, path::PathBuf};

use granchain_signal::{Dimension, QuantityError};
use thiserror::Error;

/// Largest scene file, bytes: a thousand beads, each unlike the others, are a fifth of it. Every value is kept with its place, in up to a
/// hundred times the memory of its text.
pub(super) const MOST_BYTES: u64 = 1 << 20;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a scene file; line and column count from 1, the column in characters.
    File {
        /// The file as named by its user.
        path: PathBuf,
        line: usize,
        column: usize,
    },
    BuiltIn {
        name: String,
    },
    Override {
        text: String,
    },
    Scene {
        name: String,
    },
}

impl fmt::Display for Place {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { path, line, column } => write!(formatter, "{}:{line}:{column}", path.display()),
            Self::BuiltIn { name } => write!(formatter, "built-in scene `{name}`"),
            Self::Override { text } => write!(formatter, "--set {text}"),
            Self::Scene { name } => formatter.write_str(name),
        }
    }
}

#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SceneError {
    #[error(
        "{}`{name}` is neither a built-in scene ({}) nor a scene file{}",
        place.as_ref().map(|place| format!("{place}: ")).unwrap_or_default(),
        known.join(", "),
        did_you_mean(nearest.as_deref())
    )]
    UnknownScene { place: Option<Place>, name: String, nearest: Option<String>, known: Vec<&'static str> },
    #[error("{}: expected a scene file, found none{}; `granchain scene init FILE` begins one", path.display(), did_you_mean(nearest.as_deref()))]
    NotThere { path: PathBuf, nearest: Option<String> },
    #[error("cannot read scene file `{}`: {source}", path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("`{}` is a folder; give the scene file in it, such as `{}`", path.display(), path.join("scene.toml").display())]
    Folder { path: PathBuf },
    #[error("`{}` has more than {MOST_BYTES} bytes, no scene has; a record belongs to `--measured`, the horn's motion to `drive.file`", path.display())]
    TooLarge { path: PathBuf },
    #[error("`{}` is not a text file (byte {offset} is no UTF-8); expected a scene in TOML, see `granchain scene init`", path.display())]
    NotText { path: PathBuf, offset: usize },
    #[error("{place}: not readable as TOML: {message}; expected lines such as `radius = \"0.5 mm\"` under `[chain]`")]
    Syntax { place: Place, message: String },
    #[error("--set {text}: expected KEY=VALUE such as `damping.coefficient=0.4` or `chain.radius=0.5mm`")]
    Override { text: String },
    #[error("{place}: unknown key `{key}`; {}", nearest.as_ref().map_or_else(
        || "`granchain scene keys` lists all keys".to_owned(), |nearest| format!("did you mean `{nearest}`?")))]
    UnknownKey { place: Place, key: String, nearest: Option<String> },
    #[error("{place}: `{key}`{}: {instead}", word.as_ref().map(|word| format!(" = \"{word}\"")).unwrap_or_default())]
    Gone { place: Place, key: String, word: Option<String>, instead: &'static str },
    #[error("{place}: `{key}`: expected {expected}, found {found}")]
    WrongType { place: Place, key: String, expected: String, found: String },
    #[error("{place}: `{key}`: {source}{}", advice(source))]
    Quantity { place: Place, key: String, source: QuantityError },
    #[error("{place}: `{key}`: expected one of {}, found `{found}`{}", quoted(choices), did_you_mean(nearest.as_deref()))]
    UnknownChoice { place: Place, key: String, found: String, choices: Vec<String>, nearest: Option<String> },
    #[error("{place}: `{key}`: expected {expected}, found {found}")]
    OutOfRange { place: Place, key: String, expected: String, found: String },
    #[error("{scene}: `{key}` is missing{}", reason.map_or_else(
        || format!("; add `{example}`, or begin the file with `extends = \"annulus\"`"),
        |reason| format!(" ({reason}); add `{example}`, or pass it with --set")))]
    Missing { scene: String, key: &'static str, reason: Option<&'static str>, example: &'static str },
    #[error("{place}: `{key}` has no effect with `{governor} = \"{choice}\"`, which uses {}; remove it or change `{governor}`{}",
        if used.is_empty() { "no further keys".to_owned() } else { quoted(used) },
        users(governor, users_of_key))]
    NotUsed {
        place: Place,
        key: String,
        governor: String,
        choice: String,
        used: Vec<String>,
        users_of_key: Vec<String>,
    },
    #[error("{place}: `{key}`: unknown material `{found}` (known: {}){}; define it under `[materials.{found}]`",
        known.join(", "), did_you_mean(nearest.as_deref()))]
    UnknownMaterial { place: Place, key: String, found: String, nearest: Option<String>, known: Vec<String> },
    #[error("{scene}: material `{material}` lacks `{property}`; add `materials.{material}.{property}`, {}", expected.describe())]
    IncompleteMaterial { scene: String, material: String, property: &'static str, expected: Dimension },
    #[error("{place}: `{key}`: expected `contact1` (piston) to `contact{contacts}` (support) or `all`")]
    NoSuchContact { place: Place, key: String, contacts: usize },
    #[error(
        "{place}: `{key}`: expected one value or {expected} (one for each contact of {beads} beads, from the piston), found {found}"
    )]
    WrongCount { place: Place, key: String, beads: usize, expected: usize, found: usize },
    #[error("{place}: `{key}`: there is no bead {found}; the chain has beads 1 to {beads}")]
    NoSuchBead { place: Place, key: String, beads: usize, found: String },
    #[error("{place}: bead {bead} has an override already; put both values into one `[[chain.override]]`")]
    RepeatedBead { place: Place, bead: usize },
    #[error(
        "{place}: `{key}`: gap {contact} is {gap}: {left} and {right} would overlap at the start; \
        a gap is 0 or more, a chain pressed together is `chain.precompression = \"0.05 N\"`"
    )]
    Overlap { place: Place, key: String, contact: usize, gap: String, left: String, right: String },
    #[error(
        "{place}: `chain.precompression`: {force} cannot press a chain whose contact {contact} is open by {gap}; \
        close the gaps (`chain.gaps = 0`) or set `chain.precompression = 0`"
    )]
    PrecompressedGap { place: Place, force: String, contact: usize, gap: String },
    #[error(
        "{place}: the last bead touches the ring with a normal {angle} from the axis (sin φ = R/(a + b)), expected {}° to {}°; take a {remedy}",
        between.0, between.1
    )]
    AnnulusAngle { place: Place, angle: String, between: (f64, f64), remedy: &'static str },
    #[error(
        "{place}: the last bead has radius {radius} and falls through the annulus (opening radius {opening}); \
        use a larger bead, a smaller ring (`support.ring_radius`), or another `support.kind`"
    )]
    ThroughAnnulus { place: Place, radius: String, opening: String },
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
