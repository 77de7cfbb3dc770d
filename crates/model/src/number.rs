//! One number, or eight side by side: what a loop over runs is written in once.
//!
//! Every operation on eight is element by element and free of branches, so the compiler turns it into vector instructions, and a run's result
//! does not depend on its place or on its neighbours. No operation is fused, so it does not depend on the width of the machine's vectors
//! either. A loop written for [`Number`] gives a run the same bits alone and among eight.

#![allow(clippy::needless_range_loop, reason = "one index for several arrays is what the compiler turns into vectors")]

use std::{
    fmt::Debug,
    ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub},
};

pub(crate) const WIDTH: usize = 8;

/// aᵀ b, in the order of the numbers.
#[inline(always)]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) trait Number:
    Copy
    + Debug
    + PartialEq
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    const WIDTH: usize;
    const ZERO: Self;
    type Mask: Mask;

    fn of(each: impl FnMut(usize) -> f64) -> Self;
    fn get(self, place: usize) -> f64;
    fn put(&mut self, place: usize, value: f64);
    fn root(self) -> Self;
    fn magnitude(self) -> Self;
    /// The larger of two; a NaN loses.
    fn larger(self, other: Self) -> Self;
    /// The smaller of two; a NaN loses.
    fn smaller(self, other: Self) -> Self;
    fn above(self, other: Self) -> Self::Mask;
    fn within(self, other: Self) -> Self::Mask;
    fn equals(self, other: Self) -> Self::Mask;
    /// This where the mask holds, the other elsewhere.
    fn or_where_not(self, mask: Self::Mask, other: Self) -> Self;

    /// Take every amount times its factors from the values, one amount after another; at least as many factors of each as there are values. Values
    /// are read and written once for all of them, which is what takes the time.
    fn subtract<const TERMS: usize>(values: &mut [Self], amounts: [Self; TERMS], factors: [&[f64]; TERMS]);

    #[inline(always)]
    fn subtract_all<'a>(values: &mut [Self], terms: impl Iterator<Item = (Self, &'a [f64])>) {
        let mut terms = terms.fuse();
        loop {
            match [terms.next(), terms.next(), terms.next(), terms.next()] {
                [None, ..] => return,
                [Some((a, u)), None, ..] => Self::subtract(values, [a], [u]),
                [Some((a, u)), Some((b, v)), None, _] => Self::subtract(values, [a, b], [u, v]),
                [Some((a, u)), Some((b, v)), Some((c, w)), None] => Self::subtract(values, [a, b, c], [u, v, w]),
                [Some((a, u)), Some((b, v)), Some((c, w)), Some((d, x))] => {
                    Self::subtract(values, [a, b, c, d], [u, v, w, x]);
                }
            }
        }
    }

    /// The end of a pass through a loop. Of runs side by side a number is a vector already: the compiler is kept from making any across the passes,
    /// which would take shuffles.
    #[inline(always)]
    fn pass() {
        if Self::WIDTH > 1 {
            std::hint::black_box(());
        }
    }

    #[inline(always)]
    fn finite(self) -> Self::Mask {
        self.magnitude().within(Self::all(f64::MAX))
    }

    #[inline(always)]
    fn all(value: f64) -> Self {
        Self::of(|_| value)
    }
}

pub(crate) trait Mask: Copy + Debug + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    const WIDTH: usize;

    fn all(holds: bool) -> Self;
    fn but(place: usize) -> Self;
    fn any(self) -> bool;
    fn get(self, place: usize) -> bool;

    #[inline(always)]
    fn places(self) -> impl Iterator<Item = usize> {
        (0..Self::WIDTH).filter(move |place| self.get(*place))
    }

    #[inline(always)]
    fn every(self) -> bool {
        !(!self).any()
    }
}

impl Number for f64 {
    const WIDTH: usize = 1;
    const ZERO: Self = 0.0;
    type Mask = bool;

