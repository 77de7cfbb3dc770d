/// Architecture and vector unit: last digits of factors and modes depend on them.
pub fn vector_unit() -> String {
    #[cfg(target_arch = "x86_64")]
    {
        let wide = std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma");
        let with = if wide { "with AVX2 and FMA" } else { "without AVX2 and FMA" };
        format!("x86_64 {with}")
    }
    #[cfg(not(target_arch = "x86_64"))]
    std::env::consts::ARCH.to_owned()
}
