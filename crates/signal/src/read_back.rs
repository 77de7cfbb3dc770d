//! Reads files of the program with a size limit: a path may lead to a device, a pipe, or a file of any size.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

/// Largest summary, manifest, list or plan that the program reads back, bytes.
pub const SMALL: u64 = 64 << 20;

/// Largest saved state, result or frame read back, bytes.
pub const LARGE: u64 = 4 << 30;

/// All bytes of a plain file that has at most `most` of them.
pub fn read_back(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let refused = |found: String| {
        let text = format!("expected a plain file of at most {most} bytes, found {found}");
        Err(io::Error::new(io::ErrorKind::InvalidData, text))
    };
    // Before it is opened: opening a pipe waits for its writer.
    let found = fs::metadata(path)?;
    if !found.is_file() {
        let kind = if found.is_dir() { "a folder" } else { "a device, pipe or socket" };
        return refused(kind.into());
    }
    if found.len() > most {
        return refused(format!("{} bytes", found.len()));
    }
    let mut bytes = Vec::with_capacity(usize::try_from(found.len()).unwrap_or(0));
    File::open(path)?.take(most + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most { refused("more".into()) } else { Ok(bytes) }
}

pub fn read_back_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_back(path, most)?).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}

/// A text that a user wrote, from a file or a pipe, of at most [`SMALL`] bytes.
pub fn read_text(path: &Path) -> io::Result<String> {
    let mut bytes = Vec::new();
    File::open(path)?.take(SMALL + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > SMALL {
        let text = format!("expected a text of at most {SMALL} bytes, found more");
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
    String::from_utf8(bytes).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
