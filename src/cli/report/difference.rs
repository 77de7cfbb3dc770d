//! Two versions of a file, number by number: what differs, and where a reader finds it.

use std::path::Path;

use serde::Serialize;

/// Most differences of one file that are told apart.
const MOST: usize = 500;

/// Longest word that is shown whole, characters.
const LONGEST: usize = 48;

/// One number, or word, that is not what it should be.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// The file and the place in it: `calibration.json:31: features.line_1.simulated`.
    pub place: String,
    /// What was derived.
    pub expected: String,
    /// What stands there.
    pub found: String,
}

/// What another processor may make of a number: how far apart both may be, relative to the larger of them, and in any unit where they are next to nothing.
pub const ROUNDING: f64 = 1e-6;
const NOTHING: f64 = 1e-15;

/// Numbers that are another processor's rounding apart.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Rounded {
    /// How many.
    pub numbers: usize,
    /// The largest distance among them, relative.
    pub largest: f64,
}

impl Rounded {
    /// Whether both words are numbers no further apart than [`ROUNDING`]; counted if they are.
    fn passes(&mut self, expected: &str, found: &str) -> bool {
        let (Some(a), Some(b)) = (number(expected), number(found)) else { return false };
        let (apart, size) = ((a - b).abs(), a.abs().max(b.abs()));
        let passes = apart <= f64::max(ROUNDING * size, NOTHING);
        if passes {
            self.numbers += 1;
            self.largest = self.largest.max(if apart > NOTHING { apart / size } else { 0.0 });
        }
        passes
    }
}

/// What differs between a file as derived and as found; empty where they are the same to the byte or, if `rounded` is given, to rounding. Of what is no
/// text, rounding cannot be told from more: nothing is said about it then.
pub fn differences(file: &str, expected: &[u8], found: &[u8], mut rounded: Option<&mut Rounded>) -> Vec<Difference> {
    if expected == found {
        return Vec::new();
    }
    let before = rounded.as_deref().map(|rounded| rounded.numbers);
    let (Ok(derived), Ok(stored)) = (std::str::from_utf8(expected), std::str::from_utf8(found)) else {
        if rounded.is_some() {
            return Vec::new();
        }
        let at = expected.iter().zip(found).position(|(a, b)| a != b).unwrap_or(expected.len().min(found.len()));
        let byte = |bytes: &[u8]| bytes.get(at).map_or_else(|| "the end".into(), |byte| format!("0x{byte:02x}"));
        return vec![Difference { place: format!("{file}: byte {at}"), expected: byte(expected), found: byte(found) }];
    };
    let (lines, others): (Vec<&str>, Vec<&str>) = (derived.lines().collect(), stored.lines().collect());
    let mut told = Vec::new();
    let mut start = 0;
    for (index, (line, other)) in lines.iter().zip(&others).enumerate() {
        for (at, expected, found) in differing_words(line, other) {
            let passes = rounded.as_mut().is_some_and(|rounded| rounded.passes(expected, found));
            if !passes && told.len() < MOST {
                let (expected, found) = shortened(expected, found);
                told.push(Difference { place: place(file, derived, index, start, at), expected, found });
            }
        }
        start += line.len() + 1;
        if !told.is_empty() && lines.len() != others.len() {
            break;
        }
    }
    if lines.len() != others.len() {
        let (expected, found) = (format!("{} lines", lines.len()), format!("{} lines", others.len()));
        told.push(Difference { place: file.into(), expected, found });
    }
    // No word differs, not even by rounding.
    if told.is_empty() && rounded.map(|rounded| rounded.numbers) == before {
        told.push(Difference {
            place: file.into(),
            expected: "LF at every end of a line".into(),
            found: "others".into(),
        });
    }
    told
}

/// How many numbers a text holds; none where it is no text.
pub fn numbers(bytes: &[u8]) -> usize {
    let text = std::str::from_utf8(bytes).unwrap_or_default();
    text.lines().flat_map(words).filter(|(_, word)| number(word).is_some()).count()
}

/// The value of a word that is a number.
fn number(word: &str) -> Option<f64> {
    word.contains(|letter: char| letter.is_ascii_digit()).then(|| word.replace('−', "-").parse().ok()).flatten()
}

fn is_part_of_word(letter: char) -> bool {
    letter.is_alphanumeric() || matches!(letter, '.' | '_' | '+' | '-' | '−')
}

/// Words with where they begin, bytes.
fn words(line: &str) -> Vec<(usize, &str)> {
    let mut words = Vec::new();
    let mut begin = None;
    for (at, letter) in line.char_indices().chain([(line.len(), ' ')]) {
        match (is_part_of_word(letter), begin) {
            (true, None) => begin = Some(at),
            (false, Some(from)) => {
                words.push((from, &line[from..at]));
                begin = None;
            }
            _ => {}
        }
    }
    words
}

