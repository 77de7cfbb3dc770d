//! A scene as written: values by full key, each with its place; layers laid over one another.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read as _},
    path::{Path, PathBuf},
};

use granchain_signal::closest;
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use super::{
    error::{MOST_BYTES, Place, SceneError},
    gone::{gone, is_idle},
    key::Key,
    source::{Author, Source, beginning},
    table::{GOVERNORS, Governor},
};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Entry {
    pub(super) value: Value,
    pub(super) place: Place,
}

#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
    Flag(bool),
    List(Vec<Entry>),
    Table(Vec<(String, Entry)>),
    Date(String),
}

impl Value {
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Number(number) => format!("the number {number:?}").replace(".0", ""),
            Self::Text(text) => format!("the text `{}`", beginning(text)),
            Self::Flag(flag) => format!("`{flag}`"),
            Self::List(list) => format!("a list of {}", list.len()),
            Self::Table(_) => "a table".to_owned(),
            Self::Date(date) => format!("the date {date}"),
        }
    }
}

/// Full key → value. One file, one built-in scene, or all overrides.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Document {
    pub(super) entries: BTreeMap<String, Entry>,
}

impl Document {
    pub(super) fn parse(text: &str, author: Author<'_>) -> Result<Self, SceneError> {
        let source = Source::new(text, author);
        let table = DeTable::parse(text).map_err(|error| SceneError::Syntax {
            place: source.place(error.span().map_or(0, |span| span.start)),
            message: error.message().trim().replace('\n', ", "),
        })?;
        let mut document = Self::default();
        let mut unknown = Vec::new();
        flatten(table.get_ref(), "", &source, &mut document, &mut unknown);
        unknown.sort_by_key(|(offset, _)| *offset);
        match unknown.into_iter().next() {
            Some((offset, key)) => Err(unknown_key(key, source.place(offset))),
            None => Ok(document),
        }
    }

    /// Read overrides `KEY=VALUE`; of two with the same key the later counts.
    pub(super) fn from_overrides(overrides: &[String]) -> Result<Self, SceneError> {
        let mut document = Self::default();
        for text in overrides {
            let refuse = || SceneError::Override { text: text.clone() };
            let (key, value) = text.split_once('=').ok_or_else(refuse)?;
            let (key, value) = (key.trim(), value.trim());
            if key.is_empty() || value.is_empty() {
                return Err(refuse());
            }
            let source = Source::new(text, Author::Override(text));
            let value = override_value(value, &source);
            if let Value::Table(entries) = value {
                // A table stands for its keys.
                for (name, entry) in entries {
                    document.insert_known(format!("{key}.{name}"), entry)?;
                }
            } else {
                document.insert_known(key.to_owned(), Entry { value, place: source.place(0) })?;
            }
        }
        Ok(document)
    }

    fn insert_known(&mut self, key: String, entry: Entry) -> Result<(), SceneError> {
        if Key::find(&key).is_none() {
            return match &entry.value {
                Value::Text(text) if is_idle(&key, text) => Ok(()),
                _ => Err(unknown_key(key, entry.place)),
            };
        }
        if key == "chain.gaps" {
            self.entries.retain(|other, _| !other.starts_with("chain.gaps."));
        }
        self.entries.insert(key, entry);
        Ok(())
    }

    pub(super) fn insert_default(&mut self, key: &str, text: &str, scene: &str) {
        let place = Place::Scene { name: scene.to_owned() };
        self.entries.insert(key.to_owned(), Entry { value: Value::Text(text.to_owned()), place });
    }

    /// Lay `upper` over this document. Where it changes a kind, what the new kind does not use, or reads otherwise, falls away.
    pub(super) fn overlay(&mut self, upper: Self) {
        for governor in GOVERNORS {
            // A layer that makes the model the chain without naming a law means the default one.
            let becomes_chain = governor.name == "contact.law"
                && upper.text("model.kind") == Some("chain")
                && self.text("model.kind").is_some_and(|kind| kind != "chain");
            let implied = if becomes_chain { Some("hertz") } else { None };
            let (Some(new), old) = (upper.text(governor.name).or(implied), self.chosen(governor)) else { continue };
            if old == Some(new) {
                continue;
            }
            if !governor.words().contains(&new) {
                continue;
            }
            for (key, when) in governor.governed() {
                if !when.holds(new) || governor.reinterpreted.contains(&key.name) {
                    self.entries.remove(key.name);
                }
            }
        }
        for [own, other] in [["drive.velocity", "drive.height"], ["drive.height", "drive.velocity"]] {
            if upper.entries.contains_key(own) {
                self.entries.remove(other);
            }
        }
        if upper.entries.contains_key("chain.gaps") {
            self.entries.retain(|key, _| !key.starts_with("chain.gaps."));
        }
        self.entries.extend(upper.entries);
    }

