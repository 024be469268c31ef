//! Deformation field on the CPU.
//!
//! A tile of vertices passes through all layers while its activations are in cache.

#[cfg(target_arch = "aarch64")]
use super::words::neon::{Neon, NeonDot, NeonUnfused};
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::words::simd128::Simd128;
use super::{
    LayerError, LayerSize, Linear, Precision,
    arithmetic::{Bf16, F32, Int8, Int16},
    check_layers,
    dot::dot,
    kernel::{Kernel, Registers},
    packed::{Columns, PackedLayer},
    tile::{self, FieldScratch, TILE},
    words::Plain,
};
#[cfg(target_arch = "x86_64")]
use super::{
    amx::MatrixUnits,
    words::x86::{Ymm, YmmUnfused, Zmm, ZmmUnfused},
};
use crate::{config::FieldConfig, simd::Instructions};

/// Deformation field D_φ (paper, section 3.2): maps the inputs of a vertex and a latent vector to
/// three numbers.
///
/// All vertices of a frame share the latent vector. Its products with the weights of the first
/// layer and of the skip layer are added to their biases once a frame ([`Field::fold`]). This is
/// exact, and the time of a vertex does not depend on the length of the latent vector.
///
/// Channels that are zero at all vertices of a tile are left out, which changes no bit of the
/// result. Tiles of neighbouring vertices, such as most meshes have in their order, are the
/// fastest.
#[derive(Clone, Debug)]
pub struct Field {
    layers: Vec<Linear>,
    packed: Vec<PackedLayer>,
    kernel: KernelChoice,
    config: FieldConfig,
    point_inputs: usize,
    latent_len: usize,
    /// True if the last layer is zero.
    is_zero: bool,
}

/// Biases of every layer for one frame, with the latent vector folded in.
#[derive(Clone, Debug, Default)]
pub struct FieldBiases(Vec<Vec<f32>>);

/// Kernel that a field is packed for.
#[derive(Clone, Copy, Debug)]
struct KernelChoice {
    precision: Precision,
    /// Available on this machine for the precision; kernels rely on it.
    instructions: Instructions,
}

impl Field {
    /// Makes a field from layers of the configured sizes, in [`Precision::F32`].
    ///
    /// Columns of the first layer's weights are [point, latent], those of the skip layer
    /// [hidden, point, latent].
    ///
    /// # Errors
    /// A layer of another size.
    pub fn new(
        config: &FieldConfig,
        point_inputs: usize,
        latent_len: usize,
        layers: Vec<Linear>,
    ) -> Result<Self, LayerError> {
        let expected = layer_sizes(config, point_inputs, latent_len);
        check_layers("field", &layers, &expected)?;
        let head = layers.last();
        let mut field = Self {
            is_zero: head.is_some_and(|l| l.weight.iter().chain(&l.bias).all(|x| *x == 0.0)),
            layers,
            packed: Vec::new(),
            kernel: KernelChoice {
                precision: Precision::F32,
                instructions: Instructions::best(),
            },
            config: *config,
            point_inputs,
            latent_len,
        };
        field.pack();
        Ok(field)
    }

    /// Returns the same field in another precision, packed for this machine.
    pub fn with_precision(self, precision: Precision) -> Self {
        self.with_kernel(precision, precision.best_instructions())
    }

    /// Returns the same field in another precision, packed for an instruction set of choice; for
    /// measurements.
    ///
    /// # Panics
    /// When this machine does not have the instruction set for the precision.
    #[doc(hidden)]
    pub fn with_kernel(mut self, precision: Precision, instructions: Instructions) -> Self {
        let available = precision.instructions().any(|set| set == instructions);
        assert!(available, "{instructions:?} for {precision:?} on this machine");
        self.kernel = KernelChoice {
            precision,
            instructions,
        };
        self.pack();
        self
    }

    /// Linear maps in order, in f32.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// Returns true if the output is zero whatever the inputs are.
    pub fn is_zero(&self) -> bool {
        self.is_zero
    }

