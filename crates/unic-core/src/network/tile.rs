//! All layers of the field, evaluated for one tile of vertices.

use super::{arithmetic::Arithmetic, kernel::Kernel, packed::PackedLayer};
use crate::simd::{AlignedWords, Float};

/// Vertices of a tile, which pass through the field together; a multiple of every vector width.
pub const TILE: usize = 64;

/// Scratch memory of [`Field::evaluate`](super::Field::evaluate): the activations of one tile.
#[derive(Clone, Debug, Default)]
pub struct FieldScratch {
    /// Activations that the current layer reads in f32, by channel and vertex.
    values: AlignedWords,
    /// Outputs of the current layer in f32.
    next_values: AlignedWords,
    /// Activations that the current layer reads as words, by group and vertex.
    words: AlignedWords,
    /// Outputs of the current layer as words.
    next_words: AlignedWords,
    /// Groups of words that are not zero at every vertex of the tile, in ascending order.
    active: Vec<u32>,
    /// Sums of one block of outputs.
    sums: AlignedWords,
}

/// Position of a layer, which decides its activation function and the format of its outputs.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LayerKind {
    /// Hidden layer before another one: ReLU, outputs in the number format of the precision.
    Hidden,
    /// Hidden layer before the last layer: ReLU, outputs in f32.
    LastHidden,
    /// Last layer: linear, outputs in f32.
    Last,
}

/// Inputs of a tile's vertices.
#[derive(Clone, Copy)]
struct PointInputs<'a> {
    /// Numbers by channel and vertex.
    channels: &'a [[f32; TILE]],
    /// First vertex that is evaluated.
    first_vertex: usize,
}

/// Evaluates the vertices `first_vertex..first_vertex + W` of a tile.
///
/// `channels` holds the inputs of the tile's vertices. `biases` has one row a layer, with the
/// latent vector folded in.
///
/// # Safety
/// The machine has the instructions of `K`.
#[inline(always)]
pub(super) unsafe fn evaluate<K: Kernel, const W: usize>(
    layers: &[PackedLayer],
    biases: &[Vec<f32>],
    channels: &[[f32; TILE]],
    first_vertex: usize,
    scratch: &mut FieldScratch,
    outputs: &mut [[f32; TILE]; 3],
) {
    let inputs = PointInputs {
        channels,
        first_vertex,
    };
    let Some(((head, hidden), bias)) = layers.split_last().zip(biases.last()) else {
        return;
    };
    // SAFETY: the caller's promise; every block stands between `begin` and `end`.
    unsafe {
        K::begin();
        for (i, (layer, bias)) in hidden.iter().zip(biases).enumerate() {
            let kind = match i + 1 < hidden.len() {
                true => LayerKind::Hidden,
                false => LayerKind::LastHidden,
            };
            scratch.evaluate_layer::<K, W>(layer, bias, inputs, kind);
        }
        K::end();
        K::Head::begin();
        scratch.evaluate_layer::<K::Head, W>(head, bias, inputs, LayerKind::Last);
        K::Head::end();
    }
    let values = scratch.values.as_slice::<f32>().as_chunks::<W>().0;
    for (out, values) in outputs.iter_mut().zip(values) {
        out[first_vertex..first_vertex + W].copy_from_slice(values);
    }
}

impl FieldScratch {
    /// Evaluates one layer; its outputs become the activations that the next one reads.
    ///
    /// # Safety
    /// The contract of [`Kernel::block`].
    #[inline(always)]
    unsafe fn evaluate_layer<K: Kernel, const W: usize>(
        &mut self,
        layer: &PackedLayer,
        bias: &[f32],
        inputs: PointInputs<'_>,
        kind: LayerKind,
    ) {
        let channels = K::Arithmetic::CHANNELS;
        let vertex_scales = match layer.groups {
            0 => [1.0; W],
            _ => self.quantise::<K::Arithmetic, W>(layer.groups),
        };
        // bf16 outputs are packed as they are computed. Integers are packed by the next layer, when
        // the largest activation of each vertex is known.
        let packs_outputs = kind == LayerKind::Hidden && channels > 1 && K::Arithmetic::RANGE.is_none();
        match packs_outputs {
            true => self.next_words.grow_to(layer.rows / channels * W),
            false => self.next_values.grow_to(layer.rows * W),
        }
        self.sums.grow_to(K::ROWS * W);
        if K::SKIPS_ZEROS {
            let reads = if channels == 1 { &self.values } else { &self.words };
            let words = &reads.as_slice::<u32>().as_chunks::<W>().0[..layer.groups];
            find_active(words, &mut self.active);
        }
        let block_words = K::ROWS * layer.groups;
        let epilogue = Epilogue {
            layer,
            bias,
            inputs,
            kind,
        };
        for first_row in (0..layer.rows).step_by(K::ROWS) {
            let sums = self.sums.as_mut_slice();
            if block_words > 0 {
                let reads = if channels == 1 { &self.values } else { &self.words };
                let weights = &layer.weights.as_slice::<u32>()[first_row * layer.groups..][..block_words];
                // SAFETY: the caller's promise; active groups are among those that the layer has.
                unsafe { K::block::<W>(weights, reads.as_slice(), &self.active, sums) };
            }
            let sums = sums.as_chunks::<W>().0;
            // SAFETY: the caller's promise.
            unsafe {
                if packs_outputs {
                    let words = &mut self.next_words.as_mut_slice::<u32>()[first_row / 2 * W..];
                    let words = words[..K::ROWS / 2 * W].as_chunks_mut().0;
                    epilogue.write_words::<K::Arithmetic, K::Float, W>(
                        first_row,
                        sums,
                        &vertex_scales,
                        words,
                    );
                } else {
                    let values = &mut self.next_values.as_mut_slice::<f32>()[first_row * W..];
                    let values = values[..K::ROWS * W].as_chunks_mut().0;
                    epilogue.write_values::<K::Arithmetic, K::Float, W>(
                        first_row,
                        sums,
                        &vertex_scales,
                        values,
                    );
                }
            }
        }
        match packs_outputs {
            true => std::mem::swap(&mut self.words, &mut self.next_words),
            false => std::mem::swap(&mut self.values, &mut self.next_values),
        }
    }

