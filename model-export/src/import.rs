//! Networks that others trained in PyTorch, as blobs: files of tensors, what a recipe says of them, the
//! model.

mod archive;
pub mod convention;
pub mod layers;
pub mod model;
mod pickle;
pub mod recipe;
mod safetensors_file;
pub mod tensor;
pub mod torch_file;
pub mod weight_file;
