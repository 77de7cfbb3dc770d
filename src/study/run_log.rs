//! The runs of a study, kept as they finish: one JSON line a run, appended and synced.
//!
//! A process may die between any two bytes. What counts on reading is every line that ends in a newline; a torn last
//! line is cut off before more is appended.

use std::{
    collections::BTreeMap,
    fs::{File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use thiserror::Error;

/// Why the log cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunLogError {
    /// The file system refused.
    #[error("{}: cannot {action}: {source}", path.display())]
    Io {
        /// What was tried.
        action: &'static str,
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A whole line is not what we write.
    #[error("{}:{line}: expected one finished run, found something else ({source}); start anew without --resume", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// What is wrong.
        source: serde_json::Error,
    },
}

/// An append-only file of finished runs.
#[derive(Debug)]
pub struct RunLog {
    path: PathBuf,
    file: Mutex<File>,
}

#[derive(Serialize, Deserialize)]
struct Entry<T> {
    index: usize,
    run: T,
}

impl RunLog {
    /// Open or create the log and read the runs in it, by index.
    ///
    /// # Errors
    /// When the file cannot be read or written, or holds a whole line that is no run.
    pub fn open<T: DeserializeOwned>(path: &Path) -> Result<(Self, BTreeMap<usize, T>), RunLogError> {
        let io = |action| move |source| RunLogError::Io { action, path: path.into(), source };
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(io("open"))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(io("read"))?;
        let whole = bytes.iter().rposition(|&byte| byte == b'\n').map_or(0, |last| last + 1);
        let mut runs = BTreeMap::new();
        for (index, line) in bytes[..whole].split(|&byte| byte == b'\n').enumerate() {
            if line.is_empty() {
                continue;
            }
            let entry: Entry<T> = serde_json::from_slice(line).map_err(|source| RunLogError::Damaged {
                path: path.into(),
                line: index + 1,
                source,
            })?;
            runs.insert(entry.index, entry.run);
        }
        file.set_len(whole as u64).map_err(io("cut"))?;
        file.seek(SeekFrom::End(0)).map_err(io("seek"))?;
        Ok((Self { path: path.into(), file: Mutex::new(file) }, runs))
    }

    /// Keep one finished run; when this returns, it survives a kill.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, index: usize, run: &impl Serialize) -> Result<(), RunLogError> {
        let io = |source| RunLogError::Io { action: "append", path: self.path.clone(), source };
        let mut line = serde_json::to_vec(&Entry { index, run }).map_err(|error| io(error.into()))?;
        line.push(b'\n');
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(&line).and_then(|()| file.sync_data()).map_err(io)
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_torn_last_line_is_dropped_and_overwritten() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        let (log, runs) = RunLog::open::<f64>(&path).unwrap();
        assert!(runs.is_empty());
        log.keep(0, &0.1).unwrap();
        log.keep(2, &(1.0 / 3.0)).unwrap();
        drop(log);
        let whole = fs::read(&path).unwrap();
        for torn in 1..=whole.len() / 2 {
            fs::write(&path, &whole[..whole.len() - torn]).unwrap();
            let (log, runs) = RunLog::open::<f64>(&path).unwrap();
            assert_eq!(runs.into_iter().collect::<Vec<_>>(), [(0, 0.1)]);
            log.keep(2, &(1.0 / 3.0)).unwrap();
            assert_eq!(fs::read(&path).unwrap(), whole);
        }
    }

    #[test]
    fn a_whole_line_of_something_else_is_an_error_with_its_line() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        fs::write(&path, "{\"index\":0,\"run\":1.0}\nhello\n").unwrap();
        let error = RunLog::open::<f64>(&path).unwrap_err().to_string();
        assert!(error.contains("runs.jsonl:2"), "{error}");
    }
}
