//! Measurement of one predicted frame against the truth and the body.

use crate::{kinematics::PreparedClip, metrics::FrameSums};
use glam::Vec3;
use unic_core::{
    character::{Character, Garment},
    closest::ClosestVertex,
    mesh::vertex_normals,
    surface::Surface,
    topology::edges,
};

/// Least length of a true edge whose relative error counts, metres. The error of shorter edges has
/// no meaning.
const LEAST_EDGE: f32 = 1e-6;

/// Data of one frame that all predictions share: the posed body and the true garment, each with its
/// search trees.
///
/// A context is made once and then [prepared](Self::prepare) for one frame after another. Trees are
/// refitted, not built again.
#[derive(Clone, Debug)]
pub struct FrameContext {
    body: Body,
    /// Edges of the garment.
    edges: Vec<[u32; 2]>,
    /// True world positions of the garment.
    truth: Vec<Vec3>,
    truth_tree: ClosestVertex,
    /// True length of each edge, metres.
    truth_lengths: Vec<f32>,
    /// Sum of squared second differences of the truth, m². `None` for the first frames.
    truth_second_difference: Option<f64>,
    nearest: Nearest,
}

/// Search for nearest points in a frame. It takes most of the time of a measurement.
///
/// The Hausdorff distance and all metrics of the body depend on nearest points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Nearest {
    /// Nearest points are searched.
    #[default]
    Searched,
    /// Nearest points are not searched. The sums lack what depends on them.
    Skipped,
}

/// Buffers of a measurement. Each thread needs its own.
#[derive(Clone, Debug)]
pub struct MeasureScratch {
    predicted_tree: ClosestVertex,
}

/// Predicted frame and the two predictions before it.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    /// Predicted world positions, metres.
    pub now: &'a [Vec3],
    /// Predictions of the frames t − 1 and t − 2. `None` where one of them is frame 0 or earlier,
    /// because frame 0 is given.
    pub before: Option<[&'a [Vec3]; 2]>,
}

impl FrameContext {
    /// Makes a context for a garment on a character. [`prepare`](Self::prepare) must follow.
    pub fn new(character: &Character, garment: &Garment) -> Self {
        Self {
            body: Body::new(character),
            edges: edges(&garment.rest.faces),
            truth: garment.rest.vertices.clone(),
            truth_tree: ClosestVertex::build(&garment.rest.vertices),
            truth_lengths: Vec::new(),
            truth_second_difference: None,
            nearest: Nearest::Searched,
        }
    }

    /// Makes buffers that fit this context.
    pub fn scratch(&self) -> MeasureScratch {
        MeasureScratch {
            predicted_tree: self.truth_tree.clone(),
        }
    }

    /// Poses the body and reads the true garment of one frame.
    ///
    /// The body is the clip's own where it has one, otherwise the character's by linear blend
    /// skinning.
    pub fn prepare(&mut self, character: &Character, clip: &PreparedClip, frame: usize, nearest: Nearest) {
        self.nearest = nearest;
        let truth = |t| clip.captured.garment.frame(t);
        // Buffers keep their memory from frame to frame.
        self.truth.clear();
        self.truth.extend_from_slice(truth(frame));
        if nearest == Nearest::Searched {
            self.body.pose(character, clip, frame);
            self.truth_tree.refit(&self.truth);
        }
        self.truth_lengths.clear();
        let lengths = self.edges.iter().map(|e| length(&self.truth, e));
        self.truth_lengths.extend(lengths);
        self.truth_second_difference =
            (frame >= 3).then(|| second_difference(&self.truth, truth(frame - 1), truth(frame - 2)));
    }

    /// Measures a prediction of the prepared frame.
    pub fn measure(&self, prediction: &Prediction, scratch: &mut MeasureScratch) -> FrameSums {
        let mut sums = FrameSums {
            vertices: self.truth.len(),
            ..FrameSums::default()
        };
        self.measure_errors(prediction.now, &mut sums);
        self.measure_edges(prediction.now, &mut sums);
        // Frames 1 and 2 have no two predictions before them.
        if let (Some([before, earlier]), Some(truth)) = (prediction.before, self.truth_second_difference) {
            sums.second_difference = [second_difference(prediction.now, before, earlier), truth];
        }
        if self.nearest == Nearest::Searched {
            sums.probed = prediction.now.len();
            sums.hausdorff = self.hausdorff(prediction.now, &mut scratch.predicted_tree);
            self.body.measure(prediction.now, &mut sums);
        }
        sums
    }

