//! Strain projection: gives a predicted garment its edge lengths back.
//!
//! For training, which measures the [`StrainLimit`]s of a garment, and for other implementations of
//! a step, which read the [`Edge`]s and [`Stencil`]s of a [`StrainProjection`]. Engines get it from
//! their animator.
//!
//! Linear predictions average over garments with wrinkles in different places, and an average of
//! wrinkles is flat and too short. Edges that are shorter than the cloth ever was are the trace of
//! the folds that are missing. The projection stretches them back to their lengths, and the cloth
//! buckles into folds.
//!
//! It adds an offset to every predicted position, in the vertex's own rotated frame. The offset has
//! a memory, so that a wrinkle stays where it is while the body is still:
//!
//! 1. The offset of the previous tick moves on by its decaying velocity, is limited to a radius and
//!    drawn back to the prediction a little.
//! 2. On coarse levels of well-spread vertices, chords between neighbours are brought into their
//!    limits, and all vertices move along. Sweeps over the edges of a fine mesh would not reach far,
//!    and the cloth would crumple where it should hang lower. The moves of a level are smoothed, or
//!    the level would crumple itself.
//! 3. A few Gauss-Seidel sweeps over the edges bring each length into its limits (position-based
//!    dynamics, Müller et al. 2007). Sweeps over hinges between them smooth the offset by the
//!    quadratic bending energy of Bergou et al. 2006. Free edges, which have no hinges, are smoothed
//!    by their third differences. Between the last sweeps, pushes keep folds and layers from
//!    passing through each other ([`order`]).
//! 4. What is left is the offset of this tick.
//!
//! The prediction itself is not changed: it continues as if there were no projection.

mod constraints;
mod freedom;
mod levels;
pub mod order;
mod smoothed;
mod stencil;
mod sweep;
#[cfg(test)]
mod tests;
mod transfer;

use crate::{
    animator::VertexState,
    config::ProjectionConfig,
    features::PointHistory,
    mesh::TriMesh,
    parallel::{for_each, for_each_chunk},
    topology::{edges, weld},
};
use constraints::{Constraints, Sweeps};
use glam::{Vec3, Vec3A};
use levels::{LevelScratch, LevelTopology};
use order::{LayerOrder, LayerScratch, ORDER_PASSES, SheetOrder, SheetScratch};
use stencil::bending_stencils;
use sweep::PART;
use thiserror::Error;

pub use freedom::Freedom;
pub use levels::{Level, LevelSmoothing, Levels};
pub use smoothed::{SMOOTHING_ROUNDS, SmoothedShape};
pub use sweep::{Edge, LEAST_LENGTH, Stencil};

/// Sweeps of a start without a previous tick, for each sweep of a later tick.
pub const START_ROUNDS: usize = 4;

/// Rounds of relaxation after intersection handling. Each round begins with pushes into the [`order`] of
/// the cloth, if it has one. [`RELAX_SWEEPS`] sweeps over the edges follow. One sweep over hinges and
/// free edges follows the first of them, unless the projection has none. Then vertices move above their
/// planes.
pub const RELAX_ROUNDS: usize = 3;

/// Sweeps over the edges in each of the [`RELAX_ROUNDS`].
pub const RELAX_SWEEPS: usize = 3;

/// Range of lengths that an edge keeps, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrainLimit {
    /// Least length.
    pub shortest: f32,
    /// Greatest length.
    pub longest: f32,
}

/// Error of limits that are not one for each of the [`limited_pairs`].
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("strain projection: expected {expected} limits of lengths, found {found}")]
pub struct LimitCountError {
    /// Number of the pairs.
    pub expected: usize,
    /// Number of limits that were given.
    pub found: usize,
}

/// Edges of the mesh with its seams [welded](weld). Each is a pair of vertices with the lower index
/// first.
pub fn welded_edges(rest: &TriMesh) -> Vec<[u32; 2]> {
    edges(&welded_faces(rest, &weld(&rest.vertices)))
}

/// Pairs of vertices whose distances [`StrainLimit`]s limit, in their order: the [`welded_edges`],
/// then the chords of the coarse levels, if there are any.
pub fn limited_pairs(config: &ProjectionConfig, rest: &TriMesh) -> Vec<[u32; 2]> {
    let first_at_place = weld(&rest.vertices);
    let faces = welded_faces(rest, &first_at_place);
    let mut pairs = edges(&faces);
    if config.coarse_sweeps > 0 {
        pairs.extend(LevelTopology::new(rest, &faces, &first_at_place).chords());
    }
    pairs
}

