//! Log of finished runs: one JSON line a run, appended and synced.
//!
//! A process may be killed at any time. Only lines that end in a newline are read. A torn last line is cut off before the
//! next append; a line that is no run is reported and its run repeated.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::{self, BufRead, BufReader, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{Mutex, PoisonError},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use thiserror::Error;

/// Longest line that is read, bytes.
const LONGEST_LINE: u64 = 64 << 20;

/// Why the log cannot be used.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RunLogError {
    #[error("{}: cannot {action}: {source}", path.display())]
    Io { action: &'static str, path: PathBuf, source: io::Error },
}

/// An append-only file of finished runs.
#[derive(Debug)]
pub struct RunLog {
    path: PathBuf,
    end: Mutex<End>,
    /// Unusable lines, from 1.
    damaged: Vec<usize>,
}

#[derive(Debug)]
struct End {
    file: File,
    /// Whether the last line may be torn, so that a new line must not begin in it.
    torn: bool,
}

#[derive(Serialize, Deserialize)]
struct Entry<T> {
    index: usize,
    run: T,
}

fn read_line<T: DeserializeOwned>(line: &[u8]) -> Option<Entry<T>> {
    serde_json::from_slice(line).ok()
}

/// Positions of the runs in a log; only positions are held in memory.
#[derive(Debug)]
pub struct RunIndex {
    path: PathBuf,
    file: Mutex<BufReader<File>>,
    places: BTreeMap<usize, u64>,
}

impl RunIndex {
    #[must_use]
    pub fn len(&self) -> usize {
        self.places.len()
    }

    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.places.is_empty()
    }

    /// Whether it has this run.
    #[must_use]
    pub fn contains(&self, index: usize) -> bool {
        self.places.contains_key(&index)
    }

    /// The largest index of a run.
    #[must_use]
    pub fn last(&self) -> Option<usize> {
        self.places.last_key_value().map(|(index, _)| *index)
    }

    /// Read one run.
    ///
    /// # Errors
    /// When it is not there, or not what was written.
    pub fn read<T: DeserializeOwned>(&self, index: usize) -> Result<T, RunLogError> {
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        let mut read = || {
            let place = *self.places.get(&index).ok_or(io::ErrorKind::NotFound)?;
            // What lies close behind is in the buffer already.
            let here = file.stream_position()?;
            file.seek_relative(place.cast_signed() - here.cast_signed())?;
            let mut line = Vec::new();
            file.read_until(b'\n', &mut line)?;
            line.pop();
            Ok(read_line::<T>(&line).filter(|entry| entry.index == index).ok_or(io::ErrorKind::InvalidData)?.run)
        };
        read().map_err(|source: io::Error| RunLogError::Io { action: "read", path: self.path.clone(), source })
    }
}

