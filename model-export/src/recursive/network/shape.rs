//! Layers of the recursive network, and where their numbers lie: padded for the kernels, or as in
//! blobs.

use crate::blob::grid::Channel;
use crate::posterior::architecture::LayerShape;
use bnkf::recursive::features::FEATURES;
use bnkf::recursive::schedule::OUTPUTS;

/// Neurons of a hidden layer.
pub const HIDDEN: usize = 64;
/// Layers, the output layer included.
pub const LAYERS: usize = 5;
/// Columns of the output layer: [`OUTPUTS`] padded to what the kernels take.
pub const OUTPUT_COLUMNS: usize = OUTPUTS.next_multiple_of(16);

/// Inputs and columns of every layer.
pub const SHAPES: [(usize, usize); LAYERS] = [
    (FEATURES, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, HIDDEN),
    (HIDDEN, OUTPUT_COLUMNS),
];

const fn offsets() -> [usize; LAYERS + 1] {
    let mut starts = [0; LAYERS + 1];
    let mut i = 0;
    while i < LAYERS {
        starts[i + 1] = starts[i] + (SHAPES[i].0 + 1) * SHAPES[i].1;
        i += 1;
    }
    starts
}
/// Where each layer's numbers start: `inputs` rows of weights, then one row of biases; and the end.
pub const OFFSETS: [usize; LAYERS + 1] = offsets();
/// Weights and biases, padding included.
pub const PARAMETERS: usize = OFFSETS[LAYERS];

/// Every output's weights, in the padded order.
pub fn channels() -> impl Iterator<Item = Channel> {
    let layers = SHAPES.into_iter().zip(OFFSETS);
    layers.flat_map(|((count, stride), start)| {
        (0..stride).map(move |column| Channel {
            start: start + column,
            stride,
            count,
        })
    })
}

/// Where each number of the unpadded order lies in the padded one: (unpadded, padded).
pub fn places(layers: &[LayerShape]) -> Vec<(usize, usize)> {
    let mut places = Vec::new();
    for ((shape, (inputs, columns)), start) in layers.iter().zip(SHAPES).zip(OFFSETS) {
        for output in 0..shape.outputs {
            let weights = (0..inputs).map(|input| (shape.row(output) + input, input));
            for (ordered, row) in weights.chain([(shape.bias(output), inputs)]) {
                places.push((ordered, start + row * columns + output));
            }
        }
    }
    places
}
