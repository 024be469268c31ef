//! All layers of the field over one tile of vertices.

use super::{
    arithmetic::Arithmetic,
    kernel::Kernel,
    lines::Lines,
    packed::Packed,
};

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
    /// Of one block.
    sums: Lines,
}

/// What a layer does to its sums.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Layer {
    /// max(0, x)
    Hidden,
    /// x
    Last,
}

/// Inputs of `W` of a tile's vertices, by channel, from `first` on.
struct Points<'a> {
    channels: &'a [[f32; TILE]],
    first: usize,
}

/// Evaluates the vertices `first..first + W` of a tile.
///
/// # Safety
/// The machine has the instructions of `K`.
#[inline(always)]
pub(super) unsafe fn evaluate<K: Kernel, const W: usize>(
    (layers, biases): (&[Packed], &[Vec<f32>]),
    (inputs, first): (&[[f32; TILE]], usize),
    scratch: &mut FieldScratch,
    outputs: &mut [[f32; TILE]; 3],
) {
    let points = Points {
        channels: inputs,
        first,
    };
    let Some(((head, hidden), bias)) = layers.split_last().zip(biases.last()) else {
        return;
    };
    // SAFETY: the caller's promise; every block stands between `begin` and `end`.
    unsafe {
        K::begin();
        for (layer, bias) in hidden.iter().zip(biases) {
            scratch.layer::<K, W>(layer, bias, &points, Layer::Hidden);
        }
        K::end();
        K::Head::begin();
        scratch.layer::<K::Head, W>(head, bias, &points, Layer::Last);
        K::Head::end();
    }
    for (out, values) in outputs.iter_mut().zip(scratch.values.of::<f32>().chunks_exact(W)) {
        out[first..first + W].copy_from_slice(values);
    }
}

impl FieldScratch {
    /// # Safety
    /// As [`Kernel::block`].
    #[inline(always)]
    unsafe fn layer<K: Kernel, const W: usize>(
        &mut self,
        layer: &Packed,
        bias: &[f32],
        points: &Points<'_>,
        kind: Layer,
    ) {
        let worth = self.pack::<K::Arithmetic, W>(layer.groups);
        self.next.resize(layer.rows * W);
        self.sums.resize(K::ROWS * W);
        let words = match K::Arithmetic::CHANNELS {
            1 => &self.values,
            _ => &self.words,
        };
        let block = K::ROWS * layer.groups;
        for (b, next) in self.next.of_mut::<f32>().chunks_exact_mut(K::ROWS * W).enumerate() {
            let sums = self.sums.of_mut();
            if block > 0 {
                let weights = &layer.weights.of::<u32>()[b * block..][..block];
                // SAFETY: the caller's promise.
                unsafe { K::block::<W>(weights, words.of(), sums) };
            }
            for (r, next) in next.as_chunks_mut::<W>().0.iter_mut().enumerate() {
                let row = b * K::ROWS + r;
                let sums = (block > 0).then(|| &sums[r * W..][..W]);
                finish::<K::Arithmetic, W>((layer, row), bias[row], (sums, &worth), points, next);
                if kind == Layer::Hidden {
                    next.iter_mut().for_each(|x| *x = if *x > 0.0 { *x } else { 0.0 });
                }
            }
        }
        std::mem::swap(&mut self.values, &mut self.next);
    }

    /// Makes words of the activations; what a unit of each vertex's is worth.
    #[inline(always)]
    fn pack<A: Arithmetic, const W: usize>(&mut self, groups: usize) -> [f32; W] {
        let mut worth = [1.0; W];
        if A::CHANNELS == 1 || groups == 0 {
            return worth;
        }
        let values = &self.values.of::<f32>().as_chunks::<W>().0[..groups * A::CHANNELS];
        let mut factor = [1.0; W];
        if let Some(range) = A::RANGE {
            let largest = largest(values);
            factor = largest.map(|m| if m > 0.0 { range / m } else { 0.0 });
            worth = largest.map(|m| m / range);
        }
        self.words.resize(groups * W);
        let words = self.words.of_mut::<u32>().as_chunks_mut::<W>().0;
        for (words, values) in words.iter_mut().zip(values.chunks_exact(A::CHANNELS)) {
            for (lane, word) in words.iter_mut().enumerate() {
                *word = A::activations(|c| match A::RANGE {
                    Some(_) => values[c][lane] * factor[lane],
                    None => values[c][lane],
                });
            }
        }
        worth
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

/// One row's outputs: sums in their units, bias, and the vertices' own inputs in f32. Plain loops, which the
/// compiler turns into vectors without changing a bit.
#[inline(always)]
fn finish<A: Arithmetic, const W: usize>(
    (layer, row): (&Packed, usize),
    bias: f32,
    (sums, worth): (Option<&[A::Sum]>, &[f32; W]),
    points: &Points<'_>,
    out: &mut [f32; W],
) {
    let mut y = [bias; W];
    if let Some(sums) = sums {
        let unit = layer.units[row];
        for ((y, &sum), worth) in y.iter_mut().zip(sums).zip(worth) {
            *y += match A::RANGE {
                Some(_) => A::number(sum) * (unit * worth),
                None => A::number(sum),
            };
        }
    }
    let count = layer.points.len() / layer.rows;
    let weights = &layer.points[row * count..][..count];
    for (&w, x) in weights.iter().zip(points.channels) {
        for (y, x) in y.iter_mut().zip(&x[points.first..points.first + W]) {
            *y += w * x;
        }
    }
    *out = y;
}
