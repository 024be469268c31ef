//! All layers of the field over one tile of vertices.

use super::{arithmetic::Arithmetic, float::Float, kernel::Kernel, lines::Lines, packed::Packed};

/// Vertices that pass through the field together; a multiple of every vector width.
pub const TILE: usize = 64;

/// Activations of one tile on their way through the layers.
#[derive(Clone, Debug, Default)]
pub struct FieldScratch {
    /// By channel and vertex.
    values: Lines,
    next: Lines,
    /// The same as words.
    words: Lines,
    next_words: Lines,
    /// Groups of words that are not zero at all vertices.
    active: Vec<u32>,
    /// Of one block.
    sums: Lines,
}

/// What becomes of a layer's sums.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Layer {
    /// max(0, x), for a layer that reads the words of this precision.
    Hidden,
    /// max(0, x), for a layer that reads f32.
    LastHidden,
    /// x
    Last,
}

/// What all vertices of a tile read and share.
#[derive(Clone, Copy)]
struct Inputs<'a> {
    /// By channel.
    channels: &'a [[f32; TILE]],
    /// First of the vertices that are evaluated.
    first: usize,
}

/// Evaluates the vertices `first..first + W` of a tile.
///
/// # Safety
/// The machine has the instructions of `K`.
#[inline(always)]
pub(super) unsafe fn evaluate<K: Kernel, const W: usize>(
    (layers, biases): (&[Packed], &[Vec<f32>]),
    (channels, first): (&[[f32; TILE]], usize),
    scratch: &mut FieldScratch,
    outputs: &mut [[f32; TILE]; 3],
) {
    let inputs = Inputs { channels, first };
    let Some(((head, hidden), bias)) = layers.split_last().zip(biases.last()) else {
        return;
    };
    // SAFETY: the caller's promise; every block stands between `begin` and `end`.
    unsafe {
        K::begin();
        for (i, (layer, bias)) in hidden.iter().zip(biases).enumerate() {
            let kind = match i + 1 < hidden.len() {
                true => Layer::Hidden,
                false => Layer::LastHidden,
            };
            scratch.layer::<K, W>((layer, bias), inputs, kind);
        }
        K::end();
        K::Head::begin();
        scratch.layer::<K::Head, W>((head, bias), inputs, Layer::Last);
        K::Head::end();
    }
    let values = scratch.values.of::<f32>().as_chunks::<W>().0;
    for (out, values) in outputs.iter_mut().zip(values) {
        out[first..first + W].copy_from_slice(values);
    }
}

impl FieldScratch {
    /// # Safety
    /// As [`Kernel::block`].
    #[inline(always)]
    unsafe fn layer<K: Kernel, const W: usize>(
        &mut self,
        (layer, bias): (&Packed, &[f32]),
        inputs: Inputs<'_>,
        kind: Layer,
    ) {
        let channels = K::Arithmetic::CHANNELS;
        let worth = match layer.groups {
            0 => [1.0; W],
            _ => self.scale_words::<K::Arithmetic, W>(layer.groups),
        };
        // Unscaled words are made on the way, scaled ones when the largest value is known.
        let makes_words = kind == Layer::Hidden && channels > 1 && K::Arithmetic::RANGE.is_none();
        match makes_words {
            true => self.next_words.make_room(layer.rows / channels * W),
            false => self.next.make_room(layer.rows * W),
        }
        self.sums.make_room(K::ROWS * W);
        if K::SKIPS_ZEROS {
            let reads = if channels == 1 { &self.values } else { &self.words };
            let words = &reads.of::<u32>().as_chunks::<W>().0[..layer.groups];
            find_active(words, &mut self.active);
        }
        let block = K::ROWS * layer.groups;
        let finish = Finish {
            layer,
            bias,
            inputs,
            kind,
        };
        for first in (0..layer.rows).step_by(K::ROWS) {
            let sums = self.sums.of_mut();
            if block > 0 {
                let reads = if channels == 1 { &self.values } else { &self.words };
                let weights = &layer.weights.of::<u32>()[first * layer.groups..][..block];
                // SAFETY: the caller's promise; active groups are among those that the layer has.
                unsafe { K::block::<W>(weights, reads.of(), &self.active, sums) };
            }
            let sums = sums.as_chunks::<W>().0;
            // SAFETY: the caller's promise.
            unsafe {
                if makes_words {
                    let words = &mut self.next_words.of_mut::<u32>()[first / 2 * W..][..K::ROWS / 2 * W];
                    finish.words::<K::Arithmetic, K::Float, W>(first, sums, &worth, words.as_chunks_mut().0);
                } else {
                    let values = &mut self.next.of_mut::<f32>()[first * W..][..K::ROWS * W];
                    finish.rows::<K::Arithmetic, K::Float, W>(first, sums, &worth, values.as_chunks_mut().0);
                }
            }
        }
        match makes_words {
            true => std::mem::swap(&mut self.words, &mut self.next_words),
            false => std::mem::swap(&mut self.values, &mut self.next),
        }
    }

