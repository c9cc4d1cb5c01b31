//! Layers over a blob plus a caller-owned scratch: one forward pass, or four Monte Carlo passes.

pub mod layer;
pub mod moments;
pub mod monte_carlo;
pub mod repeats;
mod unit_moments;

use crate::blob::field::{LAYERS_MAX, WIDTH_MAX};
use crate::blob::{Activation, NetworkView};
use crate::gaussian::standard_normals;
use crate::kernel::activation::gelu::gelus;
use crate::kernel::{Adjoint, Packed, Second, Vector, sqrt, square_roots};
use crate::part::Part;

use rand_core::Rng;

/// Monte Carlo passes that run together and share each unpacked weight.
pub const LANES: usize = 4;

/// Working memory of a network, 7 KB; contents are meaningless between calls.
#[derive(Debug)]
pub struct Scratch {
    activations: [[f32; LANES]; WIDTH_MAX],
    /// For a pass with every weight at its mean.
    vector: Vector,
    drawing: [Drawing; Part::Passes.count()],
    noise: [Noise; Part::Moments.count()],
    /// One number for each unit of every layer but one. Of passes those after the first layer: variances of
    /// the pre-activations, summed over the exact passes since the network was prepared, or frozen standard
    /// deviations. Of moments what [`moments::outputs`] keeps of the hidden layers.
    units: [[f32; WIDTH_MAX]; UNITS],
}

/// Working memory of passes.
#[derive(Debug)]
struct Drawing {
    packed: Packed<LANES>,
    /// Mean and standard deviation of the first layer's pre-activations: the same in every pass.
    first: [(f32, f32); WIDTH_MAX],
}

/// Working memory of moments.
#[derive(Debug)]
struct Noise {
    second: Second,
    adjoint: Adjoint,
}

/// Layers of [`Scratch::units`].
const UNITS: usize = if Part::Passes.is_built() || Part::Moments.is_built() {
    LAYERS_MAX - 1
} else {
    0
};

impl Scratch {
    /// Fresh scratch.
    pub const fn new() -> Self {
        Self {
            activations: [[0.0; LANES]; WIDTH_MAX],
            vector: Vector::new(),
            drawing: [const {
                Drawing {
                    packed: Packed::new(),
                    first: [(0.0, 0.0); WIDTH_MAX],
                }
            }; Part::Passes.count()],
            noise: [const {
                Noise {
                    second: Second::new(),
                    adjoint: Adjoint::new(),
                }
            }; Part::Moments.count()],
            units: [[0.0; WIDTH_MAX]; UNITS],
        }
    }
}

impl Default for Scratch {
    fn default() -> Self {
        Self::new()
    }
}

/// A network of Bayesian dense layers with its activation between them.
#[derive(Clone, Copy, Debug)]
pub struct Network<'a> {
    view: NetworkView<'a>,
}

impl<'a> Network<'a> {
    /// The network that `view` describes.
    pub fn new(view: NetworkView<'a>) -> Self {
        Self { view }
    }

    /// What its hidden layers end in: nothing but GELU in a build for recursive models alone, whose blobs have no
    /// other.
    #[inline]
    fn activation(&self) -> Activation {
        if Part::Memoryless.is_built() {
            self.view.activation()
        } else {
            Activation::Gelu
        }
    }

    /// Number of inputs.
    pub fn inputs(&self) -> usize {
        self.view.layer(0).inputs
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.view
            .layer(self.view.layers().saturating_sub(1))
            .outputs
    }

    /// Every weight at its mean. `inputs` are normalised; `outputs` are not yet scaled back.
    pub fn mean_pass(&self, inputs: &[f32], outputs: &mut [f32]) {
        self.means(&mut Vector::new(), &mut [0.0; WIDTH_MAX], inputs, outputs);
    }

