//! Bare limbs: the parts of a body that a garment does not cover.

use glam::Vec3;
use rayon::prelude::*;
use unic_core::{
    character::Character,
    mesh::{TriMesh, vertex_normals},
    surface::{Surface, SurfacePoint},
};

/// Largest distance at which cloth decides whether a limb is outside the garment, metres.
const BESIDE_M: f32 = 0.3;

/// Largest share of the garment's particles that may lie on a bare limb.
const BARE_SHARE: f32 = 0.005;

/// Largest number of limbs: a [`LimbSet`] has one bit each.
const MAX_LIMBS: usize = LimbSet::BITS as usize;

/// Returns the point of a body next to each of a garment's particles, both in the bind pose; `None`
/// for a particle that is not finite.
pub(crate) fn hits_in_bind_pose(body: &TriMesh, rest: &TriMesh) -> Vec<Option<SurfacePoint>> {
    let surface = Surface::build(body);
    rest.vertices.par_iter().map(|p| surface.closest(*p)).collect()
}

/// A set of bare limbs, one bit per limb. The set of a single limb also serves as its name.
pub(super) type LimbSet = u32;

/// A vertex of a bare limb.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct LimbVertex {
    /// Index of the body's vertex.
    pub(super) vertex: u32,
    /// The limb.
    pub(super) limb: LimbSet,
}

/// The parts of a body that the garment does not cover, partitioned into limbs: arms below the ends
/// of the sleeves, legs below a hem.
#[derive(Clone, Debug, Default)]
pub(crate) struct BareLimbs {
    /// Limb of each face of the body; empty set where the part is covered.
    pub(super) limb_of_face: Vec<LimbSet>,
    /// Limbs attached to the part that each face of the body belongs to.
    pub(super) attached_limbs_of_face: Vec<LimbSet>,
    /// Limbs that each particle always collides with: its own and those attached to its part.
    pub(super) never_ignored: Vec<LimbSet>,
    /// Vertices of all limbs.
    pub(super) vertices: Vec<LimbVertex>,
    /// Limbs that the garment does not enclose: arms beside a skirt, but not the shins below it.
    pub(super) outside_limbs: LimbSet,
    /// Sign for each particle that makes the normal of the garment's faces point away from the
    /// body: 1 or −1.
    pub(super) normal_signs: Vec<f32>,
    /// Faces of the garment, over particles.
    pub(super) garment_faces: Vec<[u32; 3]>,
}

impl BareLimbs {
    /// Finds the bare limbs for a garment whose particles are the vertices of `rest`, in bind-pose
    /// space. `hits` holds the point of the body next to each particle, of [`hits_in_bind_pose`].
    pub(crate) fn new(character: &Character, rest: &TriMesh, hits: &[Option<SurfacePoint>]) -> Self {
        let joint_of_face = character.joints_of_faces();
        // Each particle lies on the part of the joint that the closest face belongs to.
        let joint_at = |hit: &SurfacePoint| joint_of_face[hit.face as usize];
        let joints: Vec<Option<usize>> = hits.iter().map(|hit| hit.as_ref().map(joint_at)).collect();
        let parents = character.skeleton.parents();
        let bare = LimbJoints::find(parents, &joints);
        let never_ignored = |joint| bare.attached_to(joint, parents) | bare.limb(joint);
        let limb_of_face: Vec<LimbSet> = joint_of_face.iter().map(|&joint| bare.limb(joint)).collect();
        let mut normals = Vec::new();
        vertex_normals(&rest.vertices, &rest.faces, &mut normals);
        let mut limbs = Self {
            normal_signs: turned_outward(&mut normals, hits),
            attached_limbs_of_face: joint_of_face
                .iter()
                .map(|&joint| bare.attached_to(joint, parents))
                .collect(),
            never_ignored: (joints.iter())
                .map(|joint| joint.map_or(0, never_ignored))
                .collect(),
            vertices: limb_vertices(character, &limb_of_face),
            limb_of_face,
            outside_limbs: 0,
            garment_faces: rest.faces.clone(),
        };
        limbs.outside_limbs = (0..bare.root.len())
            .map(|index| 1 << index)
            .filter(|&limb| limbs.is_outside(limb, &character.body.vertices, &rest.vertices, &normals))
            .fold(0, |set, limb| set | limb);
        limbs
    }

