//! Deformation field on CPU: a tile of vertices goes through all layers while it is in cache.

use super::{
    Instructions, LayerError, Linear, check_layers,
    encoder::dot,
    simd::{TILE, Vector},
};
use crate::config::FieldConfig;

/// Outputs that one pass over a layer's inputs computes: 6 × 4 sums fill 24 of AVX-512's 32
/// registers, 6 × 2 fill 12 of AVX2's 16, and a tile's activations are read once for six outputs.
const ROWS: usize = 6;

/// D_φ (paper, section 3.2): point inputs and a latent vector to three numbers a vertex.
///
/// The latent vector is the same for all vertices of a frame, so its share of the first and of the
/// skip layer is folded into their biases once a frame: exact, and a vertex costs the same for any
/// latent length.
#[derive(Clone, Debug)]
pub struct Field {
    layers: Vec<Linear>,
    packed: Vec<Packed>,
    point_inputs: usize,
    latent: usize,
    skip: Option<usize>,
}

/// Weights of the point's and the hidden inputs, in the order that the kernel reads them:
/// blocks of [`ROWS`] outputs, within a block by input.
#[derive(Clone, Debug)]
struct Packed {
    blocks: usize,
    weights: Vec<[f32; ROWS]>,
    /// Columns of `Linear::weight` that multiply the latent vector start here, if any.
    latent_column: Option<usize>,
}

/// Biases of every layer for one frame, the latent vector folded in.
#[derive(Clone, Debug, Default)]
pub struct FieldBiases(Vec<Vec<f32>>);

/// Activations of one tile, channel by channel.
#[derive(Clone, Debug, Default)]
pub struct FieldScratch {
    front: Vec<[f32; TILE]>,
    back: Vec<[f32; TILE]>,
}

impl Field {
    /// From layers of the configured sizes. Columns of the first layer are [point, latent], of the
    /// skip layer [hidden, point, latent].
    ///
    /// # Errors
    /// A layer of another size.
    pub fn new(
        config: &FieldConfig,
        point_inputs: usize,
        latent: usize,
        layers: Vec<Linear>,
    ) -> Result<Self, LayerError> {
        let expected = layer_sizes(config, point_inputs, latent);
        check_layers("field", &layers, &expected)?;
        let packed = (layers.iter().enumerate())
            .map(|(i, layer)| {
                let has_input = i == 0 || config.skip == Some(i);
                Packed::new(layer, has_input.then(|| layer.inputs - latent))
            })
            .collect();
        Ok(Self {
            layers,
            packed,
            point_inputs,
            latent,
            skip: config.skip,
        })
    }

    /// The linear maps, in order.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// Numbers read of each vertex.
    pub fn point_inputs(&self) -> usize {
        self.point_inputs
    }

    /// Folds the latent vector of a frame into the biases.
    pub fn fold(&self, latent: &[f32], biases: &mut FieldBiases) {
        debug_assert_eq!(latent.len(), self.latent);
        let instructions = Instructions::best();
        biases.0.resize(self.layers.len(), Vec::new());
        for ((layer, packed), bias) in self.layers.iter().zip(&self.packed).zip(&mut biases.0) {
            bias.clear();
            bias.extend_from_slice(&layer.bias);
            if let Some(column) = packed.latent_column {
                for (bias, row) in bias.iter_mut().zip(layer.weight.chunks_exact(layer.inputs)) {
                    *bias += dot(instructions, &row[column..], latent);
                }
            }
            bias.resize(packed.blocks * ROWS, 0.0);
        }
    }

