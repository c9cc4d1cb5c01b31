//! Standard-normal samples by the Ziggurat method (Marsaglia and Tsang 2000, 128 layers).
//!
//! One 32-bit draw serves 98.8 % of the samples. The layer index and the abscissa use different
//! bits of it, which removes the correlation that Doornik (2005) found in the original.

use rand_core::Rng;

use crate::series;

const LAYERS: usize = 128;
/// Start of the tail.
const TAIL_START: f64 = 3.442_619_855_899;
/// Area of every layer.
const LAYER_AREA: f64 = 9.912_563_035_262_17e-3;
/// The abscissa is a signed 24-bit number.
const ABSCISSA_SCALE: f64 = 8_388_608.0;

struct Tables {
    /// Below this magnitude the abscissa lies inside the layer; both in the upper 24 bits.
    inside: [u32; LAYERS],
    /// 24-bit abscissa to sample.
    width: [f32; LAYERS],
    /// Density (without its constant) at the outer edge of the layer; one more for the top.
    density: [f32; LAYERS + 1],
}

const fn density(x: f64) -> f64 {
    series::exp(-0.5 * x * x)
}

const fn tables() -> Tables {
    let mut edge = [0.0; LAYERS + 1];
    // The bottom layer is a rectangle of the common area whose overhang stands for the tail.
    edge[0] = LAYER_AREA / density(TAIL_START);
    edge[1] = TAIL_START;
    let mut i = 2;
    while i < LAYERS {
        edge[i] = series::sqrt(-2.0 * series::ln(LAYER_AREA / edge[i - 1] + density(edge[i - 1])));
        i += 1;
    }
    let mut tables = Tables {
        inside: [0; LAYERS],
        width: [0.0; LAYERS],
        density: [0.0; LAYERS + 1],
    };
    let mut i = 0;
    while i < LAYERS {
        tables.inside[i] = ((edge[i + 1] / edge[i] * ABSCISSA_SCALE) as u32) << 8;
        tables.width[i] = (edge[i] / ABSCISSA_SCALE) as f32;
        tables.density[i] = density(edge[i]) as f32;
        i += 1;
    }
    tables.density[LAYERS] = 1.0;
    tables
}

static TABLES: Tables = tables();

/// One sample of the standard normal distribution.
#[inline]
pub fn standard_normal(rng: &mut impl Rng) -> f32 {
    let [x] = standard_normals(rng);
    x
}

/// `N` independent samples of the standard normal distribution.
///
/// Their words are drawn one after the other, which keeps the generator in registers; what one of
/// them needs beyond is drawn after all of them.
#[inline]
pub fn standard_normals<const N: usize>(rng: &mut impl Rng) -> [f32; N] {
    let words: [u32; N] = core::array::from_fn(|_| rng.next_u32());
    words.map(|bits| {
        let (layer, x, inside) = candidate(bits);
        if inside {
            x
        } else {
            outside_the_layer(rng, layer, x)
        }
    })
}

/// The layer that `bits` name, the sample, and whether it certainly lies under the density.
#[inline]
fn candidate(bits: u32) -> (usize, f32, bool) {
    let layer = (bits & 127) as usize;
    let signed = bits as i32;
    let x = (signed >> 8) as f32 * TABLES.width[layer];
    // The magnitude, or one less for a negative number.
    let magnitude = (signed ^ (signed >> 31)) as u32;
    (layer, x, magnitude < TABLES.inside[layer])
}

#[cold]
#[inline(never)]
fn outside_the_layer(rng: &mut impl Rng, mut layer: usize, mut x: f32) -> f32 {
    loop {
        if layer == 0 {
            return tail(rng, x < 0.0);
        }
        let (outer, inner) = (TABLES.density[layer], TABLES.density[layer + 1]);
        if outer + (inner - outer) * uniform(rng) < libm::expf(-0.5 * x * x) {
            return x;
        }
        let inside;
        (layer, x, inside) = candidate(rng.next_u32());
        if inside {
            return x;
        }
    }
}