/// Where two lines differ, bytes of the first, and the words there.
fn differing_words<'a>(line: &'a str, other: &'a str) -> Vec<(usize, &'a str, &'a str)> {
    if line == other {
        return Vec::new();
    }
    let (ours, theirs) = (words(line), words(other));
    if ours.len() == theirs.len() {
        let pairs = ours.iter().zip(&theirs).filter(|(a, b)| a.1 != b.1);
        let differing: Vec<_> = pairs.map(|(a, b)| (a.0, a.1, b.1)).collect();
        if !differing.is_empty() {
            return differing;
        }
    }
    // Other words, or the same with something else between: the first place alone, as far as both words there reach.
    let same: usize = line.chars().zip(other.chars()).take_while(|(a, b)| a == b).map(|(a, _)| a.len_utf8()).sum();
    let from = line[..same].rfind(|letter| !is_part_of_word(letter)).map_or(0, |at| at + 1);
    let from = (from..=same).find(|at| line.is_char_boundary(*at)).unwrap_or(same);
    let rest = |text: &'a str| {
        let end = text[same..].char_indices().skip(1).find(|(_, letter)| !is_part_of_word(*letter));
        &text[from..end.map_or(text.len(), |(at, _)| same + at)]
    };
    vec![(from, rest(line), rest(other))]
}

/// Both words around the first letter that differs.
fn shortened(expected: &str, found: &str) -> (String, String) {
    let same = expected.chars().zip(found.chars()).take_while(|(a, b)| a == b).count();
    let skip = if expected.chars().count().max(found.chars().count()) > LONGEST {
        same.saturating_sub(LONGEST / 2)
    } else {
        0
    };
    let cut = |text: &str| {
        let shown: String = text.chars().skip(skip).take(LONGEST).collect();
        let (before, after) =
            (if skip > 0 { "…" } else { "" }, if text.chars().count() > skip + LONGEST { "…" } else { "" });
        format!("{before}{shown}{after}")
    };
    (cut(expected), cut(found))
}

/// `FILE:LINE: …`, behind it what a reader of this form looks for. `start` is where the line begins, `at` the place in it, bytes.
fn place(file: &str, text: &str, index: usize, start: usize, at: usize) -> String {
    let line = text.lines().nth(index).unwrap_or_default();
    let within = match Path::new(file).extension().and_then(std::ffi::OsStr::to_str) {
        Some("json") => json_path(text, start + at),
        Some("csv") => {
            let column = cells(&line[..at]).len().saturating_sub(1);
            let header = cells(text.lines().next().unwrap_or_default());
            let name = header.get(column).map_or("?", String::as_str);
            format!("column `{name}` of `{}`", cells(line).first().map_or("", String::as_str))
        }
        _ => format!("column {}, behind “{}”", line[..at].chars().count() + 1, shown_before(&text[..start + at])),
    };
    format!("{file}:{}: {within}", index + 1)
}

/// Cells of a line of CSV.
fn cells(line: &str) -> Vec<String> {
    let mut cells = vec![String::new()];
    let mut quoted = false;
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            letter => cells.last_mut().into_iter().for_each(|cell| cell.push(letter)),
        }
    }
    cells
}

