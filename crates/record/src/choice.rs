//! Options that are written as keywords.

/// An option that a flag or a file sets by a keyword.
pub trait Choice: Copy + Default + Send + Sync + 'static {
    /// Keyword, value and meaning of every choice.
    const WORDS: &'static [(&'static str, Self, &'static str)];

    #[must_use]
    fn of_word(word: &str) -> Option<Self> {
        Self::WORDS.iter().find(|(own, ..)| *own == word).map(|(_, choice, _)| *choice)
    }
}

/// An enumeration with the keyword of each variant after `=`; the doc comment of a variant is its meaning in the help.
macro_rules! choice {
    (
        $(#[$about:meta])*
        pub enum $name:ident {
            $(#[doc = $meaning:literal] $(#[$more:meta])* $variant:ident = $word:literal,)+
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
        #[serde(rename_all = "kebab-case")]
        pub enum $name {
            $(#[doc = $meaning] $(#[$more])* $variant,)+
        }

        impl $crate::Choice for $name {
            const WORDS: &'static [(&'static str, Self, &'static str)] = &[$(($word, Self::$variant, $meaning)),+];
        }
    };
}

pub(super) use choice;

#[cfg(test)]
mod tests {
    use super::super::{Baseline, Choice, DecimalSign, Delimiter, Missing};

    /// The word of a flag is that of a file.
    fn agree<C: Choice + serde::Serialize + PartialEq + std::fmt::Debug>() {
        for (word, choice, meaning) in C::WORDS {
            assert_eq!(serde_json::to_value(choice).unwrap(), *word);
            assert_eq!(C::of_word(word), Some(*choice));
            assert!(!meaning.trim().is_empty());
        }
        assert_eq!(C::of_word("other"), None);
    }

    #[test]
    fn words_are_those_that_are_written() {
        agree::<Baseline>();
        agree::<Missing>();
        agree::<Delimiter>();
        agree::<DecimalSign>();
    }
}
