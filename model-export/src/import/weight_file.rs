//! A file of weights of either form, told apart by its first bytes.

use super::safetensors_file::{self, SafetensorsFileError};
use super::tensor::Tensor;
use super::torch_file::{self, MAGIC, TorchFileError};

/// Longest file that is read, bytes: fifty times three networks of the largest shape in double precision.
pub const BYTES_MAX: u64 = 1 << 26;

/// The tensors of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightFile {
    /// They.
    pub tensors: Vec<Tensor>,
    /// Whether their order is the one in which the model was put together.
    pub is_ordered: bool,
}

/// Why a file is not read.
#[derive(Debug, thiserror::Error)]
pub enum WeightFileError {
    /// A file of `torch.save`.
    #[error(transparent)]
    Torch(#[from] TorchFileError),
    /// Any other.
    #[error(transparent)]
    Safetensors(#[from] SafetensorsFileError),
}

/// Reads `bytes`. Nothing in them is executed.
///
/// # Errors
/// See [`WeightFileError`].
pub fn parse(bytes: &[u8]) -> Result<WeightFile, WeightFileError> {
    let is_ordered = bytes.starts_with(&MAGIC);
    let tensors = if is_ordered {
        torch_file::parse(bytes)?
    } else {
        safetensors_file::parse(bytes)?
    };
    Ok(WeightFile {
        tensors,
        is_ordered,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::import::archive::Archive;
    use crate::import::pickle::state_dict;
    use proptest::collection::vec;
    use proptest::prelude::*;

    const TORCH: &[u8] = include_bytes!("../../../tests/golden/torch_networks/relu.pt");
    const SAFE: &[u8] = include_bytes!("../../../tests/golden/torch_networks/gelu.safetensors");

    /// `bytes` with some of them changed, and cut.
    fn changed(bytes: &[u8], changes: &[(usize, u8)], cut: usize) -> Vec<u8> {
        let mut bytes = bytes.to_vec();
        for (at, value) in changes {
            let at = at % bytes.len();
            bytes[at] = *value;
        }
        bytes.truncate(bytes.len() - if cut < 50 { cut } else { 0 });
        bytes
    }

    #[test]
    fn both_forms_are_told_apart() {
        let (torch, safe) = (parse(TORCH).unwrap(), parse(SAFE).unwrap());
        assert!(torch.is_ordered && !safe.is_ordered);
        assert_eq!((torch.tensors.len(), safe.tensors.len()), (12, 12));
        assert_eq!(torch.tensors[0].name, "0.weight_mu");
        assert_eq!(torch.tensors[0].shape, [16, 13]);
        let error = parse(b"\x80\x02}.").unwrap_err().to_string();
        assert!(error.starts_with("neither a file of torch.save"), "{error}");
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

        /// Whatever is changed, an answer comes back; behind the archive's checksums too.
        #[test]
        fn changed_files_are_read_or_refused(
            changes in vec((any::<usize>(), any::<u8>()), 0..6),
            cut in 0_usize..200,
        ) {
            let archive = Archive::parse(TORCH).unwrap();
            let pickle = archive.names().find(|name| name.ends_with("data.pkl")).unwrap();
            let pickle = changed(archive.read(pickle).unwrap(), &changes, cut);
            if let Err(error) = state_dict(&pickle) {
                prop_assert!(!error.to_string().contains(char::is_control));
            }
            for file in [TORCH, SAFE] {
                if let Err(error) = parse(&changed(file, &changes, cut)) {
                    prop_assert!(!error.to_string().contains(char::is_control));
                }
            }
        }
    }
}
