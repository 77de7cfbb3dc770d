//! Text with unusual line ends or separators, and tables interrupted by comments.

use std::borrow::Cow;

use super::{
    DecimalSign, ReadOptions, decimal,
    dialect::{Dialect, row_delimiter},
};

/// Replaces CR line ends by LF.
pub(super) fn with_line_ends(text: Cow<'_, str>) -> Cow<'_, str> {
    if !text.contains('\n') && text.contains('\r') { Cow::Owned(text.replace('\r', "\n")) } else { text }
}

/// Blanks the line `sep=;` that Excel writes above a table; what parts the cells is known from the rows.
pub(super) fn without_excel_line(text: Cow<'_, str>) -> Cow<'_, str> {
    let line = text.lines().next().unwrap_or_default();
    if line.len() > 16 {
        return text;
    }
    let bare = line.trim().trim_matches('"').to_lowercase();
    if bare.strip_prefix("sep=").is_none_or(|sign| sign.chars().count() > 1) {
        return text;
    }
    Cow::Owned(format!("#{}", &text[line.len()..]))
}

/// Replaces the minus sign of typography before a number by a hyphen.
pub(super) fn with_hyphens(text: Cow<'_, str>) -> Cow<'_, str> {
    const MINUS: char = '\u{2212}';
    if !text.contains(MINUS) {
        return text;
    }
    let mut plain = String::with_capacity(text.len());
    let mut letters = text.chars().peekable();
    while let Some(letter) = letters.next() {
        let is_sign =
            letter == MINUS && letters.peek().is_some_and(|next| next.is_ascii_digit() || matches!(next, '.' | ','));
        plain.push(if is_sign { '-' } else { letter });
    }
    Cow::Owned(plain)
}

/// Removes the blanks between a delimiter and the quotes of the cell behind it, which would be letters of that cell.
pub(super) fn without_blanks_before_quotes(text: Cow<'_, str>) -> Cow<'_, str> {
    if !text.contains(" \"") {
        return text;
    }
    let mut plain = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let (mut quoted, mut begins) = (false, plain.len());
        for letter in line.chars() {
            let is_quote = letter == '"' && (quoted || plain[begins..].trim().is_empty());
            if is_quote && !quoted {
                plain.truncate(begins);
            }
            quoted ^= is_quote;
            plain.push(letter);
            if !quoted && matches!(letter, ',' | ';' | '\t') {
                begins = plain.len();
            }
        }
    }
    Cow::Owned(plain)
}

/// Marks lines at the top that begin with `;`, `!` or `//` as comments. A row whose first cell is empty begins with `;` too: it has as many of
/// them as the row below.
pub(super) fn with_comment_signs(text: Cow<'_, str>) -> Cow<'_, str> {
    const SIGNS: [&str; 3] = [";", "!", "//"];
    let says = |line: &&str| !line.trim().is_empty() && !line.starts_with('#');
    let begins = |line: &&str| SIGNS.iter().any(|sign| line.starts_with(sign));
    let top: Vec<&str> = text.lines().filter(says).take_while(begins).collect();
    let Some(below) = text.lines().filter(says).nth(top.len()).filter(|_| !top.is_empty()) else { return text };
    let parts = |line: &str| line.matches(';').count();
    if top.len() < 3 && top.iter().any(|line| line.starts_with(';') && parts(line) == parts(below)) {
        return text;
    }
    let mut left = top.len();
    let marked = text.split_inclusive('\n').map(|line| {
        let sign = SIGNS.iter().find(|sign| left > 0 && line.starts_with(*sign));
        left -= usize::from(sign.is_some());
        sign.map_or_else(|| line.to_owned(), |sign| "#".repeat(sign.len()) + &line[sign.len()..])
    });
    Cow::Owned(marked.collect())
}

/// CR line ends replaced by LF, of bytes.
pub(super) fn with_line_feeds(bytes: &[u8]) -> Cow<'_, [u8]> {
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return Cow::Borrowed(bytes);
    }
    Cow::Owned(bytes.iter().map(|&byte| if byte == b'\r' { b'\n' } else { byte }).collect())
}

fn is_number(word: &str) -> bool {
    decimal::number(word, DecimalSign::Point).is_some() || decimal::number(word, DecimalSign::Comma).is_some()
}

/// Replaces runs of blanks by tabs if every row of numbers has as many words as the first; the names above are split
/// likewise.
pub(super) fn by_tabs<'a>(text: &'a str, options: &ReadOptions) -> Cow<'a, str> {
    if options.delimiter.is_some() {
        return Cow::Borrowed(text);
    }
    let words = |line: &str| line.split_whitespace().count();
    let says = |line: &&str| !line.starts_with('#') && !line.trim().is_empty();
    let is_row = |line: &&str| words(line) > 1 && line.split_whitespace().all(is_number) && !line.contains([';', '\t']);
    let Some(first) = text.lines().filter(says).take(100).find(is_row) else { return Cow::Borrowed(text) };
    let width = words(first);
    let rows = text.lines().filter(says).skip_while(|line| !is_row(line));
    if row_delimiter(first, None).is_some() || !rows.clone().all(|line| words(line) == width) {
        return Cow::Borrowed(text);
    }
    let mut parted = String::with_capacity(text.len());
    for line in text.split_inclusive('\n') {
        let bare = line.trim_end_matches(['\n', '\r']);
        if says(&bare) {
            parted.push_str(&names(bare, width).unwrap_or_else(|| bare.to_owned()));
        } else {
            parted.push_str(bare);
        }
        parted.push_str(&line[bare.len()..]);
    }
    Cow::Owned(parted)
}

