//! Where in a text something stands.

use std::path::Path;

use super::error::Place;

const SHOWN: usize = 80;

#[derive(Debug, Clone, Copy)]
pub(super) enum Author<'a> {
    File(&'a Path),
    BuiltIn(&'static str),
    Override(&'a str),
}

/// A text and who wrote it: makes places of offsets, each at the same cost wherever it is.
#[derive(Debug)]
pub(super) struct Source<'a> {
    text: &'a str,
    author: Author<'a>,
    lines: Vec<usize>,
    /// Letters before every [`Source::STRIDE`] bytes.
    letters: Vec<usize>,
}

impl<'a> Source<'a> {
    const STRIDE: usize = 256;

    pub(super) fn new(text: &'a str, author: Author<'a>) -> Self {
        let mut source = Self { text, author, lines: Vec::new(), letters: Vec::new() };
        // Places in an override are the override.
        if !matches!(author, Author::Override(_)) {
            source.lines.push(0);
            source.lines.extend(text.match_indices('\n').map(|(at, _)| at + 1));
            let mut before = 0;
            for part in text.as_bytes().chunks(Self::STRIDE) {
                source.letters.push(before);
                before += letters(part);
            }
        }
        source
    }

    fn letters_before(&self, offset: usize) -> usize {
        let part = (offset / Self::STRIDE).min(self.letters.len().saturating_sub(1));
        let counted = self.letters.get(part).copied().unwrap_or(0);
        counted + letters(&self.text.as_bytes()[part * Self::STRIDE..offset])
    }

    pub(super) fn place(&self, offset: usize) -> Place {
        let offset = offset.min(self.text.len());
        let line = self.lines.partition_point(|&start| start <= offset);
        let column = || 1 + self.letters_before(offset) - self.letters_before(self.lines[line - 1]);
        match self.author {
            Author::File(path) => Place::File { path: path.to_owned(), line, column: column() },
            Author::BuiltIn(name) => Place::BuiltIn { name: name.to_owned() },
            // Every item of a list has its place: each holds the beginning of the text only.
            Author::Override(text) => Place::Override { text: beginning(text) },
        }
    }
}

/// Characters of UTF-8: bytes that continue none.
fn letters(bytes: &[u8]) -> usize {
    bytes.iter().filter(|&&byte| byte & 0xc0 != 0x80).count()
}

pub(super) fn beginning(text: &str) -> String {
    match text.char_indices().nth(SHOWN) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text.to_owned(),
    }
}
