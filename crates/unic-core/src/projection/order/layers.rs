//! Order of layers of a garment that lie on each other at rest, such as those of a pleat.

use super::{
    OrderDistances, Pair, Pairs,
    search::{Compared, Rule, Search, SearchScratch},
};
use crate::{mesh::TriMesh, parallel::for_each_chunk, projection::sweep::PART};
use glam::{IVec3, Vec3A, Vec4};
use std::{
    collections::HashMap,
    sync::atomic::{AtomicBool, Ordering},
};

// The numbers below suit a pleated dress (docs/lab/intersections.md).

/// Distances of this order.
pub const LAYERS: OrderDistances = OrderDistances { near: 7.0, kept: 2.0 };

/// Distance at rest up to which two vertices are of layers that lie on each other, gaps. Layers slide
/// along each other.
pub const REACH_GAPS: f32 = 27.0;

/// Least difference of heights at rest between vertices of two layers, gaps.
pub const LAYER_GAPS: f32 = 1.5;

/// Least cosine between the outward normals of two vertices that push each other. Pairs have their whole
/// weight from halfway between it and 1 on.
pub const LEAST_COSINE: f32 = 0.5;

/// Least cosine between the normal of a vertex and the mean normal around it. Others lie on the edge of
/// a fold, which has no normal.
const LEAST_FLATNESS: f32 = 0.5;

/// Least cosine between the outward normals of two vertices that lie on each other at rest, and between
/// these and the way from one to the other: the sides of a crease do not lie on each other.
const LEAST_STACKED: [f32; 2] = [0.8, 0.7];

/// Size of the cells whose vertices are averaged for the middle of the cloth, gaps.
const MEAN_CELL_GAPS: f32 = 20.0;

/// Vertices whose layers keep their order. An asset.
#[derive(Clone, Debug)]
pub struct LayerOrder {
    gap_m: f32,
    places: Vec<LayerPlace>,
    /// End of each vertex's corners in `corners`.
    ends: Vec<u32>,
    /// The two other corners of each face around a vertex.
    corners: Vec<[u32; 2]>,
}

/// Where a vertex is at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LayerPlace {
    /// Position, metres.
    pub position: Vec3A,
    /// Unit normal, turned outwards as most normals around it are; zero for a vertex that is not pushed.
    pub outward: Vec3A,
    /// Height above the middle of the cloth around it, metres.
    pub height_m: f32,
    /// Sign with which the normal of its faces points outwards. 0 for a vertex that is not pushed: with no
    /// other layer near it, on the edge of a fold, or not the first at its position.
    pub side: f32,
}

/// Buffers of a [`LayerOrder`].
#[derive(Clone, Debug, Default)]
pub(in crate::projection) struct LayerScratch {
    /// Outward unit normals of the current positions.
    outward: Vec<Vec3A>,
    search: SearchScratch,
    pub(in crate::projection) pairs: Pairs,
}

impl LayerOrder {
    /// Prepares the order of a garment, given the least distance between layers in metres, and its faces
    /// with welded seams. None for a garment without layers.
    pub(in crate::projection) fn new(
        gap_m: f32,
        rest: &TriMesh,
        faces: &[[u32; 3]],
        first_at_place: &[u32],
    ) -> Option<Self> {
        let positions: Vec<Vec3A> = rest.vertices.iter().map(|p| Vec3A::from(*p)).collect();
        let mut around = vec![Vec::new(); positions.len()];
        for &[a, b, c] in faces {
            for [own, next, last] in [[a, b, c], [b, c, a], [c, a, b]] {
                around[own as usize].push([next, last]);
            }
        }
        let end = |end: &mut u32, around: &Vec<[u32; 2]>| {
            *end += around.len() as u32;
            Some(*end)
        };
        let mut order = Self {
            gap_m,
            places: Vec::new(),
            ends: around.iter().scan(0, end).collect(),
            corners: around.concat(),
        };
        let is_first = |vertex: u32| first_at_place[vertex as usize] == vertex;
        order.places = order.places_at_rest(&positions, is_first);
        order.keep_layered(&positions);
        order
            .places
            .iter()
            .any(|place| place.side != 0.0)
            .then_some(order)
    }

    /// Least distance between layers, metres.
    pub fn gap_m(&self) -> f32 {
        self.gap_m
    }

    /// Places of all vertices.
    pub fn places(&self) -> &[LayerPlace] {
        &self.places
    }

    /// End of the faces around each vertex in [`LayerOrder::corners`].
    pub fn ends(&self) -> &[u32] {
        &self.ends
    }

