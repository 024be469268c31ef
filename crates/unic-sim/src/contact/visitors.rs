//! Bare limbs that come too close to dressed parts of the body, and come out under the cloth.
//!
//! Captured arms reach into bellies and hips, which real ones cannot. Cloth between them would be
//! scooped up, and stay. So a limb that comes closer than [`NEAR_M`] passes through the garment, as it
//! does through the body. On the way back it may come out under the cloth, which it would lift. So a
//! limb that the garment does not cover touches the cloth's outer side alone, and what of it is under
//! the cloth passes through with all that is around it: fingers that are half through would take the
//! cloth along. Only what hangs on the part that the limb grows from, a sleeve at its elbow, always
//! feels it.

mod limbs;

use glam::Vec3;
pub(crate) use limbs::Limbs;
use rayon::prelude::*;
use unic_core::{folds::Folds, mesh::vertex_normals, surface::Surface};

/// A bare limb this close to a dressed part leaves no room for cloth between them, metres.
const NEAR_M: f32 = 0.003;

/// Cloth farther from a limb than this says nothing about it, metres.
const BESIDE_M: f32 = 0.02;

/// So far around what is close the limb lets cloth through, metres: half a forearm, or
/// cloth that has passed its near side would be caught by the far one.
const AROUND_M: f32 = 0.03;

/// Which faces let the garment through in one pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Visitors {
    limbs: Limbs,
    /// Of each face: it is of a limb that is too close to a dressed part there; empty when none is.
    visiting: Vec<bool>,
    /// Vertices that are close themselves, with their bits.
    close: Vec<(Vec3, u32)>,
    is_visiting: Vec<bool>,
    /// Of each particle: outward.
    cloth_normals: Vec<Vec3>,
    /// Of each face of the body.
    body_normals: Vec<Vec3>,
}

impl Visitors {
    pub(super) fn new(limbs: Limbs) -> Self {
        Self {
            limbs,
            ..Self::default()
        }
    }

