//! Constraints of the whole garment or of one of its levels, by colour, and sweeps over them.

use super::{
    freedom::Freedom,
    sweep::{self, Edge, Stage, Stencil},
};
use crate::colouring::colour_constraints;
use glam::Vec3A;

/// Edges or chords, and the stencils that smooth their moves.
#[derive(Clone, Debug)]
pub(super) struct Constraints {
    /// Number of vertices; those of all constraints are below it.
    vertices: usize,
    pub(super) edges: Colours<Edge>,
    pub(super) stencils: Colours<Stencil>,
}

/// Numbers of sweeps over [`Constraints`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweeps {
    /// Sweeps over the edges.
    pub(super) edges: usize,
    /// Number of the first sweeps over the edges that one over the stencils follows each.
    pub(super) smoothed: usize,
}

impl Constraints {
    /// Sorts constraints between `vertices` vertices by colour.
    pub(super) fn new(edges: Vec<Edge>, stencils: Vec<Stencil>, vertices: usize) -> Self {
        let ends: Vec<[u32; 2]> = edges.iter().map(|edge| edge.ends).collect();
        let corners: Vec<[u32; 4]> = stencils.iter().map(|stencil| stencil.vertices).collect();
        Self {
            vertices,
            edges: Colours::new(edges, &ends, vertices),
            stencils: Colours::new(stencils, &corners, vertices),
        }
    }

    /// Sweeps over the constraints. Stencils smooth the moves from `reference`.
    ///
    /// # Panics
    /// With fewer positions than vertices.
    pub(super) fn sweep(
        &self,
        sweeps: Sweeps,
        freedom: &Freedom,
        reference: &[Vec3A],
        positions: &mut [Vec3A],
    ) {
        assert!(positions.len() >= self.vertices, "one position for each vertex");
        let (edges, stencils) = (self.edges.len(), self.stencils.len());
        let smoothed = sweeps.smoothed * (edges + stencils);
        let stage_at = |stage: usize| match stage.checked_sub(smoothed) {
            Some(after) => Stage::Edges(self.edges.get(after % edges)),
            None => match (stage % (edges + stencils)).checked_sub(edges) {
                Some(colour) => Stage::Bending(self.stencils.get(colour)),
                None => Stage::Edges(self.edges.get(stage % (edges + stencils))),
            },
        };
        let rest = sweeps.edges.saturating_sub(sweeps.smoothed) * edges;
        // SAFETY: the constraints of a colour share no vertex, and their vertices exist, because
        // colours are found by them and there is a position for each.
        unsafe { sweep::solve(smoothed + rest, stage_at, freedom, reference, positions) }
    }
}

/// Constraints in the order of their colours. Those of one colour share no vertex.
#[derive(Clone, Debug)]
pub(super) struct Colours<T> {
    constraints: Vec<T>,
    /// End of each colour in `constraints`.
    ends: Vec<usize>,
}

impl<T> Colours<T> {
    /// Sorts constraints by colour, given the vertices of each.
    fn new<const N: usize>(constraints: Vec<T>, vertices: &[[u32; N]], vertex_count: usize) -> Self {
        let colours = colour_constraints(vertices, vertex_count);
        let ends = (colours.iter())
            .scan(0, |end, colour| {
                *end += colour.len();
                Some(*end)
            })
            .collect();
        let mut constraints: Vec<Option<T>> = constraints.into_iter().map(Some).collect();
        // Every constraint has one colour, so that each is taken once.
        let sorted = colours
            .iter()
            .flatten()
            .filter_map(|&i| constraints[i as usize].take());
        Self {
            constraints: sorted.collect(),
            ends,
        }
    }

    /// Number of colours.
    pub(super) fn len(&self) -> usize {
        self.ends.len()
    }

    /// Returns the constraints of a colour.
    pub(super) fn get(&self, colour: usize) -> &[T] {
        let start = colour.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.constraints[start..self.ends[colour]]
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &[T]> {
        (0..self.len()).map(|colour| self.get(colour))
    }
}
