use std::{
    fmt,
    path::{Path, PathBuf},
};

/// A file, with line and column if known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    pub path: PathBuf,
    pub line: Option<u64>,
    /// Header of the column, as written.
    pub column: Option<String>,
}

/// Line, from 1, of byte `at` of `text`; 1 if unknown.
#[must_use]
pub fn line_of(text: &str, at: Option<usize>) -> usize {
    at.and_then(|at| text.get(..at)).map_or(1, |before| before.matches('\n').count() + 1)
}

impl Place {
    #[must_use]
    pub(crate) fn file(path: &Path) -> Self {
        Self { path: path.into(), line: None, column: None }
    }

    /// A line of a file.
    #[must_use]
    pub(crate) fn line(path: &Path, line: u64) -> Self {
        Self { path: path.into(), line: Some(line), column: None }
    }

    /// A column in a line of a file.
    #[must_use]
    pub(crate) fn cell(path: &Path, line: u64, column: &str) -> Self {
        Self::line(path, line).of(column)
    }

    /// A column there.
    pub(super) fn of(&self, column: &str) -> Self {
        Self { column: Some(column.into()), ..self.clone() }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.path.display())?;
        if let Some(line) = self.line {
            write!(f, ":{line}")?;
        }
        match &self.column {
            Some(column) => write!(f, ": column `{column}`"),
            None => Ok(()),
        }
    }
}

/// Lines of the samples of a file. Rows mostly follow one another, so only the start of each run is stored.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub(super) struct SampleLines {
    /// Sample number and line at the start of each run of consecutive lines.
    runs: Vec<(u32, u32)>,
    count: u32,
}

impl SampleLines {
    /// Adds the next sample's line. Lines beyond 4 294 967 295 are counted as that one.
    pub(super) fn push(&mut self, line: u64) {
        let line = u32::try_from(line).unwrap_or(u32::MAX);
        let follows =
            self.runs.last().is_some_and(|&(sample, first)| first.saturating_add(self.count - sample) == line);
        if !follows {
            self.runs.push((self.count, line));
        }
        self.count = self.count.saturating_add(1);
    }

    /// Line of a sample (from 0), if the file has lines.
    pub(super) fn get(&self, sample: usize) -> Option<u64> {
        let sample = u32::try_from(sample).ok().filter(|sample| *sample < self.count)?;
        let run = self.runs.partition_point(|&(first, _)| first <= sample).checked_sub(1)?;
        let (first, line) = self.runs[run];
        Some(u64::from(line) + u64::from(sample - first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_samples_skip_what_holds_none() {
        let lines = [3, 4, 5, 9, 10, 40, 41, 43];
        let mut kept = SampleLines::default();
        assert_eq!(kept.get(0), None);
        lines.iter().for_each(|&line| kept.push(line));
        assert_eq!(kept.runs.len(), 4);
        for (sample, line) in lines.into_iter().enumerate() {
            assert_eq!(kept.get(sample), Some(line));
        }
        assert_eq!(kept.get(lines.len()), None);
    }
}
