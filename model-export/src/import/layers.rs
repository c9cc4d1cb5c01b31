//! From named tensors to the posteriors of networks.

use super::convention::{Convention, Role};
use super::tensor::Tensor;
use super::weight_file::WeightFile;
use crate::posterior::architecture::{Architecture, ArchitectureError};
use crate::posterior::gaussian_weights::GaussianWeights;
use std::collections::BTreeMap;

/// Why tensors are no networks.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LayersError {
    /// A tensor that is no part of such a layer, so that the network is another one than would be read.
    #[error("tensor {0:?} is of no Bayesian dense layer of this layout")]
    Foreign(String),
    /// Two tensors of one name.
    #[error("tensor {0:?} is there twice")]
    Twice(String),
    /// A tensor that a layer must have.
    #[error("layer {layer:?} has no {role}")]
    Missing {
        /// The layer.
        layer: String,
        /// What is missing.
        role: &'static str,
    },
    /// A tensor that does not fit its layer's others.
    #[error("tensor {name:?} has the shape {found:?}, its layer needs {needed:?}")]
    Shape {
        /// The tensor.
        name: String,
        /// Its shape.
        found: Vec<usize>,
        /// What it should be.
        needed: Vec<usize>,
    },
    /// Weights of a layer that is not dense.
    #[error("tensor {name:?} has the shape {found:?}, and a dense layer's is [outputs, inputs]")]
    NotDense {
        /// The tensor.
        name: String,
        /// Its shape.
        found: Vec<usize>,
    },
    /// NaN or infinite.
    #[error("tensor {0:?} holds a number that is not finite")]
    NotFinite(String),
    /// The recipe names a layer that the file does not have.
    #[error("the recipe's layer {0:?} is not in the file")]
    NotThere(String),
    /// The file has a layer that the recipe does not name, or names twice.
    #[error("the recipe names layer {0:?} never or twice")]
    NotOnce(String),
    /// Nothing says in which order the layers follow each other.
    #[error("the file's layers have no order: name them in the recipe, layers = [...]")]
    NoOrder,
    /// A layer's inputs are not the outputs of the one before, or the recipe's features.
    #[error("layer {layer:?} has {found} inputs, what comes before it {needed} outputs")]
    Chain {
        /// The layer.
        layer: String,
        /// Its inputs.
        found: usize,
        /// What it should have.
        needed: usize,
    },
    /// Neither one network for three axes nor one for each.
    #[error("{networks} networks of {outputs} outputs: it must be 1 of 3, or 3 of 1")]
    Outputs {
        /// Networks.
        networks: usize,
        /// Outputs of the first that does not fit.
        outputs: usize,
    },
    /// A blob cannot hold it.
    #[error("the network of layer {layer:?}: {cause}")]
    Architecture {
        /// Its first layer.
        layer: String,
        /// What is wrong.
        #[source]
        cause: ArchitectureError,
    },
}

/// The tensors of one layer, by what they are to it.
type Layer<'a> = BTreeMap<Role, &'a Tensor>;

/// The networks of `file`, of `inputs` inputs each; `names` are the recipe's layers.
///
/// # Errors
/// See [`LayersError`].
pub fn networks(
    file: &WeightFile,
    convention: Convention,
    names: Option<&[Vec<String>]>,
    inputs: usize,
) -> Result<Vec<GaussianWeights>, LayersError> {
    let layers = grouped(&file.tensors, convention)?;
    let order = match names {
        Some(names) => names.to_vec(),
        None => vec![found_order(&layers, file.is_ordered)?],
    };
    check_named_once(&layers, &order)?;
    let mut networks = Vec::with_capacity(order.len());
    for names in &order {
        let of = names.iter().map(|name| {
            let found = layers.iter().find(|(prefix, _)| prefix == name);
            found.ok_or_else(|| LayersError::NotThere(name.clone()))
        });
        let layers = of.collect::<Result<Vec<_>, _>>()?;
        networks.push(network(&layers, convention, inputs)?);
    }
    let outputs = || {
        networks
            .iter()
            .map(|network| network.architecture.outputs())
    };
    let needed = if networks.len() == 1 { 3 } else { 1 };
    match outputs().find(|&outputs| outputs != needed) {
        None if matches!(networks.len(), 1 | 3) => Ok(networks),
        other => Err(LayersError::Outputs {
            networks: networks.len(),
            outputs: other.unwrap_or(needed),
        }),
    }
}

