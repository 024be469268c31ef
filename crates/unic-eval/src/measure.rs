//! One predicted frame against the truth and against the body.

use crate::{kinematics::PreparedClip, metrics::FrameSums};
use glam::Vec3;
use unic_core::{
    character::{Character, Garment},
    closest::ClosestVertex,
    mesh::vertex_normals,
    surface::Surface,
    topology::edges,
};

/// Edges shorter than this in the truth have no meaningful relative length, metres.
const LEAST_EDGE: f32 = 1e-6;

/// Everything about one frame that all predictions of it share: the posed body with its trees, the
/// true garment with its own.
///
/// Made once, then [prepared](Self::prepare) for one frame after another: trees are refitted, not
/// built again.
#[derive(Clone, Debug)]
pub struct FrameContext {
    body: Body,
    edges: Vec<[u32; 2]>,
    truth: Vec<Vec3>,
    truth_tree: ClosestVertex,
    truth_lengths: Vec<f32>,
    truth_second_difference: Option<f64>,
    nearest: Nearest,
}

/// Are nearest points looked for in a frame? The Hausdorff distance and everything about the body
/// depend on them, and they cost far more than the rest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Nearest {
    /// Yes.
    #[default]
    Found,
    /// No: what depends on them is left out of the sums.
    LeftOut,
}

/// Buffers for measuring a prediction; one a thread.
#[derive(Clone, Debug)]
pub struct MeasureScratch {
    predicted_tree: ClosestVertex,
}

/// A predicted frame and the two predictions before it.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    /// World positions, metres.
    pub now: &'a [Vec3],
    /// Of frames t − 1 and t − 2; none where one of them is frame 0 or before, which is given.
    pub before: Option<[&'a [Vec3]; 2]>,
}

impl FrameContext {
    /// For a garment on a character; [`prepare`](Self::prepare) must follow.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        Self {
            body: Body::new(character),
            edges: edges(&garment.rest.faces),
            truth: garment.rest.vertices.clone(),
            truth_tree: ClosestVertex::build(&garment.rest.vertices),
            truth_lengths: Vec::new(),
            truth_second_difference: None,
            nearest: Nearest::Found,
        }
    }

    /// Buffers that fit this context.
    pub fn scratch(&self) -> MeasureScratch {
        MeasureScratch {
            predicted_tree: self.truth_tree.clone(),
        }
    }

    /// Poses the body and takes up the true garment of one frame. The body is the clip's own where
    /// it brings one, else the character by linear blend skinning.
    pub fn prepare(&mut self, character: &Character, clip: &PreparedClip, frame: usize, nearest: Nearest) {
        self.nearest = nearest;
        let truth = |t| clip.captured.garment.frame(t);
        self.truth.clear();
        self.truth.extend_from_slice(truth(frame));
        if nearest == Nearest::Found {
            self.body.pose(character, clip, frame);
            self.truth_tree.refit(&self.truth);
        }
        self.truth_lengths.clear();
        let lengths = self.edges.iter().map(|e| length(&self.truth, e));
        self.truth_lengths.extend(lengths);
        self.truth_second_difference =
            (frame >= 3).then(|| second_difference(&self.truth, [truth(frame - 1), truth(frame - 2)]));
    }

    /// Compares a prediction of the prepared frame.
    pub fn measure(&self, prediction: &Prediction, scratch: &mut MeasureScratch) -> FrameSums {
        let mut sums = FrameSums {
            vertices: self.truth.len(),
            ..FrameSums::default()
        };
        self.measure_errors(prediction.now, &mut sums);
        self.measure_edges(prediction.now, &mut sums);
        if let (Some(before), Some(truth)) = (prediction.before, self.truth_second_difference) {
            sums.second_difference = [second_difference(prediction.now, before), truth];
        }
        if self.nearest == Nearest::Found {
            sums.probed = prediction.now.len();
            sums.hausdorff = self.hausdorff(prediction.now, &mut scratch.predicted_tree);
            self.body.measure(prediction.now, &mut sums);
        }
        sums
    }

    fn measure_errors(&self, predicted: &[Vec3], sums: &mut FrameSums) {
        for (p, g) in predicted.iter().zip(&self.truth) {
            let squared = (p.as_dvec3() - g.as_dvec3()).length_squared();
            sums.squared += squared;
            sums.distance += squared.sqrt();
        }
    }

    fn measure_edges(&self, predicted: &[Vec3], sums: &mut FrameSums) {
        for (edge, &truth) in self.edges.iter().zip(&self.truth_lengths) {
            if truth > LEAST_EDGE {
                sums.edge_error += f64::from((length(predicted, edge) - truth).abs() / truth);
                sums.edges += 1;
            }
        }
    }

    fn hausdorff(&self, predicted: &[Vec3], tree: &mut ClosestVertex) -> f64 {
        tree.refit(predicted);
        let there = farthest(predicted, &self.truth, &self.truth_tree, 0.0);
        f64::from(farthest(&self.truth, predicted, tree, there))
    }
}

