//! Edges are flipped to the other diagonal of their two triangles.

use super::{Remeshing, normal};
use glam::Vec3;

/// When an edge is flipped.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Flip {
    /// Towards six neighbours a vertex, four at a border.
    Valence,
    /// Towards Delaunay: while the opposite angles sum to more than π.
    Angle,
}

impl Remeshing<'_> {
    pub(super) fn flip(&mut self, when: Flip) {
        for [a, b] in self.edges() {
            self.flip_edge(a, b, when);
        }
    }

    fn flip_edge(&mut self, a: u32, b: u32, when: Flip) -> Option<()> {
        let edge = self.faces_on(a, b).filter(|e| !self.is_curve(*e))?;
        let (first, second) = (edge.first, edge.second?);
        // Turned so that the first face goes from a to b.
        let (a, b) = if goes(self.faces[first as usize], a, b) {
            (a, b)
        } else {
            (b, a)
        };
        let (c, d) = (self.opposite(first, a, b), self.opposite(second, a, b));
        if self.faces_on(c, d).is_some() || self.neighbours(c).contains(&d) {
            return None;
        }
        let improves = match when {
            Flip::Valence => self.valence_gain([a, b, c, d]) > 0,
            Flip::Angle => self.angle_at(c, a, b) + self.angle_at(d, a, b) > std::f32::consts::PI + 0.01,
        };
        let (new_first, new_second) = ([a, d, c], [d, b, c]);
        let may_lose = [a, b].into_iter().all(|v| self.may_lose_a_face(v));
        if !improves || !may_lose || !self.keeps_shape([a, b, c, d]) {
            return None;
        }
        self.faces[first as usize] = new_first;
        self.faces[second as usize] = new_second;
        self.around[b as usize].retain(|&f| f != first);
        self.around[a as usize].retain(|&f| f != second);
        self.around[c as usize].push(second);
        self.around[d as usize].push(first);
        Some(())
    }

    /// An interior vertex keeps three faces, a border's one.
    fn may_lose_a_face(&self, v: u32) -> bool {
        let faces = self.around[v as usize].len();
        let is_border = self.neighbours(v).len() > faces;
        faces > if is_border { 1 } else { 3 }
    }

    /// By how much a flip brings the four vertices nearer to their ideal valences, in squares.
    fn valence_gain(&self, [a, b, c, d]: [u32; 4]) -> i32 {
        let excess = |v: u32| {
            let faces = self.around[v as usize].len() as i32;
            let neighbours = self.neighbours(v).len() as i32;
            // A border vertex has one neighbour more than faces, and stands for half a disc.
            if neighbours > faces {
                neighbours - 4
            } else {
                faces - 6
            }
        };
        let cost = |v: u32, change: i32| (excess(v) + change).pow(2) - excess(v).pow(2);
        -(cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1))
    }

    /// A flip neither folds the surface nor makes a sliver.
    fn keeps_shape(&self, [a, b, c, d]: [u32; 4]) -> bool {
        let face = |x, y, z| normal([x, y, z].map(|v| self.at(v)));
        let old = (face(a, b, c) + face(b, a, d)).normalize_or_zero();
        let sound =
            |n: Vec3, longest: f32| n.dot(old) > 0.7 * n.length() && n.length() > 0.15 * longest * longest;
        let longest = self.at(c).distance(self.at(d));
        sound(face(a, d, c), longest) && sound(face(d, b, c), longest)
    }

    fn angle_at(&self, corner: u32, a: u32, b: u32) -> f32 {
        (self.at(a) - self.at(corner)).angle_between(self.at(b) - self.at(corner))
    }
}

/// Whether the face's border runs from a to b.
fn goes(face: [u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|k| (face[k], face[(k + 1) % 3]) == (a, b))
}