    /// Number format of the products.
    pub fn precision(&self) -> Precision {
        self.kernel.precision
    }

    /// Instruction set that the field is packed for.
    pub fn instructions(&self) -> Instructions {
        self.kernel.instructions
    }

    /// Number of inputs of a vertex, without the latent vector.
    pub fn point_inputs(&self) -> usize {
        self.point_inputs
    }

    /// Writes the biases of a frame: those of the layers plus the products with the latent vector.
    pub fn fold(&self, latent: &[f32], biases: &mut FieldBiases) {
        debug_assert_eq!(latent.len(), self.latent_len);
        let instructions = Instructions::best();
        biases.0.resize(self.layers.len(), Vec::new());
        for ((layer, packed), bias) in self.layers.iter().zip(&self.packed).zip(&mut biases.0) {
            bias.clear();
            bias.extend_from_slice(&layer.bias);
            if let Some(column) = packed.latent {
                for (bias, row) in bias.iter_mut().zip(layer.weight.chunks_exact(layer.inputs)) {
                    *bias += dot(instructions, &row[column..], latent);
                }
            }
            // Padding rows have zero activations.
            bias.resize(packed.rows, 0.0);
        }
    }

    /// Evaluates one tile of vertices; `inputs` holds [`point_inputs`](Self::point_inputs)
    /// channels.
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
        assert_eq!(inputs.len(), self.point_inputs, "inputs of a vertex");
        let fits = biases.0.len() == self.packed.len()
            && (biases.0.iter().zip(&self.packed)).all(|(b, p)| b.len() == p.rows);
        assert!(fits, "biases of another field");
        self.dispatch(Tile {
            biases: &biases.0,
            inputs,
            scratch,
            outputs,
        });
    }
}

/// Inputs, outputs and scratch memory of one evaluation.
struct Tile<'a> {
    biases: &'a [Vec<f32>],
    inputs: &'a [[f32; TILE]],
    scratch: &'a mut FieldScratch,
    outputs: &'a mut [[f32; TILE]; 3],
}