    /// Evaluates one tile: `inputs` holds `point_inputs` channels, `outputs` gets three.
    ///
    /// # Panics
    /// When `biases` were not folded by this field, or the number of channels is another.
    pub fn evaluate(
        &self,
        biases: &FieldBiases,
        inputs: &[[f32; TILE]],
        scratch: &mut FieldScratch,
        outputs: &mut [[f32; TILE]; 3],
    ) {
        match Instructions::best() {
            // SAFETY: detected on this machine.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx512 => unsafe { self.evaluate_avx512(biases, inputs, scratch, outputs) },
            // SAFETY: detected on this machine.
            #[cfg(target_arch = "x86_64")]
            Instructions::Avx2 => unsafe { self.evaluate_avx2(biases, inputs, scratch, outputs) },
            // SAFETY: plain arrays need no instructions.
            Instructions::Portable => unsafe {
                self.evaluate_with::<[f32; 8], 1>(biases, inputs, scratch, outputs);
            },
        }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx512f")]
    fn evaluate_avx512(
        &self,
        biases: &FieldBiases,
        inputs: &[[f32; TILE]],
        scratch: &mut FieldScratch,
        outputs: &mut [[f32; TILE]; 3],
    ) {
        // SAFETY: the caller has AVX-512F.
        unsafe { self.evaluate_with::<std::arch::x86_64::__m512, 4>(biases, inputs, scratch, outputs) }
    }

    #[cfg(target_arch = "x86_64")]
    #[target_feature(enable = "avx2,fma")]
    fn evaluate_avx2(
        &self,
        biases: &FieldBiases,
        inputs: &[[f32; TILE]],
        scratch: &mut FieldScratch,
        outputs: &mut [[f32; TILE]; 3],
    ) {
        // SAFETY: the caller has AVX2 and FMA.
        unsafe { self.evaluate_with::<std::arch::x86_64::__m256, 2>(biases, inputs, scratch, outputs) }
    }

    /// All layers over one tile with vectors `V`, `N` of them side by side.
    ///
    /// # Safety
    /// The machine has the instructions of `V`.
    #[inline(always)]
    unsafe fn evaluate_with<V: Vector, const N: usize>(
        &self,
        biases: &FieldBiases,
        inputs: &[[f32; TILE]],
        scratch: &mut FieldScratch,
        outputs: &mut [[f32; TILE]; 3],
    ) {
        const { assert!(TILE.is_multiple_of(N * V::LANES)) };
        assert_eq!(biases.0.len(), self.packed.len(), "layers of the biases");
        let FieldScratch { front, back } = scratch;
        front.clear();
        front.extend_from_slice(inputs);
        let last = self.packed.len() - 1;
        for (i, (packed, bias)) in self.packed.iter().zip(&biases.0).enumerate() {
            if self.skip == Some(i) {
                front.extend_from_slice(inputs);
            }
            back.resize(packed.blocks * ROWS, [0.0; TILE]);
            // SAFETY: the caller's promise; `floor` is the lower bound of a hidden activation.
            unsafe {
                let floor = if i < last { 0.0 } else { f32::NEG_INFINITY };
                layer_tile::<V, N>(packed, bias, front, floor, back);
            }
            back.truncate(self.layers[i].outputs);
            std::mem::swap(front, back);
        }
        outputs.copy_from_slice(&front[..3]);
    }
}

/// (inputs, outputs) of every linear map of a field.
pub(crate) fn layer_sizes(config: &FieldConfig, point_inputs: usize, latent: usize) -> Vec<(usize, usize)> {
    let input = point_inputs + latent;
    let hidden = (0..config.hidden_layers).map(|i| match i {
        0 => (input, config.width),
        i if config.skip == Some(i) => (config.width + input, config.width),
        _ => (config.width, config.width),
    });
    hidden.chain([(config.width, 3)]).collect()
}

impl Packed {
    fn new(layer: &Linear, latent_column: Option<usize>) -> Self {
        let columns = latent_column.unwrap_or(layer.inputs);
        let blocks = layer.outputs.div_ceil(ROWS);
        let weight = |row: usize, column: usize| match row < layer.outputs {
            true => layer.weight[row * layer.inputs + column],
            false => 0.0,
        };
        let block = |b: usize| (0..columns).map(move |c| std::array::from_fn(|r| weight(b * ROWS + r, c)));
        Self {
            blocks,
            weights: (0..blocks).flat_map(block).collect(),
            latent_column,
        }
    }
}

/// max(W x + b, floor) for a tile: `ROWS` outputs by `N` vectors of vertices stay in registers.
///
/// # Safety
/// The machine has the instructions of `V`.
#[inline(always)]
unsafe fn layer_tile<V: Vector, const N: usize>(
    packed: &Packed,
    bias: &[f32],
    input: &[[f32; TILE]],
    floor: f32,
    output: &mut [[f32; TILE]],
) {
    let columns = packed.weights.len() / packed.blocks;
    assert!(input.len() == columns && output.len() == packed.blocks * ROWS && bias.len() == output.len());
    let blocks = packed.weights.chunks_exact(columns).zip(bias.chunks_exact(ROWS));
    for ((weights, bias), output) in blocks.zip(output.chunks_exact_mut(ROWS)) {
        for lane in (0..TILE).step_by(N * V::LANES) {
            // SAFETY: lanes `lane..lane + N · LANES` lie within TILE, of which N · LANES is a divisor.
            unsafe {
                let mut sums: [[V; N]; ROWS] = std::array::from_fn(|r| [V::splat(bias[r]); N]);
                for (weights, x) in weights.iter().zip(input) {
                    let x: [V; N] = std::array::from_fn(|n| V::load(x.as_ptr().add(lane + n * V::LANES)));
                    for (sums, &w) in sums.iter_mut().zip(weights) {
                        let w = V::splat(w);
                        for (sum, x) in sums.iter_mut().zip(x) {
                            *sum = sum.add_product(w, x);
                        }
                    }
                }
                for (sums, out) in sums.iter().zip(output.iter_mut()) {
                    for (n, sum) in sums.iter().enumerate() {
                        sum.max(V::splat(floor))
                            .store(out.as_mut_ptr().add(lane + n * V::LANES));
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layer(inputs: usize, outputs: usize, phase: f32) -> Linear {
        let value = |i: usize| (i as f32 * 1.7 + phase).sin() / (inputs as f32).sqrt();
        Linear {
            inputs,
            outputs,
            weight: (0..inputs * outputs).map(value).collect(),
            bias: (0..outputs).map(|i| value(i + 7) * 0.3).collect(),
        }
    }

    /// The textbook form in f64, one vertex at a time, without folding.
    fn reference(field: &Field, point: &[f32], latent: &[f32]) -> Vec<f64> {
        let input: Vec<f64> = point.iter().chain(latent).map(|x| f64::from(*x)).collect();
        let mut x = input.clone();
        for (i, layer) in field.layers.iter().enumerate() {
            if field.skip == Some(i) {
                x.extend(&input);
            }
            let last = i + 1 == field.layers.len();
            x = (layer.weight.chunks(layer.inputs).zip(&layer.bias))
                .map(|(row, b)| {
                    f64::from(*b) + row.iter().zip(&x).map(|(w, x)| f64::from(*w) * x).sum::<f64>()
                })
                .map(|y| if last { y } else { y.max(0.0) })
                .collect();
        }
        x
    }

    #[test]
    fn every_instruction_set_agrees_with_the_textbook() {
        for (width, hidden_layers, skip, points, latent) in [
            (256, 8, Some(5), 3, 128),
            (37, 3, None, 15, 5),
            (6, 2, Some(1), 1, 1),
            (8, 1, None, 4, 2),
        ] {
            let config = FieldConfig {
                width,
                hidden_layers,
                skip,
            };
            let sizes = layer_sizes(&config, points, latent);
            let layers = (sizes.iter().enumerate()).map(|(i, &(a, b))| layer(a, b, i as f32));
            let field = Field::new(&config, points, latent, layers.collect()).unwrap();
            let z: Vec<f32> = (0..latent).map(|i| (i as f32).cos()).collect();
            let inputs: Vec<[f32; TILE]> = (0..points)
                .map(|c| std::array::from_fn(|l| ((c * 31 + l) as f32 * 0.7).sin()))
                .collect();
            let mut biases = FieldBiases::default();
            field.fold(&z, &mut biases);
            for set in Instructions::available() {
                let (mut scratch, mut out) = (FieldScratch::default(), [[0.0; TILE]; 3]);
                // SAFETY: only sets that this machine has.
                unsafe {
                    match set {
                        #[cfg(target_arch = "x86_64")]
                        Instructions::Avx512 => {
                            field.evaluate_avx512(&biases, &inputs, &mut scratch, &mut out)
                        }
                        #[cfg(target_arch = "x86_64")]
                        Instructions::Avx2 => field.evaluate_avx2(&biases, &inputs, &mut scratch, &mut out),
                        Instructions::Portable => {
                            field.evaluate_with::<[f32; 8], 1>(&biases, &inputs, &mut scratch, &mut out);
                        }
                    }
                }
                for lane in [0, 1, 17, TILE - 1] {
                    let point: Vec<f32> = inputs.iter().map(|c| c[lane]).collect();
                    for (k, expected) in reference(&field, &point, &z).iter().enumerate() {
                        assert!((f64::from(out[k][lane]) - expected).abs() < 1e-4, "{set:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn layers_of_other_sizes_are_refused() {
        let config = FieldConfig {
            width: 4,
            hidden_layers: 1,
            skip: None,
        };
        let error = Field::new(&config, 3, 2, vec![layer(5, 4, 0.0), layer(4, 2, 0.0)]).unwrap_err();
        assert_eq!(
            (error.layer.as_str(), error.expected_outputs, error.outputs),
            ("field.1", 3, 2)
        );
    }
}
