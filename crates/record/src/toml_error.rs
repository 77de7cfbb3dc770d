//! What a reader of TOML says, in the words of its user.

use std::ops::Range;

use granchain_signal::closest;

/// The key of the line in which a fault lies, if that line has one.
#[must_use]
pub fn key_at(text: &str, span: Option<Range<usize>>) -> Option<&str> {
    let at = span?.start;
    let begins = text.get(..at)?.rfind('\n').map_or(0, |end| end + 1);
    text[begins..].lines().next()?.split_once('=').map(|(key, _)| key.trim())
}

/// A message of the reader of TOML in plain words, with what was probably meant; `key` is that of the value at fault.
#[must_use]
pub fn plain_message(message: &str, key: Option<&str>) -> String {
    let words: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let listed = |words: &[&str]| words.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ");
    let key = key.map(|key| format!("`{key}`: ")).unwrap_or_default();
    match &words[..] {
        [unknown, known @ ..] if message.starts_with("unknown field") => {
            match closest(unknown, known.iter().copied()) {
                Some(near) => format!("unknown key `{unknown}`; did you mean `{near}`?"),
                None => format!("unknown key `{unknown}`; expected one of {}", listed(known)),
            }
        }
        [found, known @ ..] if message.starts_with("unknown variant") => {
            format!("{key}expected one of {}, found `{found}`", listed(known))
        }
        _ => match message.strip_prefix("invalid type: ").and_then(|rest| rest.rsplit_once(", expected ")) {
            Some((found, expected)) => format!("{key}expected {expected}, found {found}"),
            None => message.replace("missing field", "missing key"),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_name_key_and_likely_word() {
        for (original, plain) in [
            (
                "unknown field `evaluation`, expected one of `fit`, `evaluations`",
                "unknown key `evaluation`; did you mean `evaluations`?",
            ),
            ("unknown field `x`, expected `low` or `high`", "unknown key `x`; expected one of `low`, `high`"),
            (
                "unknown variant `both`, expected `amplitudes` or `waveform`",
                "`k`: expected one of `amplitudes`, `waveform`, found `both`",
            ),
            ("invalid type: string \"yes\", expected a boolean", "`k`: expected a boolean, found string \"yes\""),
            ("missing field `low`", "missing key `low`"),
        ] {
            assert_eq!(plain_message(original, Some("k")), plain);
        }
        assert_eq!(key_at("a = 1\nb = [\n", Some(8..9)), Some("b"));
    }
}
