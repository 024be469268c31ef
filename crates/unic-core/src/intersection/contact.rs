//! Which parts of a body may push which vertices of a garment.

use super::packets::Packets;
use crate::{
    bvh::Marks,
    character::{Character, Garment},
};

/// Least weight by which a joint carries a garment vertex. Weights diffused over a garment never quite
/// vanish; below this they move a vertex by millimetres.
const LEAST_WEIGHT: f32 = 0.02;

/// Which parts of a body may push which vertices of a garment; a part is all that one joint carries most.
///
/// A vertex is pushed by the parts of the joints that carry it, of their ancestors and of their
/// children. So the trunk pushes a sleeve, and the forearm the sleeve's hem, but a hand in front
/// of the belly does not push the shirt's front: cloth there lies under the hand or over it, and
/// the nearest way out of a hand that passes through says nothing about which.
///
/// Asset: made once from the skinning weights of both.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactParts {
    joint_of_face: Vec<u16>,
    joint_of_vertex: Vec<u16>,
    /// What pushes each garment vertex.
    of_vertices: JointSets,
    /// What pushes all corners of each garment face.
    of_faces: JointSets,
    /// The garment's vertices by what pushes them.
    packets: Packets,
    /// The body's vertices that lift any garment face, by joint.
    lifting: Packets,
}

impl ContactParts {
    /// Of a garment on a character.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        let reach = reach_of_joints(character.skeleton.parents());
        let mut of_vertices = JointSets::new(garment.weights.len(), reach.len());
        for vertex in 0..garment.weights.len() {
            let carriers = garment.weights.row(vertex).filter(|(_, w)| *w >= LEAST_WEIGHT);
            let pushing = carriers.flat_map(|(joint, _)| &reach[joint]);
            pushing.for_each(|&joint| of_vertices.insert(vertex, joint));
        }
        let of_faces = of_vertices.common(&garment.rest.faces);
        let joint_of_vertex = joints_of_vertices(character);
        let any = of_faces.union();
        Self {
            joint_of_face: (character.joints_of_faces().into_iter())
                .map(|joint| joint as u16)
                .collect(),
            lifting: Packets::of(
                (0..joint_of_vertex.len()).filter(|&vertex| any.contains(0, joint_of_vertex[vertex])),
                &character.body.vertices,
                |vertex| joint_of_vertex[vertex],
            ),
            packets: Packets::of(0..of_vertices.len(), &garment.rest.vertices, |vertex| {
                of_vertices.row(vertex)
            }),
            joint_of_vertex,
            of_vertices,
            of_faces,
        }
    }

    /// The garment's vertices; the same parts push all of a packet.
    pub(crate) fn packets(&self) -> &Packets {
        &self.packets
    }

    /// The body vertices that may lift a face; all of a packet lift the same.
    pub(crate) fn lifting(&self) -> &Packets {
        &self.lifting
    }

    /// Whether all joints have marks of their own.
    pub(crate) fn marks_tell_all(&self) -> bool {
        self.of_vertices.words <= 1
    }

    /// What a body face bears in a search for those that push.
    pub(crate) fn marks_of_face(&self, face: u32) -> Marks {
        let joint = self.joint_of_face[face as usize];
        Marks(1 << (joint % 64))
    }

    /// One of these is borne by every face that pushes a garment vertex.
    pub(crate) fn marks_of_vertex(&self, vertex: usize) -> Marks {
        let words = self.of_vertices.row(vertex).iter();
        Marks(words.fold(0, |all, word| all | word))
    }

    /// What the part around a body vertex bears.
    pub(crate) fn marks_of_lifting(&self, vertex: usize) -> Marks {
        Marks(1 << (self.joint_of_vertex[vertex] % 64))
    }

    /// One of these is borne by every part that may push all corners of a garment face.
    pub(crate) fn marks_of_lifted(&self, face: u32) -> Marks {
        let words = self.of_faces.row(face as usize).iter();
        Marks(words.fold(0, |all, word| all | word))
    }

    /// May body face `face` push garment vertex `vertex`?
    pub fn face_pushes(&self, face: u32, vertex: usize) -> bool {
        let joint = self.joint_of_face[face as usize];
        self.of_vertices.contains(vertex, joint)
    }

    /// May the part around body vertex `vertex` push all corners of garment face `face`?
    pub fn vertex_lifts(&self, vertex: usize, face: u32) -> bool {
        self.of_faces
            .contains(face as usize, self.joint_of_vertex[vertex])
    }

    /// May body face `part` push all corners of garment face `face`?
    pub(crate) fn face_lifts(&self, part: u32, face: u32) -> bool {
        self.of_faces
            .contains(face as usize, self.joint_of_face[part as usize])
    }
}

/// A set of joints for each of many items.
#[derive(Clone, Debug, PartialEq)]
struct JointSets {
    /// Words of 64 joints an item.
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

    /// What any set has, as the only one.
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

    /// For each face what the sets of its corners share.
    fn common(&self, faces: &[[u32; 3]]) -> Self {
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

/// For each joint: itself, its ancestors and its children.
fn reach_of_joints(parents: &[Option<usize>]) -> Vec<Vec<usize>> {
    let reach = |joint: usize| {
        let chain = std::iter::successors(Some(joint), |&j| parents[j]);
        let children = (0..parents.len()).filter(move |&j| parents[j] == Some(joint));
        chain.chain(children).collect()
    };
    (0..parents.len()).map(reach).collect()
}

fn joints_of_vertices(character: &Character) -> Vec<u16> {
    let most = |vertex| {
        character
            .weights
            .row(vertex)
            .next()
            .map_or(0, |(joint, _)| joint as u16)
    };
    (0..character.weights.len()).map(most).collect()
}
