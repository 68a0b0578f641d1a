//! Instruction set of the kernels.

use fearless_simd::Level;

/// Instruction set of the kernels. The default is the best one available at run time. All of them
/// give the same bits.
#[derive(Clone, Copy, Debug)]
pub struct Simd(Level);

impl Default for Simd {
    fn default() -> Self {
        Self(Level::new())
    }
}

impl Simd {
    /// Available instruction sets, the most basic one first.
    #[must_use]
    pub fn available() -> Vec<(&'static str, Self)> {
        let best = Level::new();
        let mut levels = vec![("baseline", Self(Level::baseline()))];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(best.as_sse4_2().map(|t| ("sse4.2", Self(Level::Sse4_2(t)))));
            levels.extend(best.as_avx2().map(|t| ("avx2", Self(Level::Avx2(t)))));
            levels.extend(best.as_avx512().map(|t| ("avx512", Self(Level::Avx512(t)))));
        }
        #[cfg(not(target_arch = "x86_64"))]
        levels.push(("native", Self(best)));
        levels
    }

    /// Instruction set of a level.
    pub fn of(level: Level) -> Self {
        Self(level)
    }

    /// Level to dispatch on.
    pub fn level(self) -> Level {
        self.0
    }
}
