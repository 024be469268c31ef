//! Deformation field on CPU: a tile of vertices goes through all layers while it is in cache.

#[cfg(target_arch = "aarch64")]
use super::words::neon::{Neon, NeonDot, NeonUnfused};
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use super::words::simd128::Simd128;
use super::{
    Instructions, LayerError, Linear, Precision,
    arithmetic::{Bf16, F32, Int8, Int16},
    check_layers,
    kernel::{Kernel, Registers},
    packed::{Columns, Packed},
    tile::{self, FieldScratch, TILE},
    vector::dot,
    words::Plain,
};
#[cfg(target_arch = "x86_64")]
use super::{
    amx::Matrix,
    words::x86::{Ymm, YmmUnfused, Zmm, ZmmUnfused},
};
use crate::config::FieldConfig;

/// D_φ (paper, section 3.2): point inputs and a latent vector to three numbers a vertex.
///
/// The latent vector is the same for all vertices of a frame, so its share of the first and of the
/// skip layer is folded into their biases once a frame: exact, and a vertex costs the same for any
/// latent length. Channels that are zero at all vertices of a tile are left out, which changes no bit: tiles of
/// neighbours, such as meshes have in their order, are the fastest.
#[derive(Clone, Debug)]
pub struct Field {
    layers: Vec<Linear>,
    packed: Vec<Packed>,
    kernel: (Precision, Instructions),
    config: FieldConfig,
    point_inputs: usize,
    latent: usize,
}

/// Biases of every layer for one frame, the latent vector folded in.
#[derive(Clone, Debug, Default)]
pub struct FieldBiases(Vec<Vec<f32>>);

