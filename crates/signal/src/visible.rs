//! Text for a terminal or a page. Names in files, cells, paths and saved states may hold anything; what would steer the reader's screen instead of being
//! shown is written as its code point.

use std::{borrow::Cow, fmt::Write};

/// Text for people: control characters but the end of a line and the tab, marks that turn the direction of writing, and ends of lines that are none to a
/// program, as `\u{1b}`.
pub fn visible(text: &str) -> Cow<'_, str> {
    escaped(text, |shown, letter| write!(shown, "{}", letter.escape_unicode()))
}

/// The same of JSON text, whose strings hold no such control characters below U+0020 any more, in the notation of JSON: `\u009b`.
pub fn visible_json(json: &str) -> Cow<'_, str> {
    escaped(json, |shown, letter| write!(shown, "\\u{:04x}", u32::from(letter)))
}

fn escaped(text: &str, escape: impl Fn(&mut String, char) -> std::fmt::Result) -> Cow<'_, str> {
    if !text.contains(steers) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for letter in text.chars() {
        if steers(letter) {
            // Writing to a String cannot fail.
            let _ = escape(&mut shown, letter);
        } else {
            shown.push(letter);
        }
    }
    Cow::Owned(shown)
}

fn steers(letter: char) -> bool {
    let turns = matches!(letter, '\u{200e}' | '\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    turns || letter.is_control() && !matches!(letter, '\n' | '\t')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_steers_a_terminal() {
        let cases = [
            ("a\tb\n", "a\tb\n"),
            ("\u{1b}[31mred\u{7}", "\\u{1b}[31mred\\u{7}"),
            ("over\rwritten\u{8}", "over\\u{d}written\\u{8}"),
            ("\u{9b}2J\u{7f}", "\\u{9b}2J\\u{7f}"),
            ("a\u{202e}b\u{2028}", "a\\u{202e}b\\u{2028}"),
            ("µm, 2 Δ", "µm, 2 Δ"),
        ];
        for (text, shown) in cases {
            assert_eq!(visible(text), shown);
        }
        let name = "\u{1b}\u{9b}\u{7f}\u{202e}µ";
        let json = visible_json(&serde_json::to_string(name).unwrap()).into_owned();
        assert_eq!(json, "\"\\u001b\\u009b\\u007f\\u202eµ\"");
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), name);
    }
}
