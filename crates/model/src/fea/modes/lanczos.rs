//! Lanczos' recurrence in the product of the mass matrix.

use nalgebra::{DMatrix, SymmetricEigen};

use crate::{
    fea::{
        assembly::Columns,
        body::Body,
        factor::{Factor, Half},
    },
    number::dot,
};

/// xᵀ M y.
pub(super) fn mass_product(body: &Body, x: &[f64], y: &[f64]) -> f64 {
    let mut out = body.columns(1);
    body.multiply_mass(&Columns::from_vector(y), &mut out);
    dot(x, out.as_slice())
}

#[derive(Debug, Clone)]
pub(super) struct Pair {
    /// θ.
    pub theta: f64,
    /// Bound of its relative error, 1.
    pub error: f64,
    weights: Vec<f64>,
}

/// A basis Q with Qᵀ M Q = 1 and Qᵀ M A⁻¹ M Q = T tridiagonal.
pub(super) struct Lanczos<'a> {
    body: &'a Body,
    factor: &'a Factor,
    /// The rigid mode, if there is one, then the basis; and M times each.
    basis: Vec<Vec<f64>>,
    weighted: Vec<Vec<f64>>,
    known: usize,
    diagonal: Vec<f64>,
    below: Vec<f64>,
    next: Vec<f64>,
    work: Half,
    /// Work space: a vector, and what a matrix makes of it.
    load: Columns,
    image: Columns,
}

impl<'a> Lanczos<'a> {
    pub(crate) fn new(body: &'a Body, factor: &'a Factor) -> Self {
        let known = usize::from(body.is_free());
        let mut out = Self {
            body,
            factor,
            basis: Vec::new(),
            weighted: Vec::new(),
            known: 0,
            diagonal: Vec::new(),
            below: Vec::new(),
            next: Vec::new(),
            work: factor.half(1),
            load: body.columns(1),
            image: body.columns(1),
        };
        if known == 1 {
            out.next = body.rigid();
            out.admit();
            out.known = known;
        }
        // Arbitrary but reproducible; the first product puts massless nodes where they belong.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let start: Vec<f64> = (0..body.dofs().len() as u32)
            .map(|dof| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                if body.dofs().is_free(dof) { (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5 } else { 0.0 }
            })
            .collect();
        out.load.as_mut_slice().copy_from_slice(&start);
        body.multiply_mass(&out.load, &mut out.image);
        out.next = out.image.as_slice().to_vec();
        out.solve_next();
        out.orthogonalise();
        out
    }

    pub(crate) fn steps(&self) -> usize {
        self.diagonal.len()
    }

    /// The next direction becomes A⁻¹ times it.
    fn solve_next(&mut self) {
        self.load.as_mut_slice().copy_from_slice(&self.next);
        self.factor.solve(&self.load, &mut self.work, &mut self.image);
        self.next.copy_from_slice(self.image.as_slice());
    }

    /// Make the next direction orthogonal to the whole basis; twice is enough.
    fn orthogonalise(&mut self) {
        for _ in 0..2 {
            for (vector, weighted) in self.basis.iter().zip(&self.weighted) {
                let part = dot(weighted, &self.next);
                self.next.iter_mut().zip(vector).for_each(|(next, value)| *next -= part * value);
            }
        }
    }

    /// Normalise the next direction and add it to the basis; its length before.
    fn admit(&mut self) -> f64 {
        self.load.as_mut_slice().copy_from_slice(&self.next);
        self.body.multiply_mass(&self.load, &mut self.image);
        let weighted = self.image.as_slice();
        let length = dot(&self.next, weighted).max(0.0).sqrt();
        let scale = if length > 0.0 { 1.0 / length } else { 0.0 };
        self.basis.push(self.next.iter().map(|value| scale * value).collect());
        self.weighted.push(weighted.iter().map(|value| scale * value).collect());
        length
    }

    /// Extend the basis to `steps` vectors; `true` when the space is spent before.
    pub(crate) fn extend(&mut self, steps: usize) -> bool {
        while self.steps() < steps {
            let length = self.admit();
            if !(length > 1e-14 * self.diagonal.first().copied().unwrap_or(0.0)) {
                self.basis.pop();
                self.weighted.pop();
                return true;
            }
            if !self.diagonal.is_empty() {
                self.below.push(length);
            }
            self.next.copy_from_slice(&self.weighted[self.weighted.len() - 1]);
            self.solve_next();
            self.diagonal.push(dot(&self.weighted[self.weighted.len() - 1], &self.next));
            self.orthogonalise();
        }
        false
    }

    /// The `count` largest pairs of T (fewer if it is smaller), largest θ first.
    pub(crate) fn pairs(&self, count: usize) -> Vec<Pair> {
        let size = self.steps();
        let scale = self.diagonal.iter().copied().fold(0.0, f64::max);
        if size == 0 || scale == 0.0 {
            return Vec::new();
        }
        let projected = DMatrix::from_fn(size, size, |row, column| match row.abs_diff(column) {
            0 => self.diagonal[row] / scale,
            1 => self.below[row.min(column)] / scale,
            _ => 0.0,
        });
        let eigen = SymmetricEigen::new(projected);
        let mut order: Vec<usize> = (0..size).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let rest = mass_product(self.body, &self.next, &self.next).max(0.0).sqrt();
        order
            .into_iter()
            .take(count)
            .map(|k| {
                let theta = scale * eigen.eigenvalues[k];
                let weights: Vec<f64> = eigen.eigenvectors.column(k).iter().copied().collect();
                let error = rest * weights.last().copied().unwrap_or(1.0).abs() / theta;
                Pair { theta, error, weights }
            })
            .collect()
    }

    pub(crate) fn vector(&self, pair: &Pair) -> Vec<f64> {
        let mut out = vec![0.0; self.body.dofs().len()];
        for (vector, weight) in self.basis[self.known..].iter().zip(&pair.weights) {
            out.iter_mut().zip(vector).for_each(|(out, value)| *out += weight * value);
        }
        out
    }
}
