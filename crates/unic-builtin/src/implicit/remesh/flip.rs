//! Edge flips to the other diagonal of the two triangles on an edge.

use super::{Remeshing, normal};
use glam::Vec3;

/// Condition under which an edge is flipped.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum FlipCriterion {
    /// The flip brings vertices nearer to six neighbours, or four at a border.
    Valence,
    /// The angles opposite to the edge sum to more than π (Delaunay).
    Angle,
}

/// Excess over π of the sum of opposite angles that justifies a flip, radians.
///
/// Without it rounding would flip the diagonals of squares back and forth.
const ANGLE_SLACK: f32 = 0.01;

impl Remeshing<'_> {
    /// Flips all edges that meet a criterion, in one pass.
    pub(super) fn flip(&mut self, when: FlipCriterion) {
        for [a, b] in self.edges() {
            self.flip_edge(a, b, when);
        }
    }

    /// Flips an edge if that is possible and useful; returns none if not.
    fn flip_edge(&mut self, a: u32, b: u32, when: FlipCriterion) -> Option<()> {
        let edge = self.faces_on(a, b).filter(|e| !self.is_curve(*e))?;
        let (first, second) = (edge.first, edge.second?);
        // The first face runs from a to b, the second one from b to a.
        let (a, b) = if goes(self.faces[first as usize], a, b) {
            (a, b)
        } else {
            (b, a)
        };
        let (c, d) = (self.opposite(first, a, b), self.opposite(second, a, b));
        // The new edge must not exist yet, with any number of faces.
        if self.faces_on(c, d).is_some() || self.neighbours(c).contains(&d) {
            return None;
        }
        let improves = match when {
            FlipCriterion::Valence => self.valence_gain([a, b, c, d]) > 0,
            FlipCriterion::Angle => {
                let angles = self.angle_at(c, a, b) + self.angle_at(d, a, b);
                angles > std::f32::consts::PI + ANGLE_SLACK
            }
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

    /// Returns true if a vertex keeps enough faces: three in the interior, one at a border.
    fn may_lose_a_face(&self, v: u32) -> bool {
        let faces = self.around[v as usize].len();
        let is_border = self.neighbours(v).len() > faces;
        faces > if is_border { 1 } else { 3 }
    }

    /// Decrease of the squared deviations from the ideal valence when the edge a-b is flipped to
    /// c-d.
    fn valence_gain(&self, [a, b, c, d]: [u32; 4]) -> i32 {
        let excess = |v: u32| {
            let faces = self.around[v as usize].len() as i32;
            let neighbours = self.neighbours(v).len() as i32;
            // A border vertex has one more neighbour than faces; its ideal is half a disc.
            if neighbours > faces {
                neighbours - 4
            } else {
                faces - 6
            }
        };
        let cost = |v: u32, change: i32| (excess(v) + change).pow(2) - excess(v).pow(2);
        -(cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1))
    }

    /// Returns true if flipping the edge a-b to c-d neither folds the surface nor makes a sliver.
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

/// Returns true if the outline of a face runs from `a` to `b`.
fn goes(face: [u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|k| (face[k], face[(k + 1) % 3]) == (a, b))
}