    /// [`Network::mean_pass`] in a scratch: without it the stack holds 650 bytes more.
    pub fn mean_pass_in(&self, scratch: &mut Scratch, inputs: &[f32], outputs: &mut [f32]) {
        let activations = scratch.activations.as_flattened_mut();
        self.means(&mut scratch.vector, activations, inputs, outputs);
    }

    /// A mean pass; there is an activation for every input of any layer.
    // Once in flash.
    #[inline(never)]
    fn means(
        &self,
        vector: &mut Vector,
        activations: &mut [f32],
        inputs: &[f32],
        outputs: &mut [f32],
    ) {
        for (slot, &x) in activations.iter_mut().zip(inputs) {
            *slot = x;
        }
        let last = self.view.layers().saturating_sub(1);
        for index in 0..=last {
            let layer = self.view.layer(index);
            vector.pack(&activations[..layer.inputs.min(WIDTH_MAX)]);
            if index < last {
                layer::means(&layer, vector, activations);
                let activation = self.activation();
                activation.in_place(&mut activations[..layer.outputs.min(WIDTH_MAX)]);
            } else {
                layer::means(&layer, vector, outputs);
            }
        }
    }

    /// Computes the moments of the first layer for `inputs` (normalised), which every following
    /// [`Network::sampled_passes`] starts from.
    pub fn prepare(&self, inputs: &[f32], scratch: &mut Scratch) {
        let Some(Drawing { first: slots, .. }) = scratch.drawing.first_mut() else {
            return;
        };
        let mut packed = Packed::<1>::new();
        // A vector in place of lanes, which nothing is in yet.
        let (activations, _) = scratch.activations.as_flattened_mut().as_chunks_mut();
        for (slot, &x) in activations.iter_mut().zip(inputs) {
            *slot = [x];
        }
        let first = self.view.layer(0);
        packed.pack(&activations[..first.inputs.min(WIDTH_MAX)]);
        layer::moments(&first, &packed, slots, |slot, [mean], [variance]| {
            *slot = (mean, sqrt(variance));
        });
        for spread in scratch.units.as_flattened_mut() {
            *spread = 0.0;
        }
    }