/// Marsaglia's exact method for the tail beyond `TAIL_START`.
fn tail(rng: &mut impl Rng, negative: bool) -> f32 {
    let start = TAIL_START as f32;
    loop {
        let x = -libm::logf(uniform(rng)) / start;
        let y = -libm::logf(uniform(rng));
        if y + y > x * x {
            return if negative { -(start + x) } else { start + x };
        }
    }
}

/// Uniform in (0, 1): never zero, so that its logarithm is finite.
fn uniform(rng: &mut impl Rng) -> f32 {
    ((rng.next_u32() >> 8) as f32 + 0.5) / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::seeded;

    const DRAWS: usize = 2_000_000;

    /// Gives the words it was given, in order, and no more than those.
    struct Script<'a>(core::slice::Iter<'a, u32>);

    impl<'a> Script<'a> {
        fn new(words: &'a [u32]) -> Self {
            Self(words.iter())
        }
    }

    impl rand_core::TryRng for Script<'_> {
        type Error = core::convert::Infallible;

        fn try_next_u32(&mut self) -> Result<u32, Self::Error> {
            Ok(*self.0.next().expect("no more words are drawn"))
        }

        fn try_next_u64(&mut self) -> Result<u64, Self::Error> {
            unreachable!("only words are drawn")
        }

        fn try_fill_bytes(&mut self, _: &mut [u8]) -> Result<(), Self::Error> {
            unreachable!("only words are drawn")
        }
    }

    /// The word that [`uniform`] turns into `u`.
    fn word_of(u: f64) -> u32 {
        ((u * 16_777_216.0) as u32) << 8
    }

    fn f(x: f64) -> f64 {
        libm::exp(-0.5 * x * x)
    }

    /// Outer edges of the layers, from the outside in, by their definition: layers of one area
    /// under the density, the last of which ends at the top. In f64 with the library's functions.
    fn edges() -> [f64; LAYERS + 1] {
        let mut edge = [0.0; LAYERS + 1];
        edge[0] = LAYER_AREA / f(TAIL_START);
        edge[1] = TAIL_START;
        for i in 2..LAYERS {
            let height = f(edge[i - 1]) + LAYER_AREA / edge[i - 1];
            edge[i] = libm::sqrt(-2.0 * libm::log(height));
        }
        edge
    }

    #[test]
    fn the_layers_have_one_area() {
        let edge = edges();
        // The bottom: a rectangle up to the start of the tail, and the tail.
        let half = libm::sqrt(core::f64::consts::FRAC_PI_2);
        let tail = half * libm::erfc(TAIL_START / core::f64::consts::SQRT_2);
        assert!((TAIL_START * f(TAIL_START) + tail - LAYER_AREA).abs() < 1e-12);
        // The top closes at a density of 1.
        let last = edge[LAYERS - 1];
        assert!((last * (1.0 - f(last)) - LAYER_AREA).abs() < 1e-9);
        for i in 0..LAYERS {
            let width = edge[i] / ABSCISSA_SCALE;
            assert!((f64::from(TABLES.width[i]) / width - 1.0).abs() < 1e-7);
            assert!((f64::from(TABLES.density[i]) - f(edge[i])).abs() < 1e-7);
            // Abscissas below the edge of the layer above are inside, in units of 1/2^23.
            let inside = edge[i + 1] / edge[i] * ABSCISSA_SCALE;
            let steps = TABLES.inside[i] >> 8;
            assert!((f64::from(steps) + 0.5 - inside).abs() < 0.6, "{i}");
            assert_eq!(TABLES.inside[i] & 0xFF, 0);
        }
        assert_eq!(TABLES.density[LAYERS], 1.0);
    }

    /// Layer, sample and place of random words against their definition in f64.
    #[test]
    fn a_word_names_its_layer_and_its_place() {
        let (edge, mut rng) = (edges(), seeded(21));
        for _ in 0..100_000 {
            let word = rng.next_u32();
            let (layer, x, inside) = candidate(word);
            assert_eq!(layer, (word % 128) as usize);
            let abscissa = f64::from((word as i32) >> 8);
            let expected = abscissa * edge[layer] / ABSCISSA_SCALE;
            assert!((f64::from(x) - expected).abs() <= 1e-6 * expected.abs());
            // One step of the abscissa either way.
            let step = 1.5 * edge[layer] / ABSCISSA_SCALE;
            let beyond = expected.abs() - edge[layer + 1];
            assert!(if inside {
                beyond < step
            } else {
                beyond > -step
            });
        }
        // The first abscissa that is not inside.
        assert!(candidate(TABLES.inside[0] - 128).2);
        assert!(!candidate(TABLES.inside[0]).2);
        assert!(!candidate(u32::MAX).2);
    }

    #[test]
    fn a_uniform_word_is_the_middle_of_its_step() {
        for (word, numerator) in [(0, 0.5), (255, 0.5), (256, 1.5), (1 << 31, 8_388_608.5)] {
            let expected = numerator / 16_777_216.0;
            let got = f64::from(uniform(&mut Script::new(&[word])));
            assert!((got / expected - 1.0).abs() < 1e-7, "{word}: {got}");
        }
        assert!(uniform(&mut Script::new(&[u32::MAX])) <= 1.0);
    }

    /// Beside a layer's inside a sample is kept if a uniform height between the layer's two
    /// densities lies under the density, else another word is a candidate.
    #[test]
    fn a_wedge_is_kept_under_the_density() {
        let (edge, mut rng) = (edges(), seeded(22));
        let mut kept = [0; 2];
        for layer in 1..LAYERS {
            for _ in 0..20 {
                let part = f64::from(uniform(&mut rng));
                let x = edge[layer + 1] + part * (edge[layer] - edge[layer + 1]);
                let x = if rng.next_u32() & 1 == 0 { x } else { -x };
                let u = f64::from(uniform(&mut rng));
                let height = f(edge[layer]) + (f(edge[layer + 1]) - f(edge[layer])) * u;
                // In f32 both sides are off by some 1e-7.
                if (height - f(x)).abs() < 1e-6 {
                    continue;
                }
                // A word of layer 5 close to zero, certainly inside.
                let next = 0x0100_0000 | 5;
                let got = outside_the_layer(&mut Script::new(&[word_of(u), next]), layer, x as f32);
                let under = height < f(x);
                let expected = if under { x as f32 } else { candidate(next).1 };
                assert_eq!(got, expected, "layer {layer}, {x}, {u}");
                kept[usize::from(under)] += 1;
            }
        }
        assert!(kept[0] > 500 && kept[1] > 500, "{kept:?}");
    }

    #[test]
    fn a_rejected_sample_is_followed_by_a_whole_new_one() {
        let edge = edges();
        // Rejected at its outer edge under the upper density; the next word is a wedge again and is
        // kept under the lower density.
        let outer = (edge[3] * 0.999) as f32;
        let beside = (TABLES.inside[7] + (1 << 16)) & !127 | 7;
        let (layer, x, inside) = candidate(beside);
        assert!(layer == 7 && !inside);
        let words = [word_of(0.999), beside, word_of(1e-4)];
        assert_eq!(outside_the_layer(&mut Script::new(&words), 3, outer), x);
    }

    /// The tail as Marsaglia defines it, both signs, with a first pair that is refused.
    #[test]
    fn the_tail_follows_marsaglias_method() {
        let pair = |u: f64, v: f64| {
            let (x, y) = (-libm::log(u) / TAIL_START, -libm::log(v));
            (x, 2.0 * y > x * x)
        };
        let refused = (0.001, 0.9);
        assert!(!pair(refused.0, refused.1).1);
        let mut rng = seeded(23);
        let mut both = [0; 2];
        for _ in 0..200 {
            let (u, v) = (f64::from(uniform(&mut rng)), f64::from(uniform(&mut rng)));
            let (u, v) = (u.max(1e-5), 0.5 + 0.5 * v.min(0.999));
            let (x, kept) = pair(u, v);
            both[usize::from(kept)] += 1;
            let second = (0.3, 0.2);
            let words = [refused.0, refused.1, u, v, second.0, second.1].map(word_of);
            let expected = TAIL_START + if kept { x } else { pair(second.0, second.1).0 };
            for (negative, sign) in [(false, 1.0), (true, -1.0)] {
                let got = f64::from(tail(&mut Script::new(&words), negative));
                assert!((got - sign * expected).abs() < 1e-4, "{u} {v}: {got}");
            }
        }
        assert!(both[0] > 5 && both[1] > 50, "{both:?}");
    }

    #[test]
    fn the_bottom_layer_continues_in_its_own_tail() {
        let words = [0.3, 0.2].map(word_of);
        for side in [1.0, -1.0] {
            let got = outside_the_layer(&mut Script::new(&words), 0, side * 3.6);
            assert_eq!(got, tail(&mut Script::new(&words), side < 0.0));
            assert!(got * side > TAIL_START as f32);
        }
    }

    /// The words of all samples come first, what one of them needs beyond comes after them.
    #[test]
    fn several_samples_draw_their_words_first() {
        let inside = [0x0100_0005, 0xFF00_0009, 0x0200_0001].map(|word| (word, candidate(word).1));
        let edge = TABLES.inside[0];
        let words = [inside[0].0, edge, inside[1].0, inside[2].0];
        let beyond = [0.3, 0.2].map(word_of);
        let got: [f32; 4] = standard_normals(&mut Script::new(&[&words[..], &beyond].concat()));
        let tail = tail(&mut Script::new(&beyond), false);
        assert_eq!(got, [inside[0].1, tail, inside[1].1, inside[2].1]);
        let one = standard_normal(&mut Script::new(&[inside[2].0]));
        assert_eq!(one, inside[2].1);
    }

    #[test]
    fn moments_lie_within_five_standard_errors() {
        let mut rng = seeded(3);
        let mut sums = [0.0_f64; 4];
        for _ in 0..DRAWS {
            let x = f64::from(standard_normal(&mut rng));
            for (power, sum) in sums.iter_mut().enumerate() {
                *sum += libm::pow(x, (power + 1) as f64);
            }
        }
        // Variances of x, x^2, x^3, x^4 under N(0, 1) are 1, 2, 15, 96.
        for ((sum, mean), variance) in sums
            .into_iter()
            .zip([0.0, 1.0, 0.0, 3.0])
            .zip([1.0, 2.0, 15.0, 96.0])
        {
            let error = sum / DRAWS as f64 - mean;
            assert!(
                error.abs() < 5.0 * libm::sqrt(variance / DRAWS as f64),
                "{error}"
            );
        }
    }

    /// Chi-square over 64 bins and both tails: a wrong layer or edge shows here, not in moments.
    #[test]
    fn histogram_follows_the_density() {
        const BINS: usize = 66;
        let mut rng = seeded(9);
        let mut counts = [0_u32; BINS];
        for _ in 0..DRAWS {
            let x = standard_normal(&mut rng);
            let bin = libm::floorf((x + 4.0) * 8.0) as i32 + 1;
            counts[bin.clamp(0, BINS as i32 - 1) as usize] += 1;
        }
        let cdf = |bin: usize| match bin {
            0 => 0.0,
            BINS => 1.0,
            bin => 0.5 * libm::erfc(-((bin - 1) as f64 / 8.0 - 4.0) / core::f64::consts::SQRT_2),
        };
        let chi_square: f64 = (0..BINS)
            .map(|bin| {
                let expected = (cdf(bin + 1) - cdf(bin)) * DRAWS as f64;
                (f64::from(counts[bin]) - expected).powi(2) / expected
            })
            .sum();
        // 65 degrees of freedom: mean 65, sd 11.4; 110 is exceeded by chance once in 2,500 seeds.
        assert!(chi_square < 110.0, "{chi_square}");
    }
}