    /// For the body's pose of the last refit, with its vertices at `positions`, and particles.
    pub(super) fn find(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3], particles: &[Vec3]) {
        self.find_sides(surface, positions, particles);
        self.find_close(surface, folds, positions);
        self.find_under(positions, particles);
        self.spread(surface, positions);
    }

    /// Which way the cloth and the body's faces look.
    fn find_sides(&mut self, surface: &Surface, positions: &[Vec3], particles: &[Vec3]) {
        if self.limbs.outer == 0 {
            return;
        }
        vertex_normals(particles, &self.limbs.garment, &mut self.cloth_normals);
        for (normal, sign) in self.cloth_normals.iter_mut().zip(&self.limbs.outward) {
            *normal *= *sign;
        }
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        };
        self.body_normals.clear();
        self.body_normals.extend(surface.faces().iter().map(normal));
    }

    fn find_close(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3]) {
        let Limbs {
            of_face,
            beside_face,
            vertices,
            ..
        } = &self.limbs;
        self.close.clear();
        self.close
            .par_extend(vertices.par_iter().filter_map(|&(vertex, bit)| {
                let p = positions[vertex as usize];
                let is_dressed = |face: u32| (of_face[face as usize] | beside_face[face as usize] & bit) == 0;
                // Deep inside a dressed part its surface is far; fingers that touch each other are not.
                let reach = if folds.vertices()[vertex as usize] {
                    AROUND_M
                } else {
                    NEAR_M
                };
                let is_close = surface.closest_where(p, reach, is_dressed).is_some();
                is_close.then_some((p, bit))
            }));
    }

    /// Vertices that are on the inner side of the cloth next to them: a hand that is half through would
    /// take it along on its fingers.
    fn find_under(&mut self, positions: &[Vec3], particles: &[Vec3]) {
        let Limbs {
            felt,
            vertices,
            outer,
            ..
        } = &self.limbs;
        for limb in (0..u32::BITS)
            .map(|limb| 1 << limb)
            .filter(|bit| outer & bit != 0)
        {
            let of_limb = vertices.iter().filter(|(_, bit)| *bit == limb);
            let of_limb: Vec<Vec3> = of_limb.map(|(vertex, _)| positions[*vertex as usize]).collect();
            let low = of_limb.iter().copied().fold(Vec3::INFINITY, Vec3::min) - BESIDE_M;
            let high = of_limb.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) + BESIDE_M;
            let is_beside = |&i: &usize| {
                let p = particles[i];
                felt[i] & limb == 0 && p.cmpge(low).all() && p.cmple(high).all()
            };
            let mut cloth: Vec<usize> = (0..particles.len()).filter(is_beside).collect();
            cloth.sort_by(|&a, &b| particles[a].x.total_cmp(&particles[b].x));
            let under = of_limb
                .par_iter()
                .filter(|p| self.is_beneath(**p, &cloth, particles));
            let under: Vec<(Vec3, u32)> = under.map(|p| (*p, limb)).collect();
            self.close.extend(under);
        }
    }

    /// Whether a point is on the inner side of the particle next to it, if one is near. `cloth` is sorted
    /// by x.
    fn is_beneath(&self, p: Vec3, cloth: &[usize], particles: &[Vec3]) -> bool {
        let from = cloth.partition_point(|&i| particles[i].x < p.x - BESIDE_M);
        let to = cloth.partition_point(|&i| particles[i].x <= p.x + BESIDE_M);
        let distance = |i: usize| particles[i].distance_squared(p);
        let near = cloth[from..to].iter().copied();
        let nearest = near.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.filter(|&i| distance(i) < BESIDE_M * BESIDE_M);
        nearest.is_some_and(|i| (p - particles[i]).dot(self.cloth_normals[i]) < 0.0)
    }

    /// Spreads what is close over the limb.
    fn spread(&mut self, surface: &Surface, positions: &[Vec3]) {
        let Limbs {
            of_face, vertices, ..
        } = &self.limbs;
        self.is_visiting.clear();
        self.is_visiting.resize(positions.len(), false);
        if self.close.is_empty() {
            self.visiting.clear();
            return;
        }
        for &(vertex, bit) in vertices {
            let p = positions[vertex as usize];
            let is_near = |(q, of): &(Vec3, u32)| *of == bit && q.distance_squared(p) < AROUND_M * AROUND_M;
            self.is_visiting[vertex as usize] |= self.close.iter().any(is_near);
        }
        let is_visiting = |face: &[u32; 3]| face.iter().any(|&v| self.is_visiting[v as usize]);
        self.visiting.clear();
        let faces = surface.faces().iter().zip(of_face);
        self.visiting
            .extend(faces.map(|(face, bit)| *bit != 0 && is_visiting(face)));
    }

    /// Whether a particle passes through a face; false for what is no face.
    pub(super) fn pass(&self, particle: usize, face: u32) -> bool {
        let face = face as usize;
        let bit = self.limbs.of_face.get(face).copied().unwrap_or(0);
        if bit == 0 || self.limbs.felt[particle] & bit != 0 {
            return false;
        }
        let is_visiting = self.visiting.get(face).is_some_and(|&is| is);
        is_visiting || (self.limbs.outer & bit != 0 && self.is_under(particle, face))
    }

    /// Whether the face looks at the inner side of the cloth.
    fn is_under(&self, particle: usize, face: usize) -> bool {
        let normals = self.cloth_normals.get(particle).zip(self.body_normals.get(face));
        normals.is_some_and(|(cloth, body)| cloth.dot(*body) > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::{
        character::Character,
        mesh::TriMesh,
        skeleton::{Skeleton, SkeletonParts},
        skinning::SkinningWeights,
    };

    /// Four cubes in a row along x, 10 cm thick and 20 cm apart: trunk, upper arm, forearm, hand.
    fn cubes() -> Character {
        let corner = |i: u32| Vec3::from([i & 1, i >> 1 & 1, i >> 2].map(|bit| bit as f32 - 0.5)) * 0.1;
        let squares = [
            [0, 4, 6, 2],
            [1, 3, 7, 5],
            [0, 1, 5, 4],
            [2, 6, 7, 3],
            [0, 2, 3, 1],
            [4, 5, 7, 6],
        ];
        let (mut vertices, mut faces, mut rows) = (Vec::new(), Vec::new(), Vec::new());
        for joint in 0..4 {
            let first = vertices.len() as u32;
            let centre = Vec3::X * 0.2 * joint as f32;
            vertices.extend((0..8).map(|i| corner(i) + centre));
            let triangles = squares.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
            faces.extend(triangles.map(|f: [u32; 3]| f.map(|v| v + first)));
            rows.extend([(joint, 1.0); 8].map(std::iter::once));
        }
        let parts = SkeletonParts {
            parents: vec![-1, 0, 1, 2],
            joints: (0..4).map(|j| Vec3::X * 0.2 * j as f32).collect(),
            ..Default::default()
        };
        Character {
            body: TriMesh::new(vertices, faces).unwrap(),
            skeleton: Skeleton::new(parts).unwrap(),
            weights: SkinningWeights::from_rows(4, rows.into_iter()).unwrap(),
        }
    }

    /// A patch of cloth over each of these places, facing up.
    fn patches<const N: usize>(places: [Vec3; N]) -> TriMesh {
        let corners = [-Vec3::ONE, Vec3::Z, Vec3::X].map(|p| p.with_y(0.0) * 0.01);
        let vertices = places.iter().flat_map(|&p| corners.map(|corner| p + corner));
        let face = |i: u32| [3 * i, 3 * i + 1, 3 * i + 2];
        TriMesh::new(vertices.collect(), (0..N as u32).map(face).collect()).unwrap()
    }

    /// A patch on the trunk, particles 0 to 2, and one on the upper arm.
    fn shirt() -> TriMesh {
        patches([Vec3::Y * 0.06, Vec3::new(0.2, 0.06, 0.0)])
    }

    /// For the cubes with the last one moved.
    fn find_with_hand_moved(visitors: &mut Visitors, character: &Character, cloth: &TriMesh, way: Vec3) {
        let mut posed = character.body.vertices.clone();
        let hand = posed.len() / 4 * 3;
        posed[hand..].iter_mut().for_each(|v| *v += way);
        let mut surface = Surface::build(&character.body);
        surface.refit(&posed);
        let mut folds = Folds::default();
        folds.find(&surface);
        visitors.find(&surface, &folds, &posed, &cloth.vertices);
    }

    #[test]
    fn a_limb_begins_where_the_garment_ends() {
        let limbs = Limbs::new(&cubes(), &shirt());
        let faces = limbs.of_face.len() / 4;
        let bits: Vec<u32> = limbs.of_face.iter().step_by(faces).copied().collect();
        assert_eq!(bits, [0, 0, 1, 1], "forearm and hand are one limb");
        assert_eq!(
            limbs.felt,
            [0, 0, 0, 1, 1, 1],
            "the sleeve feels the forearm that it ends at"
        );
        let gloves = Limbs::new(&cubes(), &patches([Vec3::X * 0.66]));
        assert!(
            gloves.of_face.iter().all(|&bit| bit == 0),
            "what carries the garment is no limb"
        );
    }

    #[test]
    fn a_hand_at_the_trunk_passes_through_the_shirt_and_one_beside_it_does_not() {
        let character = cubes();
        let cloth = shirt();
        let mut visitors = Visitors::new(Limbs::new(&character, &cloth));
        let hand_face = (character.body.faces.len() / 4 * 3) as u32;
        let mut passes = |gap: f32| {
            find_with_hand_moved(&mut visitors, &character, &cloth, Vec3::new(-0.6, 0.0, 0.1 + gap));
            let (trunk, sleeve) = (visitors.pass(0, hand_face), visitors.pass(3, hand_face));
            assert!(
                !visitors.pass(0, 0) && !visitors.pass(0, u32::MAX),
                "the trunk stays solid"
            );
            (trunk, sleeve)
        };
        assert_eq!(passes(0.03), (false, false));
        assert_eq!(passes(0.002), (true, false));
        assert_eq!(passes(-0.02), (true, false));
        assert_eq!(passes(0.5), (false, false));
    }

    #[test]
    fn what_the_garment_does_not_cover_touches_its_outer_side_alone() {
        let character = cubes();
        let (cloth, surface) = (shirt(), Surface::build(&character.body));
        let mut folds = Folds::default();
        folds.find(&surface);
        let limbs = Limbs::new(&character, &cloth);
        assert_eq!(limbs.outer, 1);
        let mut visitors = Visitors::new(limbs);
        let hand = (character.body.faces.len() / 4 * 3) as u32;
        let faces = surface.faces()[hand as usize..].iter().zip(hand..);
        let facing = |way: Vec3| {
            let looks = |face: &[u32; 3]| {
                let [a, b, c] = face.map(|v| character.body.vertices[v as usize]);
                (b - a).cross(c - a).dot(way) > 1e-6
            };
            faces.clone().find(|(face, _)| looks(face)).unwrap().1
        };
        visitors.find(&surface, &folds, &character.body.vertices, &cloth.vertices);
        let passes = |particle, way| visitors.pass(particle, facing(way));
        assert!(passes(0, Vec3::Y), "the top of a hand under the cloth");
        assert!(!passes(0, -Vec3::Y), "the palm of one upon it");
        assert!(!passes(3, Vec3::Y), "the sleeve feels it always");
        // The same shirt, sewn inside out.
        let mut reversed = cloth.clone();
        reversed.faces.iter_mut().for_each(|face| face.swap(0, 1));
        let mut visitors = Visitors::new(Limbs::new(&character, &reversed));
        visitors.find(&surface, &folds, &character.body.vertices, &cloth.vertices);
        assert!(visitors.pass(0, facing(Vec3::Y)) && !visitors.pass(0, facing(-Vec3::Y)));
    }

    #[test]
    fn a_hand_half_through_the_cloth_passes_whole() {
        let character = cubes();
        // Cloth 25 cm over the trunk: nothing but the cloth is near a hand under it.
        let cloth = patches([Vec3::Y * 0.3, Vec3::new(0.2, 0.06, 0.0)]);
        let mut visitors = Visitors::new(Limbs::new(&character, &cloth));
        let side = (character.body.faces.len() / 4 * 3 + 2) as u32;
        let mut passes = |corner_y: f32| {
            // One corner of the hand comes to lie on the vertical through the cloth.
            let way = Vec3::new(-0.65, corner_y - 0.05, -0.05);
            find_with_hand_moved(&mut visitors, &character, &cloth, way);
            visitors.pass(0, side)
        };
        assert!(passes(0.295), "5 mm under the cloth");
        assert!(!passes(0.27), "3 cm under it");
        assert!(!passes(0.305), "through it and beyond");
    }

    #[test]
    fn legs_below_a_hem_touch_it_from_within() {
        // Cloth of the trunk that reaches over the arm, as a skirt does over both shins.
        let limbs = Limbs::new(
            &cubes(),
            &patches([Vec3::new(0.09, 0.08, 0.0), Vec3::new(0.2, 0.06, 0.0)]),
        );
        assert_eq!(limbs.felt, [0, 0, 0, 1, 1, 1]);
        assert_eq!(limbs.outer, 0);
    }
}
