//! Which instruction set the kernels use on this machine.
//!
//! The only module of the crate that may hold `unsafe`: calling a function compiled for an
//! instruction set is sound only where that set was found, and a [`Tier`] is the proof of it.

/// An instruction set that this processor was found to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tier(pub(crate) Level);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Level {
    Portable,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Tier {
    /// What every processor of the target has. On x86-64 this has no fused multiply-add in
    /// hardware: right to the bit, but some hundred times slower.
    #[must_use]
    pub fn portable() -> Self {
        Self(Level::Portable)
    }

    /// Every tier of this processor, slowest first.
    #[must_use]
    pub fn available() -> Vec<Self> {
        let mut tiers = vec![Self::portable()];
        #[cfg(target_arch = "x86_64")]
        {
            let avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
            if avx2 {
                tiers.push(Self(Level::Avx2));
            }
            if avx2 && is_x86_feature_detected!("avx512f") {
                tiers.push(Self(Level::Avx512));
            }
        }
        tiers
    }

    /// The fastest tier of this processor.
    #[must_use]
    pub fn detect() -> Self {
        Self::available().pop().unwrap_or(Self::portable())
    }

    /// Name for reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self.0 {
            Level::Portable => "portable",
            #[cfg(target_arch = "x86_64")]
            Level::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            Level::Avx512 => "avx512",
        }
    }
}

/// Defines a public kernel that takes a [`Tier`] first and runs one of three instances of an
/// `#[inline(always)]` body: for every processor, for AVX2 with FMA, for AVX-512.
macro_rules! per_tier {
    (
        $(#[$meta:meta])*
        fn $name:ident($($argument:ident: $kind:ty),* $(,)?)
            => $portable:expr, $avx2:expr, $avx512:expr
    ) => {
        $(#[$meta])*
        #[allow(unsafe_code, clippy::too_many_arguments)]
        pub fn $name(tier: $crate::kernel::Tier, $($argument: $kind),*) {
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma")]
            #[allow(clippy::too_many_arguments)]
            fn avx2($($argument: $kind),*) {
                ($avx2)($($argument),*);
            }
            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2,fma,avx512f")]
            #[allow(clippy::too_many_arguments)]
            fn avx512($($argument: $kind),*) {
                ($avx512)($($argument),*);
            }
            match tier.0 {
                $crate::kernel::tier::Level::Portable => ($portable)($($argument),*),
                // SAFETY: a tier of this level exists only where AVX2 and FMA were detected.
                #[cfg(target_arch = "x86_64")]
                $crate::kernel::tier::Level::Avx2 => unsafe { avx2($($argument),*) },
                // SAFETY: a tier of this level exists only where AVX-512F was detected as well.
                #[cfg(target_arch = "x86_64")]
                $crate::kernel::tier::Level::Avx512 => unsafe { avx512($($argument),*) },
            }
        }
    };
}
pub(crate) use per_tier;
