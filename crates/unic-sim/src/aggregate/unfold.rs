//! Flattening of a neighbourhood: distances along cloth as if it were laid out on a table.

use glam::{Vec2, Vec3};
use std::{cmp::Reverse, collections::BinaryHeap};
use unic_core::mesh::TriMesh;

/// Triangles with what is needed to walk from one to the next.
pub(super) struct Unfolder<'a> {
    mesh: &'a TriMesh,
    /// Edges, lower end first, with a face each; sorted.
    sides: Vec<([u32; 2], u32)>,
    /// Where the sides of each face's three edges begin.
    sides_at: Vec<[u32; 3]>,
    /// A face of each particle.
    face_at: Vec<u32>,
}

/// Scratch of one thread: what is laid out so far.
pub(super) struct Chart {
    /// Place of a particle, if `placed_in` is the current chart.
    places: Vec<Vec2>,
    placed_in: Vec<u32>,
    visited_in: Vec<u32>,
    current: u32,
    /// Particles laid out, in order.
    pub(super) reached: Vec<u32>,
    /// Where they lie.
    pub(super) laid: Vec<Vec2>,
    heap: BinaryHeap<Reverse<Step>>,
}

/// A face to enter, by the distance from the origin of the corner that it adds.
///
/// It brings its own layout along, a continuation of that of the face that it is entered from:
/// around a corner that cannot be flattened the layouts of two faces differ, and one mixed from
/// both may be turned over.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Step {
    /// Bits of a number that is not negative sort as the number.
    distance: u32,
    face: u32,
    /// The edge crossed, then the corner added.
    corners: [u32; 3],
    /// Bits of their places.
    places: [[u32; 2]; 3],
}

impl Chart {
    pub(super) fn new(mesh: &TriMesh) -> Self {
        Self {
            places: vec![Vec2::ZERO; mesh.vertices.len()],
            placed_in: vec![0; mesh.vertices.len()],
            visited_in: vec![0; mesh.faces.len()],
            current: 0,
            reached: Vec::new(),
            laid: Vec::new(),
            heap: BinaryHeap::new(),
        }
    }

    /// Where a particle lies; none when it was not reached.
    #[inline]
    pub(super) fn place(&self, particle: u32) -> Option<Vec2> {
        let p = particle as usize;
        (self.placed_in[p] == self.current).then(|| self.places[p])
    }

    fn put(&mut self, particle: u32, place: Vec2) {
        self.places[particle as usize] = place;
        self.placed_in[particle as usize] = self.current;
        self.reached.push(particle);
        self.laid.push(place);
    }

    fn clear(&mut self) {
        self.current += 1;
        self.reached.clear();
        self.laid.clear();
        self.heap.clear();
    }
}

