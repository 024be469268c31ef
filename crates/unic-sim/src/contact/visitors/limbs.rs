//! The parts of a body that a garment does not cover.

use glam::Vec3;
use rayon::prelude::*;
use unic_core::{
    character::Character,
    mesh::{TriMesh, vertex_normals},
    surface::{Surface, SurfacePoint},
};

/// Cloth farther from a limb tells nothing about it, metres.
const BESIDE_M: f32 = 0.3;

/// A limb is bare when no more of the garment than this share lies on it.
const BARE_SHARE: f32 = 0.005;

/// Limbs that are told apart: bits of a set.
const MOST_LIMBS: usize = 32;

/// The parts of a body that the garment does not cover, as limbs: below the sleeves' ends the arms,
/// below a hem the legs.
///
/// A limb is a set of one bit.
#[derive(Clone, Debug, Default)]
pub(crate) struct Limbs {
    /// Of each face: the bit of its limb, zero where it is dressed.
    pub(super) of_face: Vec<u32>,
    /// Of each face: bits of the limbs that grow from its part.
    pub(super) beside_face: Vec<u32>,
    /// Of each particle: bits of the limbs that it always feels.
    pub(super) felt: Vec<u32>,
    /// Vertices of bare limbs, with their bits.
    pub(super) vertices: Vec<(u32, u32)>,
    /// Bits of the limbs that the garment does not reach over: arms beside a skirt, not the shins
    /// below it.
    pub(super) outer: u32,
    /// Of each particle: 1 where the normals of the garment's faces point away from the body, −1
    /// where they point to it.
    pub(super) outward: Vec<f32>,
    /// Faces of the garment.
    pub(super) garment: Vec<[u32; 3]>,
}

impl Limbs {
    /// For particles at the vertices of `rest`, in bind-pose space.
    pub(crate) fn new(character: &Character, rest: &TriMesh) -> Self {
        let joint_of_face = character.joints_of_faces();
        let surface = Surface::build(&character.body);
        let hits: Vec<_> = rest.vertices.par_iter().map(|p| surface.closest(*p)).collect();
        let home = |hit: &SurfacePoint| joint_of_face[hit.face as usize];
        let homes: Vec<Option<usize>> = hits.iter().map(|hit| hit.as_ref().map(home)).collect();
        let parents = character.skeleton.parents();
        let bare = BareLimbs::find(parents, &homes);
        let felt = |joint| bare.beside(joint, parents) | bare.bit(joint);
        let of_face: Vec<u32> = joint_of_face.iter().map(|&joint| bare.bit(joint)).collect();
        let mut normals = Vec::new();
        vertex_normals(&rest.vertices, &rest.faces, &mut normals);
        let mut limbs = Self {
            outward: turned_outward(&mut normals, &hits),
            beside_face: joint_of_face
                .iter()
                .map(|&joint| bare.beside(joint, parents))
                .collect(),
            felt: homes.iter().map(|home| home.map_or(0, felt)).collect(),
            vertices: vertices_of(character, &of_face),
            of_face,
            outer: 0,
            garment: rest.faces.clone(),
        };
        limbs.outer = (0..bare.root.len())
            .map(|limb| 1 << limb)
            .filter(|&bit| limbs.is_outside(bit, &character.body.vertices, &rest.vertices, &normals))
            .fold(0, |bits, bit| bits | bit);
        limbs
    }

    /// Whether most of a limb lies on the outer side of the cloth next to it, or beyond
    /// [`BESIDE_M`]. `normals` point outward.
    fn is_outside(&self, bit: u32, body: &[Vec3], particles: &[Vec3], normals: &[Vec3]) -> bool {
        let cloth = || (0..particles.len()).filter(|&i| self.felt[i] & bit == 0);
        let vote = |&(vertex, _): &(u32, u32)| {
            let p = body[vertex as usize];
            let distance = |i: &usize| particles[*i].distance_squared(p);
            let nearest = cloth().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            let is_beside = distance(&nearest) < BESIDE_M * BESIDE_M;
            is_beside.then(|| i32::from((p - particles[nearest]).dot(normals[nearest]) > 0.0) * 2 - 1)
        };
        // An eighth of the vertices tells as much.
        let vertices: Vec<_> = self
            .vertices
            .iter()
            .filter(|(_, of)| *of == bit)
            .step_by(8)
            .collect();
        let votes: i32 = vertices.par_iter().filter_map(|&vertex| vote(vertex)).sum();
        votes >= 0
    }
}

/// Turns a garment's normals away from the body; the signs that did it.
fn turned_outward(normals: &mut [Vec3], hits: &[Option<SurfacePoint>]) -> Vec<f32> {
    let mut signs = vec![1.0; normals.len()];
    for ((normal, sign), hit) in normals.iter_mut().zip(&mut signs).zip(hits) {
        if hit.as_ref().is_some_and(|hit| normal.dot(hit.normal) < 0.0) {
            (*sign, *normal) = (-1.0, -*normal);
        }
    }
    signs
}

/// Which bare limb each joint belongs to.
struct BareLimbs {
    of_joint: Vec<Option<usize>>,
    /// The joint that each limb begins with.
    root: Vec<usize>,
}

impl BareLimbs {
    /// The largest subtrees on which next to nothing of the garment lies. `homes`: for each particle the
    /// joint whose part it lies on.
    fn find(parents: &[Option<usize>], homes: &[Option<usize>]) -> Self {
        let up = |joint: usize| std::iter::successors(Some(joint), |&j| parents[j]);
        let mut worn = vec![0usize; parents.len()];
        for joint in homes.iter().flatten().flat_map(|&home| up(home)) {
            worn[joint] += 1;
        }
        let most = (BARE_SHARE * homes.len() as f32) as usize;
        let is_bare = |joint: usize| worn[joint] <= most;
        let begins =
            |joint: &usize| is_bare(*joint) && parents[*joint].is_some_and(|parent| !is_bare(parent));
        let root: Vec<usize> = (0..parents.len()).filter(begins).take(MOST_LIMBS).collect();
        let limb_of = |joint: usize| up(joint).find_map(|j| root.iter().position(|&r| r == j));
        Self {
            of_joint: (0..parents.len()).map(limb_of).collect(),
            root,
        }
    }

    /// The bit of a joint's limb; zero where it is dressed.
    fn bit(&self, joint: usize) -> u32 {
        self.of_joint[joint].map_or(0, |limb| 1 << limb)
    }

    /// Bits of the limbs that grow from a joint's part.
    fn beside(&self, joint: usize, parents: &[Option<usize>]) -> u32 {
        let roots = self.root.iter().enumerate();
        let grow_here = roots.filter(|(_, root)| parents[**root] == Some(joint));
        grow_here.fold(0, |bits, (limb, _)| bits | 1 << limb)
    }
}

fn vertices_of(character: &Character, of_face: &[u32]) -> Vec<(u32, u32)> {
    let faces = character.body.faces.iter().zip(of_face);
    let bare = faces.filter(|(_, bit)| **bit != 0);
    let mut vertices: Vec<(u32, u32)> = bare.flat_map(|(face, &bit)| face.map(|v| (v, bit))).collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
