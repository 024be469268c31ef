//! Smoothed shape of a garment: that of the samples of its finest coarse level.

use super::{levels::Levels, sweep::PART};
use crate::parallel::for_each_chunk;
use glam::Vec3A;

/// Times that each sample is averaged with those that its chords join.
pub const SMOOTHING_ROUNDS: usize = 3;

/// Samples that are averaged with each other. An asset.
#[derive(Clone, Debug)]
pub struct SmoothedShape {
    /// End of each sample's neighbours in `neighbours`.
    ends: Vec<u32>,
    /// Places of neighbours in the samples.
    neighbours: Vec<u32>,
}

impl SmoothedShape {
    /// Takes the chords of the finest level; none without levels.
    pub(super) fn new(levels: &Levels) -> Option<Self> {
        let finest = levels.levels().last()?;
        let mut around = vec![Vec::new(); levels.samples().len()];
        for chord in finest.chord_colours().flatten() {
            let [a, b] = chord.ends;
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
        let end = |end: &mut u32, around: &Vec<u32>| {
            *end += around.len() as u32;
            Some(*end)
        };
        Some(Self {
            ends: around.iter().scan(0, end).collect(),
            neighbours: around.concat(),
        })
    }

    /// End of the neighbours of each sample in [`SmoothedShape::neighbours`].
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Neighbours of all samples, sample by sample: places in the [samples](Levels::samples).
    pub fn neighbours(&self) -> &[u32] {
        &self.neighbours
    }

    /// Computes the smoothed shape of a garment from the positions of its vertices: those of the
    /// samples, averaged, and all vertices interpolated from them.
    pub(super) fn smooth(
        &self,
        levels: &Levels,
        positions: &[Vec3A],
        samples: &mut [Vec<Vec3A>; 2],
        smoothed: &mut Vec<Vec3A>,
    ) {
        let [now, next] = samples;
        now.clear();
        now.extend(levels.samples().iter().map(|&v| positions[v as usize]));
        for _ in 0..SMOOTHING_ROUNDS {
            next.clear();
            let mut start = 0;
            next.extend(self.ends.iter().zip(&*now).map(|(&end, own)| {
                let near = &self.neighbours[start..end as usize];
                start = end as usize;
                let sum: Vec3A = near.iter().map(|&n| now[n as usize]).sum();
                (*own + sum) / (1 + near.len()) as f32
            }));
            std::mem::swap(now, next);
        }
        let (now, rows) = (
            &*now,
            levels.levels().last().map_or(&[][..], |finest| finest.rows()),
        );
        smoothed.resize(positions.len(), Vec3A::ZERO);
        for_each_chunk(smoothed, PART, |start, smoothed| {
            for (smoothed, row) in smoothed.iter_mut().zip(&rows[start..]) {
                let samples = row.samples.iter().zip(row.weights);
                *smoothed = samples.map(|(&s, weight)| now[s as usize] * weight).sum();
            }
        });
    }
}
