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
        self.next.resize(layer.rows * W);
        self.next_words.resize(layer.rows * W);
        self.sums.resize(K::ROWS * W);
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
                // SAFETY: the caller's promise.
                unsafe { K::block::<W>(weights, reads.of(), sums) };
            }
            // Words that have been made need no values any more.
            let at = if makes_words { 0 } else { first * W };
            let values = self.next.of_mut::<f32>()[at..].as_chunks_mut::<W>().0;
            let sums = sums.as_chunks::<W>().0;
            let values = &mut values[..K::ROWS];
            // SAFETY: the caller's promise.
            unsafe { finish.rows::<K::Arithmetic, K::Float, W>(first, sums, &worth, values) };
            if makes_words {
                let words = &mut self.next_words.of_mut::<u32>()[first / channels * W..];
                K::Arithmetic::pack(values, &worth, words.as_chunks_mut().0);
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
        self.words.resize(groups * W);
        A::pack(values, &factor, self.words.of_mut().as_chunks_mut().0);
        largest.map(|m| m / range)
    }
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
        let biases = &self.bias[first..][..out.len()];
        let units = &self.layer.units[first..][..out.len()];
        let rows = out.iter_mut().zip(sums).zip(biases.iter().zip(units));
        // SAFETY: the caller's promise.
        unsafe {
            // Most layers read no inputs of vertices: what asks for them costs as much as all else here.
            if self.layer.point_inputs == 0 && self.layer.groups > 0 {
                for ((out, sums), (&bias, &unit)) in rows {
                    for lane in (0..W).step_by(F::LANES) {
                        let sum = Self::sum::<A, F, W>(sums, worth, unit, lane);
                        self.store(F::splat(bias).add(sum), &mut out[lane..][..F::LANES]);
                    }
                }
            } else {
                for (row, ((out, sums), (&bias, &unit))) in (first..).zip(rows) {
                    for lane in (0..W).step_by(F::LANES) {
                        let mut y = F::splat(bias);
                        if self.layer.groups > 0 {
                            y = y.add(Self::sum::<A, F, W>(sums, worth, unit, lane));
                        }
                        y = self.add_points(row, lane, y);
                        self.store(y, &mut out[lane..][..F::LANES]);
                    }
                }
            }
        }
    }

    /// In units of the layer's outputs.
    ///
    /// # Safety
    /// As [`rows`](Self::rows); `lane` is a multiple of the vector's lanes.
    #[inline(always)]
    unsafe fn sum<A: Arithmetic, F: Float, const W: usize>(
        sums: &[A::Sum; W],
        worth: &[f32; W],
        unit: f32,
        lane: usize,
    ) -> F {
        const { assert!(W.is_multiple_of(F::LANES)) };
        // SAFETY: the caller's promise; `lane..lane + LANES` lies within the arrays.
        unsafe {
            let sum = A::load::<F>(sums.as_ptr().add(lane));
            match A::RANGE {
                Some(_) => sum.mul(F::splat(unit).mul(F::load(worth.as_ptr().add(lane)))),
                None => sum,
            }
        }
    }

    /// # Safety
    /// As [`rows`](Self::rows).
    #[inline(always)]
    unsafe fn add_points<F: Float>(&self, row: usize, lane: usize, mut y: F) -> F {
        let count = self.layer.point_inputs;
        let points = &self.layer.points[row * count..][..count];
        for (&w, x) in points.iter().zip(self.inputs.channels) {
            let x = &x[self.inputs.first + lane..][..F::LANES];
            // SAFETY: the caller's promise; the slice has so many numbers.
            y = unsafe { y.add(F::splat(w).mul(F::load(x.as_ptr()))) };
        }
        y
    }

    /// # Safety
    /// As [`rows`](Self::rows); `out` has so many numbers.
    #[inline(always)]
    unsafe fn store<F: Float>(&self, y: F, out: &mut [f32]) {
        // SAFETY: the caller's promise.
        unsafe {
            match self.kind {
                Layer::Hidden | Layer::LastHidden => y.relu().store(out.as_mut_ptr()),
                Layer::Last => y.store(out.as_mut_ptr()),
            }
        }
    }
}