/// The last words before a place, without markup.
fn shown_before(text: &str) -> String {
    let mut shown: Vec<char> = Vec::new();
    let mut markup = !text.contains('>') || text.rfind('<') > text.rfind('>');
    let attribute = markup;
    for letter in text.chars().rev().take(4000) {
        match letter {
            '>' => markup = true,
            '<' if markup => markup = false,
            letter if !markup || attribute => shown.push(letter),
            _ => {}
        }
        if shown.len() >= LONGEST || (attribute && letter == '<') {
            break;
        }
    }
    let shown: String = shown.into_iter().rev().collect();
    shown.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Keys and indices that lead to a place of a JSON text.
fn json_path(text: &str, offset: usize) -> String {
    enum Level {
        Object(Option<String>),
        Array(usize),
    }
    let bytes = text.as_bytes();
    let mut levels: Vec<Level> = Vec::new();
    let mut at = 0;
    while at < bytes.len() && at <= offset {
        match bytes[at] {
            b'{' => levels.push(Level::Object(None)),
            b'[' => levels.push(Level::Array(0)),
            b'}' | b']' => {
                levels.pop();
            }
            b',' => match levels.last_mut() {
                Some(Level::Object(key)) => *key = None,
                Some(Level::Array(index)) => *index += 1,
                None => {}
            },
            b'"' => {
                let begin = at + 1;
                at = begin;
                while at < bytes.len() && bytes[at] != b'"' {
                    at += if bytes[at] == b'\\' { 2 } else { 1 };
                }
                if let Some(Level::Object(key @ None)) = levels.last_mut() {
                    *key = Some(text.get(begin..at).unwrap_or_default().to_owned());
                }
            }
            _ => {}
        }
        at += 1;
    }
    let mut path = String::new();
    for level in levels {
        match level {
            Level::Object(Some(key)) if path.is_empty() => path = key,
            Level::Object(Some(key)) => path = format!("{path}.{key}"),
            Level::Object(None) => {}
            Level::Array(index) => path = format!("{path}[{index}]"),
        }
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(file: &str, expected: &str, found: &str) -> Difference {
        let mut all = differences(file, expected.as_bytes(), found.as_bytes(), None);
        assert_eq!(all.len(), 1, "{all:?}");
        all.remove(0)
    }

    #[test]
    fn a_number_of_a_json_file_is_named_by_its_path() {
        let text = "{\n  \"features\": {\n    \"line_1\": {\"values\": [0.5, 1.25e-3], \"unit\": \"m/s\"}\n  }\n}\n";
        let told = only("x.json", text, &text.replace("1.25e-3", "1.26e-3"));
        assert_eq!(told.place, "x.json:3: features.line_1.values[1]");
        assert_eq!((told.expected.as_str(), told.found.as_str()), ("1.25e-3", "1.26e-3"));
        let told = only("x.json", text, &text.replace("line_1", "line_2"));
        assert_eq!(told.place, "x.json:3: features.line_1");
    }

    #[test]
    fn a_cell_is_named_by_its_column_and_a_word_of_a_page_by_what_stands_before_it() {
        let table = "name,unit,value\n\"a, b\",m,0.5\nc,m,-0.25\n";
        let told = only("x.csv", table, &table.replace("0.5", "0.6"));
        assert_eq!(told.place, "x.csv:2: column `value` of `a, b`");
        let page = "<p>α is <b>0.711</b> here</p><svg><path d=\"M1.5,2.5\"/></svg>";
        let told = only("x.html", page, &page.replace("0.711", "0.712"));
        assert!(told.place.ends_with("behind “α is”"), "{told:?}");
        let told = only("x.html", page, &page.replace("2.5", "2.6"));
        assert_eq!((told.expected.as_str(), told.found.as_str()), ("2.5", "2.6"));
        assert!(told.place.contains("path d=\"M1.5,"), "{told:?}");
    }

    #[test]
    fn whatever_differs_is_found() {
        for (expected, found) in [
            ("a 1\n", "a 1\r\n"),
            ("a 1\n", "a 1"),
            ("a,1\n", "a;1\n"),
            ("a\nb\n", "a\n"),
            ("−1", "-1"),
            ("é1", "é 1"),
            ("1", ""),
        ] {
            assert!(
                !differences("x.md", expected.as_bytes(), found.as_bytes(), None).is_empty(),
                "{expected:?} {found:?}"
            );
        }
        assert_eq!(differences("x.png", &[0xff, 1], &[0xff, 2], None)[0].place, "x.png: byte 1");
        let long = "A".repeat(300);
        let told = only("x.html", &format!("{long}5{long}"), &format!("{long}6{long}"));
        assert!(
            told.expected.contains('5') && told.found.contains('6') && told.expected.chars().count() <= LONGEST + 2
        );
    }

    #[test]
    fn every_altered_digit_is_found_and_shown() {
        let text = "{\n  \"a\": [0.123, -4.5e-6, {\"b\": \"2/3 of 17\"}],\n  \"c\": 89\n}\n";
        for (at, digit) in text.bytes().enumerate().filter(|(_, byte)| byte.is_ascii_digit()) {
            let mut altered = text.as_bytes().to_vec();
            altered[at] = if digit == b'7' { b'3' } else { b'7' };
            let told = differences("x.json", text.as_bytes(), &altered, None);
            assert_eq!(told.len(), 1, "{told:?}");
            assert_ne!(told[0].expected, told[0].found);
        }
    }

    #[test]
    fn rounding_passes_and_nothing_else_does() {
        let text = "{\"a\": 0.7006123456789, \"b\": -1.387e-17, \"c\": 600, \"d\": \"linear\"}";
        let told = |from: &str, to: &str| {
            let mut rounded = Rounded::default();
            let found = text.replace(from, to);
            (differences("x.json", text.as_bytes(), found.as_bytes(), Some(&mut rounded)).len(), rounded)
        };
        let (differing, rounded) = told("0.7006123456789", "0.7006123456123");
        assert_eq!((differing, rounded.numbers), (0, 1));
        assert!((rounded.largest / 9.5e-11 - 1.0).abs() < 0.01, "{rounded:?}");
        assert_eq!(told("-1.387e-17", "1.2e-17"), (0, Rounded { numbers: 1, largest: 0.0 }));
        assert_eq!(told("\"linear\"}", "\"linear\"}\r\n"), (1, Rounded::default()));
        for (from, to) in
            [("0.7006123", "0.7006143"), ("600", "601"), ("linear", "nonlinear"), ("0.70", "-0.70"), ("600", "NaN")]
        {
            assert_eq!(told(from, to), (1, Rounded::default()), "{from} {to}");
        }
    }

    #[test]
    fn numbers_are_counted_without_words() {
        assert_eq!(numbers("α = 0.5, −3 of 1e-3 m2, c3 and 1/3\n".as_bytes()), 5);
    }
}