/// Largest distance from a point of `from` to the nearest of `to`, or `known` if that is larger.
///
/// Point i of both is the same vertex, so their distance bounds the nearest one's: vertices whose
/// bound cannot raise the maximum are not looked up, which are nearly all.
fn farthest(from: &[Vec3], to: &[Vec3], tree: &ClosestVertex, known: f32) -> f32 {
    let bound = |i: usize| from[i].distance(to[i]);
    let nearest = |i: usize| tree.nearest(from[i]).map_or(f32::INFINITY, |(_, d)| d);
    // The most displaced vertex first: it rules out most of the others.
    let first = (0..from.len()).max_by(|&a, &b| bound(a).total_cmp(&bound(b)));
    let start = first.map_or(known, |i| known.max(nearest(i)));
    (0..from.len()).fold(start, |most, i| {
        // NaN is no bound: such a vertex is looked up and found infinitely far.
        if bound(i) <= most {
            most
        } else {
            most.max(nearest(i))
        }
    })
}

fn length(positions: &[Vec3], &[a, b]: &[u32; 2]) -> f32 {
    positions[a as usize].distance(positions[b as usize])
}

/// Σ ‖x_t − 2 x_{t−1} + x_{t−2}‖², m².
pub(crate) fn second_difference(now: &[Vec3], [before, earlier]: [&[Vec3]; 2]) -> f64 {
    let terms = now.iter().zip(before).zip(earlier);
    terms
        .map(|((x, y), z)| (x.as_dvec3() - 2.0 * y.as_dvec3() + z.as_dvec3()).length_squared())
        .sum()
}

/// The posed body with its trees.
#[derive(Clone, Debug)]
struct Body {
    faces: Vec<[u32; 3]>,
    /// A face at each vertex: where the search for the closest face begins.
    face_of_vertex: Vec<u32>,
    vertices: Vec<Vec3>,
    normals: Vec<Vec3>,
    tree: ClosestVertex,
    surface: Surface,
}

impl Body {
    fn new(character: &Character) -> Self {
        let body = &character.body;
        let mut face_of_vertex = vec![u32::MAX; body.vertices.len()];
        for (face, corners) in body.faces.iter().enumerate() {
            corners
                .iter()
                .for_each(|&v| face_of_vertex[v as usize] = face as u32);
        }
        Self {
            faces: body.faces.clone(),
            face_of_vertex,
            vertices: body.vertices.clone(),
            normals: Vec::new(),
            tree: ClosestVertex::build(&body.vertices),
            surface: Surface::build(body),
        }
    }

    fn pose(&mut self, character: &Character, clip: &PreparedClip, frame: usize) {
        match &clip.captured.body {
            Some(body) => {
                self.vertices.clear();
                self.vertices.extend_from_slice(body.frame(frame));
            }
            None => {
                let world_from_rest = clip.kinematics.world_from_rest(frame);
                let rest = &character.body.vertices;
                character.weights.skin(rest, world_from_rest, &mut self.vertices);
            }
        }
        vertex_normals(&self.vertices, &self.faces, &mut self.normals);
        self.tree.refit(&self.vertices);
        self.surface.refit(&self.vertices);
    }

    fn measure(&self, garment: &[Vec3], sums: &mut FrameSums) {
        for &p in garment {
            let Some((nearest, _)) = self.tree.nearest(p) else {
                continue;
            };
            // The paper prints the indicator as 1 on the outer side of the tangent plane; its text
            // means the inner one.
            let inside = (p - self.vertices[nearest]).dot(self.normals[nearest]) < 0.0;
            sums.inside_paper += usize::from(inside);
            let Some(hit) = self.surface.closest_from(p, self.face_of_vertex[nearest]) else {
                continue;
            };
            if hit.signed_distance < 0.0 {
                let depth = f64::from(hit.distance);
                sums.inside_closest += 1;
                sums.depth += depth;
                sums.max_depth = sums.max_depth.max(depth);
            }
        }
    }
}

#[cfg(test)]
mod tests;
