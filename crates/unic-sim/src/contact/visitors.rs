//! Bare limbs that come too close to dressed parts of the body.

use glam::Vec3;
use rayon::prelude::*;
use unic_core::{character::Character, folds::Folds, surface::Surface};

/// A bare limb this close to a dressed part leaves no room for cloth between them, metres.
const NEAR_M: f32 = 0.003;

/// So far around what is close the limb lets cloth through, metres: half a forearm, or
/// cloth that has passed its near side would be caught by the far one.
const AROUND_M: f32 = 0.05;

/// A limb is bare when no more of the garment than this share lies on it.
const BARE_SHARE: f32 = 0.005;

/// Limbs that are told apart: bits of a set.
const MOST_LIMBS: usize = 32;

/// The parts of a body that the garment does not cover, as limbs: below the sleeves' ends the arms,
/// below a hem the legs.
///
/// Captured arms reach into bellies and hips, which real ones cannot. Cloth between them would be
/// scooped up, and stay. So a limb that comes closer than [`NEAR_M`] passes through the garment, as
/// it does through the body; only what hangs on the part that the limb grows from, a sleeve at its
/// elbow, still feels it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Limbs {
    /// Of each face: the bit of its limb, zero where it is dressed.
    of_face: Vec<u32>,
    /// Of each face: bits of the limbs that grow from its part.
    beside_face: Vec<u32>,
    /// Of each particle: bits of the limbs that it always feels.
    felt: Vec<u32>,
    /// Vertices of bare limbs, with their bits.
    vertices: Vec<(u32, u32)>,
}

impl Limbs {
    /// For particles at these places of the bind pose.
    pub(crate) fn new(character: &Character, rest: &[Vec3]) -> Self {
        let joint_of_face = joints_of_faces(character);
        let surface = Surface::build(&character.body);
        let home = |p: &Vec3| surface.closest(*p).map(|hit| joint_of_face[hit.face as usize]);
        let homes: Vec<Option<usize>> = rest.par_iter().map(home).collect();
        let parents = character.skeleton.parents();
        let limb_of_joint = bare_limbs(parents, &homes);
        let parent_of = |limb: usize| limb_of_joint.root[limb].and_then(|root| parents[root]);
        let beside = |joint: usize| {
            let grows_here = |limb: &usize| parent_of(*limb) == Some(joint);
            let limbs = (0..limb_of_joint.root.len()).filter(grows_here);
            limbs.fold(0, |bits, limb| bits | 1 << limb)
        };
        let of_face: Vec<u32> = (joint_of_face.iter())
            .map(|&joint| limb_of_joint.bit(joint))
            .collect();
        Self {
            beside_face: joint_of_face.iter().map(|&joint| beside(joint)).collect(),
            felt: (homes.iter())
                .map(|home| home.map_or(0, |joint| beside(joint) | limb_of_joint.bit(joint)))
                .collect(),
            vertices: vertices_of(character, &of_face),
            of_face,
        }
    }
}

/// Which bare limb each joint belongs to.
struct BareLimbs {
    of_joint: Vec<Option<usize>>,
    /// The joint that each limb begins with.
    root: Vec<Option<usize>>,
}

impl BareLimbs {
    fn bit(&self, joint: usize) -> u32 {
        self.of_joint[joint].map_or(0, |limb| 1 << limb)
    }
}

/// The largest subtrees on which next to nothing of the garment lies.
fn bare_limbs(parents: &[Option<usize>], homes: &[Option<usize>]) -> BareLimbs {
    let mut worn = vec![0usize; parents.len()];
    for &home in homes.iter().flatten() {
        let mut joint = Some(home);
        while let Some(j) = joint {
            worn[j] += 1;
            joint = parents[j];
        }
    }
    let most = (BARE_SHARE * homes.len() as f32) as usize;
    let is_bare = |joint: usize| worn[joint] <= most;
    let mut limbs = BareLimbs {
        of_joint: vec![None; parents.len()],
        root: Vec::new(),
    };
    let begins = |joint: &usize| is_bare(*joint) && parents[*joint].is_some_and(|parent| !is_bare(parent));
    for root in (0..parents.len()).filter(begins).take(MOST_LIMBS) {
        let limb = limbs.root.len();
        limbs.root.push(Some(root));
        for joint in 0..parents.len() {
            let mut up = Some(joint);
            while up.is_some_and(|j| j != root) {
                up = up.and_then(|j| parents[j]);
            }
            if up.is_some() {
                limbs.of_joint[joint] = Some(limb);
            }
        }
    }
    limbs
}

