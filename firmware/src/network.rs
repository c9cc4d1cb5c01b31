//! Layers over a blob plus a caller-owned scratch: one forward pass, or four Monte Carlo passes.

use crate::activation::{gelu, gelus};
use crate::blob::NetworkView;
use crate::blob::field::WIDTH_MAX;
use crate::gaussian::standard_normals;
use crate::kernel::{Packed, sqrt, square_roots};
use crate::layer;
use rand_core::Rng;

/// Monte Carlo passes that run together and share each unpacked weight.
pub const LANES: usize = 4;

/// Working memory of a network, about 4 KiB; contents are meaningless between calls.
pub struct Scratch {
    packed: Packed<LANES>,
    activations: [[f32; LANES]; WIDTH_MAX],
    /// Mean and standard deviation of the first layer's pre-activations: the same in every pass.
    first: [(f32, f32); WIDTH_MAX],
}

impl Scratch {
    /// Fresh scratch.
    pub const fn new() -> Self {
        Self {
            packed: Packed::new(),
            activations: [[0.0; LANES]; WIDTH_MAX],
            first: [(0.0, 0.0); WIDTH_MAX],
        }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

/// A network of Bayesian dense layers with GELU between them.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    view: NetworkView<'a>,
}

impl<'a> Network<'a> {
    /// The network that `view` describes.
    pub fn new(view: NetworkView<'a>) -> Self {
        Self { view }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.view.layer(0).inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.view.layer(self.view.layers() - 1).outputs
    }

    /// Every weight at its mean. `inputs` are normalised; `outputs` are not yet scaled back.
    pub fn mean_pass(&self, inputs: &[f32], outputs: &mut [f32]) {
        let mut packed = Packed::<1>::new();
        let mut activations = [[0.0_f32; 1]; WIDTH_MAX];
        for (slot, &x) in activations.iter_mut().zip(inputs) {
            *slot = [x];
        }
        let last = self.view.layers() - 1;
        for index in 0..=last {
            let layer = self.view.layer(index);
            packed.pack(&activations[..layer.inputs]);
            layer::means(&layer, &packed, |output, mean| {
                activations[output] = if index < last { mean.map(gelu) } else { mean };
            });
        }
        for (slot, activation) in outputs.iter_mut().zip(activations) {
            *slot = activation[0];
        }
    }

    /// Computes the moments of the first layer for `inputs` (normalised), which every following
    /// [`Network::sampled_passes`] starts from.
    pub fn prepare(&self, inputs: &[f32], scratch: &mut Scratch) {
        let mut packed = Packed::<1>::new();
        let mut activations = [[0.0_f32; 1]; WIDTH_MAX];
        for (slot, &x) in activations.iter_mut().zip(inputs) {
            *slot = [x];
        }
        let first = self.view.layer(0);
        packed.pack(&activations[..first.inputs]);
        layer::moments(&first, &packed, |output, mean, variance| {
            scratch.first[output] = (mean[0], sqrt(variance[0]));
        });
    }

    /// [`LANES`] Monte Carlo passes for the inputs last given to [`Network::prepare`], by local
    /// reparameterisation. Returns the outputs, `[output][pass]`, not yet scaled back.
    pub fn sampled_passes<'s>(
        &self,
        scratch: &'s mut Scratch,
        rng: &mut impl Rng,
    ) -> &'s [[f32; LANES]] {
        let Scratch {
            packed,
            activations,
            first,
        } = scratch;
        let last = self.view.layers() - 1;
        let mut outputs = self.view.layer(0).outputs;
        for (slot, &(mean, sigma)) in activations.iter_mut().zip(first.iter()).take(outputs) {
            let drawn = standard_normals(rng).map(|normal| mean + sigma * normal);
            *slot = if last > 0 { gelus(drawn) } else { drawn };
        }
        for index in 1..=last {
            let layer = self.view.layer(index);
            outputs = layer.outputs;
            packed.pack(&activations[..layer.inputs]);
            layer::moments(&layer, packed, |output, mean, variance| {
                let sigma = square_roots(variance);
                let normals: [f32; LANES] = standard_normals(rng);
                let drawn = core::array::from_fn(|lane| mean[lane] + sigma[lane] * normals[lane]);
                activations[output] = if index < last { gelus(drawn) } else { drawn };
            });
        }
        &activations[..outputs]
    }

    /// One pass with every weight drawn, for verification: slow, f32 throughout.
    pub fn weight_sampled_pass(&self, inputs: &[f32], rng: &mut impl Rng, outputs: &mut [f32]) {
        let mut current = [0.0_f32; WIDTH_MAX];
        current[..inputs.len()].copy_from_slice(inputs);
        let last = self.view.layers() - 1;
        for index in 0..=last {
            let layer = self.view.layer(index);
            let mut next = [0.0_f32; WIDTH_MAX];
            layer::sample_weights(&layer, &current, rng, &mut next);
            current = if index < last { next.map(gelu) } else { next };
        }
        outputs.copy_from_slice(&current[..outputs.len()]);
    }
}