    /// Where words are scaled, makes them of the activations; what a unit of each vertex's is worth.
    #[inline(always)]
    fn scale_words<A: Arithmetic, const W: usize>(&mut self, groups: usize) -> [f32; W] {
        let Some(range) = A::RANGE else {
            return [1.0; W];
        };
        let values = &self.values.of::<f32>().as_chunks::<W>().0[..groups * A::CHANNELS];
        let largest = largest(values);
        let factor = largest.map(|m| if m > 0.0 { range / m } else { 0.0 });
        self.words.make_room(groups * W);
        A::pack(values, &factor, self.words.of_mut().as_chunks_mut().0);
        largest.map(|m| m / range)
    }
}

/// The ramp leaves about half of the channels at zero, and the same ones at neighbouring vertices.
#[inline(always)]
fn find_active<const W: usize>(words: &[[u32; W]], active: &mut Vec<u32>) {
    active.clear();
    active.resize(words.len(), 0);
    let mut count = 0;
    for (group, words) in words.iter().enumerate() {
        active[count] = group as u32;
        count += usize::from(words.iter().fold(0, |any, word| any | word) != 0);
    }
    active.truncate(count);
}

#[inline(always)]
fn largest<const W: usize>(values: &[[f32; W]]) -> [f32; W] {
    let mut largest = [0.0; W];
    for values in values {
        for (largest, &x) in largest.iter_mut().zip(values) {
            *largest = if x > *largest { x } else { *largest };
        }
    }
    largest
}

/// From sums to outputs: units, bias, and the vertices' own inputs in f32. Products and sums
/// are rounded one by one, so that every instruction set gives the same bits.
struct Finish<'a> {
    layer: &'a Packed,
    bias: &'a [f32],
    inputs: Inputs<'a>,
    kind: Layer,
}

