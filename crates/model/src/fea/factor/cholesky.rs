//! The numerical factorisation: faer's supernodal Cholesky, one thread.

use faer::{
    Mat, Par, Side,
    dyn_stack::{MemBuffer, MemStack, StackReq},
    linalg::cholesky::{
        ldlt::factor::{LdltError, LdltRegularization},
        llt::factor::{LltError as PivotError, LltRegularization},
    },
    sparse::{
        FaerError, SparseColMatRef,
        linalg::{
            SupernodalThreshold, SymbolicSupernodalParams,
            cholesky::{
                CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
                factorize_symbolic_cholesky,
                supernodal::{SupernodalLltRef, SupernodeRef, SymbolicSupernodalCholesky},
            },
        },
    },
};

use crate::tally;

/// Columns merged into one supernode: (columns at most, share of explicit zeros at most). Sparing: panels are fast enough narrow, and every
/// zero stored is read twice a step; faer's own choice stores 5 % more for no gain.
const MERGE: &[(usize, f64)] = &[(2, 0.3), (8, 0.1)];

#[derive(Debug, Clone, Copy)]
pub(crate) enum Failure {
    Pivot(usize),
    Size(FaerError),
}

pub(super) struct Cholesky {
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
}

type Upper<'a> = SparseColMatRef<'a, u32, f64>;

fn analyse(matrix: Upper<'_>, ordering: SymmetricOrdering<'_, u32>) -> Result<SymbolicCholesky<u32>, Failure> {
    let parameters = CholeskySymbolicParams {
        supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
        supernodal_params: SymbolicSupernodalParams { relax: Some(MERGE) },
        ..CholeskySymbolicParams::default()
    };
    factorize_symbolic_cholesky(matrix.symbolic(), Side::Upper, ordering, parameters).map_err(Failure::Size)
}

fn memory(needed: StackReq) -> Result<MemBuffer, Failure> {
    MemBuffer::try_new(needed).map_err(|_| Failure::Size(FaerError::OutOfMemory))
}

/// L D Lᵀ of a symmetric matrix by its upper triangle, without pivoting.
pub(crate) fn ldlt(
    matrix: Upper<'_>,
    ordering: SymmetricOrdering<'_, u32>,
) -> Result<(SymbolicCholesky<u32>, Vec<f64>), Failure> {
    tally::add(|made| made.factorisations += 1);
    let symbolic = analyse(matrix, ordering)?;
    let mut values = vec![0.0; symbolic.len_val()];
    let mut memory = memory(symbolic.factorize_numeric_ldlt_scratch::<f64>(Par::Seq, faer::Spec::default()))?;
    symbolic
        .factorize_numeric_ldlt(
            &mut values,
            matrix,
            Side::Upper,
            LdltRegularization::default(),
            Par::Seq,
            MemStack::new(&mut memory),
            faer::Spec::default(),
        )
        .map_err(|LdltError::ZeroPivot { index }| Failure::Pivot(index))?;
    Ok((symbolic, values))
}

/// The supernodes of a pattern; none of an empty matrix, whose factor faer keeps otherwise.
pub(crate) fn supernodal(symbolic: &SymbolicCholesky<u32>) -> Option<&SymbolicSupernodalCholesky<u32>> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(pattern) => Some(pattern),
        SymbolicCholeskyRaw::Simplicial(_) => None,
    }
}

impl Cholesky {
    pub(crate) fn new(matrix: Upper<'_>) -> Result<Self, Failure> {
        let symbolic = analyse(matrix, SymmetricOrdering::Identity)?;
        let mut values = vec![0.0; symbolic.len_val()];
        let mut memory = memory(symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, faer::Spec::default()))?;
        symbolic
            .factorize_numeric_llt(
                &mut values,
                matrix,
                Side::Upper,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut memory),
                faer::Spec::default(),
            )
            .map_err(|PivotError::NonPositivePivot { index }| Failure::Pivot(index))?;
        Ok(Self { symbolic, values })
    }

    pub(crate) fn supernodes(&self) -> impl Iterator<Item = SupernodeRef<'_, u32, f64>> {
        supernodal(&self.symbolic).into_iter().flat_map(|pattern| {
            let factor = SupernodalLltRef::new(pattern, &self.values);
            (0..pattern.n_supernodes()).map(move |index| factor.supernode(index))
        })
    }

    /// The last `size` rows and columns of L, dense, zero above the diagonal.
    pub(crate) fn trailing(&self, size: usize) -> Mat<f64> {
        let first = self.symbolic.nrows() - size;
        let mut out = Mat::zeros(size, size);
        for supernode in self.supernodes() {
            let (start, block) = (supernode.start(), supernode.val());
            let own = start..start + block.ncols();
            let rows: Vec<usize> = own.clone().chain(supernode.pattern().iter().map(|&row| row as usize)).collect();
            for (k, column) in own.enumerate().filter(|&(_, column)| column >= first) {
                for (place, &row) in rows.iter().enumerate().skip(k) {
                    out[(row - first, column - first)] = block[(place, k)];
                }
            }
        }
        out
    }
}
