//! Numbers as Fortran writes them: `1.5D-07`, `-1.00000-100`, two side by side without a space.

/// The number in a field; blanks around it, a D for the exponent and a missing exponent letter are allowed.
pub(super) fn number(field: &str) -> Option<f64> {
    let mut numbers = Numbers::new(field);
    let first = numbers.next()?.ok()?;
    numbers.next().is_none().then_some(first)
}

/// The numbers of a line, one after the other; text that is none as an error.
pub(super) struct Numbers<'a> {
    rest: &'a str,
}

impl<'a> Numbers<'a> {
    pub(super) fn new(line: &'a str) -> Self {
        Self { rest: line }
    }
}

impl<'a> Iterator for Numbers<'a> {
    type Item = Result<f64, &'a str>;

    fn next(&mut self) -> Option<Self::Item> {
        // Some writers end lines with NUL.
        self.rest = self.rest.trim_start_matches(|letter: char| letter.is_whitespace() || letter == '\0');
        if self.rest.is_empty() {
            return None;
        }
        let length = length_of_number(self.rest.as_bytes());
        let token = self.rest.split(char::is_whitespace).next().unwrap_or_default();
        let Some(value) = length.and_then(|length| value(self.rest.get(..length)?)) else {
            self.rest = &self.rest[token.len()..];
            return Some(Err(token));
        };
        self.rest = &self.rest[length.unwrap_or(self.rest.len())..];
        Some(Ok(value))
    }
}

/// Bytes of the number at the beginning: [sign] digits [. digits] [E, D or a sign, then digits].
fn length_of_number(text: &[u8]) -> Option<usize> {
    let digits = |from: usize| text[from.min(text.len())..].iter().take_while(|byte| byte.is_ascii_digit()).count();
    let sign = |at: usize| usize::from(matches!(text.get(at), Some(b'+' | b'-')));
    let mut end = sign(0);
    let whole = digits(end);
    end += whole;
    let mut fraction = 0;
    if text.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    match text.get(end) {
        Some(b'E' | b'e' | b'D' | b'd') => {
            let from = end + 1 + sign(end + 1);
            let exponent = digits(from);
            (exponent > 0).then_some(from + exponent.min(3))
        }
        // Three digits of exponent leave no room for the letter; a number that follows has a point.
        Some(b'+' | b'-') if fraction > 0 && digits(end + 1) == 3 && text.get(end + 4) != Some(&b'.') => Some(end + 4),
        _ => Some(end),
    }
}

fn value(text: &str) -> Option<f64> {
    if let Ok(value) = text.parse() {
        return Some(value);
    }
    let exponent = text.get(1..)?.find(['E', 'e', 'D', 'd', '+', '-'])? + 1;
    let (mantissa, rest) = text.split_at(exponent);
    let rest = rest.trim_start_matches(['E', 'e', 'D', 'd']);
    format!("{mantissa}e{rest}").parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(line: &str) -> Vec<Result<f64, &str>> {
        Numbers::new(line).collect()
    }

    #[test]
    fn fortran_s_numbers_are_read() {
        for (text, expected) in [
            ("  1.50000E-07", 1.5e-7),
            ("1.5D-07", 1.5e-7),
            ("-0.1234d+03", -123.4),
            ("1.00000-100", 1e-100),
            ("-1.00000+100", -1e100),
            ("42", 42.0),
            (".5", 0.5),
            ("7.", 7.0),
        ] {
            assert_eq!(number(text), Some(expected), "{text}");
        }
        for text in ["", "  ", "x", "1 2", "1.5E", "-", ".", "E5", "1,5"] {
            assert_eq!(number(text), None, "{text}");
        }
    }

    #[test]
    fn numbers_side_by_side_are_parted_at_the_sign() {
        assert_eq!(all("-1.00000E-01-2.00000E-01 3.0"), [Ok(-0.1), Ok(-0.2), Ok(3.0)]);
        assert_eq!(all("1.5-2.5"), [Ok(1.5), Ok(-2.5)]);
        assert_eq!(all("1.00000-100-2.00000-100"), [Ok(1e-100), Ok(-2e-100)]);
        assert_eq!(all("1.0 NaN ********* 2.0\0\0"), [Ok(1.0), Err("NaN"), Err("*********"), Ok(2.0)]);
    }
}
