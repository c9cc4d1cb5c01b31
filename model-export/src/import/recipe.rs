//! What a file of weights does not say of its network, from a small TOML file; `docs/import.md` has one.

use super::convention::Convention;
use crate::blob::writer::Normalisation;
use crate::memoryless::model::PASSES;
use bnkf::blob::{Activation, FeatureLayout};
use serde::Deserialize;

/// Longest file that is read, bytes.
pub const BYTES_MAX: u64 = 1 << 16;

/// Why a file is no recipe.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecipeError {
    /// No TOML, a key that means nothing, or a value of another type.
    #[error("line {line}: {message}")]
    Line {
        /// Which line.
        line: usize,
        /// What is wrong.
        message: String,
    },
    /// A list of another length than the network's.
    #[error("{field} has {found} numbers, the network {needed}")]
    Count {
        /// Which list.
        field: &'static str,
        /// Its length.
        found: usize,
        /// What it should be.
        needed: usize,
    },
    /// A number that is not finite, or a scale that is not positive.
    #[error("{0} holds a number that is not finite, or a scale that is not positive")]
    Number(&'static str),
}

/// What a recipe says.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// How the tensors are named.
    pub convention: Convention,
    /// What every layer but the last ends in.
    pub activation: Activation,
    /// What the inputs are.
    pub features: FeatureLayout,
    /// Monte Carlo passes by default.
    pub passes: u16,
    /// Names of the layers from input to output, of each network; found if they are missing.
    pub layers: Option<Vec<Vec<String>>>,
    /// Of each input.
    pub inputs: Vec<Normalisation>,
    /// Of each axis, metres.
    pub outputs: Vec<Normalisation>,
    /// Standard deviation of a velocity component in the population, m/s.
    pub speed_sigma_mps: f32,
    /// Standard deviation of an acceleration component in the population, m/s^2.
    pub acceleration_sigma_mps2: f32,
}

/// The file's keys.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    layout: Convention,
    activation: ActivationName,
    features: FeaturesName,
    #[serde(default = "passes_by_default")]
    passes: u16,
    layers: Option<Layers>,
    input: Input,
    output: Output,
    population: Population,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ActivationName {
    Gelu,
    Relu,
    Tanh,
    Identity,
}

#[derive(Clone, Copy, Deserialize)]
enum FeaturesName {
    #[serde(rename = "polar-12")]
    Polar12,
    #[serde(rename = "polar-13")]
    Polar13,
}

