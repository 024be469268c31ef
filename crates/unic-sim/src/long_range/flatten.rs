//! Local flattening of a mesh: distances along the cloth, measured in the plane.

use glam::{Vec2, Vec3};
use std::{cmp::Reverse, collections::BinaryHeap};
use unic_core::mesh::TriMesh;

/// A mesh with the adjacency that flattening needs.
pub(super) struct Flattener<'a> {
    mesh: &'a TriMesh,
    /// Edges of all faces, each with its lower end first, sorted by edge and then by face.
    half_edges: Vec<HalfEdge>,
    /// Index of the first half-edge of each of a face's three edges.
    first_half_edges: Vec<[u32; 3]>,
    /// Lowest face of each particle.
    face_at: Vec<u32>,
}

/// An edge of a face. The derived order is by edge, then by face.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct HalfEdge {
    /// Particles at the ends, lower first.
    edge: [u32; 2],
    face: u32,
}

/// A planar chart of the neighbourhood of one particle, in metres; reused by one thread.
pub(super) struct Chart {
    /// Position of each particle in the chart number `placed_in`.
    places: Vec<Vec2>,
    placed_in: Vec<u32>,
    /// Number of the last chart that each face was visited in.
    visited_in: Vec<u32>,
    /// Number of the current chart. Counting charts makes clearing cheap: nothing per particle is
    /// reset.
    current: u32,
    /// Particles in the chart, in the order in which they were reached.
    pub(super) reached: Vec<u32>,
    /// Positions of `reached`.
    pub(super) positions: Vec<Vec2>,
    heap: BinaryHeap<Reverse<QueuedFace>>,
}

/// A face next to the chart. The derived order is by the distance from the origin of the corner
/// that the face adds.
///
/// Each face carries its own positions, which continue those of the face that it is entered from.
/// Around a vertex where cloth is not developable, the positions by two faces differ. A triangle
/// with corners from both could be flipped.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct QueuedFace {
    /// Distance of the added corner from the origin, metres, as bits. Bits of floats that are not
    /// negative have the same order as the floats, and integers implement `Ord`.
    distance: u32,
    face: u32,
    /// The two ends of the edge that is crossed, then the added corner.
    corners: [u32; 3],
    /// Chart positions of the corners, as bits.
    places: [[u32; 2]; 3],
}

/// An edge with its position in a chart.
#[derive(Clone, Copy)]
struct PlacedEdge {
    /// Particles at its ends.
    ends: [u32; 2],
    /// Chart positions of the ends, metres.
    places: [Vec2; 2],
}

impl Chart {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        Self {
            places: vec![Vec2::ZERO; mesh.vertices.len()],
            placed_in: vec![0; mesh.vertices.len()],
            visited_in: vec![0; mesh.faces.len()],
            current: 0,
            reached: Vec::new(),
            positions: Vec::new(),
            heap: BinaryHeap::new(),
        }
    }

    /// Returns the position of a particle in the chart; `None` when it was not reached.
    #[inline]
    pub(super) fn position(&self, particle: u32) -> Option<Vec2> {
        let p = particle as usize;
        (self.placed_in[p] == self.current).then(|| self.places[p])
    }

    fn place(&mut self, particle: u32, position: Vec2) {
        self.places[particle as usize] = position;
        self.placed_in[particle as usize] = self.current;
        self.reached.push(particle);
        self.positions.push(position);
    }

    fn clear(&mut self) {
        self.current += 1;
        self.reached.clear();
        self.positions.clear();
        self.heap.clear();
    }
}

