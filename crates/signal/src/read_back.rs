//! Reading back what the program wrote, with a limit: a path may lead to a device, to a pipe, or to a file of any size.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

/// All bytes of a plain file that has at most `most` of them.
///
/// # Errors
/// What the system says; [`io::ErrorKind::InvalidData`] for anything else than a plain file, and for a larger one, before it is read.
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

/// The same as text.
///
/// # Errors
/// As [`read_back`]; bytes that are no UTF-8.
pub fn read_back_text(path: &Path, most: u64) -> io::Result<String> {
    String::from_utf8(read_back(path, most)?).map_err(|error| io::Error::new(io::ErrorKind::InvalidData, error))
}
