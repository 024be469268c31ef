//! Contact filter: the body parts that may push each vertex of a garment.

use super::packets::Packets;
use crate::{
    aabb_tree::GroupMask,
    character::{Character, Garment},
};

/// Smallest weight with which a joint carries a garment vertex.
///
/// Weights diffused over a garment are nowhere exactly zero. Below this they move a vertex by
/// millimetres.
pub const MIN_CARRYING_WEIGHT: f32 = 0.02;

/// Contact filter between body parts and garment vertices. A part is the set of faces, or of
/// vertices, that one joint moves most.
///
/// A vertex is pushed by the parts of the joints that carry it, of their ancestors and of their
/// children. So the trunk pushes a sleeve, and the forearm the sleeve's hem. A hand in front of the
/// belly does not push the shirt's front: cloth there may lie under the hand or over it, and the
/// nearest way out of a hand that passes through does not tell which.
///
/// Asset: made once from the skinning weights of both.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactFilter {
    joint_of_face: Vec<u16>,
    joint_of_vertex: Vec<u16>,
    /// Joints whose parts push each garment vertex.
    pushing_vertices: JointSets,
    /// Joints whose parts push all corners of each garment face.
    lifting_faces: JointSets,
    garment_packets: Packets,
    lifting_vertices: Packets,
}

impl ContactFilter {
    /// Makes the filter of a garment on a character, from the garment's carriers.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        let pushing = pushing_joints(character.skeleton.parents());
        let mut pushing_vertices = JointSets::new(garment.carriers().len(), pushing.len());
        for vertex in 0..garment.carriers().len() {
            let carriers = garment
                .carriers()
                .row(vertex)
                .filter(|(_, w)| *w >= MIN_CARRYING_WEIGHT);
            let joints = carriers.flat_map(|(joint, _)| &pushing[joint]);
            joints.for_each(|&joint| pushing_vertices.insert(vertex, joint));
        }
        let lifting_faces = pushing_vertices.common_to_corners(&garment.rest.faces);
        let joint_of_vertex = joints_of_vertices(character);
        let lifting_any = lifting_faces.union();
        let lifts_a_face = |vertex: &usize| lifting_any.contains(0, joint_of_vertex[*vertex]);
        Self {
            joint_of_face: (character.joints_of_faces().into_iter())
                .map(|joint| joint as u16)
                .collect(),
            // Vertices of one joint lift the same faces, so the joint is the key of the contact
            // class.
            lifting_vertices: Packets::partition(
                (0..joint_of_vertex.len()).filter(lifts_a_face),
                &character.body.vertices,
                |vertex| joint_of_vertex[vertex],
            ),
            garment_packets: Packets::partition(
                0..pushing_vertices.len(),
                &garment.rest.vertices,
                |vertex| pushing_vertices.row(vertex),
            ),
            joint_of_vertex,
            pushing_vertices,
            lifting_faces,
        }
    }

    /// Garment vertices in packets; the same parts push all vertices of a packet.
    pub(crate) fn garment_packets(&self) -> &Packets {
        &self.garment_packets
    }

    /// Body vertices that may lift a garment face, in packets; all vertices of a packet lift the
    /// same faces.
    pub(crate) fn lifting_vertices(&self) -> &Packets {
        &self.lifting_vertices
    }

    /// Returns whether every joint has a collision group of its own, so that group masks decide
    /// without [`Self::face_may_push`]. A mask has 64 bits.
    pub(crate) fn groups_are_exact(&self) -> bool {
        self.pushing_vertices.words <= 1
    }

    /// Collision group of a body face in a search for the parts that push.
    pub(crate) fn groups_of_body_face(&self, face: u32) -> GroupMask {
        let joint = self.joint_of_face[face as usize];
        GroupMask(1 << (joint % 64))
    }

    /// Collision groups of the faces that push a garment vertex.
    // With more than 64 joints several share a group. The mask is then too wide, never too narrow,
    // and `face_may_push` decides.
    pub(crate) fn groups_pushing_vertex(&self, vertex: usize) -> GroupMask {
        let words = self.pushing_vertices.row(vertex).iter();
        GroupMask(words.fold(0, |all, word| all | word))
    }

    /// Collision group of the part around a body vertex.
    pub(crate) fn groups_of_body_vertex(&self, vertex: usize) -> GroupMask {
        GroupMask(1 << (self.joint_of_vertex[vertex] % 64))
    }

    /// Collision groups of the parts that may push all corners of a garment face.
    pub(crate) fn groups_lifting_face(&self, face: u32) -> GroupMask {
        let words = self.lifting_faces.row(face as usize).iter();
        GroupMask(words.fold(0, |all, word| all | word))
    }

    /// Returns whether body face `face` may push garment vertex `vertex`.
    pub fn face_may_push(&self, face: u32, vertex: usize) -> bool {
        let joint = self.joint_of_face[face as usize];
        self.pushing_vertices.contains(vertex, joint)
    }

    /// Returns whether the part around body vertex `vertex` may push all corners of garment face
    /// `face`.
    pub fn vertex_may_lift(&self, vertex: usize, face: u32) -> bool {
        self.lifting_faces
            .contains(face as usize, self.joint_of_vertex[vertex])
    }

    /// Returns whether body face `body_face` may push all corners of garment face `face`.
    pub(crate) fn face_may_lift(&self, body_face: u32, face: u32) -> bool {
        self.lifting_faces
            .contains(face as usize, self.joint_of_face[body_face as usize])
    }
}