/// Layers in the order in which their first tensors come.
fn grouped(
    tensors: &[Tensor],
    convention: Convention,
) -> Result<Vec<(&str, Layer<'_>)>, LayersError> {
    let mut layers: Vec<(&str, Layer<'_>)> = Vec::new();
    for tensor in tensors {
        let (prefix, own) = tensor.name.rsplit_once('.').unwrap_or(("", &tensor.name));
        let role = match convention.role(own) {
            None => return Err(LayersError::Foreign(tensor.name.clone())),
            Some(Role::Ignored) => continue,
            Some(role) => role,
        };
        let at = layers.iter().position(|(name, _)| *name == prefix);
        let at = at.unwrap_or_else(|| {
            layers.push((prefix, Layer::new()));
            layers.len() - 1
        });
        if layers[at].1.insert(role, tensor).is_some() {
            return Err(LayersError::Twice(tensor.name.clone()));
        }
    }
    Ok(layers)
}

/// The file's order, or where it has none that of the one number by which the names differ.
fn found_order(layers: &[(&str, Layer<'_>)], is_ordered: bool) -> Result<Vec<String>, LayersError> {
    let names = layers.iter().map(|(name, _)| *name);
    if is_ordered || layers.len() < 2 {
        return Ok(names.map(str::to_owned).collect());
    }
    let common = |a: &str, b: &str| a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count();
    let first = layers[0].0;
    let start = names.clone().skip(1).map(|name| common(first, name)).min();
    // A digit that all share belongs to the number: 10 and 12.
    let head = &first.as_bytes()[..start.unwrap_or(0)];
    let digits = head.iter().rev().take_while(|byte| byte.is_ascii_digit());
    let start = head.len() - digits.count();
    let numbered = names.map(|name| {
        let rest = name.get(start..)?;
        let end = rest.find(|c: char| !c.is_ascii_digit());
        let (number, tail) = rest.split_at(end.unwrap_or(rest.len()));
        Some((number.parse::<u32>().ok()?, tail, name))
    });
    let mut numbered = numbered
        .collect::<Option<Vec<_>>>()
        .ok_or(LayersError::NoOrder)?;
    numbered.sort_unstable();
    let is_one_series = numbered
        .windows(2)
        .all(|pair| pair[0].1 == pair[1].1 && pair[0].0 < pair[1].0);
    if is_one_series {
        Ok(numbered
            .into_iter()
            .map(|(_, _, name)| name.to_owned())
            .collect())
    } else {
        Err(LayersError::NoOrder)
    }
}

fn check_named_once(
    layers: &[(&str, Layer<'_>)],
    order: &[Vec<String>],
) -> Result<(), LayersError> {
    for (prefix, _) in layers {
        if order.iter().flatten().filter(|name| name == prefix).count() != 1 {
            return Err(LayersError::NotOnce((*prefix).to_owned()));
        }
    }
    Ok(())
}

/// One network of `layers` from input to output.
fn network(
    layers: &[&(&str, Layer<'_>)],
    convention: Convention,
    inputs: usize,
) -> Result<GaussianWeights, LayersError> {
    let mut widths = vec![inputs];
    let (mut means, mut log_sigmas) = (Vec::new(), Vec::new());
    for (name, layer) in layers {
        let weights = wanted(name, layer, Role::WeightMean)?;
        let &[outputs, found] = dense(&weights.shape) else {
            return Err(LayersError::NotDense {
                name: weights.name.clone(),
                found: weights.shape.clone(),
            });
        };
        let needed = widths[widths.len() - 1];
        if found != needed {
            return Err(LayersError::Chain {
                layer: (*name).to_owned(),
                found,
                needed,
            });
        }
        widths.push(outputs);
        let shape = [outputs, found];
        means.extend(finite(weights)?);
        let spreads = wanted(name, layer, Role::WeightSpread)?;
        fits(spreads, &shape)?;
        log_sigmas.extend(finite(spreads)?.map(|coded| convention.log_sigma(coded)));
        if layer.contains_key(&Role::BiasMean) || layer.contains_key(&Role::BiasSpread) {
            let biases = wanted(name, layer, Role::BiasMean)?;
            let spreads = wanted(name, layer, Role::BiasSpread)?;
            fits(biases, &[outputs])?;
            fits(spreads, &[outputs])?;
            means.extend(finite(biases)?);
            log_sigmas.extend(finite(spreads)?.map(|coded| convention.log_sigma(coded)));
        } else {
            // No bias is one that is zero without doubt.
            means.extend(std::iter::repeat_n(0.0, outputs));
            log_sigmas.extend(std::iter::repeat_n(f32::NEG_INFINITY, outputs));
        }
    }
    let architecture = Architecture::new(widths).map_err(|cause| LayersError::Architecture {
        layer: layers.first().map_or("", |(name, _)| name).to_owned(),
        cause,
    })?;
    Ok(GaussianWeights {
        architecture,
        means,
        log_sigmas,
    })
}

fn wanted<'a>(name: &str, layer: &Layer<'a>, role: Role) -> Result<&'a Tensor, LayersError> {
    layer
        .get(&role)
        .copied()
        .ok_or_else(|| LayersError::Missing {
            layer: name.to_owned(),
            role: match role {
                Role::WeightMean => "weight means",
                Role::WeightSpread => "deviations of the weights",
                Role::BiasMean => "bias means",
                Role::BiasSpread => "deviations of the biases",
                Role::Ignored => "tensor",
            },
        })
}

/// A shape without the ones that a convolution over single points has at its end.
fn dense(shape: &[usize]) -> &[usize] {
    match shape.split_at_checked(2) {
        Some((two, rest)) if rest.iter().all(|&size| size == 1) => two,
        _ => shape,
    }
}

fn fits(tensor: &Tensor, needed: &[usize]) -> Result<(), LayersError> {
    if tensor.shape == needed || (needed.len() == 2 && dense(&tensor.shape) == needed) {
        return Ok(());
    }
    Err(LayersError::Shape {
        name: tensor.name.clone(),
        found: tensor.shape.clone(),
        needed: needed.to_vec(),
    })
}

fn finite(tensor: &Tensor) -> Result<impl Iterator<Item = f32> + '_, LayersError> {
    if tensor.values.iter().all(|value| value.is_finite()) {
        Ok(tensor.values.iter().copied())
    } else {
        Err(LayersError::NotFinite(tensor.name.clone()))
    }
}

#[cfg(test)]
mod tests;