    /// Adds the distances of vertices to their true positions.
    fn measure_errors(&self, predicted: &[Vec3], sums: &mut FrameSums) {
        for (p, g) in predicted.iter().zip(&self.truth) {
            // Coordinates of a character that has walked far are large beside errors of
            // millimetres: f64 keeps the difference exact.
            let squared = (p.as_dvec3() - g.as_dvec3()).length_squared();
            sums.squared += squared;
            sums.distance += squared.sqrt();
        }
    }

    /// Adds the relative errors of edge lengths.
    fn measure_edges(&self, predicted: &[Vec3], sums: &mut FrameSums) {
        for (edge, &truth) in self.edges.iter().zip(&self.truth_lengths) {
            if truth > LEAST_EDGE {
                sums.edge_error += f64::from((length(predicted, edge) - truth).abs() / truth);
                sums.edges += 1;
            }
        }
    }

    /// Returns the symmetric Hausdorff distance between prediction and truth, metres.
    fn hausdorff(&self, predicted: &[Vec3], tree: &mut ClosestVertex) -> f64 {
        // The scratch tree has the topology of the same vertices, so that refitting replaces
        // building.
        tree.refit(predicted);
        // The second direction begins with the result of the first, which rules out most searches.
        let there = farthest(predicted, &self.truth, &self.truth_tree, 0.0);
        f64::from(farthest(&self.truth, predicted, tree, there))
    }
}

/// Returns the largest distance from a point of `from` to the nearest point of `to`, or `known` if
/// that is larger.
///
/// Point i of both sets is the same vertex, so that the distance between the two is an upper bound
/// of the distance to the nearest point. Points whose bound cannot raise the maximum are not
/// searched, which are nearly all.
fn farthest(from: &[Vec3], to: &[Vec3], tree: &ClosestVertex, known: f32) -> f32 {
    let bound = |i: usize| from[i].distance(to[i]);
    let nearest = |i: usize| tree.nearest(from[i]).map_or(f32::INFINITY, |(_, d)| d);
    // The point with the largest bound comes first, since its distance rules out most others.
    let first = (0..from.len()).max_by(|&a, &b| bound(a).total_cmp(&bound(b)));
    let start = first.map_or(known, |i| known.max(nearest(i)));
    (0..from.len()).fold(start, |most, i| {
        // A comparison with NaN is false, so that such a point is searched and found infinitely
        // far.
        if bound(i) <= most {
            most
        } else {
            most.max(nearest(i))
        }
    })
}

/// Returns the length of an edge, metres.
fn length(positions: &[Vec3], &[a, b]: &[u32; 2]) -> f32 {
    positions[a as usize].distance(positions[b as usize])
}

/// Returns Σ ‖x_t − 2 x_{t−1} + x_{t−2}‖² over all vertices, m².
pub(crate) fn second_difference(now: &[Vec3], before: &[Vec3], earlier: &[Vec3]) -> f64 {
    let terms = now.iter().zip(before).zip(earlier);
    terms
        .map(|((x, y), z)| (x.as_dvec3() - 2.0 * y.as_dvec3() + z.as_dvec3()).length_squared())
        .sum()
}

/// Posed body with its search trees.
#[derive(Clone, Debug)]
struct Body {
    faces: Vec<[u32; 3]>,
    /// One face at each vertex, from which the search for the closest face starts.
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

    /// Poses the body in one frame and refits its trees.
    fn pose(&mut self, character: &Character, clip: &PreparedClip, frame: usize) {
        clip.pose_body(character, frame, &mut self.vertices);
        vertex_normals(&self.vertices, &self.faces, &mut self.normals);
        self.tree.refit(&self.vertices);
        self.surface.refit(&self.vertices);
    }

    /// Counts the garment vertices inside the body and adds up their depths.
    fn measure(&self, garment: &[Vec3], sums: &mut FrameSums) {
        for &p in garment {
            // Positions that are not finite have no nearest vertex and count as outside.
            let Some((nearest, _)) = self.tree.nearest(p) else {
                continue;
            };
            // The paper's formula counts vertices on the outer side of the tangent plane. Its text
            // means the inner side, which this test uses.
            let inside = (p - self.vertices[nearest]).dot(self.normals[nearest]) < 0.0;
            sums.inside_paper += usize::from(inside);
            // The nearest vertex lies near the closest face, so that the search starts with a good
            // bound.
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