/// Set of joints for each of many items, as bits.
#[derive(Clone, Debug, PartialEq)]
struct JointSets {
    /// Words of 64 joints in the set of one item.
    words: usize,
    bits: Vec<u64>,
}

impl JointSets {
    /// Empty sets.
    fn new(items: usize, joints: usize) -> Self {
        let words = joints.div_ceil(64);
        Self {
            words,
            bits: vec![0; words * items],
        }
    }

    fn insert(&mut self, item: usize, joint: usize) {
        self.bits[item * self.words + joint / 64] |= 1 << (joint % 64);
    }

    // Joints are u16 to keep the tables that searches read small; skinning weights have the same
    // limit.
    fn contains(&self, item: usize, joint: u16) -> bool {
        let word = self.bits[item * self.words + usize::from(joint / 64)];
        word >> (joint % 64) & 1 == 1
    }

    fn len(&self) -> usize {
        self.bits.len() / self.words.max(1)
    }

    fn row(&self, item: usize) -> &[u64] {
        &self.bits[item * self.words..][..self.words]
    }

    /// Union of all sets, as the only set of the result.
    fn union(&self) -> Self {
        let mut union = vec![0; self.words];
        for row in self.bits.chunks_exact(self.words.max(1)) {
            union.iter_mut().zip(row).for_each(|(all, word)| *all |= word);
        }
        Self {
            words: self.words,
            bits: union,
        }
    }

    /// Intersects the sets of the corners of each face.
    fn common_to_corners(&self, faces: &[[u32; 3]]) -> Self {
        let word = |corner: u32, k: usize| self.bits[corner as usize * self.words + k];
        let shared = |&[a, b, c]: &[u32; 3], k| word(a, k) & word(b, k) & word(c, k);
        let rows = faces
            .iter()
            .flat_map(|face| (0..self.words).map(move |k| shared(face, k)));
        Self {
            words: self.words,
            bits: rows.collect(),
        }
    }
}

/// Joints whose parts push a vertex that a joint carries, for each joint: itself, its ancestors and
/// its children.
fn pushing_joints(parents: &[Option<usize>]) -> Vec<Vec<usize>> {
    let pushing = |joint: usize| {
        let chain = std::iter::successors(Some(joint), |&j| parents[j]);
        let children = (0..parents.len()).filter(move |&j| parents[j] == Some(joint));
        chain.chain(children).collect()
    };
    (0..parents.len()).map(pushing).collect()
}

/// Joint that moves each body vertex most: rows of weights are in descending order.
fn joints_of_vertices(character: &Character) -> Vec<u16> {
    let heaviest = |vertex| {
        character
            .weights
            .row(vertex)
            .next()
            .map_or(0, |(joint, _)| joint as u16)
    };
    (0..character.weights.len()).map(heaviest).collect()
}
