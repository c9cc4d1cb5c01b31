//! What hidden layers end in, chosen once a layer.

pub mod gelu;
pub mod relu;
pub mod tanh;

use crate::blob::Activation;
use gelu::gelu_in_place;
use relu::relu;
use tanh::tanh;

impl Activation {
    /// The function of every number. NaN stays NaN.
    #[inline]
    pub(crate) fn in_place(self, x: &mut [f32]) {
        match self {
            Self::Gelu => gelu_in_place(x),
            Self::Relu => each(x, relu),
            Self::Tanh => each(x, tanh),
            Self::Identity => {}
        }
    }
}

#[inline]
fn each(x: &mut [f32], function: impl Fn(f32) -> f32) {
    for x in x {
        *x = function(*x);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kernel::activation::gelu::gelu;

    #[test]
    fn every_number_is_mapped_and_nan_stays() {
        let x = [-7.0, -0.4, 0.0, 0.3, 6.0, f32::INFINITY];
        type Function = fn(f32) -> f32;
        let functions: [(Activation, Function); 4] = [
            (Activation::Gelu, gelu),
            (Activation::Relu, |x| x.max(0.0)),
            (Activation::Tanh, tanh),
            (Activation::Identity, |x| x),
        ];
        for (activation, function) in functions {
            let mut got = x;
            activation.in_place(&mut got);
            assert_eq!(got, x.map(function), "{activation}");
            let mut nan = [f32::NAN];
            activation.in_place(&mut nan);
            assert!(nan[0].is_nan(), "{activation}");
        }
    }
}