/// Runs code with the kernel of a [`KernelChoice`] as a type, the vertices that it takes at a time
/// as a constant, and the function that is compiled for its instruction set.
///
/// Integer precisions have an unfused last layer in f32, so that their results are the same bits on
/// every instruction set.
macro_rules! for_kernel {
    ($kernel:expr, |$k:ident, $w:ident, $run:ident| $body:expr) => {{
        use Instructions as I;
        use Precision as P;
        macro_rules! body {
            ($type:ty, $width:expr, $function:ident) => {{
                type $k = $type;
                const $w: usize = $width;
                #[allow(unused_imports, reason = "packing runs nothing")]
                use $function as $run;
                $body
            }};
        }
        match ($kernel.precision, $kernel.instructions) {
            #[cfg(target_arch = "x86_64")]
            (P::F32, I::Amx | I::Avx512) => body!(Registers<Zmm<F32>, Zmm<F32>, 8, 2>, HALF_TILE, avx512),
            #[cfg(target_arch = "x86_64")]
            (P::F32, I::Avx2) => body!(Registers<Ymm<F32>, Ymm<F32>, 4, 2>, HALF_TILE, avx2),
            #[cfg(target_arch = "aarch64")]
            (P::F32, I::NeonDot | I::Neon) => body!(Registers<Neon<F32>, Neon<F32>, 4, 4>, HALF_TILE, neon),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            (P::F32, I::Simd128) => body!(Registers<Simd128<F32>, Simd128<F32>, 4, 2>, HALF_TILE, portable),
            (P::F32, I::Portable) => body!(Registers<Plain<F32>, Plain<F32>, 4, 1>, HALF_TILE, portable),
            #[cfg(target_arch = "x86_64")]
            (P::Bf16, I::Amx) => body!(MatrixUnits<Bf16>, HALF_TILE, avx512),
            #[cfg(target_arch = "x86_64")]
            (P::Bf16, I::Avx512) => body!(Registers<Zmm<Bf16>, Zmm<F32>, 8, 2>, TILE, avx512_bf16),
            #[cfg(target_arch = "x86_64")]
            (P::Bf16, I::Avx2) => body!(Registers<Ymm<Bf16>, Ymm<F32>, 4, 2>, TILE, avx2),
            #[cfg(target_arch = "aarch64")]
            (P::Bf16, I::NeonDot) => body!(Registers<NeonDot<Bf16>, Neon<F32>, 4, 4>, TILE, neon_bf16),
            #[cfg(target_arch = "aarch64")]
            (P::Bf16, I::Neon) => body!(Registers<Neon<Bf16>, Neon<F32>, 4, 4>, TILE, neon),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            (P::Bf16, I::Simd128) => body!(Registers<Simd128<Bf16>, Simd128<F32>, 4, 2>, TILE, portable),
            (P::Bf16, I::Portable) => body!(Registers<Plain<Bf16>, Plain<F32>, 4, 1>, TILE, portable),
            #[cfg(target_arch = "x86_64")]
            (P::Int16, I::Amx | I::Avx512) => {
                body!(Registers<Zmm<Int16>, ZmmUnfused<F32>, 8, 2>, TILE, avx512_vnni)
            }
            #[cfg(target_arch = "x86_64")]
            (P::Int16, I::Avx2) => body!(Registers<Ymm<Int16>, YmmUnfused<F32>, 4, 2>, TILE, avx2),
            #[cfg(target_arch = "aarch64")]
            (P::Int16, I::NeonDot | I::Neon) => {
                body!(Registers<Neon<Int16>, NeonUnfused<F32>, 4, 4>, TILE, neon)
            }
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            (P::Int16, I::Simd128) => body!(Registers<Simd128<Int16>, Simd128<F32>, 4, 2>, TILE, portable),
            (P::Int16, I::Portable) => body!(Registers<Plain<Int16>, Plain<F32>, 4, 1>, TILE, portable),
            #[cfg(target_arch = "x86_64")]
            (P::Int8, I::Amx) => body!(MatrixUnits<Int8>, TILE, avx512),
            #[cfg(target_arch = "x86_64")]
            (P::Int8, I::Avx512) => {
                body!(Registers<Zmm<Int8>, ZmmUnfused<F32>, 8, 2>, TILE, avx512_vnni)
            }
            #[cfg(target_arch = "x86_64")]
            (P::Int8, I::Avx2) => body!(Registers<Ymm<Int8>, YmmUnfused<F32>, 4, 2>, TILE, avx2),
            #[cfg(target_arch = "aarch64")]
            (P::Int8, I::NeonDot) => {
                body!(
                    Registers<NeonDot<Int8>, NeonUnfused<F32>, 4, 2>,
                    TILE,
                    neon_dotprod
                )
            }
            #[cfg(target_arch = "aarch64")]
            (P::Int8, I::Neon) => body!(Registers<Neon<Int8>, NeonUnfused<F32>, 4, 2>, TILE, neon),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            (P::Int8, I::Simd128) => body!(Registers<Simd128<Int8>, Simd128<F32>, 4, 2>, TILE, portable),
            (P::Int8, I::Portable) => body!(Registers<Plain<Int8>, Plain<F32>, 4, 1>, TILE, portable),
        }
    }};
}

/// Vertices that kernels of f32, and matrix units in bf16, evaluate at a time.
///
/// 256 channels of 32 vertices in f32 take two thirds of a first-level cache of 48 KiB. Formats of
/// 16 and 8 bits leave room for the whole tile. bf16 on matrix units takes half of it all the same:
/// the units are so fast that they wait unless activations, sums and the next activations are all
/// in that cache.
const HALF_TILE: usize = TILE / 2;

impl Field {
    /// Packs the layers for the kernel in force.
    fn pack(&mut self) {
        for_kernel!(self.kernel, |K, _W, _run| {
            self.packed = self.packed_for::<K>();
        });
    }