fn welded_faces(rest: &TriMesh, first_at_place: &[u32]) -> Vec<[u32; 3]> {
    let welded = |face: &[u32; 3]| face.map(|v| first_at_place[v as usize]);
    rest.faces.iter().map(welded).collect()
}

/// Strain projection of one garment: its constraints, coloured and packed. An asset.
#[derive(Clone, Debug)]
pub struct StrainProjection {
    config: ProjectionConfig,
    limits: Vec<StrainLimit>,
    /// First vertex at the place of each vertex. Only first vertices are solved for.
    first_at_place: Vec<u32>,
    freedom: Freedom,
    constraints: Constraints,
    levels: Option<Levels>,
    order: Option<SheetOrder>,
    layers: Option<LayerOrder>,
}

/// Time and place of a tick of the projection.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProjectionTick {
    /// Duration of the tick, seconds.
    pub(crate) dt: f32,
    /// World position near the garment, which positions are measured from, metres. Far from the
    /// world's origin f32 is too coarse for differences along an edge.
    pub(crate) origin: Vec3,
    /// Whether there was a tick before.
    pub(crate) memory: Memory,
}

/// Use of the offsets of the previous tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Memory {
    /// There was no tick before. Offsets start at zero and get more sweeps.
    None,
    /// Offsets continue.
    Previous,
}

/// Half-space n · x ≥ h that a vertex stays in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ContactPlane {
    /// Unit normal n; zero for a vertex without a plane.
    pub(crate) normal: Vec3,
    /// Height h along the normal, metres.
    pub(crate) height: f32,
}

impl ContactPlane {
    /// No plane: every position is allowed.
    pub(crate) const NONE: Self = Self {
        normal: Vec3::ZERO,
        height: 0.0,
    };

    /// Returns the closest allowed position.
    fn closest(&self, p: Vec3) -> Vec3 {
        let below = (self.height - self.normal.dot(p)).max(0.0);
        p + self.normal * below
    }
}

/// Buffers of a projection.
#[derive(Clone, Debug, Default)]
pub(crate) struct ProjectionScratch {
    /// Positions from which hinges smooth the moves, metres: the predicted ones relative to the tick's
    /// origin, then the shown ones before intersection handling, in world space.
    smoothed_from: Vec<Vec3A>,
    /// Projected positions relative to the tick's origin, metres.
    projected: Vec<Vec3A>,
    levels: LevelScratch,
    orders: OrderScratch,
}

/// Buffers of the pushes into the order of the cloth.
#[derive(Clone, Debug, Default)]
struct OrderScratch {
    sheet: SheetScratch,
    layers: LayerScratch,
}

impl ProjectionScratch {
    /// Keeps the shown positions before intersection handling, metres, for
    /// [`StrainProjection::relax`].
    pub(crate) fn keep_uncorrected(&mut self, positions: &[Vec3]) {
        self.smoothed_from.clear();
        self.smoothed_from
            .extend(positions.iter().map(|p| Vec3A::from(*p)));
    }
}

impl StrainProjection {
    /// Prepares the projection of a garment. `mask` is that of the garment: vertices keep this share
    /// of their freedom, and those at 0 stay at the prediction.
    ///
    /// `limits` has one entry for each of the [`limited_pairs`] of `rest`.
    ///
    /// # Errors
    /// Another number of limits.
    pub fn new(
        config: ProjectionConfig,
        rest: &TriMesh,
        mask: Option<&[f32]>,
        limits: Vec<StrainLimit>,
    ) -> Result<Self, LimitCountError> {
        let first_at_place = weld(&rest.vertices);
        let faces = welded_faces(rest, &first_at_place);
        let freedom = Freedom::of_mask(mask, &first_at_place);
        let ends = edges(&faces);
        let levels = (config.coarse_sweeps > 0).then(|| LevelTopology::new(rest, &faces, &first_at_place));
        let chord_count = levels.as_ref().map_or(0, |l| l.chords().count());
        let (expected, found) = (ends.len() + chord_count, limits.len());
        if expected != found {
            return Err(LimitCountError { expected, found });
        }
        let count = rest.vertices.len();
        let packed = ends.iter().zip(&limits);
        let packed = packed.map(|(&ends, &limit)| Edge { ends, limit });
        let stencils = bending_stencils(&rest.vertices, &faces, &ends, config.bending);
        let stencils = stencils.iter().map(|s| Stencil::new(s, &freedom));
        let limits_of_chords = &limits[ends.len()..];
        let levels = levels.map(|topology| Levels::new(topology, rest, &config, &freedom, limits_of_chords));
        let edge_m = mean_length(rest, &ends);
        let order = levels.as_ref().filter(|_| config.order > 0.0);
        let order =
            order.and_then(|levels| SheetOrder::new(config.order * edge_m, rest, &first_at_place, levels));
        let layers = (config.layers > 0.0)
            .then(|| LayerOrder::new(config.layers, edge_m, rest, &faces, &first_at_place));
        Ok(Self {
            levels,
            order,
            layers: layers.flatten(),
            constraints: Constraints::new(packed.collect(), stencils.collect(), count),
            config,
            limits,
            first_at_place,
            freedom,
        })
    }