impl RunLog {
    /// Open or create the log and read the runs in it, by index.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub fn open<T: DeserializeOwned>(path: &Path) -> Result<(Self, BTreeMap<usize, T>), RunLogError> {
        let mut runs = BTreeMap::new();
        let log = Self::scanned(path, |entry: Entry<T>, _| drop(runs.insert(entry.index, entry.run)))?;
        Ok((log, runs))
    }

    /// Opens or creates the log and indexes its runs, to be read one by one.
    ///
    /// # Errors
    /// As [`RunLog::open`].
    pub fn index<T: DeserializeOwned>(path: &Path) -> Result<(Self, RunIndex), RunLogError> {
        let mut places = BTreeMap::new();
        let log = Self::scanned(path, |entry: Entry<T>, place| {
            places.insert(entry.index, place);
        })?;
        let file = File::open(path).map_err(|source| RunLogError::Io { action: "open", path: path.into(), source })?;
        Ok((log, RunIndex { path: path.into(), file: Mutex::new(BufReader::new(file)), places }))
    }

    /// Opens or creates the log; every run in it is passed to `found` with the position of its line.
    fn scanned<T: DeserializeOwned>(path: &Path, mut found: impl FnMut(Entry<T>, u64)) -> Result<Self, RunLogError> {
        let io = |action| move |source| RunLogError::Io { action, path: path.into(), source };
        // Opening a pipe waits for another process, and a device has no end.
        if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
            return Err(io("open")(io::Error::new(io::ErrorKind::InvalidData, "expected a plain file")));
        }
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(io("open"))?;
        let (mut whole, mut damaged) = (0, Vec::new());
        let (mut reader, mut line) = (BufReader::new(&file), Vec::new());
        for number in 1.. {
            line.clear();
            // No line of ours is longer: what is left of one, and what comes after it, is dropped like a torn line.
            let length = reader.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(io("read"))?;
            if line.pop_if(|last| *last == b'\n').is_none() {
                break;
            }
            match read_line(&line) {
                Some(entry) => found(entry, whole),
                None if line.is_empty() => {}
                None => damaged.push(number),
            }
            whole += length as u64;
        }
        file.set_len(whole).map_err(io("cut"))?;
        file.seek(SeekFrom::End(0)).map_err(io("seek"))?;
        Ok(Self { path: path.into(), end: Mutex::new(End { file, torn: false }), damaged })
    }

    /// Warning about damaged lines; `None` if there are none.
    #[must_use]
    pub fn damage(&self) -> Option<String> {
        let lines: Vec<String> = self.damaged.iter().map(ToString::to_string).collect();
        (!lines.is_empty()).then(|| {
            let path = self.path.display();
            format!("{path}:{}: damaged since it was written; what stood there is run again", lines.join(", "))
        })
    }

    /// Appends one finished run; on return it is on disc.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn keep(&self, index: usize, run: &impl Serialize) -> Result<(), RunLogError> {
        let io = |source| RunLogError::Io { action: "append", path: self.path.clone(), source };
        let mut line = serde_json::to_vec(&Entry { index, run }).map_err(|error| io(error.into()))?;
        line.push(b'\n');
        let mut end = self.end.lock().unwrap_or_else(PoisonError::into_inner);
        if end.torn {
            line.insert(0, b'\n');
        }
        // A disk that is full for a moment takes a part of a line; another thread may find room again.
        end.torn = true;
        end.file.write_all(&line).and_then(|()| end.file.sync_data()).map_err(io)?;
        end.torn = false;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
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
    fn runs_are_read_one_by_one_as_they_were_kept() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        let (log, _) = RunLog::open::<f64>(&path).unwrap();
        for index in [7, 2, 5, 2] {
            log.keep(index, &(1.0 / index as f64)).unwrap();
        }
        let (_, runs) = RunLog::index::<f64>(&path).unwrap();
        assert_eq!((runs.len(), runs.last(), runs.contains(5), runs.contains(3)), (3, Some(7), true, false));
        for index in [2, 7, 5, 2] {
            assert_eq!(runs.read::<f64>(index).unwrap().to_bits(), (1.0 / index as f64).to_bits());
        }
        assert!(runs.read::<f64>(3).unwrap_err().to_string().contains("runs.jsonl: cannot read"));
        // Damaged behind its back.
        let altered = fs::read_to_string(&path).unwrap().replace("0.5", "0,5");
        fs::write(&path, altered).unwrap();
        let (_, runs) = RunLog::index::<f64>(&path).unwrap();
        assert!(!runs.contains(2) && runs.contains(5));
    }

    #[test]
    fn a_run_kept_behind_a_line_that_the_disk_took_a_part_of_is_kept() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        let (log, _) = RunLog::open::<f64>(&path).unwrap();
        log.keep(0, &0.1).unwrap();
        // A disk that is full after six bytes, and then no more.
        log.end.lock().unwrap().file.write_all(b"granch").unwrap();
        let writable = std::mem::replace(&mut log.end.lock().unwrap().file, File::open(&path).unwrap());
        log.keep(1, &0.25).unwrap_err();
        log.end.lock().unwrap().file = writable;
        log.keep(2, &(1.0 / 3.0)).unwrap();
        drop(log);
        let (log, runs) = RunLog::open::<f64>(&path).unwrap();
        assert_eq!(runs, BTreeMap::from([(0, 0.1), (2, 1.0 / 3.0)]));
        assert!(log.damage().is_some_and(|given| given.contains("runs.jsonl:2:")));
    }

    #[test]
    fn a_line_without_end_is_dropped_without_being_held() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        let (log, _) = RunLog::open::<f64>(&path).unwrap();
        log.keep(0, &0.1).unwrap();
        let whole = fs::metadata(&path).unwrap().len();
        // Sparse: more than any memory holds.
        File::options().write(true).open(&path).unwrap().set_len(1 << 40).unwrap();
        let (_, runs) = RunLog::open::<f64>(&path).unwrap();
        assert_eq!((runs.len(), fs::metadata(&path).unwrap().len()), (1, whole));
        assert!(RunLog::open::<f64>(place.path()).unwrap_err().to_string().contains("expected a plain file"));
    }

    #[test]
    fn a_line_that_is_no_run_is_named_and_the_others_are_kept() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("runs.jsonl");
        let (log, _) = RunLog::open::<f64>(&path).unwrap();
        assert_eq!(log.damage(), None);
        for (index, run) in [0.1, 0.25, 1.0 / 3.0].iter().enumerate() {
            log.keep(index, run).unwrap();
        }
        drop(log);
        let damaged = fs::read_to_string(&path).unwrap().replace("0.25", "0,25");
        fs::write(&path, damaged).unwrap();
        let (log, runs) = RunLog::open::<f64>(&path).unwrap();
        assert_eq!(runs, BTreeMap::from([(0, 0.1), (2, 1.0 / 3.0)]));
        assert!(log.damage().is_some_and(|given| given.contains("runs.jsonl:2:")));
    }
}
