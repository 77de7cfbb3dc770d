//! Loops compiled for the vector instructions of the machine.

#[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
use pulp::Arch;
use pulp::{NullaryFnOnce, WithSimd};

/// Runs a loop whose results do not depend on the width of the vectors, on the widest.
pub fn widest<Op: NullaryFnOnce>(op: Op) -> Op::Output {
    // pulp's own choice would compile the widest twice.
    #[cfg(target_arch = "x86_64")]
    return match (pulp::x86::V4::try_new(), pulp::x86::V3::try_new()) {
        (Some(eight), _) => eight.vectorize(op),
        (None, Some(four)) => four.vectorize(op),
        (None, None) => op.call(),
    };
    // A module is compiled for its vectors as a whole: a choice would only compile everything twice.
    #[cfg(target_arch = "wasm32")]
    return op.call();
    #[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
    Arch::new().dispatch(op)
}

/// Runs a kernel on vectors of four numbers where the machine has them: its sums depend on their number.
pub fn of_four<Op: WithSimd>(op: Op) -> Op::Output {
    #[cfg(target_arch = "x86_64")]
    return match pulp::x86::V3::try_new() {
        Some(four) => pulp::Simd::vectorize(four, op),
        None => pulp::Simd::vectorize(pulp::Scalar, op),
    };
    #[cfg(target_arch = "wasm32")]
    return pulp::Simd::vectorize(pulp::Scalar, op);
    #[cfg(not(any(target_arch = "x86_64", target_arch = "wasm32")))]
    Arch::new().dispatch(op)
}