    /// Settings.
    pub fn config(&self) -> &ProjectionConfig {
        &self.config
    }

    /// Limits of the [`limited_pairs`], in their order.
    pub fn limits(&self) -> &[StrainLimit] {
        &self.limits
    }

    /// Coarse levels, which are solved before the edges.
    pub fn levels(&self) -> Option<&Levels> {
        self.levels.as_ref()
    }

    /// Order along the smoothed shape that the cloth keeps; none where the settings have none, and without
    /// levels.
    pub fn order(&self) -> Option<&SheetOrder> {
        self.order.as_ref()
    }

    /// Order of the layers of the cloth; none where the settings have none, and for a garment without
    /// layers.
    pub fn layers(&self) -> Option<&LayerOrder> {
        self.layers.as_ref()
    }

    /// First vertex at the rest place of each vertex, which is the vertex itself away from seams.
    /// Only first vertices are solved for.
    pub fn first_at_place(&self) -> &[u32] {
        &self.first_at_place
    }

    /// Share of its moves that each vertex makes.
    pub fn freedom(&self) -> &Freedom {
        &self.freedom
    }

    /// Edges colour by colour, in the order of a sweep. Those of one colour share no vertex.
    pub fn edge_colours(&self) -> impl Iterator<Item = &[Edge]> {
        self.constraints.edges.iter()
    }

    /// Bending stencils colour by colour, in the order of a sweep. Those of one colour share no
    /// vertex.
    pub fn stencil_colours(&self) -> impl Iterator<Item = &[Stencil]> {
        self.constraints.stencils.iter()
    }

    /// Advances the offsets by one tick, given the predicted world positions of all vertices.
    ///
    /// An offset's `value` and `previous` are its last two ticks, metres, in the vertex's frame.
    pub(crate) fn advance(
        &self,
        tick: ProjectionTick,
        points: &[PointHistory],
        predicted: &[Vec3],
        offsets: &mut [VertexState],
        scratch: &mut ProjectionScratch,
    ) {
        let ProjectionScratch {
            smoothed_from: relative,
            projected,
            levels,
            orders,
        } = scratch;
        relative.resize(predicted.len(), Vec3A::ZERO);
        projected.resize(predicted.len(), Vec3A::ZERO);
        let starts = relative.chunks_mut(PART).zip(projected.chunks_mut(PART));
        let carried = (predicted.chunks(PART).zip(points.chunks(PART))).zip(offsets.chunks(PART));
        for_each(
            starts.zip(carried),
            |((relative, projected), ((predicted, points), offsets))| {
                let starts = relative.iter_mut().zip(projected);
                for ((relative, projected), ((p, point), offset)) in
                    starts.zip(predicted.iter().zip(points).zip(offsets))
                {
                    *relative = Vec3A::from(*p - tick.origin);
                    *projected = *relative + point.now.rotation * Vec3A::from(self.carried(tick, offset));
                }
            },
        );
        self.solve(tick.memory, relative, projected, (levels, orders));
        let (relative, projected) = (&*relative, &*projected);
        for_each_chunk(offsets, PART, |start, offsets| {
            for (vertex, offset) in (start..).zip(offsets) {
                let solved = projected[self.first_at_place[vertex] as usize] - relative[vertex];
                let value = points[vertex].now.rotation.inverse() * Vec3::from(solved);
                let value = value.clamp_length_max(self.config.radius_m);
                *offset = VertexState {
                    // The velocity of a start is zero.
                    previous: match tick.memory {
                        Memory::None => value,
                        Memory::Previous => offset.value,
                    },
                    value,
                };
            }
        });
    }

    /// Returns the offset at the start of a tick's sweeps, metres.
    fn carried(&self, tick: ProjectionTick, offset: &VertexState) -> Vec3 {
        if tick.memory == Memory::None {
            return Vec3::ZERO;
        }
        // Time constants, not factors, so that the result depends little on the tick rate.
        let velocity = (offset.value - offset.previous) * (-tick.dt / self.config.carry_s).exp();
        let moved = (offset.value + velocity).clamp_length_max(self.config.radius_m);
        moved * (-tick.dt / self.config.pull_s).exp()
    }

