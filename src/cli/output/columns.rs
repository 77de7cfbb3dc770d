//! Text no wider than the terminal it is read on.
//!
//! On a terminal, or where `COLUMNS` is exported, a line too long goes on below itself, indented as its text is. A file or a pipe gets lines whole:
//! `grep` finds what belongs together.

use std::fmt::Write;

use console::Term;
use textwrap::{Options, WordSeparator, WordSplitter, WrapAlgorithm, core::display_width, wrap};

use crate::report::page::Table;

/// The widest line on a terminal, columns; help keeps to it too.
pub const WIDEST: usize = 80;

/// A narrower terminal breaks lines as it likes, columns.
const NARROWEST: usize = 40;

/// Text begun farther right than this is continued farther left, columns.
const FARTHEST_INDENT: usize = 42;

/// Columns of a terminal; `None` for other streams.
pub fn columns_of(stream: &Term) -> Option<usize> {
    let exported = std::env::var("COLUMNS").ok().and_then(|columns| columns.parse().ok());
    let wide = exported.or_else(|| stream.size_checked().map(|(_, columns)| usize::from(columns)));
    wide.map(|columns: usize| columns.clamp(NARROWEST, WIDEST))
}

/// `text` with its lines broken at blanks, none of them wider than `columns` but those with a word that fits nowhere and those to be typed (a
/// command of this program).
pub fn broken(text: &str, columns: usize, program: &str) -> String {
    let mut shown = String::with_capacity(text.len() + text.len() / 40);
    for line in text.split_inclusive('\n') {
        let (line, end) = line.strip_suffix('\n').map_or((line, ""), |line| (line, "\n"));
        let text = line.trim_start();
        let to_type = text.starts_with("then type ")
            || [program, "granchain"].iter().any(|name| text.starts_with(&format!("{name} ")));
        let indent = indent_of(line);
        // A digest or a path that fits nowhere is no better on a line of its own.
        let unbreakable = || line.split_whitespace().skip(1).any(|word| display_width(word) > columns - indent);
        if to_type || display_width(line) <= columns || unbreakable() {
            shown.push_str(line);
        } else {
            let indent = " ".repeat(indent);
            let options = Options::new(columns)
                .subsequent_indent(&indent)
                .break_words(false)
                .word_separator(WordSeparator::AsciiSpace)
                .word_splitter(WordSplitter::NoHyphenation)
                .wrap_algorithm(WrapAlgorithm::FirstFit);
            shown.push_str(&wrap(line, options).join("\n"));
        }
        shown.push_str(end);
    }
    shown
}

/// Where the text of a line goes on: below the text behind its label, else a little right of its beginning.
fn indent_of(line: &str) -> usize {
    let text = line.trim_start();
    let before = line.len() - text.len();
    let behind_label = text.find("  ").map(|gap| {
        let rest = text[gap..].trim_start();
        before + display_width(&text[..text.len() - rest.len()])
    });
    match behind_label {
        Some(indent) if indent <= FARTHEST_INDENT => indent,
        _ if before == 0 && !text.split(' ').next().is_some_and(|word| word.ends_with(':')) => 0,
        _ => before + 2,
    }
}

/// A table for the terminal: caption, where it has one, head and rows, columns two blanks apart.
pub fn aligned(table: &Table) -> String {
    let head: Vec<String> = table.columns.iter().map(|column| column.head()).collect();
    let lines: Vec<&Vec<String>> = std::iter::once(&head).chain(&table.rows).collect();
    let width = |index: usize| {
        lines.iter().filter_map(|line| line.get(index)).map(|cell| cell.chars().count()).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let mut text = if table.caption.is_empty() { String::new() } else { format!("{}.\n", table.caption) };
    for line in lines {
        let cells = line.iter().zip(&widths).zip(&table.columns).map(|((cell, width), column)| {
            if column.numeric { format!("{cell:>width$}") } else { format!("{cell:<width$}") }
        });
        let _ = writeln!(text, "{}", cells.collect::<Vec<_>>().join("  ").trim_end());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_goes_on_below_its_own_text() {
        let row =
            "  peaks      +310/−224 mm/s at the pole of the last bead, below 1.50 MHz; paper: measured +289/−247\n";
        let shown = "  peaks      +310/−224 mm/s at the pole\n             of the last bead, below\n             1.50 MHz; paper: measured\n             +289/−247\n";
        assert_eq!(broken(row, 40, "granchain"), shown);
        let note = "assumed: scene `annulus`; name another with --scene";
        assert_eq!(broken(note, 40, "granchain"), "assumed: scene `annulus`; name another\n  with --scene");
        let sentence = "The model does not explain the data: of records that the model makes";
        assert_eq!(broken(sentence, 40, "x"), "The model does not explain the data: of\nrecords that the model makes");
    }

    #[test]
    fn what_is_typed_or_fits_stays_whole() {
        let command = "  granchain calibrate --plan plan.toml --dry-run --out look   # records";
        assert_eq!(broken(command, 40, "granchain"), command);
        let table = "a   b\n\n  1   2\n";
        assert_eq!(broken(table, 40, "granchain"), table);
        let digest = format!("  sha-256    {}", "x".repeat(50));
        assert_eq!(broken(&digest, 40, "granchain"), digest);
    }
}
