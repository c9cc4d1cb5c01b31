//! Little-endian numbers inside a blob.

/// Little-endian f32 values inside a blob.
#[derive(Clone, Copy, Debug)]
pub struct Floats<'a>(pub(super) &'a [u8]);

impl<'a> Floats<'a> {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.0.len() / 4
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Value `index`, which must be below [`Floats::len`].
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        let b = &self.0[4 * index..4 * index + 4];
        f32::from_le_bytes([b[0], b[1], b[2], b[3]])
    }

    /// All values in order.
    pub fn iter(&self) -> impl Iterator<Item = f32> + use<'a> {
        self.bytes().iter().map(|&b| f32::from_le_bytes(b))
    }

    /// All values in order, two at a time.
    pub fn pairs(&self) -> impl Iterator<Item = [f32; 2]> + use<'a> {
        let (pairs, _) = self.bytes().as_chunks();
        pairs
            .iter()
            .map(|[a, b]| [a, b].map(|&b| f32::from_le_bytes(b)))
    }

    /// The bytes of all values in order.
    #[inline]
    pub fn bytes(&self) -> &'a [[u8; 4]] {
        self.0.as_chunks().0
    }
}

pub(super) fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

pub(super) fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

pub(super) fn f32_at(bytes: &[u8], at: usize) -> f32 {
    f32::from_bits(u32_at(bytes, at))
}