impl Finish<'_> {
    /// Most layers read no inputs of vertices: to ask every time costs as much as all else here.
    fn is_edge(&self) -> bool {
        self.layer.point_inputs > 0 || self.layer.groups == 0
    }

    /// The outputs from `first` on, as many as `out` has.
    ///
    /// # Safety
    /// The machine has the instructions of `F`.
    #[inline(always)]
    unsafe fn rows<A: Arithmetic, F: Float, const W: usize>(
        &self,
        first: usize,
        sums: &[[A::Sum; W]],
        worth: &[f32; W],
        out: &mut [[f32; W]],
    ) {
        let edge = self.is_edge();
        for (row, (out, sums)) in (first..).zip(out.iter_mut().zip(sums)) {
            for lane in (0..W).step_by(2 * F::LANES) {
                // SAFETY: the caller's promise; `lane` is a multiple of two registers, whose lanes `out` has.
                unsafe {
                    let outputs = match edge {
                        true => self.outputs::<A, F, W, true>(row, sums, worth, lane),
                        false => self.outputs::<A, F, W, false>(row, sums, worth, lane),
                    };
                    outputs[0].store(out.as_mut_ptr().add(lane));
                    outputs[1].store(out.as_mut_ptr().add(lane + F::LANES));
                }
            }
        }
    }

    /// The same as words of bf16 for the next layer, of two outputs each.
    ///
    /// # Safety
    /// As [`rows`](Self::rows).
    #[inline(always)]
    unsafe fn words<A: Arithmetic, F: Float, const W: usize>(
        &self,
        first: usize,
        sums: &[[A::Sum; W]],
        worth: &[f32; W],
        words: &mut [[u32; W]],
    ) {
        let edge = self.is_edge();
        let rows = (first..).step_by(2).zip(sums.as_chunks::<2>().0);
        for ((row, [low, high]), words) in rows.zip(words) {
            for lane in (0..W).step_by(2 * F::LANES) {
                // SAFETY: the caller's promise; `lane` is a multiple of two registers, whose lanes `words` has.
                unsafe {
                    let [low, high] = match edge {
                        true => [
                            self.outputs::<A, F, W, true>(row, low, worth, lane),
                            self.outputs::<A, F, W, true>(row + 1, high, worth, lane),
                        ],
                        false => [
                            self.outputs::<A, F, W, false>(row, low, worth, lane),
                            self.outputs::<A, F, W, false>(row + 1, high, worth, lane),
                        ],
                    };
                    let words = words.as_mut_ptr().add(lane);
                    F::store_bf16(low[0], high[0], words);
                    F::store_bf16(low[1], high[1], words.add(F::LANES));
                }
            }
        }
    }

    /// Two registers of one output from `lane` on. `EDGE`: of a layer that reads inputs of vertices, or no activations.
    ///
    /// # Safety
    /// As [`rows`](Self::rows); `lane` is a multiple of the lanes of two registers.
    #[inline(always)]
    unsafe fn outputs<A: Arithmetic, F: Float, const W: usize, const EDGE: bool>(
        &self,
        row: usize,
        sums: &[A::Sum; W],
        worth: &[f32; W],
        lane: usize,
    ) -> [F; 2] {
        const { assert!(W.is_multiple_of(2 * F::LANES)) };
        // SAFETY: the caller's promise; `lane..lane + 2 · LANES` lies within the arrays.
        unsafe {
            let bias = F::splat(self.bias[row]);
            let mut y = [bias, bias];
            if !EDGE || self.layer.groups > 0 {
                let unit = self.layer.units[row];
                y[0] = y[0].add(Self::sum::<A, F, W>(sums, worth, unit, lane));
                y[1] = y[1].add(Self::sum::<A, F, W>(sums, worth, unit, lane + F::LANES));
            }
            if EDGE {
                let count = self.layer.point_inputs;
                let points = &self.layer.points[row * count..][..count];
                for (&w, x) in points.iter().zip(self.inputs.channels) {
                    let x = &x[self.inputs.first + lane..][..2 * F::LANES];
                    let w = F::splat(w);
                    y[0] = y[0].add(w.mul(F::load(x.as_ptr())));
                    y[1] = y[1].add(w.mul(F::load(x.as_ptr().add(F::LANES))));
                }
            }
            match self.kind {
                Layer::Hidden | Layer::LastHidden => [y[0].relu(), y[1].relu()],
                Layer::Last => y,
            }
        }
    }

    /// In units of the layer's outputs.
    ///
    /// # Safety
    /// As [`rows`](Self::rows); `lane..lane + LANES` lies within the arrays.
    #[inline(always)]
    unsafe fn sum<A: Arithmetic, F: Float, const W: usize>(
        sums: &[A::Sum; W],
        worth: &[f32; W],
        unit: f32,
        lane: usize,
    ) -> F {
        // SAFETY: the caller's promise.
        unsafe {
            let sum = A::load::<F>(sums.as_ptr().add(lane));
            match A::RANGE {
                Some(_) => sum.mul(F::splat(unit).mul(F::load(worth.as_ptr().add(lane)))),
                None => sum,
            }
        }
    }
}