/// The names in a line joined by tabs, a unit in brackets kept with its name, if there are `width`: parted by two blanks or
/// more, else by any.
pub(super) fn names(line: &str, width: usize) -> Option<String> {
    let line = line.trim_start_matches('%');
    let parted: Vec<&str> = line.split("  ").map(str::trim).filter(|name| !name.is_empty()).collect();
    if parted.len() == width {
        return Some(parted.join("\t"));
    }
    let mut cells: Vec<String> = Vec::with_capacity(width);
    for word in line.split_whitespace() {
        match cells.last_mut() {
            Some(last) if word.starts_with(['(', '[']) => {
                last.push(' ');
                last.push_str(word);
            }
            _ => cells.push(word.into()),
        }
    }
    (cells.len() == width).then(|| cells.join("\t"))
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Block {
    pub from: usize,
    pub to: usize,
    /// Line of the first row.
    pub line: u64,
}

/// Blocks of rows between comment lines; the first begins with the text. One block without comments.
pub(super) fn blocks(text: &str, dialect: Dialect, first_line: u64) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    // Nearly every file has comments above its rows alone.
    let Some(last) = text.rfind("\n#") else { return found };
    let is_row = |line: &str| row_delimiter(line, Some(dialect.delimiter)).is_some();
    let (mut at, mut open) = (0, false);
    for (line, number) in text.split_inclusive('\n').zip(first_line..) {
        if line.starts_with('#') {
            open = false;
        } else if !line.trim().is_empty() {
            if !open && is_row(line) {
                let from = if found.is_empty() { 0 } else { at };
                found.push(Block { from, to: text.len(), line: number });
                open = true;
                if at > last {
                    break;
                }
            }
            if let Some(block) = found.last_mut().filter(|_| open) {
                block.to = at + line.len();
            }
        }
        at += line.len();
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blanks_part_cells_where_every_row_agrees() {
        let parted = |text| by_tabs(text, &ReadOptions::default()).into_owned();
        assert_eq!(
            parted("Time (s)  Velocity (m/s)\n 0.0  1.5\n 0.1  -2\n"),
            "Time (s)\tVelocity (m/s)\n0.0\t1.5\n0.1\t-2\n"
        );
        assert_eq!(parted("t v\r\n0,1 1\r\n"), "t\tv\r\n0,1\t1\r\n");
        for same in ["t,v\n0, 1\n", "t v\n0 1\n1 2 3\n", "t;v\n0; 1\n", "v\n1\n2\n"] {
            assert_eq!(parted(same), same);
        }
    }

    #[test]
    fn comments_between_rows_part_blocks_and_those_above_and_below_do_not() {
        let text = "#a\nt,v\n0,1\n1,2\n#b\n#c\n5,6\n7,8\n#end\n";
        let found = blocks(text, Dialect::default(), 1);
        let texts: Vec<&str> = found.iter().map(|it| &text[it.from..it.to]).collect();
        assert_eq!(texts, ["#a\nt,v\n0,1\n1,2\n", "5,6\n7,8\n"]);
        assert_eq!(found[1].line, 7);
        assert!(blocks("#a\nt,v\n0,1\n1,2\n#b\n", Dialect::default(), 1).len() == 1);
    }
}
