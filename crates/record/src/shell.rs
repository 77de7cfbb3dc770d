use std::borrow::Cow;

/// A word quoted so that a POSIX shell, Bash or Zsh reads exactly these characters as one word. All printed commands
/// use it.
///
/// ```
/// # use granchain_record::shell_word;
/// assert_eq!(shell_word("damping.kind=linear"), "damping.kind=linear");
/// assert_eq!(shell_word("gap=0.5 nm"), "'gap=0.5 nm'");
/// ```
#[must_use]
pub fn shell_word(word: &str) -> Cow<'_, str> {
    let is_plain = |letter: char| letter.is_alphanumeric() || "-_./:+=,@%".contains(letter);
    if !word.is_empty() && !word.starts_with(['=', '%']) && word.chars().all(is_plain) {
        return word.into();
    }
    match shell_words::quote(word) {
        // Letters that are special in some shells only, such as `{` and `!`.
        Cow::Borrowed(same) if same == word => format!("'{word}'").into(),
        quoted => quoted,
    }
}

/// Words as a command line.
#[must_use]
pub fn shell_line<W: AsRef<str>>(words: impl IntoIterator<Item = W>) -> String {
    words.into_iter().map(|word| shell_word(word.as_ref()).into_owned()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use std::process::Command;

    use proptest::prelude::*;

    use super::*;

    /// Splits a line into words by real shells.
    fn read_by_shells(words: &[String]) -> Vec<Vec<String>> {
        let shells = ["sh", "bash"].into_iter();
        let read = shells.filter_map(|shell| {
            let line = format!("printf '%s\\0' {}", shell_line(words));
            let output = Command::new(shell).args(["-c", &line]).output().ok()?;
            let text = String::from_utf8(output.stdout).unwrap();
            Some(text.split_terminator('\0').map(str::to_owned).collect())
        });
        read.collect()
    }

    #[test]
    fn shells_read_the_words_that_were_meant() {
        let words = [
            "a';touch pwned;'b",
            "$(touch pwned)",
            "`touch pwned`",
            "two words",
            "",
            "~",
            "~root",
            "{a,b}",
            "!!",
            "a\nb",
            "\\",
            "\"",
            "*",
            "-rf",
            "#",
            "=ls",
            "%1",
            "a=b",
            "µm",
            "a&b|c>d<e",
            "^x^y",
            "[a-z]",
            "a\tb",
            "'",
            "''",
            "damping=0.1 N s/m:1 N s/m",
        ];
        let words = words.map(String::from);
        let read = read_by_shells(&words);
        assert!(!read.is_empty());
        for read in read {
            assert_eq!(read, words);
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn any_text_is_one_word(words in proptest::collection::vec("[^\\x00]{0,20}", 1..12)) {
            for read in read_by_shells(&words) {
                prop_assert_eq!(&read, &words);
            }
        }
    }
}
