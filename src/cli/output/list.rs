//! The list of the files that granchain wrote into a folder, and which of them still are as they were written.
//!
//! `.granchain` begins with a line that names its form; every further line is the SHA-256 of a file, two spaces and its name below the
//! folder. In place of the digest of `timing.json` stands `varies`, and digests of a page leave its times out, so that the list is the same for equal
//! results.
//!
//! A list may come with a folder from anywhere. It never leads to a file: the files that stand in the folder are looked up in it, and one is
//! ours only while its digest is the one listed.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    io::{self, Read},
    path::{Component, Path, PathBuf},
};

use sha2::{Digest, Sha256};

use super::{COMMON, OutputError};
use crate::{
    cli::timing,
    measurement::{
        hexadecimal,
        read_back::{SMALL, read_back},
        sha256,
    },
    report::page::{PAGES, without_times},
};

/// Name of the list in a finished folder.
pub const LIST: &str = ".granchain";

/// First line of a list.
const FORM: &str = "# granchain: files of this folder, form 3";

/// In place of a digest: the file differs from run to run.
const VARIES: &str = "varies";

/// Largest result, bytes: none larger is hashed to see whether it is ours.
const LARGEST: u64 = 64 << 30;

/// Names of files, each with the digests it may have.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct List(BTreeMap<String, BTreeSet<String>>);

impl List {
    pub fn add(&mut self, name: String, digest: String) {
        self.0.entry(name).or_default().insert(digest);
    }

    /// Add all files of another list.
    pub fn extend(&mut self, other: &Self) {
        for (name, digests) in &other.0 {
            self.0.entry(name.clone()).or_default().extend(digests.iter().cloned());
        }
    }

    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.0.keys().map(String::as_str)
    }

    /// Whether the name is listed.
    pub fn contains(&self, name: &str) -> bool {
        self.0.contains_key(name)
    }

    /// Whether a file of the folder is as the list says; `None` where the list does not name it.
    fn is_as_written(&self, folder: &Path, name: &str) -> Result<Option<bool>, OutputError> {
        let Some(digests) = self.0.get(name) else { return Ok(None) };
        let path = folder.join(name);
        let plain = fs::symlink_metadata(&path).is_ok_and(|file| file.is_file() && file.len() <= LARGEST);
        Ok(Some(plain && digests.contains(&digest_of_file(name, &path)?)))
    }

    /// What stands in the file.
    pub fn text(&self) -> String {
        let lines = self.0.iter().flat_map(|(name, digests)| digests.iter().map(move |digest| (digest, name)));
        lines.fold(format!("{FORM}\n"), |text, (digest, name)| format!("{text}{digest}  {name}\n"))
    }

    /// The list of a folder; empty where there is none.
    fn read(folder: &Path) -> Result<Self, OutputError> {
        let path = folder.join(LIST);
        let damaged = |line, found: &str| {
            let found = found.chars().take(80).collect::<String>().escape_debug().to_string();
            OutputError::DamagedList { path: path.clone(), line, found }
        };
        match fs::symlink_metadata(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(source) => return Err(OutputError::io("read", &path)(source)),
            Ok(file) if !file.is_file() => return Err(damaged(1, "no plain file")),
            Ok(_) => {}
        }
        let bytes = read_back(&path, SMALL).map_err(OutputError::io("read", &path))?;
        let text = String::from_utf8(bytes).map_err(|_| damaged(1, "bytes that are no text"))?;
        // Not `lines`, which takes `\r` for part of the end.
        let mut list = Self::default();
        for (number, line) in text.split_terminator('\n').enumerate() {
            match line.split_once("  ") {
                None if number == 0 && line == FORM => {}
                Some((digest, name)) if number > 0 && is_digest(digest) && is_plain(name) => {
                    list.add(name.into(), digest.into());
                }
                _ => return Err(damaged(number + 1, line)),
            }
        }
        Ok(list)
    }
}

/// A contradiction between the list of a folder and a file that it names.
pub struct ListFault {
    /// Which of both was altered if the other is as it was written: the list, but for a file that carries its own seal.
    pub place: &'static str,
    /// The file that is named.
    pub name: String,
    pub found: String,
}

/// The contradictions of a folder's list, if there is one; files that are gone but `known` from elsewhere are none.
pub fn list_faults(folder: &Path, known: impl Fn(&str) -> bool) -> Result<Vec<ListFault>, OutputError> {
    let fault = |place, name: &str, found| ListFault { place, name: name.to_owned(), found };
    let list = match List::read(folder) {
        Err(OutputError::DamagedList { line, found, .. }) => {
            return Ok(vec![fault(LIST, LIST, format!("line {line}: {found}"))]);
        }
        list => list?,
    };
    let mut faults = Vec::new();
    for name in list.names() {
        if !folder.join(name).exists() {
            faults.extend((!known(name)).then(|| fault(LIST, name, format!("a line of {name}, which is not there"))));
        } else if list.is_as_written(folder, name)? == Some(false) {
            let place = if name == timing::FILE { timing::FILE } else { LIST };
            faults.push(fault(place, name, format!("another digest of {name}")));
        }
    }
    Ok(faults)
}

/// What stands in a folder.
#[derive(Debug, Default)]
pub struct Standing {
    /// Files as an earlier run of ours wrote them.
    pub ours: BTreeSet<String>,
    /// The first file that nobody listed.
    pub foreign: Option<String>,
    /// What the folder's list says.
    pub list: List,
}

