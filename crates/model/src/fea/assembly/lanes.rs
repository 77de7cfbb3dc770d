//! The arithmetic of columns side by side: one row of numbers at a time, in vector registers.

use std::marker::PhantomData;

use pulp::Simd;

pub(crate) trait Arithmetic: Copy {
    type Row: Copy;

    fn zero(self) -> Self::Row;
    /// sum + factor × row, fused where the machine can; results of two machines differ by that rounding alone.
    fn plus(self, sum: Self::Row, factor: f64, row: Self::Row) -> Self::Row;
    fn rows(numbers: &[f64]) -> &[Self::Row];
    fn rows_mut(numbers: &mut [f64]) -> &mut [Self::Row];
}

pub(crate) trait Kernel {
    fn run<A: Arithmetic>(self, arithmetic: A, step: usize);
}

/// Run a kernel on rows of `width` numbers: widths are 1, 2, 4, 6, 8, 12 or multiples of 8.
pub(crate) fn run(width: usize, kernel: impl Kernel) {
    granchain_signal::vectors::of_four(Dispatch { width, kernel });
}

struct Dispatch<K> {
    width: usize,
    kernel: K,
}

impl<K: Kernel> pulp::WithSimd for Dispatch<K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { width, kernel } = self;
        let block = match width {
            1 | 2 | 4 | 6 | 8 | 12 => width,
            _ if width.is_multiple_of(16) => 16,
            _ if width.is_multiple_of(8) => 8,
            _ => 1,
        };
        let step = width / block;
        // Vectors a block; a block of one, two or six numbers is left to the compiler.
        match (block, block / S::F64_LANES) {
            (1, _) => kernel.run(Numbers::<S, 1>(PhantomData), step),
            (2, _) => kernel.run(Numbers::<S, 2>(PhantomData), step),
            (6, _) => kernel.run(Numbers::<S, 6>(PhantomData), step),
            (_, 1) => kernel.run(Vectors::<S, 1>(simd), step),
            (_, 2) => kernel.run(Vectors::<S, 2>(simd), step),
            (_, 3) => kernel.run(Vectors::<S, 3>(simd), step),
            (_, 4) => kernel.run(Vectors::<S, 4>(simd), step),
            _ => kernel.run(Numbers::<S, 1>(PhantomData), width),
        }
    }
}

pub(crate) struct Numbers<S, const W: usize>(pub(crate) PhantomData<S>);

impl<S, const W: usize> Clone for Numbers<S, W> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S, const W: usize> Copy for Numbers<S, W> {}

impl<S: Simd, const W: usize> Arithmetic for Numbers<S, W> {
    type Row = [f64; W];

    #[inline(always)]
    fn zero(self) -> Self::Row {
        [0.0; W]
    }

    #[inline(always)]
    fn plus(self, sum: Self::Row, factor: f64, row: Self::Row) -> Self::Row {
        let mut out = sum;
        for (sum, value) in out.iter_mut().zip(row) {
            *sum = if S::F64_LANES > 1 { factor.mul_add(value, *sum) } else { *sum + factor * value };
        }
        out
    }

    #[inline(always)]
    fn rows(numbers: &[f64]) -> &[Self::Row] {
        numbers.as_chunks().0
    }

    #[inline(always)]
    fn rows_mut(numbers: &mut [f64]) -> &mut [Self::Row] {
        numbers.as_chunks_mut().0
    }
}

#[derive(Clone, Copy)]
pub(crate) struct Vectors<S, const R: usize>(pub(crate) S);

impl<S: Simd, const R: usize> Arithmetic for Vectors<S, R> {
    type Row = [S::f64s; R];

    #[inline(always)]
    fn zero(self) -> Self::Row {
        [self.0.splat_f64s(0.0); R]
    }

    #[inline(always)]
    fn plus(self, sum: Self::Row, factor: f64, row: Self::Row) -> Self::Row {
        let factor = self.0.splat_f64s(factor);
        let mut out = sum;
        for (sum, row) in out.iter_mut().zip(row) {
            *sum = self.0.mul_add_e_f64s(factor, row, *sum);
        }
        out
    }

    #[inline(always)]
    fn rows(numbers: &[f64]) -> &[Self::Row] {
        S::as_simd_f64s(numbers).0.as_chunks().0
    }

    #[inline(always)]
    fn rows_mut(numbers: &mut [f64]) -> &mut [Self::Row] {
        S::as_mut_simd_f64s(numbers).0.as_chunks_mut().0
    }
}
