//! Numbers at places in bytes.

/// Bytes with an order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bytes<'a> {
    pub all: &'a [u8],
    pub big_endian: bool,
}

/// Type of a stored sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Sample {
    Unsigned(usize),
    Signed(usize),
    Float(usize),
}

impl Sample {
    pub(crate) fn width(self) -> usize {
        match self {
            Self::Unsigned(width) | Self::Signed(width) | Self::Float(width) => width,
        }
    }
}

impl<'a> Bytes<'a> {
    pub(crate) fn little(all: &'a [u8]) -> Self {
        Self { all, big_endian: false }
    }

    pub(crate) fn slice(&self, at: usize, length: usize) -> Option<&'a [u8]> {
        self.all.get(at..at.checked_add(length)?)
    }

    fn fixed<const N: usize>(&self, at: usize) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = self.slice(at, N)?.try_into().ok()?;
        if self.big_endian {
            bytes.reverse();
        }
        Some(bytes)
    }

    pub(crate) fn u16(&self, at: usize) -> Option<u16> {
        self.fixed(at).map(u16::from_le_bytes)
    }

    pub(crate) fn i16(&self, at: usize) -> Option<i16> {
        self.fixed(at).map(i16::from_le_bytes)
    }

    pub(crate) fn u32(&self, at: usize) -> Option<u32> {
        self.fixed(at).map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&self, at: usize) -> Option<u64> {
        self.fixed(at).map(u64::from_le_bytes)
    }

    pub(crate) fn byte(&self, at: usize) -> Option<u8> {
        self.all.get(at).copied()
    }

    pub(crate) fn i32(&self, at: usize) -> Option<f64> {
        self.u32(at).map(|value| f64::from(value.cast_signed()))
    }

    pub(crate) fn i64(&self, at: usize) -> Option<f64> {
        self.u64(at).map(|value| value.cast_signed() as f64)
    }

    pub(crate) fn f32(&self, at: usize) -> Option<f64> {
        self.fixed(at).map(f32::from_le_bytes).map(f64::from)
    }

    pub(crate) fn f64(&self, at: usize) -> Option<f64> {
        self.fixed(at).map(f64::from_le_bytes)
    }

    /// A length or a number of entries, of 32 bits.
    pub(crate) fn count(&self, at: usize) -> Option<usize> {
        self.u32(at).map(|count| count as usize)
    }

    /// Text up to its first zero byte.
    pub(crate) fn text(&self, at: usize, length: usize) -> Option<String> {
        let bytes = self.slice(at, length)?;
        let end = bytes.iter().position(|byte| *byte == 0).unwrap_or(length);
        Some(bytes[..end].iter().map(|byte| char::from(*byte)).collect::<String>().trim().to_owned())
    }

    pub(crate) fn sample(&self, at: usize, kind: Sample) -> Option<f64> {
        Some(match kind {
            Sample::Unsigned(1) => f64::from(*self.all.get(at)?),
            Sample::Signed(1) => f64::from(i8::from_le_bytes([*self.all.get(at)?])),
            Sample::Unsigned(2) => f64::from(self.u16(at)?),
            Sample::Signed(2) => f64::from(self.i16(at)?),
            Sample::Unsigned(4) => f64::from(self.u32(at)?),
            Sample::Signed(4) => f64::from(self.u32(at)?.cast_signed()),
            Sample::Unsigned(_) => self.u64(at)? as f64,
            Sample::Signed(_) => self.u64(at)?.cast_signed() as f64,
            Sample::Float(4) => self.f32(at)?,
            Sample::Float(_) => self.f64(at)?,
        })
    }

    /// `count` samples from `at` on, `stride` bytes apart; as many as there are.
    pub(crate) fn samples(&self, at: usize, stride: usize, count: usize, kind: Sample) -> Vec<f64> {
        let there = self.all.len().saturating_sub(at) / stride.max(1) + 1;
        (0..count.min(there)).map_while(|index| self.sample(at.checked_add(index * stride)?, kind)).collect()
    }
}
