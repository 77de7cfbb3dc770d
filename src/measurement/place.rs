//! Where in a file something is.

use std::{
    fmt,
    path::{Path, PathBuf},
};

/// A file, and the line and column in it where they are known.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    /// The file.
    pub path: PathBuf,
    /// Line, from 1.
    pub line: Option<u64>,
    /// Header of the column, as written.
    pub column: Option<String>,
}

impl Place {
    /// Somewhere in a file.
    #[must_use]
    pub fn file(path: &Path) -> Self {
        Self { path: path.into(), line: None, column: None }
    }

    /// A line of a file.
    #[must_use]
    pub fn line(path: &Path, line: u64) -> Self {
        Self { path: path.into(), line: Some(line), column: None }
    }

    /// A column in a line of a file.
    #[must_use]
    pub fn cell(path: &Path, line: u64, column: &str) -> Self {
        Self { path: path.into(), line: Some(line), column: Some(column.into()) }
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