/// The joint that moves each face most.
fn joints_of_faces(character: &Character) -> Vec<usize> {
    let joint_of = |face: &[u32; 3]| {
        let mut sums = vec![0.0f32; character.skeleton.len()];
        for &vertex in face {
            for (joint, weight) in character.weights.row(vertex as usize) {
                sums[joint] += weight;
            }
        }
        let best = sums.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        best.map_or(0, |(joint, _)| joint)
    };
    character.body.faces.iter().map(joint_of).collect()
}

fn vertices_of(character: &Character, of_face: &[u32]) -> Vec<(u32, u32)> {
    let faces = character.body.faces.iter().zip(of_face);
    let bare = faces.filter(|(_, bit)| **bit != 0);
    let mut vertices: Vec<(u32, u32)> = bare.flat_map(|(face, &bit)| face.map(|v| (v, bit))).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}

/// Which faces let the garment through in one pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Visitors {
    limbs: Limbs,
    /// Of each face: the bit of its limb where that is too close to a dressed part, else zero.
    visiting: Vec<u32>,
    /// Vertices that are close themselves, with their bits.
    close: Vec<(Vec3, u32)>,
    is_visiting: Vec<bool>,
}

impl Visitors {
    pub(super) fn new(limbs: Limbs) -> Self {
        Self {
            limbs,
            ..Self::default()
        }
    }

    /// For the pose of the last refit.
    pub(super) fn find(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3]) {
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
        self.visiting.extend(
            (surface.faces().iter().zip(of_face)).map(|(face, bit)| if is_visiting(face) { *bit } else { 0 }),
        );
    }

    /// Whether a particle passes through a face; false for what is no face.
    pub(super) fn pass(&self, particle: usize, face: u32) -> bool {
        let bit = self.visiting.get(face as usize).copied().unwrap_or(0);
        bit != 0 && self.limbs.felt[particle] & bit == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use unic_core::{
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

    /// A particle on the trunk and one on the upper arm.
    fn shirt() -> [Vec3; 2] {
        [Vec3::Y * 0.06, Vec3::new(0.2, 0.06, 0.0)]
    }

    #[test]
    fn a_limb_begins_where_the_garment_ends() {
        let limbs = Limbs::new(&cubes(), &shirt());
        let faces = limbs.of_face.len() / 4;
        let bits: Vec<u32> = limbs.of_face.iter().step_by(faces).copied().collect();
        assert_eq!(bits, [0, 0, 1, 1], "forearm and hand are one limb");
        assert_eq!(limbs.felt, [0, 1], "the sleeve feels the forearm that it ends at");
        let gloves = Limbs::new(&cubes(), &[Vec3::X * 0.66]);
        assert!(
            gloves.of_face.iter().all(|&bit| bit == 0),
            "what carries the garment is no limb"
        );
    }

    #[test]
    fn a_hand_at_the_trunk_passes_through_the_shirt_and_one_beside_it_does_not() {
        let character = cubes();
        let mut visitors = Visitors::new(Limbs::new(&character, &shirt()));
        let hand = character.body.vertices.len() / 4 * 3;
        let hand_face = (character.body.faces.len() / 4 * 3) as u32;
        let mut passes = |gap: f32| {
            let mut posed = character.body.vertices.clone();
            let way = Vec3::new(-0.6, 0.0, 0.1 + gap);
            posed[hand..].iter_mut().for_each(|v| *v += way);
            let mut surface = Surface::build(&character.body);
            surface.refit(&posed);
            let mut folds = Folds::default();
            folds.find(&surface);
            visitors.find(&surface, &folds, &posed);
            let (trunk, sleeve) = (visitors.pass(0, hand_face), visitors.pass(1, hand_face));
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
}
