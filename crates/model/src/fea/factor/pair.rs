//! Arithmetic on the two unknowns of a node in several columns: (r₀, z₀, r₁, z₁, …).
//!
//! A pair of entries of L, one of either unknown, is then spread over a vector by one load and multiplies all columns; six columns fill three
//! vectors of four numbers, none of them idle.

use std::marker::PhantomData;

use pulp::{Simd, bytemuck::cast, num_complex::Complex};

use crate::fea::assembly::{Arithmetic, Numbers, Vectors};

pub(super) trait Pairs: Arithmetic {
    /// (e₀ r, e₁ z).
    fn times(self, entries: [f64; 2], row: Self::Row) -> Self::Row;
    /// sum + (e₀ r, e₁ z), fused as [`Arithmetic::plus`].
    fn with(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row;
    /// sum − (e₀ r, e₁ z).
    fn without(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row;
    fn sum(self, one: Self::Row, other: Self::Row) -> Self::Row;
    fn turned(self, row: Self::Row) -> Self::Row;
    fn merged(self, one: Self::Row, other: Self::Row) -> Self::Row;

    #[inline(always)]
    fn spread(self, row: Self::Row) -> [Self::Row; 2] {
        let turned = self.turned(row);
        [self.merged(row, turned), self.merged(turned, row)]
    }

    /// (r + z of one, r + z of the other).
    #[inline(always)]
    fn gathered(self, [one, other]: [Self::Row; 2]) -> Self::Row {
        self.sum(self.merged(one, self.turned(other)), self.merged(self.turned(one), other))
    }
}

pub(super) trait Kernel {
    fn run<A: Pairs>(self, arithmetic: A);
}

/// Blocks that a kernel runs on, columns.
pub(super) const BLOCKS: [usize; 4] = [6, 4, 2, 1];

/// Run a kernel on a block of 1, 2, 4 or 6 columns.
pub(super) fn run(columns: usize, kernel: impl Kernel) {
    granchain_signal::vectors::of_four(Dispatch { columns, kernel });
}

struct Dispatch<K> {
    columns: usize,
    kernel: K,
}

impl<K: Kernel> pulp::WithSimd for Dispatch<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { columns, kernel } = self;
        // One branch by the constant alone: the others are then not compiled.
        if S::F64_LANES == 4 {
            match columns {
                6 => kernel.run(Vectors::<S, 3>(simd)),
                4 => kernel.run(Vectors::<S, 2>(simd)),
                2 => kernel.run(Vectors::<S, 1>(simd)),
                _ => kernel.run(Numbers::<S, 2>(PhantomData)),
            }
        } else if S::F64_LANES == 2 {
            match columns {
                6 => kernel.run(Vectors::<S, 6>(simd)),
                4 => kernel.run(Vectors::<S, 4>(simd)),
                2 => kernel.run(Vectors::<S, 2>(simd)),
                _ => kernel.run(Numbers::<S, 2>(PhantomData)),
            }
        } else {
            match columns {
                6 => kernel.run(Numbers::<S, 12>(PhantomData)),
                4 => kernel.run(Numbers::<S, 8>(PhantomData)),
                2 => kernel.run(Numbers::<S, 4>(PhantomData)),
                _ => kernel.run(Numbers::<S, 2>(PhantomData)),
            }
        }
    }
}

impl<S: Simd, const W: usize> Pairs for Numbers<S, W> {
    #[inline(always)]
    fn times(self, entries: [f64; 2], row: Self::Row) -> Self::Row {
        std::array::from_fn(|place| entries[place % 2] * row[place])
    }

    #[inline(always)]
    fn with(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row {
        std::array::from_fn(|place| {
            let (entry, value) = (entries[place % 2], row[place]);
            if S::F64_LANES > 1 { entry.mul_add(value, sum[place]) } else { sum[place] + entry * value }
        })
    }

    #[inline(always)]
    fn without(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row {
        self.with(sum, entries.map(|entry| -entry), row)
    }

    #[inline(always)]
    fn sum(self, one: Self::Row, other: Self::Row) -> Self::Row {
        std::array::from_fn(|place| one[place] + other[place])
    }

    #[inline(always)]
    fn turned(self, row: Self::Row) -> Self::Row {
        std::array::from_fn(|place| row[place ^ 1])
    }

    #[inline(always)]
    fn merged(self, one: Self::Row, other: Self::Row) -> Self::Row {
        std::array::from_fn(|place| [one, other][place % 2][place])
    }
}

impl<S: Simd, const R: usize> Vectors<S, R> {
    #[inline(always)]
    fn pairs(self, [re, im]: [f64; 2]) -> S::f64s {
        cast(self.0.splat_c64s(Complex { re, im }))
    }
}

impl<S: Simd, const R: usize> Pairs for Vectors<S, R> {
    #[inline(always)]
    fn times(self, entries: [f64; 2], row: Self::Row) -> Self::Row {
        let entries = self.pairs(entries);
        row.map(|row| self.0.mul_f64s(entries, row))
    }

    #[inline(always)]
    fn with(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row {
        let entries = self.pairs(entries);
        std::array::from_fn(|place| self.0.mul_add_e_f64s(entries, row[place], sum[place]))
    }

    #[inline(always)]
    fn without(self, sum: Self::Row, entries: [f64; 2], row: Self::Row) -> Self::Row {
        let entries = self.pairs(entries);
        std::array::from_fn(|place| self.0.negate_mul_add_e_f64s(entries, row[place], sum[place]))
    }

    #[inline(always)]
    fn sum(self, one: Self::Row, other: Self::Row) -> Self::Row {
        std::array::from_fn(|place| self.0.add_f64s(one[place], other[place]))
    }

    #[inline(always)]
    fn turned(self, row: Self::Row) -> Self::Row {
        row.map(|row| cast(self.0.swap_re_im_c64s(cast(row))))
    }

    #[inline(always)]
    fn merged(self, one: Self::Row, other: Self::Row) -> Self::Row {
        let first = self.0.equal_f64s(self.pairs([1.0, 0.0]), self.0.splat_f64s(1.0));
        std::array::from_fn(|place| self.0.select_f64s(first, one[place], other[place]))
    }
}
