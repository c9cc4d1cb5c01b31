//! Files of safetensors.

use super::tensor::{NAME_BYTES_MAX, NumberFormat, TENSORS_MAX, Tensor, TensorError};
use safetensors::{Dtype, SafeTensors};

/// Most characters of what the reader says that are passed on.
const SAID_MAX: usize = 200;

/// Why a file is not read.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum SafetensorsFileError {
    /// It is no such file; what its reader says may quote the file.
    #[error("neither a file of torch.save (1.6 or later) nor safetensors: {0:?}")]
    Form(String),
    /// More tensors than any network has.
    #[error("has more than {TENSORS_MAX} tensors")]
    Tensors,
    /// A name that is longer than any.
    #[error("a tensor's name has more than {NAME_BYTES_MAX} bytes")]
    Name,
    /// One tensor.
    #[error("tensor {name:?} {cause}")]
    Tensor {
        /// Its name.
        name: String,
        /// What is wrong.
        #[source]
        cause: TensorError,
    },
}

/// The tensors in `bytes`, in no order that means anything.
///
/// # Errors
/// See [`SafetensorsFileError`].
pub fn parse(bytes: &[u8]) -> Result<Vec<Tensor>, SafetensorsFileError> {
    let file = SafeTensors::deserialize(bytes).map_err(|cause| {
        let said = cause.to_string().chars().take(SAID_MAX).collect();
        SafetensorsFileError::Form(said)
    })?;
    if file.len() > TENSORS_MAX {
        return Err(SafetensorsFileError::Tensors);
    }
    if file.iter().any(|(name, _)| name.len() > NAME_BYTES_MAX) {
        return Err(SafetensorsFileError::Name);
    }
    let tensor = |(name, view): (&str, safetensors::tensor::TensorView<'_>)| {
        let format = match view.dtype() {
            Dtype::F16 => Ok(NumberFormat::F16),
            Dtype::F32 => Ok(NumberFormat::F32),
            Dtype::F64 => Ok(NumberFormat::F64),
            _ => Err(TensorError::Format),
        };
        let numbers = format.map(|format| (format, view.data()));
        let tensor = numbers.and_then(|numbers| Tensor::contiguous(name, numbers, view.shape()));
        tensor.map_err(|cause| SafetensorsFileError::Tensor {
            name: name.to_owned(),
            cause,
        })
    };
    file.iter().map(tensor).collect()
}