    /// Faces around all vertices, vertex by vertex: their two other corners.
    pub fn corners(&self) -> &[[u32; 2]] {
        &self.corners
    }

    /// Finds the pairs that may have to push each other, given the positions of all vertices.
    pub(in crate::projection) fn find(&self, positions: &[Vec3A], scratch: &mut LayerScratch) {
        let LayerScratch {
            outward,
            search,
            pairs,
        } = scratch;
        outward.resize(positions.len(), Vec3A::ZERO);
        for_each_chunk(outward, PART, |start, outward| {
            for (vertex, outward) in (start..).zip(outward) {
                *outward = match self.places[vertex].side {
                    0.0 => Vec3A::ZERO,
                    side => self.normal(vertex, positions) * side,
                };
            }
        });
        let rule = LayerRule {
            places: &self.places,
            gap_m: self.gap_m,
        };
        self.search(rule, positions, outward, search)
            .find(&mut pairs.by_part);
    }

    fn search<'a, R: Rule>(
        &self,
        rule: R,
        positions: &[Vec3A],
        outward: &[Vec3A],
        scratch: &'a mut SearchScratch,
    ) -> Search<'a, R> {
        let layered = (0..).zip(&self.places).filter(|(_, place)| place.side != 0.0);
        let compared = |vertex: u32| Compared {
            position: positions[vertex as usize],
            vector: outward[vertex as usize],
            number: self.places[vertex as usize].height_m,
        };
        Search::new(
            rule,
            layered.map(|(vertex, _)| vertex),
            positions,
            compared,
            scratch,
        )
    }

    /// The two other corners of each face around a vertex.
    fn around(&self, vertex: usize) -> &[[u32; 2]] {
        let start = vertex.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.corners[start as usize..self.ends[vertex] as usize]
    }

    /// Unit normal of the faces around a vertex; zero if they have none.
    fn normal(&self, vertex: usize, positions: &[Vec3A]) -> Vec3A {
        let own = positions[vertex];
        let normals = self.around(vertex).iter().map(|corners| {
            let [next, last] = corners.map(|v| positions[v as usize] - own);
            next.cross(last)
        });
        normals.sum::<Vec3A>().normalize_or_zero()
    }

    /// Returns the place of each vertex relative to the cloth around it, whether or not that has layers.
    fn places_at_rest(&self, positions: &[Vec3A], is_first: impl Fn(u32) -> bool) -> Vec<LayerPlace> {
        let mut means = CellMeans::new(MEAN_CELL_GAPS * self.gap_m);
        let firsts = || (0..positions.len()).filter(|&vertex| is_first(vertex as u32));
        for vertex in firsts() {
            means.add(positions[vertex], self.normal(vertex, positions));
        }
        let mut places: Vec<LayerPlace> = (positions.iter())
            .map(|&position| LayerPlace {
                position,
                outward: Vec3A::ZERO,
                height_m: 0.0,
                side: 0.0,
            })
            .collect();
        for vertex in firsts() {
            let [middle, outward] = means.around(positions[vertex]);
            let normal = self.normal(vertex, positions);
            let cosine = normal.dot(outward);
            if cosine.abs() > LEAST_FLATNESS {
                places[vertex] = LayerPlace {
                    position: positions[vertex],
                    outward: normal * cosine.signum(),
                    height_m: (positions[vertex] - middle).dot(outward),
                    side: cosine.signum(),
                };
            }
        }
        places
    }

    /// Leaves out the vertices that have no other layer near them at rest.
    fn keep_layered(&mut self, positions: &[Vec3A]) {
        let outward: Vec<Vec3A> = self.places.iter().map(|place| place.outward).collect();
        let marks = Marks {
            gap_m: self.gap_m,
            is_layered: positions.iter().map(|_| AtomicBool::new(false)).collect(),
        };
        let mut scratch = SearchScratch::default();
        let search = self.search(&marks, positions, &outward, &mut scratch);
        search.find(&mut Vec::new());
        let is_marked = |vertex: u32| marks.is_layered[vertex as usize].load(Ordering::Relaxed);
        for vertex in 0..self.places.len() {
            // Beside a layer, too: a vertex above the middle of a face is not above its corners.
            let is_layered =
                is_marked(vertex as u32) || self.around(vertex).iter().flatten().any(|&v| is_marked(v));
            if !is_layered {
                let place = &mut self.places[vertex];
                (place.outward, place.side) = (Vec3A::ZERO, 0.0);
            }
        }
    }
}

/// Sums over the vertices in cells, for means over a few of them.
struct CellMeans {
    size_m: f32,
    /// Sums of positions and their number, and of normals.
    sums: HashMap<IVec3, (Vec4, Vec3A)>,
}

