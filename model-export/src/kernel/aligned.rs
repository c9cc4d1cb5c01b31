//! A buffer that starts on a cache line.

use super::LANES;

/// `f32` values whose first one lies on a 64-byte boundary. Without that every 512-bit load crosses
/// a cache line, which costs half the speed of the products.
#[derive(Clone, Debug)]
pub struct Aligned {
    values: Vec<f32>,
    start: usize,
    len: usize,
}

impl Aligned {
    /// `len` zeros.
    #[must_use]
    pub fn zeros(len: usize) -> Self {
        let values = vec![0.0; len + LANES];
        // `align_offset` may give up with usize::MAX; speed is then lost, not correctness.
        let start = values.as_ptr().align_offset(64).min(LANES);
        Self { values, start, len }
    }
}

impl std::ops::Deref for Aligned {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.values[self.start..self.start + self.len]
    }
}

impl std::ops::DerefMut for Aligned {
    fn deref_mut(&mut self) -> &mut [f32] {
        &mut self.values[self.start..self.start + self.len]
    }
}

#[cfg(test)]
mod tests {
    use super::Aligned;

    #[test]
    fn starts_on_a_cache_line() {
        for len in [0, 1, 17, 4096] {
            let buffer = Aligned::zeros(len);
            assert_eq!(buffer.len(), len);
            assert_eq!(buffer.as_ptr() as usize % 64, 0);
            assert!(buffer.iter().all(|&value| value == 0.0));
        }
    }
}
