//! What may happen to a file on its way.

use proptest::prelude::*;

/// What may happen to a file.
#[derive(Debug, Clone)]
pub enum Harm {
    Change(usize, u8),
    Cut(usize, usize),
    Repeat(usize, usize),
    Insert(usize, Vec<u8>),
    End(usize),
}

/// One of them; `words` are put in.
pub fn harm(words: Vec<Vec<u8>>) -> impl Strategy<Value = Harm> {
    let at = any::<prop::sample::Index>().prop_map(|at| at.index(6000));
    prop_oneof![
        4 => (at.clone(), any::<u8>()).prop_map(|(at, byte)| Harm::Change(at, byte)),
        2 => (at.clone(), 1usize..200).prop_map(|(at, length)| Harm::Cut(at, length)),
        1 => (at.clone(), 1usize..200).prop_map(|(at, length)| Harm::Repeat(at, length)),
        3 => (at.clone(), prop::sample::select(words)).prop_map(|(at, word)| Harm::Insert(at, word)),
        1 => at.prop_map(Harm::End),
    ]
}

/// The bytes after all of it.
pub fn harmed(bytes: &[u8], harms: &[Harm]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for harm in harms {
        let within = |at: usize| at % (bytes.len() + 1);
        match harm {
            Harm::Change(at, byte) => {
                let at = within(*at);
                if let Some(place) = bytes.get_mut(at) {
                    *place = *byte;
                }
            }
            Harm::Cut(at, length) => {
                let at = within(*at);
                let end = (at + length).min(bytes.len());
                bytes.drain(at..end);
            }
            Harm::Repeat(at, length) => {
                let at = within(*at);
                let part = bytes[at..(at + length).min(bytes.len())].to_vec();
                bytes.splice(at..at, part);
            }
            Harm::Insert(at, word) => {
                let at = within(*at);
                bytes.splice(at..at, word.iter().copied());
            }
            Harm::End(at) => bytes.truncate(within(*at)),
        }
    }
    bytes
}

/// As many cases, or `PROPTEST_CASES`.
pub fn cases(usual: u32) -> ProptestConfig {
    let cases = std::env::var("PROPTEST_CASES").ok().and_then(|cases| cases.parse().ok()).unwrap_or(usual);
    ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() }
}