    /// Brings the edges of shown positions, metres, back towards their limits after intersection
    /// handling, while each vertex stays above its plane.
    ///
    /// One sweep over hinges and free edges, unless `bending_sweeps` is 0, follows the first sweep of
    /// each round. It smooths the moves from the positions that [`ProjectionScratch::keep_uncorrected`]
    /// has kept in this tick. Without it the cloth beside a push crumples. `order_share` scales the
    /// pushes into the order of the cloth, 0 to 1: cloth that was given has to stay as it lies.
    pub(crate) fn relax(
        &self,
        planes: &[ContactPlane],
        order_share: f32,
        positions: &mut [Vec3],
        scratch: &mut ProjectionScratch,
    ) {
        let ProjectionScratch {
            smoothed_from: uncorrected,
            projected: relaxed,
            orders,
            ..
        } = scratch;
        relaxed.clear();
        relaxed.extend(positions.iter().map(|p| Vec3A::from(*p)));
        // After the first sweep of a round: later ones lengthen the edges that hinges have shortened.
        let sweeps = Sweeps {
            edges: RELAX_SWEEPS,
            smoothed: self.config.hinge_sweeps().min(1),
        };
        self.find_pairs(relaxed, orders);
        for _ in 0..RELAX_ROUNDS {
            self.push_pairs(order_share, orders, relaxed);
            (self.constraints).sweep(sweeps, &self.freedom, uncorrected, relaxed);
            for (p, plane) in relaxed.iter_mut().zip(planes) {
                *p = plane.closest((*p).into()).into();
            }
        }
        // Vertices at one place move together.
        for (position, &first) in positions.iter_mut().zip(&self.first_at_place) {
            *position = relaxed[first as usize].into();
        }
    }

    /// Sweeps over the constraints.
    fn solve(
        &self,
        memory: Memory,
        predicted: &[Vec3A],
        projected: &mut [Vec3A],
        (of_levels, orders): (&mut LevelScratch, &mut OrderScratch),
    ) {
        let rounds = match memory {
            Memory::None => START_ROUNDS,
            Memory::Previous => 1,
        };
        if let Some(levels) = &self.levels {
            levels.solve(rounds, &self.freedom, of_levels, projected);
        }
        let smoothed = rounds * self.config.hinge_sweeps();
        let of_edges = |edges| Sweeps { edges, smoothed: 0 };
        let sweep = |sweeps, positions: &mut [Vec3A]| {
            (self.constraints).sweep(sweeps, &self.freedom, predicted, positions);
        };
        sweep(
            Sweeps {
                edges: smoothed,
                smoothed,
            },
            projected,
        );
        let left = rounds * self.config.sweeps - smoothed;
        if self.order.is_none() && self.layers.is_none() {
            return sweep(of_edges(left), projected);
        }
        self.find_pairs(projected, orders);
        for edges in between_pushes(left) {
            self.push_pairs(1.0, orders, projected);
            sweep(of_edges(edges), projected);
        }
    }

    /// Finds the pairs of vertices that may have to be pushed into their order, if there is one.
    fn find_pairs(&self, positions: &[Vec3A], scratch: &mut OrderScratch) {
        if let (Some(order), Some(levels)) = (&self.order, &self.levels) {
            order.find(levels, positions, &mut scratch.sheet);
        }
        if let Some(layers) = &self.layers {
            layers.find(positions, &mut scratch.layers);
        }
    }

    /// Pushes the found pairs by a share, 0 to 1: first along the smoothed shape, then between layers.
    fn push_pairs(&self, share: f32, scratch: &mut OrderScratch, positions: &mut [Vec3A]) {
        if let Some(order) = &self.order {
            (scratch.sheet.pairs).push(order.gap_m(), share, &self.freedom, positions);
        }
        if let Some(layers) = &self.layers {
            (scratch.layers.pairs).push(layers.gap_m(), share, &self.freedom, positions);
        }
    }
}

/// Splits sweeps over the edges into those after each of the [`ORDER_PASSES`].
pub fn between_pushes(sweeps: usize) -> [usize; ORDER_PASSES] {
    std::array::from_fn(|i| sweeps * (i + 1) / ORDER_PASSES - sweeps * i / ORDER_PASSES)
}

fn mean_length(rest: &TriMesh, ends: &[[u32; 2]]) -> f32 {
    let length = |&[a, b]: &[u32; 2]| rest.vertices[a as usize].distance(rest.vertices[b as usize]);
    ends.iter().map(length).sum::<f32>() / ends.len().max(1) as f32
}