    #[inline(always)]
    fn of(mut each: impl FnMut(usize) -> f64) -> Self {
        each(0)
    }
    #[inline(always)]
    fn get(self, _: usize) -> f64 {
        self
    }
    #[inline(always)]
    fn put(&mut self, _: usize, value: f64) {
        *self = value;
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.sqrt()
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.abs()
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.max(other)
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.min(other)
    }
    #[inline(always)]
    fn above(self, other: Self) -> bool {
        self > other
    }
    #[inline(always)]
    fn within(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn equals(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn or_where_not(self, mask: bool, other: Self) -> Self {
        if mask { self } else { other }
    }
    /// Four at a time: the lists are short, and what the compiler makes of a plain loop is for long ones.
    #[inline(always)]
    fn subtract<const TERMS: usize>(values: &mut [Self], amounts: [Self; TERMS], factors: [&[f64]; TERMS]) {
        let factors = factors.map(|factors| &factors[..values.len()]);
        let (fours, rest) = values.as_chunks_mut::<4>();
        let many = factors.map(|factors| &factors.as_chunks::<4>().0[..fours.len()]);
        for (i, values) in fours.iter_mut().enumerate() {
            for (amount, factors) in amounts.iter().zip(&many) {
                for k in 0..4 {
                    values[k] -= amount * factors[i][k];
                }
            }
        }
        let last = factors.map(|factors| factors.as_chunks::<4>().1);
        for (i, value) in rest.iter_mut().enumerate() {
            for (amount, factors) in amounts.iter().zip(&last) {
                *value -= amount * factors[i];
            }
        }
    }
}

impl Mask for bool {
    const WIDTH: usize = 1;

    #[inline(always)]
    fn all(holds: bool) -> Self {
        holds
    }
    #[inline(always)]
    fn but(_: usize) -> Self {
        false
    }
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn get(self, _: usize) -> bool {
        self
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(align(64))]
pub(crate) struct Lane(pub(crate) [f64; WIDTH]);

/// One answer of each run: all bits set, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(align(64))]
pub(crate) struct Lanes([u64; WIDTH]);

macro_rules! element_wise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lane {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.with(other, |a, b| a $operator b)
            }
        }
        impl $trait<f64> for Lane {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: f64) -> Self {
                self.map(|a| a $operator other)
            }
        }
    };
}
element_wise!(Add, add, +);
element_wise!(Sub, sub, -);
element_wise!(Mul, mul, *);
element_wise!(Div, div, /);

impl Lane {
    #[inline(always)]
    pub(crate) fn map(self, f: impl Fn(f64) -> f64) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = f(self.0[k]);
        }
        Self(out)
    }

    #[inline(always)]
    fn with(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = f(self.0[k], other.0[k]);
        }
        Self(out)
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f64, f64) -> bool) -> Lanes {
        let mut out = [0; WIDTH];
        for k in 0..WIDTH {
            out[k] = u64::from(f(self.0[k], other.0[k])).wrapping_neg();
        }
        Lanes(out)
    }

    /// The larger of each number and `least`; `least` for NaN.
    #[inline(always)]
    pub(crate) fn at_least(self, least: f64) -> Self {
        self.map(|x| if x > least { x } else { least })
    }

    /// The smaller of each number and `most`; `most` for NaN.
    #[inline(always)]
    pub(crate) fn at_most(self, most: f64) -> Self {
        self.map(|x| if x < most { x } else { most })
    }
}

impl Number for Lane {
    const WIDTH: usize = WIDTH;
    const ZERO: Self = Self([0.0; WIDTH]);
    type Mask = Lanes;