    /// Packs the activations of `groups` words as integers, for formats that scale them by vertex.
    ///
    /// Returns the scale of each vertex: the value of one unit, 1 for formats without a scale.
    #[inline(always)]
    fn quantise<A: Arithmetic, const W: usize>(&mut self, groups: usize) -> [f32; W] {
        let Some(range) = A::RANGE else {
            return [1.0; W];
        };
        let values = &self.values.as_slice::<f32>().as_chunks::<W>().0[..groups * A::CHANNELS];
        let largest = largest_of_vertices(values);
        let factor = largest.map(|m| if m > 0.0 { range / m } else { 0.0 });
        self.words.grow_to(groups * W);
        A::pack(values, &factor, self.words.as_mut_slice().as_chunks_mut().0);
        largest.map(|m| m / range)
    }
}

/// Lists the groups of words that are not zero at every vertex.
///
/// About half of the ReLU activations are zero, and neighbouring vertices share the same zeros.
#[inline(always)]
fn find_active<const W: usize>(words: &[[u32; W]], active: &mut Vec<u32>) {
    active.clear();
    active.resize(words.len(), 0);
    let mut count = 0;
    // Without a branch, which would be mispredicted half of the time: every group is written, and
    // the next one overwrites it unless it is active.
    for (group, words) in words.iter().enumerate() {
        active[count] = group as u32;
        count += usize::from(words.iter().fold(0, |any, word| any | word) != 0);
    }
    active.truncate(count);
}

/// Returns the largest value of each vertex over all channels, at least 0.
#[inline(always)]
fn largest_of_vertices<const W: usize>(values: &[[f32; W]]) -> [f32; W] {
    let mut largest = [0.0; W];
    for values in values {
        for (largest, &x) in largest.iter_mut().zip(values) {
            // Compiles to one instruction a register; f32::max has more to do for NaN.
            *largest = if x > *largest { x } else { *largest };
        }
    }
    largest
}

/// The work after a block's matrix product: scales, bias, the vertices' own inputs, activation.
///
/// All of it is in f32. Products and sums are rounded one by one, so that every instruction set
/// gives the same bits.
struct Epilogue<'a> {
    layer: &'a PackedLayer,
    bias: &'a [f32],
    inputs: PointInputs<'a>,
    kind: LayerKind,
}