    /// [`LANES`] Monte Carlo passes for the inputs last given to [`Network::prepare`], by local
    /// reparameterisation. Returns the outputs, `[output][pass]`, not yet scaled back; what follows
    /// them has no meaning.
    // Once in flash for all numbers of outputs.
    #[inline(never)]
    pub fn sampled_passes<'s>(
        &self,
        scratch: &'s mut Scratch,
        rng: &mut impl Rng,
    ) -> &'s [[f32; LANES]; WIDTH_MAX] {
        let Scratch {
            activations,
            drawing,
            units: spread,
            ..
        } = scratch;
        let Some(Drawing { packed, first }) = drawing.first_mut() else {
            return activations;
        };
        let last = self.first_layer(activations, first, rng);
        for (index, spread) in (1..=last).zip(spread) {
            let layer = self.view.layer(index);
            let gelu_at_once = self.gelu_follows(index, last);
            packed.pack(&activations[..layer.inputs.min(WIDTH_MAX)]);
            let slots = activations.iter_mut().zip(spread);
            layer::moments(&layer, packed, slots, |(slot, sum), mean, variance| {
                let [a, b, c, d] = variance;
                *sum += (a + b) + (c + d);
                let sigma = square_roots(variance);
                let normals: [f32; LANES] = standard_normals(rng);
                let drawn = core::array::from_fn(|lane| mean[lane] + sigma[lane] * normals[lane]);
                *slot = if gelu_at_once { gelus(drawn) } else { drawn };
            });
            self.activate_others(index, last, layer.outputs, activations);
        }
        activations
    }

    /// Freezes the standard deviations of the pre-activations at those over the passes, `blocks` times
    /// [`LANES`], that [`Network::sampled_passes`] has run since [`Network::prepare`].
    pub fn freeze(&self, blocks: u16, scratch: &mut Scratch) {
        let per_pass = 1.0 / (LANES as f32 * f32::from(blocks));
        let after_first = self.view.layers().saturating_sub(1);
        let spreads = scratch.units.iter_mut().take(after_first);
        for spread in spreads.flatten() {
            *spread = sqrt(*spread * per_pass);
        }
    }

    /// As [`Network::sampled_passes`], with the standard deviations that [`Network::freeze`] left: half the
    /// work.
    #[inline(never)]
    pub fn frozen_passes<'s>(
        &self,
        scratch: &'s mut Scratch,
        rng: &mut impl Rng,
    ) -> &'s [[f32; LANES]; WIDTH_MAX] {
        let Scratch {
            activations,
            drawing,
            units: spread,
            ..
        } = scratch;
        let Some(Drawing { packed, first }) = drawing.first_mut() else {
            return activations;
        };
        let last = self.first_layer(activations, first, rng);
        for (index, sigmas) in (1..=last).zip(spread) {
            let layer = self.view.layer(index);
            let gelu_at_once = self.gelu_follows(index, last);
            packed.pack_values(&activations[..layer.inputs.min(WIDTH_MAX)]);
            let slots = activations.iter_mut().zip(sigmas);
            layer::pass_means(&layer, packed, slots, |(slot, sigma), mean| {
                let normals: [f32; LANES] = standard_normals(rng);
                let drawn = core::array::from_fn(|lane| mean[lane] + *sigma * normals[lane]);
                *slot = if gelu_at_once { gelus(drawn) } else { drawn };
            });
            self.activate_others(index, last, layer.outputs, activations);
        }
        activations
    }

    /// Whether layer `index` of those to `last` ends in GELU, which costs least while the numbers are still in
    /// registers.
    #[inline]
    fn gelu_follows(&self, index: usize, last: usize) -> bool {
        index < last && self.activation() == Activation::Gelu
    }

    /// What layer `index` of those to `last` ends in, unless it was done by [`Network::gelu_follows`].
    // Once in flash, and off the stack of the passes.
    #[inline(never)]
    fn activate_others(
        &self,
        index: usize,
        last: usize,
        outputs: usize,
        activations: &mut [[f32; LANES]; WIDTH_MAX],
    ) {
        let activation = self.activation();
        if index < last && activation != Activation::Gelu {
            activation.in_place(activations[..outputs.min(WIDTH_MAX)].as_flattened_mut());
        }
    }

    /// Draws what follows the first layer; the index of the last.
    #[inline]
    fn first_layer(
        &self,
        activations: &mut [[f32; LANES]; WIDTH_MAX],
        first: &[(f32, f32); WIDTH_MAX],
        rng: &mut impl Rng,
    ) -> usize {
        let last = self.view.layers().saturating_sub(1);
        let outputs = self.view.layer(0).outputs;
        let gelu_at_once = self.gelu_follows(0, last);
        for (slot, &(mean, sigma)) in activations.iter_mut().zip(first).take(outputs) {
            let drawn = standard_normals(rng).map(|normal| mean + sigma * normal);
            *slot = if gelu_at_once { gelus(drawn) } else { drawn };
        }
        self.activate_others(0, last, outputs, activations);
        last
    }

    /// One pass with every weight drawn, for verification: slow, f32 throughout.
    pub fn weight_sampled_pass(&self, inputs: &[f32], rng: &mut impl Rng, outputs: &mut [f32]) {
        let mut current = [0.0_f32; WIDTH_MAX];
        for (slot, &x) in current.iter_mut().zip(inputs) {
            *slot = x;
        }
        let last = self.view.layers().saturating_sub(1);
        for index in 0..=last {
            let layer = self.view.layer(index);
            let mut next = [0.0_f32; WIDTH_MAX];
            layer::sample_weights(&layer, &current, rng, &mut next);
            if index < last {
                self.activation().in_place(&mut next);
            }
            current = next;
        }
        for (output, x) in outputs.iter_mut().zip(current) {
            *output = x;
        }
    }
}

#[cfg(test)]
mod tests;