impl<'a> Flattener<'a> {
    pub(super) fn new(mesh: &'a TriMesh) -> Self {
        let mut face_at = vec![u32::MAX; mesh.vertices.len()];
        let mut half_edges = Vec::with_capacity(3 * mesh.faces.len());
        for (face, &[a, b, c]) in mesh.faces.iter().enumerate() {
            let face = face as u32;
            for [p, q] in [[a, b], [b, c], [c, a]] {
                half_edges.push(HalfEdge {
                    edge: ends(p, q),
                    face,
                });
                face_at[p as usize] = face_at[p as usize].min(face);
            }
        }
        half_edges.sort_unstable();
        let mut first_half_edges = vec![[0; 3]; mesh.faces.len()];
        let mut first = 0;
        for (at, &HalfEdge { edge, face }) in half_edges.iter().enumerate() {
            if half_edges[first].edge != edge {
                first = at;
            }
            let corners = mesh.faces[face as usize];
            for k in (0..3).filter(|&k| ends(corners[k], corners[(k + 1) % 3]) == edge) {
                first_half_edges[face as usize][k] = first as u32;
            }
        }
        Self {
            mesh,
            half_edges,
            first_half_edges,
            face_at,
        }
    }

    /// Flattens the neighbourhood of a particle within `radius` metres into the chart, with the
    /// particle at the origin.
    ///
    /// Faces are added in the order of their distance, as in Dijkstra's algorithm, each next to the
    /// face that it is entered from. Distances are exact where the cloth is developable.
    pub(super) fn flatten(&self, origin: u32, radius: f32, chart: &mut Chart) {
        chart.clear();
        chart.place(origin, Vec2::ZERO);
        let Some(&corners) = self.mesh.faces.get(self.face_at[origin as usize] as usize) else {
            return;
        };
        let turn = corners.iter().position(|&c| c == origin).unwrap_or(0);
        let (next, third) = (corners[(turn + 1) % 3], corners[(turn + 2) % 3]);
        let length = self.rest_position(next).distance(self.rest_position(origin));
        // The rotation of a chart is arbitrary: the first edge lies along +x, the face above it.
        let edge = PlacedEdge {
            ends: [origin, next],
            places: [Vec2::ZERO, Vec2::X * length],
        };
        let last = self.beside(edge, third, Vec2::NEG_Y);
        chart.place(next, edge.places[1]);
        chart.place(third, last);
        chart.visited_in[self.face_at[origin as usize] as usize] = chart.current;
        let from = self.face_at[origin as usize];
        self.push_neighbours(
            from,
            [origin, next, third],
            [edge.places[0], edge.places[1], last],
            radius,
            chart,
        );
        while let Some(Reverse(next)) = chart.heap.pop() {
            // A face is queued once per neighbour; the entry with the smallest distance wins.
            if chart.visited_in[next.face as usize] == chart.current {
                continue;
            }
            chart.visited_in[next.face as usize] = chart.current;
            let places = next.places.map(|bits| Vec2::from(bits.map(f32::from_bits)));
            // The first position of a corner stays: faces come in the order of distance.
            if chart.position(next.corners[2]).is_none() {
                chart.place(next.corners[2], places[2]);
            }
            self.push_neighbours(next.face, next.corners, places, radius, chart);
        }
    }

    /// Queues the faces across the edges of the face `from`, whose corners are at `places` in the
    /// chart, if the corner that they add is within `radius` metres of the origin.
    fn push_neighbours(
        &self,
        from: u32,
        corners: [u32; 3],
        places: [Vec2; 3],
        radius: f32,
        chart: &mut Chart,
    ) {
        for turn in 0..3 {
            let at = [turn, (turn + 1) % 3];
            let edge = PlacedEdge {
                ends: at.map(|k| corners[k]),
                places: at.map(|k| places[k]),
            };
            let inner = places[(turn + 2) % 3];
            for face in self.faces_at_edge(from, ends(edge.ends[0], edge.ends[1])) {
                if chart.visited_in[face as usize] == chart.current {
                    continue;
                }
                let all = self.mesh.faces[face as usize];
                // A degenerate face may have no third corner.
                let added = all
                    .into_iter()
                    .find(|v| !edge.ends.contains(v))
                    .unwrap_or(edge.ends[0]);
                let place = self.beside(edge, added, inner);
                if place.length() <= radius {
                    chart.heap.push(Reverse(QueuedFace {
                        distance: place.length().to_bits(),
                        face,
                        corners: [edge.ends[0], edge.ends[1], added],
                        places: [edge.places[0], edge.places[1], place]
                            .map(|v| v.to_array().map(f32::to_bits)),
                    }));
                }
            }
        }
    }