/// One network's, or a list for each of three.
#[derive(Deserialize)]
#[serde(untagged)]
enum Layers {
    One(Vec<String>),
    Three(Vec<Vec<String>>),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Input {
    mean: Vec<f32>,
    scale: Vec<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Output {
    mean_m: Vec<f32>,
    scale_m: Vec<f32>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Population {
    speed_sigma_mps: f32,
    acceleration_sigma_mps2: f32,
}

const fn passes_by_default() -> u16 {
    PASSES
}

/// Reads a recipe.
///
/// # Errors
/// See [`RecipeError`].
pub fn parse(text: &str) -> Result<Recipe, RecipeError> {
    let file: File = toml::from_str(text).map_err(|error| {
        let start = error.span().map_or(0, |span| span.start).min(text.len());
        let before = text.as_bytes()[..start].iter();
        RecipeError::Line {
            line: before.filter(|byte| **byte == b'\n').count() + 1,
            message: error.message().lines().collect::<Vec<_>>().join(", "),
        }
    })?;
    let features = match file.features {
        FeaturesName::Polar12 => FeatureLayout::Polar12,
        FeaturesName::Polar13 => FeatureLayout::Polar13,
    };
    let inputs = ["input.mean", "input.scale"];
    let inputs = pairs(inputs, &file.input.mean, &file.input.scale, features.len())?;
    let outputs = ["output.mean_m", "output.scale_m"];
    let outputs = pairs(outputs, &file.output.mean_m, &file.output.scale_m, 3)?;
    Ok(Recipe {
        convention: file.layout,
        activation: match file.activation {
            ActivationName::Gelu => Activation::Gelu,
            ActivationName::Relu => Activation::Relu,
            ActivationName::Tanh => Activation::Tanh,
            ActivationName::Identity => Activation::Identity,
        },
        features,
        passes: file.passes,
        layers: file.layers.map(|layers| match layers {
            Layers::One(names) => vec![names],
            Layers::Three(networks) => networks,
        }),
        inputs,
        outputs,
        speed_sigma_mps: file.population.speed_sigma_mps,
        acceleration_sigma_mps2: file.population.acceleration_sigma_mps2,
    })
}

fn pairs(
    fields: [&'static str; 2],
    means: &[f32],
    scales: &[f32],
    needed: usize,
) -> Result<Vec<Normalisation>, RecipeError> {
    for (field, list) in fields.into_iter().zip([means, scales]) {
        let found = list.len();
        if found != needed {
            return Err(RecipeError::Count {
                field,
                found,
                needed,
            });
        }
        if !list.iter().all(|number| number.is_finite()) {
            return Err(RecipeError::Number(field));
        }
    }
    // A blob holds the inverse too.
    if !scales
        .iter()
        .all(|&scale| scale > 0.0 && (1.0 / scale).is_finite())
    {
        return Err(RecipeError::Number(fields[1]));
    }
    let pairs = means.iter().zip(scales);
    let pair = |(&mean, &scale): (&f32, &f32)| Normalisation { mean, scale };
    Ok(pairs.map(pair).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const RECIPE: &str = "\
layout = \"bayesian-torch\"
activation = \"tanh\"
features = \"polar-12\"
layers = [\"first\", \"last\"]
[input]
mean = [0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0.5]
scale = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 4]
[output]
mean_m = [0, 0, 10]
scale_m = [20, 20, 5]
[population]
speed_sigma_mps = 2
acceleration_sigma_mps2 = 3.5
";

    fn refusal(from: &str, to: &str) -> String {
        assert!(RECIPE.contains(from), "{from}");
        parse(&RECIPE.replace(from, to)).unwrap_err().to_string()
    }

    #[test]
    fn what_is_written_is_what_is_read() {
        let recipe = parse(RECIPE).unwrap();
        assert_eq!(recipe.convention, Convention::BayesianTorch);
        assert_eq!(recipe.activation, Activation::Tanh);
        assert_eq!(
            (recipe.features, recipe.passes),
            (FeatureLayout::Polar12, 100)
        );
        let names = vec!["first".to_owned(), "last".to_owned()];
        assert_eq!(recipe.layers, Some(vec![names]));
        let last = Normalisation {
            mean: 0.5,
            scale: 4.0,
        };
        assert_eq!(recipe.inputs[11], last);
        assert_eq!(
            recipe.outputs[2],
            Normalisation {
                mean: 10.0,
                scale: 5.0
            }
        );
        assert_eq!(
            (recipe.speed_sigma_mps, recipe.acceleration_sigma_mps2),
            (2.0, 3.5)
        );
        let three = RECIPE.replace("[\"first\", \"last\"]", "[[\"a\"], [\"b\"], [\"c\"]]");
        assert_eq!(parse(&three).unwrap().layers.unwrap().len(), 3);
        let found = RECIPE.replace("layers = [\"first\", \"last\"]\n", "passes = 20\n");
        let found = parse(&found).unwrap();
        assert_eq!((found.layers, found.passes), (None, 20));
    }

    #[test]
    fn faults_name_line_or_field() {
        let unknown = refusal("\"tanh\"", "\"swish\"");
        assert!(
            unknown.starts_with("line 2: unknown variant `swish`"),
            "{unknown}"
        );
        let unknown = refusal("[population]", "[people]");
        assert!(
            unknown.starts_with("line 11: unknown field `people`"),
            "{unknown}"
        );
        let missing = refusal("activation = \"tanh\"\n", "");
        assert!(missing.contains("missing field `activation`"), "{missing}");
        assert_eq!(
            refusal("\"polar-12\"", "\"polar-13\""),
            "input.mean has 12 numbers, the network 13"
        );
        assert_eq!(
            refusal("scale_m = [20, 20, 5]", "scale_m = [20]"),
            "output.scale_m has 1 numbers, the network 3"
        );
        for bad in ["0", "-1", "inf", "1e-40"] {
            let refused = refusal("scale_m = [20,", &format!("scale_m = [{bad},"));
            assert!(
                refused.starts_with("output.scale_m holds"),
                "{bad}: {refused}"
            );
        }
        let refused = refusal("mean_m = [0, 0, 10]", "mean_m = [0, 0, nan]");
        assert!(refused.starts_with("output.mean_m holds"), "{refused}");
    }
}
