//! Any bytes as a file of PyTorch's weights: the archive, the pickle in it, safetensors, and the layers.

use bnkf_model_export::import::convention::Convention;
use bnkf_model_export::import::tensor::{TENSORS_MAX, VALUES_MAX};
use bnkf_model_export::import::{layers, weight_file};

/// Panics where a reader does, reads more than its bounds, or says more than a line.
pub fn run(bytes: &[u8]) {
    match weight_file::parse(bytes) {
        Ok(file) => {
            assert!(file.tensors.len() <= TENSORS_MAX);
            for tensor in &file.tensors {
                assert!(tensor.values.len() <= VALUES_MAX);
                assert_eq!(tensor.values.len(), tensor.shape.iter().product::<usize>());
            }
            for convention in [Convention::Torchbnn, Convention::BayesianTorch] {
                match layers::networks(&file, convention, None, 13) {
                    Ok(networks) => {
                        for network in networks {
                            assert_eq!(network.means.len(), network.architecture.parameters());
                            assert_eq!(network.means.len(), network.log_sigmas.len());
                        }
                    }
                    Err(error) => assert_one_line(&error.to_string()),
                }
            }
        }
        Err(error) => assert_one_line(&error.to_string()),
    }
}

fn assert_one_line(text: &str) {
    assert!(
        text.len() < 8192 && !text.contains(char::is_control),
        "{text:?}"
    );
}