    /// The value of a governor's key, or what stands for it where it is not given.
    pub(super) fn chosen(&self, governor: &Governor) -> Option<&str> {
        let default = match governor.name {
            "model.kind" => Some("chain"),
            "contact.law" if self.text("model.kind").unwrap_or("chain") != "chain" => return None,
            "contact.law" => Some("hertz"),
            "model.integrator" => match self.text("model.kind") {
                Some("fea") => Some("trapezoid"),
                Some("reduced") => None,
                // The clock of the disc.
                _ if self.text("support.kind") == Some("disc") => Some("symplectic"),
                _ => Some("dormand-prince-853"),
            },
            "piston.contact" if self.text("drive.kind") != Some("striker") => Some("rigid"),
            "water.medium" if self.text("support.kind") == Some("disc") => Some("water"),
            "water.method" if self.text("support.kind") != Some("disc") => None,
            "water.method" if self.text("model.kind") == Some("fea") => Some("elements"),
            "water.method" if self.text("water.baffle") == Some("soft") => Some("elements"),
            "water.method" => Some("rayleigh"),
            _ => None,
        };
        if self.entries.contains_key(governor.name) { self.text(governor.name) } else { default }
    }

    pub(super) fn text(&self, key: &str) -> Option<&str> {
        match &self.entries.get(key)?.value {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }
}

fn unknown_key(key: String, place: Place) -> SceneError {
    gone(&key, None, &place).unwrap_or_else(|| SceneError::UnknownKey { nearest: Key::nearest(&key), key, place })
}

fn flatten(
    table: &DeTable<'_>,
    prefix: &str,
    source: &Source<'_>,
    document: &mut Document,
    unknown: &mut Vec<(usize, String)>,
) {
    for (key, value) in table.iter() {
        let full = if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
        match value.get_ref() {
            DeValue::Table(inner) if Key::is_table(&full) => flatten(inner, &full, source, document, unknown),
            DeValue::Table(inner) if Key::find(&full).is_none() => {
                // Name the key inside: `[dampng] coefficient` is a misspelt `damping.coefficient`.
                let leaf = inner.keys().next().map(|leaf| format!("{full}.{}", leaf.get_ref()));
                unknown.push((key.span().start, leaf.unwrap_or(full)));
            }
            DeValue::String(text) if is_idle(&full, text) => {}
            _ if Key::find(&full).is_none() => unknown.push((key.span().start, full)),
            _ => {
                document.entries.insert(full, read(value, source));
            }
        }
    }
}

fn read(value: &Spanned<DeValue<'_>>, source: &Source<'_>) -> Entry {
    let place = source.place(value.span().start);
    let value = match value.get_ref() {
        DeValue::String(string) => Value::Text(string.to_string()),
        DeValue::Boolean(flag) => Value::Flag(*flag),
        // Digits of a valid TOML integer; beyond i64 it is taken as a float.
        DeValue::Integer(integer) => Value::Number(
            i64::from_str_radix(integer.as_str(), integer.radix())
                .map_or_else(|_| integer.as_str().parse().unwrap_or(f64::NAN), |whole| whole as f64),
        ),
        DeValue::Float(float) => Value::Number(float.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Datetime(date) => Value::Date(date.to_string()),
        DeValue::Array(list) => Value::List(list.iter().map(|item| read(item, source)).collect()),
        DeValue::Table(table) => Value::Table(
            table
                .iter()
                .map(|(key, value)| {
                    let entry = read(value, source);
                    (key.get_ref().to_string(), Entry { place: source.place(key.span().start), ..entry })
                })
                .collect(),
        ),
    };
    Entry { value, place }
}

/// A value on the command line: TOML if it is (numbers, `true`, quoted text, lists), else a word or quantity as it stands; in a list
/// the items may stand as they are too.
fn override_value(value: &str, source: &Source<'_>) -> Value {
    if let Ok(parsed) = DeValue::parse(value) {
        let parsed = read(&parsed, source).value;
        if !matches!(parsed, Value::Date(_)) {
            return parsed;
        }
    }
    if let Some(items) = value.strip_prefix('[').and_then(|rest| rest.strip_suffix(']'))
        && !items.contains(['[', '{'])
    {
        let items = items.split(',').map(str::trim).filter(|item| !item.is_empty());
        let place = source.place(0);
        return Value::List(
            items.map(|item| Entry { value: override_value(item, source), place: place.clone() }).collect(),
        );
    }
    Value::Text(value.to_owned())
}

pub(super) fn read_text(path: &Path) -> Result<String, SceneError> {
    if path.is_dir() {
        return Err(SceneError::Folder { path: path.to_owned() });
    }
    let unreadable = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => SceneError::NotThere { path: path.to_owned(), nearest: nearest_scene(path) },
        _ => SceneError::Unreadable { path: path.to_owned(), source },
    };
    let mut bytes = Vec::new();
    File::open(path).and_then(|file| file.take(MOST_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > MOST_BYTES {
        return Err(SceneError::TooLarge { path: path.to_owned() });
    }
    String::from_utf8(bytes)
        .map_err(|error| SceneError::NotText { path: path.to_owned(), offset: error.utf8_error().valid_up_to() })
}

/// A scene file in the same folder whose name differs in a few letters.
fn nearest_scene(path: &Path) -> Option<String> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let files = std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let scenes: Vec<String> = files.filter(|name| name.ends_with(".toml")).collect();
    let nearest = closest(path.file_name()?.to_str()?, scenes.iter().map(String::as_str))?;
    Some(path.with_file_name(nearest).display().to_string())
}

/// `file` as written in a scene file at `place`: relative to that scene file's folder.
pub(super) fn resolved(file: &str, place: &Place) -> PathBuf {
    match place {
        Place::File { path, .. } => path.parent().map_or_else(|| PathBuf::from(file), |folder| folder.join(file)),
        _ => PathBuf::from(file),
    }
}