    fn packed_for<K: Kernel>(&self) -> Vec<PackedLayer> {
        let last = self.layers.len() - 1;
        let pack = |(i, layer): (usize, &Linear)| {
            let hidden = if i == 0 { 0 } else { self.config.width };
            let reads_input = i == 0 || self.config.skip == Some(i);
            let points = if reads_input { self.point_inputs } else { 0 };
            let columns = Columns { hidden, points };
            match i < last {
                true => PackedLayer::new::<K>(layer, columns),
                // The last layer is f32 in all precisions: bf16 would place a vertex at 1 m to 4
                // mm.
                false => PackedLayer::new::<K::Head>(layer, columns),
            }
        };
        self.layers.iter().enumerate().map(pack).collect()
    }

    /// Evaluates all vertices of a tile by the kernel in force, `W` of them at a time.
    fn dispatch(&self, mut tile: Tile<'_>) {
        for_kernel!(self.kernel, |K, W, run| {
            for first_vertex in (0..TILE).step_by(W) {
                // SAFETY: this machine has the instructions of `kernel`, see `KernelChoice`.
                unsafe { run::<K, W>(&self.packed, &mut tile, first_vertex) };
            }
        });
    }
}

impl Tile<'_> {
    /// Evaluates `W` vertices of the tile.
    ///
    /// # Safety
    /// The machine has the instructions of `K`.
    #[inline(always)]
    unsafe fn evaluate<K: Kernel, const W: usize>(&mut self, layers: &[PackedLayer], first_vertex: usize) {
        let Self {
            biases,
            inputs,
            scratch,
            outputs,
        } = self;
        // SAFETY: the caller's promise.
        unsafe { tile::evaluate::<K, W>(layers, biases, inputs, first_vertex, scratch, outputs) }
    }
}

/// Evaluates `W` vertices by a kernel whose instructions every machine of the target has.
///
/// # Safety
/// The machine has the instructions of `K`.
unsafe fn portable<K: Kernel, const W: usize>(
    layers: &[PackedLayer],
    tile: &mut Tile<'_>,
    first_vertex: usize,
) {
    // SAFETY: the caller's promise.
    unsafe { tile.evaluate::<K, W>(layers, first_vertex) }
}

/// Defines a function like [`portable`] that is compiled for processor features.
macro_rules! compiled_for {
    ($name:ident, $arch:literal, $features:literal) => {
        #[cfg(target_arch = $arch)]
        #[target_feature(enable = $features)]
        fn $name<K: Kernel, const W: usize>(
            layers: &[PackedLayer],
            tile: &mut Tile<'_>,
            first_vertex: usize,
        ) {
            // SAFETY: the caller has the features, and with them the instructions of K.
            unsafe { tile.evaluate::<K, W>(layers, first_vertex) }
        }
    };
}

compiled_for!(avx2, "x86_64", "avx2,fma");
compiled_for!(avx512, "x86_64", "avx512f,avx512bw");
compiled_for!(avx512_bf16, "x86_64", "avx512f,avx512bw,avx512bf16");
compiled_for!(avx512_vnni, "x86_64", "avx512f,avx512bw,avx512vnni");
compiled_for!(neon, "aarch64", "neon");
compiled_for!(neon_bf16, "aarch64", "neon,bf16");
compiled_for!(neon_dotprod, "aarch64", "neon,dotprod");

/// Sizes of all linear maps of a field.
fn layer_sizes(config: &FieldConfig, point_inputs: usize, latent_len: usize) -> Vec<LayerSize> {
    let input = point_inputs + latent_len;
    let hidden = (0..config.hidden_layers).map(|i| LayerSize {
        inputs: match i {
            0 => input,
            i if config.skip == Some(i) => config.width + input,
            _ => config.width,
        },
        outputs: config.width,
    });
    let last = LayerSize {
        inputs: config.width,
        outputs: 3,
    };
    hidden.chain([last]).collect()
}