    /// Returns the chart position of a corner that forms a triangle with the edge.
    ///
    /// The corner lies on the side of the edge that is opposite to `inner`, and has the same
    /// distances from both ends as in space.
    fn beside(&self, edge: PlacedEdge, corner: u32, inner: Vec2) -> Vec2 {
        let PlacedEdge {
            ends: [p, q],
            places: [start, end],
        } = edge;
        let [from, to, at] = [p, q, corner].map(|v| self.rest_position(v));
        let (edge, arm) = (to - from, at - from);
        // Degenerate edges occur in input meshes; the limit keeps 0/0 out of the chart.
        let along = arm.dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE);
        let height = (arm - edge * along).length();
        let flat = end - start;
        let across = flat.perp().normalize_or_zero();
        let is_left = (inner - start).dot(across) > 0.0;
        start + flat * along + across * if is_left { -height } else { height }
    }

    /// Lists the faces at an edge of `face`, itself included.
    fn faces_at_edge(&self, face: u32, edge: [u32; 2]) -> impl Iterator<Item = u32> {
        let corners = self.mesh.faces[face as usize];
        let k = (0..3).find(|&k| ends(corners[k], corners[(k + 1) % 3]) == edge);
        let first = k.map_or(self.half_edges.len(), |k| {
            self.first_half_edges[face as usize][k] as usize
        });
        let same = self.half_edges[first..]
            .iter()
            .take_while(move |half_edge| half_edge.edge == edge);
        same.map(|half_edge| half_edge.face)
    }

    fn rest_position(&self, particle: u32) -> Vec3 {
        self.mesh.vertices[particle as usize]
    }
}

/// Returns the ends of an edge, lower first.
fn ends(p: u32, q: u32) -> [u32; 2] {
    [p.min(q), p.max(q)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// A tube of `around` × `along` squares about the y axis, of the given radius in metres.
    fn tube(around: u32, along: u32, radius: f32) -> TriMesh {
        let side = TAU * radius / around as f32;
        let place = |i: u32| {
            let angle = TAU * (i % around) as f32 / around as f32;
            Vec3::new(
                radius * angle.cos(),
                side * (i / around) as f32,
                radius * angle.sin(),
            )
        };
        let at = |x: u32, y: u32| y * around + x % around;
        let squares = (0..along).flat_map(|y| (0..around).map(move |x| (x, y)));
        let faces = squares.flat_map(|(x, y)| {
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        });
        TriMesh::new((0..around * (along + 1)).map(place).collect(), faces.collect()).unwrap()
    }

    #[test]
    fn a_tube_is_flattened_without_distortion() {
        let (around, radius) = (60, 0.2);
        let tube = tube(around, 20, radius);
        let flattener = Flattener::new(&tube);
        let mut chart = Chart::new(&tube);
        let origin = 10 * around + 7;
        flattener.flatten(origin, 0.15, &mut chart);
        let side = 2.0 * radius * (TAU / 2.0 / around as f32).sin();
        let height = TAU * radius / around as f32;
        assert!(chart.reached.len() > 100, "{}", chart.reached.len());
        for &p in &chart.reached {
            let turns = (p % around) as f32 - 7.0;
            let rows = (p / around) as f32 - 10.0;
            let expected = Vec2::new(turns * side, rows * height).length();
            let found = chart.position(p).unwrap().length();
            assert!((found - expected).abs() < 1e-5, "{p}: {found} {expected}");
            assert!(found < 0.15 + 1e-5);
        }
    }
}