impl CellMeans {
    fn new(size_m: f32) -> Self {
        Self {
            size_m,
            sums: HashMap::new(),
        }
    }

    fn add(&mut self, position: Vec3A, normal: Vec3A) {
        let cell = (position / self.size_m).floor().as_ivec3();
        let (positions, normals) = self.sums.entry(cell).or_default();
        *positions += position.extend(1.0);
        *normals += normal;
    }

    /// Returns the mean position and the direction of the mean normal around a place. The cells around it
    /// have the weights of a quadratic B-spline.
    fn around(&self, place: Vec3A) -> [Vec3A; 2] {
        let cell = (place / self.size_m).floor();
        // Place in the cell, from −0.5 to 0.5.
        let within = place / self.size_m - cell - 0.5;
        let weights = |x: f32| [0.5 * (0.5 - x).powi(2), 0.75 - x * x, 0.5 * (0.5 + x).powi(2)];
        let weights = within.to_array().map(weights);
        let (mut positions, mut normals) = (Vec4::ZERO, Vec3A::ZERO);
        for step in 0..27 {
            let [x, y, z] = [step % 3, step / 3 % 3, step / 9];
            let steps = IVec3::new(x as i32, y as i32, z as i32) - 1;
            if let Some((position, normal)) = self.sums.get(&(cell.as_ivec3() + steps)) {
                let weight = weights[0][x] * weights[1][y] * weights[2][z];
                positions += *position * weight;
                normals += *normal * weight;
            }
        }
        let middle = Vec3A::from_vec4(positions) / positions.w;
        [middle, normals.normalize_or_zero()]
    }
}

/// Vertices are compared by their outward normals, and by their heights at rest.
struct LayerRule<'a> {
    places: &'a [LayerPlace],
    gap_m: f32,
}

impl Rule for LayerRule<'_> {
    fn near_m(&self) -> f32 {
        LAYERS.near * self.gap_m
    }

    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
        let upwards = own.vector + other.vector;
        let rise = (other.position - own.position).dot(upwards) * (other.number - own.number).signum();
        let kept = LAYERS.kept * self.gap_m;
        let is_far = rise > 0.0 && rise * rise > kept * kept * upwards.length_squared();
        are_layers(own, other, self.gap_m) && !is_far
    }

    /// Vertices that are not in order at rest lie where a fold turns the cloth.
    fn pair(&self, ends: [u32; 2], own: &Compared, other: &Compared) -> Option<Pair> {
        let [a, b] = ends.map(|v| self.places[v as usize]);
        let (side, at_rest) = ((b.height_m - a.height_m).signum(), b.position - a.position);
        let rest = at_rest.dot((a.outward + b.outward).normalize_or_zero()) * side;
        let upwards = (own.vector + other.vector).normalize_or_zero();
        let near = other.position.distance_squared(own.position) / (LAYERS.near * self.gap_m).powi(2);
        let agreement = (own.vector.dot(other.vector) - LEAST_COSINE) / (1.0 - LEAST_COSINE);
        let is_in_order = rest >= self.gap_m && at_rest.length() < REACH_GAPS * self.gap_m;
        is_in_order.then(|| Pair {
            ends,
            along: upwards * side,
            weight: (1.0 - near) * (2.0 * agreement).min(1.0),
        })
    }
}

/// Marks vertices that another layer lies on.
struct Marks {
    gap_m: f32,
    is_layered: Vec<AtomicBool>,
}

impl Rule for &Marks {
    fn near_m(&self) -> f32 {
        2.0 * LAYERS.near * self.gap_m
    }

    fn may_be_pair(&self, own: &Compared, other: &Compared) -> bool {
        let [agreement, upwards] = LEAST_STACKED;
        let between = (other.position - own.position).normalize_or_zero();
        let rise = between.dot((own.vector + other.vector).normalize_or_zero());
        own.vector.dot(other.vector) > agreement
            && rise * (other.number - own.number).signum() > upwards
            && are_layers(own, other, self.gap_m)
    }

    fn pair(&self, ends: [u32; 2], _: &Compared, _: &Compared) -> Option<Pair> {
        for end in ends {
            self.is_layered[end as usize].store(true, Ordering::Relaxed);
        }
        None
    }
}

/// Returns whether two vertices lie in different layers, whose outward normals agree. False for NaN.
fn are_layers(own: &Compared, other: &Compared, gap_m: f32) -> bool {
    (other.number - own.number).abs() >= LAYER_GAPS * gap_m && own.vector.dot(other.vector) > LEAST_COSINE
}
