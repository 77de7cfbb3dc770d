//! The arithmetic of columns side by side.

/// Whether the machine multiplies and adds in one instruction; results differ from a machine without it by rounding alone.
pub(in crate::model::fea) fn fused() -> bool {
    cfg!(target_arch = "aarch64") || !matches!(pulp::Arch::new(), pulp::Arch::Scalar)
}

/// sum + factor × row, number by number.
#[inline(always)]
pub(in crate::model::fea) fn multiply_add<const W: usize, const FUSED: bool>(
    sum: &mut [f64; W],
    factor: f64,
    row: &[f64; W],
) {
    for (sum, value) in sum.iter_mut().zip(row) {
        *sum = if FUSED { factor.mul_add(*value, *sum) } else { *sum + factor * *value };
    }
}