impl Field {
    /// From layers of the configured sizes, in [`Precision::F32`]. Columns of the first layer are
    /// [point, latent], of the skip layer [hidden, point, latent].
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
        let mut field = Self {
            layers,
            packed: Vec::new(),
            kernel: (Precision::F32, Instructions::best(Precision::F32)),
            config: *config,
            point_inputs,
            latent,
        };
        field.pack();
        Ok(field)
    }

    /// The same field in another precision, packed for this machine.
    pub fn with_precision(self, precision: Precision) -> Self {
        self.with_kernel(precision, Instructions::best(precision))
    }

    /// As [`with_precision`](Self::with_precision), on instructions that are not the best: to measure them.
    ///
    /// # Panics
    /// When this machine does not have them.
    #[doc(hidden)]
    pub fn with_kernel(mut self, precision: Precision, instructions: Instructions) -> Self {
        let available = Instructions::available(precision).any(|set| set == instructions);
        assert!(available, "{instructions:?} for {precision:?} on this machine");
        self.kernel = (precision, instructions);
        self.pack();
        self
    }

    /// The linear maps, in order.
    pub fn layers(&self) -> &[Linear] {
        &self.layers
    }

    /// What its products are taken in.
    pub fn precision(&self) -> Precision {
        self.kernel.0
    }

    /// What it runs on.
    pub fn instructions(&self) -> Instructions {
        self.kernel.1
    }

    /// Numbers read of each vertex.
    pub fn point_inputs(&self) -> usize {
        self.point_inputs
    }

    /// Folds the latent vector of a frame into the biases.
    pub fn fold(&self, latent: &[f32], biases: &mut FieldBiases) {
        debug_assert_eq!(latent.len(), self.latent);
        let instructions = Instructions::best(Precision::F32);
        biases.0.resize(self.layers.len(), Vec::new());
        for ((layer, packed), bias) in self.layers.iter().zip(&self.packed).zip(&mut biases.0) {
            bias.clear();
            bias.extend_from_slice(&layer.bias);
            if let Some(column) = packed.latent {
                for (bias, row) in bias.iter_mut().zip(layer.weight.chunks_exact(layer.inputs)) {
                    *bias += dot(instructions, &row[column..], latent);
                }
            }
            bias.resize(packed.rows, 0.0);
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

/// What one evaluation reads and writes.
struct Tile<'a> {
    biases: &'a [Vec<f32>],
    inputs: &'a [[f32; TILE]],
    scratch: &'a mut FieldScratch,
    outputs: &'a mut [[f32; TILE]; 3],
}

/// The kernel of every precision on every instruction set, how many vertices it takes at a time, and the
/// function compiled for it. After whole numbers the last layer is rounded alike everywhere, too.
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
        match $kernel {
            #[cfg(target_arch = "x86_64")]
            (P::F32, I::Amx | I::Avx512) => body!(Registers<Zmm<F32>, Zmm<F32>, 8, 2>, NARROW, avx512),
            #[cfg(target_arch = "x86_64")]
            (P::F32, I::Avx2) => body!(Registers<Ymm<F32>, Ymm<F32>, 4, 2>, NARROW, avx2),
            #[cfg(target_arch = "aarch64")]
            (P::F32, I::NeonDot | I::Neon) => body!(Registers<Neon<F32>, Neon<F32>, 4, 4>, NARROW, neon),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            (P::F32, I::Simd128) => body!(Registers<Simd128<F32>, Simd128<F32>, 4, 2>, NARROW, portable),
            (P::F32, I::Portable) => body!(Registers<Plain<F32>, Plain<F32>, 4, 1>, NARROW, portable),
            #[cfg(target_arch = "x86_64")]
            (P::Bf16, I::Amx) => body!(Matrix<Bf16>, NARROW, avx512),
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
            (P::Int8, I::Amx) => body!(Matrix<Int8>, TILE, avx512),
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

/// Vertices of a tile of f32 that are evaluated together: 256 channels of them fill two thirds of a
/// first-level cache of 48 KiB. Words of 16 and 8 bits take the whole tile; those of bf16 on matrix units do not, which
/// are so fast that they wait where activations, sums and next activations do not all stay in that cache.
const NARROW: usize = TILE / 2;

impl Field {
    fn pack(&mut self) {
        for_kernel!(self.kernel, |K, _W, _run| {
            self.packed = self.packed_for::<K>();
        });
    }

    fn packed_for<K: Kernel>(&self) -> Vec<Packed> {
        let last = self.layers.len() - 1;
        let pack = |(i, layer): (usize, &Linear)| {
            let hidden = if i == 0 { 0 } else { self.config.width };
            let reads_input = i == 0 || self.config.skip == Some(i);
            let points = if reads_input { self.point_inputs } else { 0 };
            let columns = Columns { hidden, points };
            match i < last {
                true => Packed::new::<K>(layer, columns),
                false => Packed::new::<K::Head>(layer, columns),
            }
        };
        self.layers.iter().enumerate().map(pack).collect()
    }

    fn dispatch(&self, mut tile: Tile<'_>) {
        for_kernel!(self.kernel, |K, W, run| {
            for first in (0..TILE).step_by(W) {
                // SAFETY: `kernel` is of what this machine has.
                unsafe { run::<K, W>(&self.packed, &mut tile, first) };
            }
        });
    }
}

impl Tile<'_> {
    /// # Safety
    /// The machine has the instructions of `K`.
    #[inline(always)]
    unsafe fn evaluate<K: Kernel, const W: usize>(&mut self, layers: &[Packed], first: usize) {
        let Self {
            biases,
            inputs,
            scratch,
            outputs,
        } = self;
        // SAFETY: the caller's promise.
        unsafe { tile::evaluate::<K, W>((layers, biases), (inputs, first), scratch, outputs) }
    }
}

/// # Safety
/// The target always has the instructions of `K`.
unsafe fn portable<K: Kernel, const W: usize>(layers: &[Packed], tile: &mut Tile<'_>, first: usize) {
    // SAFETY: see above.
    unsafe { tile.evaluate::<K, W>(layers, first) }
}

macro_rules! compiled_for {
    ($name:ident, $arch:literal, $features:literal) => {
        #[cfg(target_arch = $arch)]
        #[target_feature(enable = $features)]
        fn $name<K: Kernel, const W: usize>(layers: &[Packed], tile: &mut Tile<'_>, first: usize) {
            // SAFETY: the caller has the features, and with them the instructions of K.
            unsafe { tile.evaluate::<K, W>(layers, first) }
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
