//! A tensor of a file of weights, with bounds that hold before memory is asked for.

use bnkf::blob::field::WIDTH_MAX;
use half::f16;

/// Most numbers of a tensor: the weights of the widest layer.
pub const VALUES_MAX: usize = WIDTH_MAX * WIDTH_MAX;
/// Most tensors of a file: three networks of eight layers with means and deviations of weights and biases,
/// and what some layers keep beside them.
pub const TENSORS_MAX: usize = 512;

/// Longest name, bytes.
pub const NAME_BYTES_MAX: usize = 200;

/// A named tensor, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Tensor {
    /// Its name in the file.
    pub name: String,
    /// Numbers along each axis.
    pub shape: Vec<usize>,
    /// The numbers, the last axis fastest.
    pub values: Vec<f32>,
}

/// What numbers are in a file, little-endian.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NumberFormat {
    /// Half precision.
    F16,
    /// Single precision.
    F32,
    /// Double precision.
    F64,
}

/// Why a tensor is not read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TensorError {
    /// More numbers than a layer has.
    #[error("has more than {VALUES_MAX} numbers, those of a layer of width {WIDTH_MAX}")]
    Values,
    /// Its numbers are not floats of 2, 4 or 8 bytes.
    #[error("is no tensor of half, single or double floats")]
    Format,
    /// Its numbers lie outside what the file holds.
    #[error("reaches beyond its storage")]
    Storage,
}

impl NumberFormat {
    const fn len(self) -> usize {
        match self {
            Self::F16 => 2,
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// The number at `index`.
    fn read(self, storage: &[u8], index: usize) -> Option<f32> {
        let bytes = storage.get(index.checked_mul(self.len())?..)?;
        Some(match self {
            Self::F16 => f16::from_le_bytes(*bytes.first_chunk()?).to_f32(),
            Self::F32 => f32::from_le_bytes(*bytes.first_chunk()?),
            Self::F64 => f64::from_le_bytes(*bytes.first_chunk()?) as f32,
        })
    }
}

impl Tensor {
    /// The numbers of `storage` that lie `strides` apart from `offset` on.
    ///
    /// # Errors
    /// Too many of them, or they are not there.
    pub fn gather(
        name: &str,
        (format, storage): (NumberFormat, &[u8]),
        offset: usize,
        shape: &[usize],
        strides: &[usize],
    ) -> Result<Self, TensorError> {
        let count = count(shape)?;
        if strides.len() != shape.len() {
            return Err(TensorError::Storage);
        }
        let place = |number: usize| {
            let (mut left, mut at) = (number, offset);
            for (&size, &stride) in shape.iter().zip(strides).rev() {
                let size = size.max(1);
                at = at.checked_add((left % size).checked_mul(stride)?)?;
                left /= size;
            }
            Some(at)
        };
        let values = (0..count).map(|number| format.read(storage, place(number)?));
        let values = values.collect::<Option<_>>().ok_or(TensorError::Storage)?;
        Ok(Self {
            name: name.to_owned(),
            shape: shape.to_vec(),
            values,
        })
    }

    /// All numbers of `storage`, in order.
    ///
    /// # Errors
    /// As [`Tensor::gather`].
    pub fn contiguous(
        name: &str,
        numbers: (NumberFormat, &[u8]),
        shape: &[usize],
    ) -> Result<Self, TensorError> {
        count(shape)?;
        let mut step = 1;
        let mut strides: Vec<usize> = shape
            .iter()
            .rev()
            .map(|&size| {
                let stride = step;
                step *= size.max(1);
                stride
            })
            .collect();
        strides.reverse();
        Self::gather(name, numbers, 0, shape, &strides)
    }
}

/// The product of the sizes, where it is no more than [`VALUES_MAX`].
fn count(shape: &[usize]) -> Result<usize, TensorError> {
    // A zero makes nothing of whatever stands beside it, but strides are multiplied from the rest.
    let mut sizes = shape.iter().map(|&size| size.max(1));
    match sizes.try_fold(1_usize, usize::checked_mul) {
        Some(bound) if bound <= VALUES_MAX => Ok(shape.iter().product()),
        _ => Err(TensorError::Values),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn storage() -> Vec<u8> {
        (0..6).flat_map(|x| (x as f32).to_le_bytes()).collect()
    }

    #[test]
    fn strides_are_followed() {
        let storage = storage();
        let gather = |offset, shape: &[usize], strides: &[usize]| {
            let numbers = (NumberFormat::F32, &storage[..]);
            Tensor::gather("w", numbers, offset, shape, strides).map(|tensor| tensor.values)
        };
        assert_eq!(
            gather(0, &[2, 3], &[3, 1]),
            Ok(vec![0., 1., 2., 3., 4., 5.])
        );
        // Transposed.
        assert_eq!(
            gather(0, &[3, 2], &[1, 3]),
            Ok(vec![0., 3., 1., 4., 2., 5.])
        );
        assert_eq!(gather(4, &[2], &[1]), Ok(vec![4.0, 5.0]));
        assert_eq!(gather(5, &[], &[]), Ok(vec![5.0]));
        assert_eq!(gather(9, &[0, 4], &[1, 1]), Ok(vec![]));
        for (offset, shape, stride) in
            [(5, 2, 1), (0, 2, 6), (usize::MAX, 2, 1), (1, 2, usize::MAX)]
        {
            assert_eq!(
                gather(offset, &[shape], &[stride]),
                Err(TensorError::Storage)
            );
        }
        assert_eq!(gather(0, &[2, 3], &[1]), Err(TensorError::Storage));
        let whole = Tensor::contiguous("w", (NumberFormat::F32, &storage), &[2, 3]).unwrap();
        assert_eq!(whole.values, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
    }

    #[test]
    fn more_numbers_than_a_layer_has_are_refused_unread() {
        let gather = |shape: &[usize]| {
            let none = vec![0; shape.len()];
            Tensor::gather("w", (NumberFormat::F32, &[0; 4]), 0, shape, &none)
                .map(|t| t.values.len())
        };
        assert_eq!(gather(&[WIDTH_MAX, WIDTH_MAX]), Ok(VALUES_MAX));
        for shape in [[VALUES_MAX, 2], [usize::MAX, 2], [0, usize::MAX]] {
            assert_eq!(gather(&shape), Err(TensorError::Values), "{shape:?}");
        }
    }

    #[test]
    fn every_format_is_read() {
        let half = [0x00, 0x3E, 0x00, 0xC0];
        let double: Vec<u8> = [1.5_f64, -2.0]
            .iter()
            .flat_map(|x| x.to_le_bytes())
            .collect();
        for (format, bytes) in [(NumberFormat::F16, &half[..]), (NumberFormat::F64, &double)] {
            let tensor = Tensor::contiguous("w", (format, bytes), &[2]).unwrap();
            assert_eq!(tensor.values, [1.5, -2.0]);
        }
    }
}