impl<'a> Unfolder<'a> {
    pub(super) fn new(mesh: &'a TriMesh) -> Self {
        let mut face_at = vec![u32::MAX; mesh.vertices.len()];
        let mut sides = Vec::with_capacity(3 * mesh.faces.len());
        for (face, &[a, b, c]) in mesh.faces.iter().enumerate() {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                sides.push((ends(p, q), face as u32));
                face_at[p as usize] = face_at[p as usize].min(face as u32);
            }
        }
        sides.sort_unstable();
        let mut sides_at = vec![[0; 3]; mesh.faces.len()];
        let mut first = 0;
        for (at, &(edge, face)) in sides.iter().enumerate() {
            if sides[first].0 != edge {
                first = at;
            }
            let corners = mesh.faces[face as usize];
            for k in (0..3).filter(|&k| ends(corners[k], corners[(k + 1) % 3]) == edge) {
                sides_at[face as usize][k] = first as u32;
            }
        }
        Self {
            mesh,
            sides,
            sides_at,
            face_at,
        }
    }

    /// Lays out what is within `radius` metres of a particle, which goes to the origin: faces in
    /// the order of their distance, each beside the one that it was entered from. Exact where the
    /// cloth can be flattened.
    pub(super) fn lay_out(&self, origin: u32, radius: f32, chart: &mut Chart) {
        chart.clear();
        chart.put(origin, Vec2::ZERO);
        let Some(&corners) = self.mesh.faces.get(self.face_at[origin as usize] as usize) else {
            return;
        };
        let turn = corners.iter().position(|&c| c == origin).unwrap_or(0);
        let (next, third) = (corners[(turn + 1) % 3], corners[(turn + 2) % 3]);
        let length = self.place_of(next).distance(self.place_of(origin));
        let edge = [Vec2::ZERO, Vec2::X * length];
        let last = self.beside([origin, next], edge, third, Vec2::NEG_Y);
        chart.put(next, edge[1]);
        chart.put(third, last);
        chart.visited_in[self.face_at[origin as usize] as usize] = chart.current;
        let from = self.face_at[origin as usize];
        self.push_around(
            from,
            [origin, next, third],
            [edge[0], edge[1], last],
            radius,
            chart,
        );
        while let Some(Reverse(step)) = chart.heap.pop() {
            if chart.visited_in[step.face as usize] == chart.current {
                continue;
            }
            chart.visited_in[step.face as usize] = chart.current;
            let places = step.places.map(|bits| Vec2::from(bits.map(f32::from_bits)));
            if chart.place(step.corners[2]).is_none() {
                chart.put(step.corners[2], places[2]);
            }
            self.push_around(step.face, step.corners, places, radius, chart);
        }
    }

    /// Offers the faces across the edges of the face `from`, which is laid out.
    fn push_around(&self, from: u32, corners: [u32; 3], places: [Vec2; 3], radius: f32, chart: &mut Chart) {
        for turn in 0..3 {
            let at = [turn, (turn + 1) % 3];
            let (edge, laid) = (at.map(|k| corners[k]), at.map(|k| places[k]));
            let inner = places[(turn + 2) % 3];
            for face in self.faces_of(from, ends(edge[0], edge[1])) {
                if chart.visited_in[face as usize] == chart.current {
                    continue;
                }
                let all = self.mesh.faces[face as usize];
                let added = all.into_iter().find(|v| !edge.contains(v)).unwrap_or(edge[0]);
                let place = self.beside(edge, laid, added, inner);
                if place.length() <= radius {
                    chart.heap.push(Reverse(Step {
                        distance: place.length().to_bits(),
                        face,
                        corners: [edge[0], edge[1], added],
                        places: [laid[0], laid[1], place].map(|v| v.to_array().map(f32::to_bits)),
                    }));
                }
            }
        }
    }

    /// Place of a corner by an edge that is laid out, on the side of it where `inner` is not.
    fn beside(&self, [p, q]: [u32; 2], [start, end]: [Vec2; 2], corner: u32, inner: Vec2) -> Vec2 {
        let [from, to, at] = [p, q, corner].map(|v| self.place_of(v));
        let (edge, arm) = (to - from, at - from);
        let along = arm.dot(edge) / edge.length_squared().max(f32::MIN_POSITIVE);
        let height = (arm - edge * along).length();
        let flat = end - start;
        let across = flat.perp().normalize_or_zero();
        let is_left = (inner - start).dot(across) > 0.0;
        start + flat * along + across * if is_left { -height } else { height }
    }

    /// Faces at an edge of a face.
    fn faces_of(&self, face: u32, edge: [u32; 2]) -> impl Iterator<Item = u32> {
        let corners = self.mesh.faces[face as usize];
        let k = (0..3).find(|&k| ends(corners[k], corners[(k + 1) % 3]) == edge);
        let first = k.map_or(self.sides.len(), |k| self.sides_at[face as usize][k] as usize);
        let same = self.sides[first..].iter().take_while(move |(e, _)| *e == edge);
        same.map(|(_, face)| *face)
    }

    fn place_of(&self, particle: u32) -> Vec3 {
        self.mesh.vertices[particle as usize]
    }
}

/// An edge, its lower end first.
fn ends(p: u32, q: u32) -> [u32; 2] {
    [p.min(q), p.max(q)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f32::consts::TAU;

    /// `around` × `along` squares of a sheet rolled into a tube of a given radius.
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
    fn a_tube_is_laid_out_flat() {
        let (around, radius) = (60, 0.2);
        let tube = tube(around, 20, radius);
        let unfolder = Unfolder::new(&tube);
        let mut chart = Chart::new(&tube);
        let origin = 10 * around + 7;
        unfolder.lay_out(origin, 0.15, &mut chart);
        let side = 2.0 * radius * (TAU / 2.0 / around as f32).sin();
        let height = TAU * radius / around as f32;
        assert!(chart.reached.len() > 100, "{}", chart.reached.len());
        for &p in &chart.reached {
            let turns = (p % around) as f32 - 7.0;
            let rows = (p / around) as f32 - 10.0;
            let expected = Vec2::new(turns * side, rows * height).length();
            let found = chart.place(p).unwrap().length();
            assert!((found - expected).abs() < 1e-5, "{p}: {found} {expected}");
            assert!(found < 0.15 + 1e-5);
        }
    }
}