impl Epilogue<'_> {
    /// Returns true if the layer reads inputs of vertices or no activations.
    ///
    /// Most layers do neither. Asking once a block, not once an output, halves the epilogue's time.
    fn is_input_layer(&self) -> bool {
        self.layer.point_inputs > 0 || self.layer.groups == 0
    }

    /// Writes the outputs from `first_row` on in f32, as many as `out` has.
    ///
    /// # Safety
    /// The machine has the instructions of `F`.
    #[inline(always)]
    unsafe fn write_values<A: Arithmetic, F: Float, const W: usize>(
        &self,
        first_row: usize,
        sums: &[[A::Sum; W]],
        vertex_scales: &[f32; W],
        out: &mut [[f32; W]],
    ) {
        let is_input_layer = self.is_input_layer();
        for (row, (out, sums)) in (first_row..).zip(out.iter_mut().zip(sums)) {
            for lane in (0..W).step_by(2 * F::LANES) {
                // SAFETY: the caller's promise; `lane` is a multiple of two registers, whose lanes
                // `out` has.
                unsafe {
                    let outputs = match is_input_layer {
                        true => self.outputs::<A, F, W, true>(row, sums, vertex_scales, lane),
                        false => self.outputs::<A, F, W, false>(row, sums, vertex_scales, lane),
                    };
                    outputs[0].store(out.as_mut_ptr().add(lane));
                    outputs[1].store(out.as_mut_ptr().add(lane + F::LANES));
                }
            }
        }
    }

    /// Writes the outputs from `first_row` on as words of two bf16 each.
    ///
    /// # Safety
    /// The machine has the instructions of `F`.
    #[inline(always)]
    unsafe fn write_words<A: Arithmetic, F: Float, const W: usize>(
        &self,
        first_row: usize,
        sums: &[[A::Sum; W]],
        vertex_scales: &[f32; W],
        words: &mut [[u32; W]],
    ) {
        let is_input_layer = self.is_input_layer();
        let rows = (first_row..).step_by(2).zip(sums.as_chunks::<2>().0);
        for ((row, [low, high]), words) in rows.zip(words) {
            for lane in (0..W).step_by(2 * F::LANES) {
                // SAFETY: the caller's promise; `lane` is a multiple of two registers, whose lanes
                // `words` has.
                unsafe {
                    let [low, high] = match is_input_layer {
                        true => [
                            self.outputs::<A, F, W, true>(row, low, vertex_scales, lane),
                            self.outputs::<A, F, W, true>(row + 1, high, vertex_scales, lane),
                        ],
                        false => [
                            self.outputs::<A, F, W, false>(row, low, vertex_scales, lane),
                            self.outputs::<A, F, W, false>(row + 1, high, vertex_scales, lane),
                        ],
                    };
                    let words = words.as_mut_ptr().add(lane);
                    F::store_bf16(low[0], high[0], words);
                    F::store_bf16(low[1], high[1], words.add(F::LANES));
                }
            }
        }
    }

    /// Returns two registers of one output, for the vertices from `lane` on.
    ///
    /// `INPUT_LAYER` is the result of [`is_input_layer`](Self::is_input_layer).
    ///
    /// # Safety
    /// The machine has the instructions of `F`; `lane` is a multiple of the lanes of two registers.
    #[inline(always)]
    unsafe fn outputs<A: Arithmetic, F: Float, const W: usize, const INPUT_LAYER: bool>(
        &self,
        row: usize,
        sums: &[A::Sum; W],
        vertex_scales: &[f32; W],
        lane: usize,
    ) -> [F; 2] {
        const { assert!(W.is_multiple_of(2 * F::LANES)) };
        // SAFETY: the caller's promise; `lane..lane + 2 · LANES` lies within the arrays.
        unsafe {
            let bias = F::splat(self.bias[row]);
            let mut y = [bias, bias];
            // The first layer reads no activations, and then no kernel has written sums.
            if !INPUT_LAYER || self.layer.groups > 0 {
                let row_scale = self.layer.row_scales[row];
                y[0] = y[0].add(Self::sum::<A, F, W>(sums, vertex_scales, row_scale, lane));
                y[1] = y[1].add(Self::sum::<A, F, W>(
                    sums,
                    vertex_scales,
                    row_scale,
                    lane + F::LANES,
                ));
            }
            if INPUT_LAYER {
                let count = self.layer.point_inputs;
                let weights = &self.layer.point_weights[row * count..][..count];
                for (&w, x) in weights.iter().zip(self.inputs.channels) {
                    let x = &x[self.inputs.first_vertex + lane..][..2 * F::LANES];
                    let w = F::splat(w);
                    y[0] = y[0].add(w.mul(F::load(x.as_ptr())));
                    y[1] = y[1].add(w.mul(F::load(x.as_ptr().add(F::LANES))));
                }
            }
            match self.kind {
                LayerKind::Hidden | LayerKind::LastHidden => [y[0].relu(), y[1].relu()],
                LayerKind::Last => y,
            }
        }
    }

    /// Loads sums as f32 and multiplies them by the scales of weights and activations.
    ///
    /// # Safety
    /// The machine has the instructions of `F`; `lane..lane + LANES` lies within the arrays.
    #[inline(always)]
    unsafe fn sum<A: Arithmetic, F: Float, const W: usize>(
        sums: &[A::Sum; W],
        vertex_scales: &[f32; W],
        row_scale: f32,
        lane: usize,
    ) -> F {
        // SAFETY: the caller's promise.
        unsafe {
            let sum = A::load::<F>(sums.as_ptr().add(lane));
            match A::RANGE {
                Some(_) => sum.mul(F::splat(row_scale).mul(F::load(vertex_scales.as_ptr().add(lane)))),
                None => sum,
            }
        }
    }
}