    #[inline(always)]
    fn of(mut each: impl FnMut(usize) -> f64) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = each(k);
        }
        Self(out)
    }
    #[inline(always)]
    fn get(self, place: usize) -> f64 {
        self.0[place]
    }
    #[inline(always)]
    fn put(&mut self, place: usize, value: f64) {
        self.0[place] = value;
    }
    #[inline(always)]
    fn root(self) -> Self {
        self.map(f64::sqrt)
    }
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.map(f64::abs)
    }
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        self.with(other, f64::max)
    }
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        self.with(other, f64::min)
    }
    #[inline(always)]
    fn above(self, other: Self) -> Lanes {
        self.compare(other, |a, b| a > b)
    }
    #[inline(always)]
    fn within(self, other: Self) -> Lanes {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn equals(self, other: Self) -> Lanes {
        self.compare(other, |a, b| a == b)
    }
    /// By bits, which stays a vector operation where a choice would not.
    #[inline(always)]
    fn or_where_not(self, mask: Lanes, other: Self) -> Self {
        let mut out = [0.0; WIDTH];
        for k in 0..WIDTH {
            out[k] = f64::from_bits(self.0[k].to_bits() & mask.0[k] | other.0[k].to_bits() & !mask.0[k]);
        }
        Self(out)
    }
    #[inline(always)]
    fn subtract<const TERMS: usize>(values: &mut [Self], amounts: [Self; TERMS], factors: [&[f64]; TERMS]) {
        let factors = factors.map(|factors| &factors[..values.len()]);
        for (i, value) in values.iter_mut().enumerate() {
            let terms = amounts.iter().zip(factors);
            *value = terms.fold(*value, |value, (amount, factors)| value - *amount * factors[i]);
            Self::pass();
        }
    }
}

macro_rules! bit_wise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut out = [0; WIDTH];
                for k in 0..WIDTH {
                    out[k] = self.0[k] $operator other.0[k];
                }
                Self(out)
            }
        }
    };
}
bit_wise!(BitAnd, bitand, &);
bit_wise!(BitOr, bitor, |);

impl Not for Lanes {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        let mut out = self.0;
        for k in 0..WIDTH {
            out[k] = !out[k];
        }
        Self(out)
    }
}

impl Mask for Lanes {
    const WIDTH: usize = WIDTH;

    #[inline(always)]
    fn all(holds: bool) -> Self {
        Self([u64::from(holds).wrapping_neg(); WIDTH])
    }
    #[inline(always)]
    fn but(place: usize) -> Self {
        let mut all = [u64::MAX; WIDTH];
        all[place] = 0;
        Self(all)
    }
    #[inline(always)]
    fn any(self) -> bool {
        let mut any = 0;
        for k in 0..WIDTH {
            any |= self.0[k];
        }
        any != 0
    }
    #[inline(always)]
    fn get(self, place: usize) -> bool {
        self.0[place] != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_for_one_number_holds_for_each_of_eight() {
        let values = [1.0, -1.0, 0.0, 2.0, f64::NAN, -0.0, 1e-300, f64::NEG_INFINITY];
        let lane = Lane(values);
        for (place, value) in values.into_iter().enumerate() {
            for other in [0.0, 1.0, f64::NAN, f64::INFINITY] {
                let all = Lane::all(other);
                assert_eq!(lane.above(all).get(place), value.above(other));
                assert_eq!(lane.within(all).get(place), value.within(other));
                assert_eq!(lane.equals(all).get(place), value.equals(other));
                assert_eq!(lane.finite().get(place), value.is_finite());
                assert_eq!(lane.larger(all).get(place).to_bits(), value.max(other).to_bits(), "{value} {other}");
                assert_eq!(lane.smaller(all).get(place).to_bits(), value.min(other).to_bits(), "{value} {other}");
                let kept = lane.or_where_not(lane.above(all), Lane::all(3.0)).get(place);
                assert_eq!(kept.to_bits(), value.or_where_not(value > other, 3.0).to_bits());
            }
        }
        assert!(lane.above(Lane::ZERO).any() && !lane.above(Lane::ZERO).every());
        assert!(!lane.above(Lane::all(5.0)).any() && (!lane.above(Lane::all(5.0))).every());
    }
}
