//! A batch of points and its division into tiles and groups.

use std::ops::Range;

use crate::error::expect_length;
use crate::{FieldShape, KernelError};

/// Points of one tile at most. A multiple of 12, the rows of a block; at width 256 a tile's layer takes 192 KB, so
/// that a layer's input, output and weights fit the second-level cache together.
const TILE_POINTS: usize = 192;

/// Tiles in a chunk at least: clearing and summing a chunk's weight gradient stays near 2 % of the work.
const CHUNK_TILES: usize = 8;

/// Chunks at most: bounds the memory of their gradients and the threads that backward can use.
const MAX_CHUNKS: usize = 64;

/// What the field is evaluated on: groups (frames) of equally many points, each group with a latent of its own.
#[derive(Debug, Clone, Copy)]
pub struct Batch<'a> {
    /// `[groups · points_per_group, P]`, row-major.
    pub points: &'a [f32],
    /// `[groups, L]`, row-major.
    pub latents: &'a [f32],
    /// Points in each group.
    pub points_per_group: usize,
}

/// A batch's sizes, checked against a field.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Extent {
    pub(crate) points: usize,
    pub(crate) points_per_group: usize,
    pub(crate) groups: usize,
}

impl Batch<'_> {
    /// Number of groups: as many as the points fill, or, without points, as there are latents.
    pub fn groups(&self, shape: &FieldShape) -> usize {
        match self.points_per_group * shape.point_inputs {
            0 => self.latents.len().checked_div(shape.latent).unwrap_or(0),
            group => self.points.len() / group,
        }
    }

    pub(crate) fn extent(&self, shape: &FieldShape) -> Result<Extent, KernelError> {
        let groups = self.groups(shape);
        let points = groups * self.points_per_group;
        expect_length("points", points * shape.point_inputs, self.points.len())?;
        expect_length("latents", groups * shape.latent, self.latents.len())?;
        Ok(Extent {
            points,
            points_per_group: self.points_per_group,
            groups,
        })
    }
}

/// Rows of a tile that belong to one group.
pub(crate) struct Segment {
    pub(crate) group: usize,
    pub(crate) rows: Range<usize>,
}

impl Extent {
    /// Points of every tile but the last.
    pub(crate) fn tile_points(&self) -> usize {
        self.points.clamp(1, TILE_POINTS)
    }

    pub(crate) fn tiles(&self) -> usize {
        self.points.div_ceil(self.tile_points())
    }

    /// Points of every chunk but the last; a function of the batch's size alone, so that results are the same for
    /// any number of threads.
    pub(crate) fn chunk_points(&self) -> usize {
        let tiles = CHUNK_TILES.max(self.tiles().div_ceil(MAX_CHUNKS));
        tiles * self.tile_points()
    }

    pub(crate) fn chunks(&self) -> usize {
        self.points.div_ceil(self.chunk_points())
    }

    /// Points of the tile that starts at `first`.
    pub(crate) fn tile_at(&self, first: usize) -> Range<usize> {
        first..self.points.min(first + self.tile_points())
    }

    /// Groups that some consecutive points belong to.
    pub(crate) fn groups_of(&self, points: &Range<usize>) -> Range<usize> {
        if points.is_empty() {
            return 0..0;
        }
        points.start / self.points_per_group..(points.end - 1) / self.points_per_group + 1
    }

    /// The groups of a tile, with rows counted from the tile's first point.
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
