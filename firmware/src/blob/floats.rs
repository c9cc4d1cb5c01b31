//! Little-endian numbers inside a blob.

/// Little-endian f32 values inside a blob.
#[derive(Clone, Copy, Debug)]
pub struct Floats<'a>(pub(super) &'a [[u8; 4]]);

impl<'a> Floats<'a> {
    /// Number of values.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Value `index`; NaN from [`Floats::len`] on.
    #[inline]
    pub fn get(&self, index: usize) -> f32 {
        let bytes = self.0.get(index);
        bytes.map_or(f32::NAN, |&bytes| f32::from_le_bytes(bytes))
    }

    /// All values in order.
    pub fn iter(&self) -> impl Iterator<Item = f32> + use<'a> {
        self.0.iter().map(|&b| f32::from_le_bytes(b))
    }

    /// All values in order, two at a time.
    pub fn pairs(&self) -> impl Iterator<Item = [f32; 2]> + use<'a> {
        let (pairs, _) = self.0.as_chunks();
        pairs
            .iter()
            .map(|[a, b]| [a, b].map(|&b| f32::from_le_bytes(b)))
    }

    /// The bytes of all values in order.
    #[inline]
    pub fn bytes(&self) -> &'a [[u8; 4]] {
        self.0
    }
}

/// The two bytes from the constant offset `AT` on.
pub(super) fn u16_at<const AT: usize, const LEN: usize>(bytes: &[u8; LEN]) -> u16 {
    const { assert!(AT + 2 <= LEN) };
    u16::from_le_bytes([bytes[AT], bytes[AT + 1]])
}

/// The four bytes from the constant offset `AT` on.
pub(super) fn u32_at<const AT: usize, const LEN: usize>(bytes: &[u8; LEN]) -> u32 {
    const { assert!(AT + 4 <= LEN) };
    u32::from_le_bytes([bytes[AT], bytes[AT + 1], bytes[AT + 2], bytes[AT + 3]])
}