    /// Returns whether most of a limb lies on the outer side of the cloth next to it, or has no
    /// cloth within [`BESIDE_M`]. `normals` are those of the particles, away from the body.
    fn is_outside(&self, limb: LimbSet, body: &[Vec3], particles: &[Vec3], normals: &[Vec3]) -> bool {
        let cloth = || (0..particles.len()).filter(|&i| self.never_ignored[i] & limb == 0);
        let vote = |limb_vertex: &LimbVertex| {
            let p = body[limb_vertex.vertex as usize];
            let distance = |i: &usize| particles[*i].distance_squared(p);
            let nearest = cloth().min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
            let is_beside = distance(&nearest) < BESIDE_M * BESIDE_M;
            // Integer votes: their sum does not depend on the order in which threads add them.
            is_beside.then(|| i32::from((p - particles[nearest]).dot(normals[nearest]) > 0.0) * 2 - 1)
        };
        // The search is quadratic, and an eighth of the vertices is a large enough sample.
        let vertices: Vec<_> = self
            .vertices
            .iter()
            .filter(|v| v.limb == limb)
            .step_by(8)
            .collect();
        let votes: i32 = vertices.par_iter().filter_map(|&vertex| vote(vertex)).sum();
        votes >= 0
    }
}

/// Turns a garment's normals away from the body. Returns the signs that they were multiplied by.
fn turned_outward(normals: &mut [Vec3], hits: &[Option<SurfacePoint>]) -> Vec<f32> {
    let mut signs = vec![1.0; normals.len()];
    for ((normal, sign), hit) in normals.iter_mut().zip(&mut signs).zip(hits) {
        if hit.as_ref().is_some_and(|hit| normal.dot(hit.normal) < 0.0) {
            (*sign, *normal) = (-1.0, -*normal);
        }
    }
    signs
}

/// Partition of the bare joints into limbs.
struct LimbJoints {
    /// Index of each joint's limb; `None` for joints of covered parts.
    of_joint: Vec<Option<usize>>,
    /// First joint of each limb.
    root: Vec<usize>,
}

impl LimbJoints {
    /// Finds the largest subtrees of the skeleton that next to nothing of the garment lies on.
    /// `joints` holds the joint whose part each particle lies on.
    fn find(parents: &[Option<usize>], joints: &[Option<usize>]) -> Self {
        let ancestors = |joint: usize| std::iter::successors(Some(joint), |&j| parents[j]);
        // Number of particles on the subtree of each joint.
        let mut particles_on = vec![0usize; parents.len()];
        for joint in joints.iter().flatten().flat_map(|&joint| ancestors(joint)) {
            particles_on[joint] += 1;
        }
        // A few particles may lie on a limb by chance, such as a hem that touches a thigh.
        let most = (BARE_SHARE * joints.len() as f32) as usize;
        let is_bare = |joint: usize| particles_on[joint] <= most;
        let is_root =
            |joint: &usize| is_bare(*joint) && parents[*joint].is_some_and(|parent| !is_bare(parent));
        let root: Vec<usize> = (0..parents.len()).filter(is_root).take(MAX_LIMBS).collect();
        let limb_of = |joint: usize| ancestors(joint).find_map(|j| root.iter().position(|&r| r == j));
        Self {
            of_joint: (0..parents.len()).map(limb_of).collect(),
            root,
        }
    }

    /// Returns the limb of a joint; the empty set for a covered part.
    fn limb(&self, joint: usize) -> LimbSet {
        self.of_joint[joint].map_or(0, |limb| 1 << limb)
    }

    /// Returns the limbs that begin at a child of the joint.
    fn attached_to(&self, joint: usize, parents: &[Option<usize>]) -> LimbSet {
        let roots = self.root.iter().enumerate();
        let attached = roots.filter(|(_, root)| parents[**root] == Some(joint));
        attached.fold(0, |set, (limb, _)| set | 1 << limb)
    }
}

/// Lists the vertices of all limbs, sorted, each once per limb.
fn limb_vertices(character: &Character, limb_of_face: &[LimbSet]) -> Vec<LimbVertex> {
    let faces = character.body.faces.iter().zip(limb_of_face);
    let bare = faces.filter(|(_, limb)| **limb != 0);
    let mut vertices: Vec<LimbVertex> = bare
        .flat_map(|(face, &limb)| face.map(|vertex| LimbVertex { vertex, limb }))
        .collect();
    vertices.sort_unstable();
    vertices.dedup();
    vertices
}