impl Standing {
    /// Look through a folder; nothing stands in one that is not there.
    ///
    /// # Errors
    /// [`OutputError::NotAFolder`]; a damaged list; a file of ours that was changed since.
    pub fn of(folder: &Path) -> Result<Self, OutputError> {
        if fs::symlink_metadata(folder).is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
            return Ok(Self::default());
        }
        if !folder.is_dir() {
            return Err(OutputError::NotAFolder { path: folder.into() });
        }
        let mut standing = Self { list: List::read(folder)?, ..Self::default() };
        for name in files_below(folder)? {
            match standing.list.is_as_written(folder, &name)? {
                Some(true) => _ = standing.ours.insert(name),
                Some(false) => return Err(OutputError::Altered { folder: folder.into(), found: name }),
                None if name == LIST => {}
                None => _ = standing.foreign.get_or_insert(name),
            }
        }
        Ok(standing)
    }

    /// Refuse a folder of ours in which nothing stands of what only a run that writes `names` writes, unless it may be replaced (`force`).
    ///
    /// # Errors
    /// [`OutputError::OtherKind`].
    pub fn refuse_other_kind(&self, folder: &Path, force: bool, names: &[&str]) -> Result<(), OutputError> {
        let own = || names.iter().filter(|name| !COMMON.contains(name));
        let same_kind = own().next().is_none() || own().any(|name| self.ours.contains(*name));
        match self.ours.first() {
            Some(found) if !force && !same_kind => {
                Err(OutputError::OtherKind { folder: folder.into(), found: found.clone() })
            }
            _ => Ok(()),
        }
    }

    /// Refuse a folder that holds something else, unless it may (`force`); and in any case one in which the name of a result is taken.
    ///
    /// # Errors
    /// [`OutputError::Foreign`], [`OutputError::Taken`].
    pub fn refuse<'a>(
        &self,
        folder: &Path,
        force: bool,
        names: impl IntoIterator<Item = &'a str>,
    ) -> Result<(), OutputError> {
        let Some(found) = &self.foreign else { return Ok(()) };
        if !force {
            return Err(OutputError::Foreign { folder: folder.into(), found: found.clone() });
        }
        match names.into_iter().find_map(|name| self.taken(folder, name)) {
            Some(found) => Err(OutputError::Taken { folder: folder.into(), found }),
            None => Ok(()),
        }
    }

    /// What stands where a file of this name would be written: a file that is not ours, a folder, or a link on the way.
    fn taken(&self, folder: &Path, name: &str) -> Option<String> {
        let way = Path::new(name).ancestors().filter(|way| !way.as_os_str().is_empty());
        way.enumerate().find_map(|(level, way)| {
            let found = fs::symlink_metadata(folder.join(way)).ok()?;
            let free = if level == 0 { self.ours.contains(name) } else { found.is_dir() };
            (!free).then(|| way.display().to_string())
        })
    }
}

/// Whether a file differs from its entry in the list beside it; `false` without an entry.
///
/// # Errors
/// A list that is damaged, or a file that cannot be read.
pub fn is_altered(file: &Path) -> Result<bool, OutputError> {
    let folder = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let Some(name) = file.file_name().and_then(|name| name.to_str()) else { return Ok(false) };
    Ok(List::read(folder)?.is_as_written(folder, name)? == Some(false))
}

/// What the list says of a file with these bytes.
pub fn digest(name: &str, bytes: &[u8]) -> String {
    match name {
        timing::FILE => VARIES.into(),
        name if PAGES.contains(&name) => sha256(&without_times(bytes)),
        _ => sha256(bytes),
    }
}

/// The same of a file on disk.
pub fn digest_of_file(name: &str, path: &Path) -> Result<String, OutputError> {
    let read = || {
        if name == timing::FILE {
            return Ok(VARIES.into());
        }
        if PAGES.contains(&name) {
            return Ok(digest(name, &fs::read(path)?));
        }
        let (mut file, mut hash, mut part) = (fs::File::open(path)?, Sha256::new(), vec![0; 1 << 16]);
        loop {
            match file.read(&mut part)? {
                0 => return Ok(hexadecimal(&hash.finalize())),
                length => hash.update(&part[..length]),
            }
        }
    };
    read().map_err(OutputError::io("read", path))
}

fn is_digest(text: &str) -> bool {
    text == VARIES || text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// Whether a name is one that [`files_below`] can give: relative, of plain parts with `/` between them, of printable text.
pub fn is_plain(name: &str) -> bool {
    let parts: Option<Vec<&str>> = Path::new(name)
        .components()
        .map(|part| if let Component::Normal(part) = part { part.to_str() } else { None })
        .collect();
    // U+FFFD stands for bytes that are no text, so that two files could have one name.
    let printable = !name.contains(|letter: char| letter.is_control() || letter == char::REPLACEMENT_CHARACTER);
    printable && !name.is_empty() && parts.is_some_and(|parts| parts.join("/") == name)
}

/// Every file below `folder`, relative, with `/`, sorted; a link is a file, wherever it leads.
pub fn files_below(folder: &Path) -> Result<Vec<String>, OutputError> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(place) = open.pop() {
        for path in entries(&place)? {
            if path.is_dir() && !path.is_symlink() {
                open.push(path);
            } else if let Ok(relative) = path.strip_prefix(folder) {
                let parts: Vec<_> = relative.iter().map(|part| part.to_string_lossy()).collect();
                found.push(parts.join("/"));
            }
        }
    }
    found.sort();
    Ok(found)
}

/// What lies in a folder, sorted.
pub fn entries(folder: &Path) -> Result<Vec<PathBuf>, OutputError> {
    let mut paths = fs::read_dir(folder)
        .and_then(|entries| entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<Vec<_>, _>>())
        .map_err(OutputError::io("read the folder", folder))?;
    paths.sort();
    Ok(paths)
}
