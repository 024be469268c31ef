//! A batch of points and its partition into groups, tiles and chunks.

use std::ops::Range;

use crate::error::expect_length;
use crate::{FieldShape, KernelError};

/// Largest number of points in a tile. It is a multiple of 12, the number of rows of a block. At
/// width 256 the activations of a layer take 192 KB, so that a layer's input, output and weights
/// fit into the second-level cache together.
const TILE_POINTS: usize = 192;

/// Smallest number of tiles in a chunk. Clearing and adding up a chunk's weight gradient then takes
/// about 2 % of the work.
const CHUNK_TILES: usize = 8;

/// Largest number of chunks. It bounds the memory of their gradients, and the number of threads
/// that the backward pass can use.
const MAX_CHUNKS: usize = 64;

/// Inputs of the field: groups (frames) of equally many points, with one latent per group.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// Point inputs, `[groups · points_per_group, P]`, row-major.
    pub points: &'a [f32],
    /// Latents, `[groups, L]`, row-major.
    pub latents: &'a [f32],
    /// Number of points in each group.
    pub points_per_group: usize,
}

/// Sizes of a batch, checked against a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BatchExtent {
    /// Number of points in all groups.
    pub(crate) points: usize,
    pub(crate) points_per_group: usize,
    pub(crate) groups: usize,
}

impl Batch<'_> {
    /// Returns the number of groups that the points fill. Without points it is the number of
    /// latents.
    pub fn groups(&self, shape: &FieldShape) -> usize {
        match self.points_per_group * shape.point_inputs {
            0 => self.latents.len().checked_div(shape.latent).unwrap_or(0),
            group => self.points.len() / group,
        }
    }

    pub(crate) fn extent(&self, shape: &FieldShape) -> Result<BatchExtent, KernelError> {
        let groups = self.groups(shape);
        let points = groups * self.points_per_group;
        expect_length("points", points * shape.point_inputs, self.points.len())?;
        expect_length("latents", groups * shape.latent, self.latents.len())?;
        Ok(BatchExtent {
            points,
            points_per_group: self.points_per_group,
            groups,
        })
    }
}

/// The rows of a tile that belong to one group.
pub(crate) struct Segment {
    pub(crate) group: usize,
    /// Rows counted from the tile's first point.
    pub(crate) rows: Range<usize>,
}

impl BatchExtent {
    /// Returns the number of points of every tile except the last, which may have fewer.
    pub(crate) fn tile_points(&self) -> usize {
        // At least one, so that an empty batch divides by no zero.
        self.points.clamp(1, TILE_POINTS)
    }

    pub(crate) fn tiles(&self) -> usize {
        self.points.div_ceil(self.tile_points())
    }

    /// Returns the number of points of every chunk except the last. It depends on the size of the
    /// batch only, so that results are the same for any number of threads.
    pub(crate) fn chunk_points(&self) -> usize {
        let tiles = CHUNK_TILES.max(self.tiles().div_ceil(MAX_CHUNKS));
        tiles * self.tile_points()
    }

    pub(crate) fn chunks(&self) -> usize {
        self.points.div_ceil(self.chunk_points())
    }

    /// Returns the points of the tile that begins at `first`.
    pub(crate) fn tile_at(&self, first: usize) -> Range<usize> {
        first..self.points.min(first + self.tile_points())
    }

    /// Returns the groups that a range of points belongs to.
    pub(crate) fn groups_of(&self, points: &Range<usize>) -> Range<usize> {
        if points.is_empty() {
            return 0..0;
        }
        points.start / self.points_per_group..(points.end - 1) / self.points_per_group + 1
    }

    /// Lists the groups of a tile with their rows.
    pub(crate) fn segments(&self, tile: Range<usize>) -> impl Iterator<Item = Segment> {
        let per_group = self.points_per_group;
        self.groups_of(&tile).map(move |group| {
            let start = tile.start.max(group * per_group) - tile.start;
            let end = tile.end.min((group + 1) * per_group) - tile.start;
            Segment {
                group,
                rows: start..end,
            }
        })
    }
}
