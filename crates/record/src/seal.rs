//! Sealed files: a digest shows whether a file was altered since the program wrote it.

use super::sha256;

/// Format of a sealed text: this word, the SHA-256 of its body in hexadecimal, the body.
const FORM: &str = "granchain-state-1";
const DIGITS: usize = 64;

/// Why a sealed text is refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BrokenSeal {
    #[error("it does not begin with `granchain-state-1`")]
    Form,
    /// Right format, wrong digest.
    #[error("it was altered or damaged since it was written")]
    Altered,
}

/// `body` with its seal.
#[must_use]
pub fn sealed(body: &[u8]) -> Vec<u8> {
    [format!("{FORM} {} ", sha256(body)).as_bytes(), body].concat()
}

/// The body of what [`sealed`] made.
///
/// # Errors
/// [`BrokenSeal`].
pub fn unsealed(bytes: &[u8]) -> Result<&[u8], BrokenSeal> {
    let rest = bytes.strip_prefix(FORM.as_bytes()).and_then(|rest| rest.strip_prefix(b" ")).ok_or(BrokenSeal::Form)?;
    let (digest, rest) = rest.split_at_checked(DIGITS).ok_or(BrokenSeal::Form)?;
    let body = rest.strip_prefix(b" ").ok_or(BrokenSeal::Form)?;
    if digest == sha256(body).as_bytes() { Ok(body) } else { Err(BrokenSeal::Altered) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_flipped_bit_and_every_cut_is_seen() {
        let whole = sealed(b"{\"index\":3,\"run\":0.125}");
        assert_eq!(unsealed(&whole), Ok(&b"{\"index\":3,\"run\":0.125}"[..]));
        for place in 0..whole.len() {
            for bit in 0..8 {
                let mut flipped = whole.clone();
                flipped[place] ^= 1 << bit;
                assert!(unsealed(&flipped).is_err(), "{place} {bit}");
            }
            assert!(unsealed(&whole[..place]).is_err(), "{place}");
        }
    }
}
