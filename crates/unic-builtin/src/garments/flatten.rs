//! Pattern coordinates: flattening of curved panels.

use glam::{Vec2, Vec3};
use unic_core::mesh::Uvs;

/// Rounds of fitting rotations and solving for positions.
const ROUNDS: usize = 60;

/// Conjugate-gradient steps of a round.
///
/// A round does not converge: it starts from the solution of the round before, which is close.
const SOLVER_STEPS: usize = 20;

/// Smallest cotangent weight. Negative weights of obtuse triangles would make the energy
/// indefinite.
const LEAST_COTANGENT: f32 = 0.02;

/// Lays a panel flat with as little distortion of lengths as possible.
///
/// It is the local-global iteration of Liu et al. 2008, "A local/global approach to mesh
/// parameterization" (ARAP). `initial` holds a start position of each vertex in metres, with faces
/// counter-clockwise.
pub(crate) fn flattened(vertices: &[Vec3], faces: &[[u32; 3]], initial: Vec<Vec2>) -> Vec<Vec2> {
    let triangles: Vec<FlatTriangle> = faces
        .iter()
        .map(|f| FlatTriangle::new(f.map(|v| vertices[v as usize])))
        .collect();
    let mut places = initial;
    for _ in 0..ROUNDS {
        // Local step: the best rotation of each triangle. Global step: the positions that fit the
        // rotated edges best.
        let mut pull = vec![Vec2::ZERO; vertices.len()];
        for (face, flat) in faces.iter().zip(&triangles) {
            let turn = flat.rotation(face.map(|v| places[v as usize]));
            for k in 0..3 {
                let (a, b) = (face[k] as usize, face[(k + 1) % 3] as usize);
                let edge = turn.rotate(flat.edge(k)) * flat.weights[k];
                pull[a] -= edge;
                pull[b] += edge;
            }
        }
        solve(faces, &triangles, &pull, &mut places);
    }
    places
}

/// A triangle of the rest shape, laid flat by itself.
struct FlatTriangle {
    /// Positions, metres: the first corner at the origin, the second on the x axis.
    corners: [Vec2; 3],
    /// Cotangent weight of each edge (k, k + 1), that of the angle opposite to it.
    weights: [f32; 3],
}

impl FlatTriangle {
    fn new([a, b, c]: [Vec3; 3]) -> Self {
        let along = (b - a).normalize_or(Vec3::X);
        let height = (c - a).reject_from_normalized(along).length();
        let corners = [
            Vec2::ZERO,
            Vec2::new(a.distance(b), 0.0),
            Vec2::new((c - a).dot(along), height),
        ];
        let weights = [0, 1, 2].map(|k| {
            let (p, q) = (
                corners[k] - corners[(k + 2) % 3],
                corners[(k + 1) % 3] - corners[(k + 2) % 3],
            );
            (p.dot(q) / p.perp_dot(q).max(1e-12)).max(LEAST_COTANGENT)
        });
        Self { corners, weights }
    }

    /// Vector from corner k to the next one, metres.
    fn edge(&self, k: usize) -> Vec2 {
        self.corners[(k + 1) % 3] - self.corners[k]
    }

    /// Rotation that best fits this triangle to the given positions, as a complex number.
    fn rotation(&self, places: [Vec2; 3]) -> Vec2 {
        // In the plane the weighted sum of conj(from) · to has the angle of the best rotation.
        let mut sum = Vec2::ZERO;
        for k in 0..3 {
            let (from, to) = (self.edge(k), places[(k + 1) % 3] - places[k]);
            sum += Vec2::new(from.dot(to), from.perp_dot(to)) * self.weights[k];
        }
        sum.normalize_or(Vec2::X)
    }
}

/// Improves positions towards the solution of the weighted Laplace equation with the right-hand
/// side `pull`, by conjugate gradients with a diagonal preconditioner.
fn solve(faces: &[[u32; 3]], triangles: &[FlatTriangle], pull: &[Vec2], places: &mut [Vec2]) {
    let apply = |x: &[Vec2]| {
        let mut out = vec![Vec2::ZERO; x.len()];
        each_edge(faces, triangles, |a, b, w| {
            let difference = (x[a] - x[b]) * w;
            out[a] += difference;
            out[b] -= difference;
        });
        out
    };
    // Not zero, for a vertex without faces is divided by its entry too.
    let mut diagonal = vec![1e-9; places.len()];
    each_edge(faces, triangles, |a, b, w| {
        diagonal[a] += w;
        diagonal[b] += w;
    });
    // Sums over thousands of vertices are taken in f64.
    let dot = |x: &[Vec2], y: &[Vec2]| x.iter().zip(y).map(|(p, q)| f64::from(p.dot(*q))).sum::<f64>();
    let scaled = |r: &[Vec2]| r.iter().zip(&diagonal).map(|(r, d)| *r / *d).collect::<Vec<_>>();
    let mut residual: Vec<Vec2> = pull.iter().zip(apply(places)).map(|(p, l)| *p - l).collect();
    let mut direction = scaled(&residual);
    let mut rz = dot(&residual, &direction);
    for _ in 0..SOLVER_STEPS {
        let along = apply(&direction);
        let curvature = dot(&direction, &along);
        // Converged: the next step would be 0/0.
        if curvature <= 1e-20 {
            return;
        }
        let step = (rz / curvature) as f32;
        for v in 0..places.len() {
            places[v] += direction[v] * step;
            residual[v] -= along[v] * step;
        }
        let z = scaled(&residual);
        let next = dot(&residual, &z);
        let keep = (next / rz) as f32;
        direction
            .iter_mut()
            .zip(&z)
            .for_each(|(d, z)| *d = *z + *d * keep);
        rz = next;
    }
}

/// Calls `edge` with both ends and the weight of each edge of each triangle.
fn each_edge(faces: &[[u32; 3]], triangles: &[FlatTriangle], mut edge: impl FnMut(usize, usize, f32)) {
    for (face, flat) in faces.iter().zip(triangles) {
        for k in 0..3 {
            edge(face[k] as usize, face[(k + 1) % 3] as usize, flat.weights[k]);
        }
    }
}

/// Distance between panels in the pattern, metres.
const GAP_M: f32 = 0.05;

/// Computes pattern coordinates of a mesh whose faces belong to panels, each of them a disc.
///
/// Every panel is flattened by itself and laid beside the one before. `frame` gives the directions
/// of u and v in space of a panel; flattening starts from the projection onto them.
pub(crate) fn pattern(
    vertices: &[Vec3],
    faces: &[[u32; 3]],
    labels: &[u8],
    frame: impl Fn(u8) -> [Vec3; 2],
) -> Uvs {
    let mut uvs = Uvs {
        coordinates: Vec::new(),
        faces: vec![[0; 3]; faces.len()],
    };
    let mut free = 0.0;
    for label in 0..=labels.iter().copied().max().unwrap_or(0) {
        let panel = Panel::of(vertices, faces, labels, label);
        let [u, v] = frame(label);
        let initial = panel
            .vertices
            .iter()
            .map(|p| Vec2::new(p.dot(u), p.dot(v)))
            .collect();
        let places = flattened(&panel.vertices, &panel.faces, initial);
        let (low, high) = (places.iter()).fold((Vec2::MAX, Vec2::MIN), |(l, h), p| (l.min(*p), h.max(*p)));
        let first = uvs.coordinates.len() as u32;
        uvs.coordinates
            .extend(places.iter().map(|p| *p - low + Vec2::X * free));
        for (&face, corners) in panel.face_of.iter().zip(&panel.faces) {
            uvs.faces[face] = corners.map(|c| first + c);
        }
        free += (high.x - low.x).max(0.0) + GAP_M;
    }
    uvs
}

/// Faces of one panel as a separate mesh.
struct Panel {
    vertices: Vec<Vec3>,
    faces: Vec<[u32; 3]>,
    /// Index of each face in the full mesh.
    face_of: Vec<usize>,
}

impl Panel {
    /// Extracts the faces with a label.
    fn of(vertices: &[Vec3], faces: &[[u32; 3]], labels: &[u8], label: u8) -> Self {
        let mut number = vec![u32::MAX; vertices.len()];
        let mut panel = Self {
            vertices: Vec::new(),
            faces: Vec::new(),
            face_of: Vec::new(),
        };
        for (f, face) in faces.iter().enumerate().filter(|(f, _)| labels[*f] == label) {
            let corners = face.map(|v| {
                let number = &mut number[v as usize];
                if *number == u32::MAX {
                    *number = panel.vertices.len() as u32;
                    panel.vertices.push(vertices[v as usize]);
                }
                *number
            });
            panel.faces.push(corners);
            panel.face_of.push(f);
        }
        panel
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bent_strip_unrolls_to_its_lengths() {
        // A strip of a cylinder of radius 0.2 over an angle of 2 radians.
        let (columns, rows) = (16usize, 6usize);
        let angle = |i: usize| (i as f32 / columns as f32 - 0.5) * 2.0;
        let at = |i: usize, j: usize| {
            let (sin, cos) = angle(i).sin_cos();
            Vec3::new(0.2 * sin, j as f32 * 0.03, 0.2 * cos)
        };
        let index = |i: usize, j: usize| (j * (columns + 1) + i) as u32;
        let vertices: Vec<Vec3> = (0..=rows)
            .flat_map(|j| (0..=columns).map(move |i| at(i, j)))
            .collect();
        let mut faces = Vec::new();
        for j in 0..rows {
            for i in 0..columns {
                let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| index(i, j));
                faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        let initial = vertices.iter().map(|p| Vec2::new(p.x, p.y)).collect();
        let flat = flattened(&vertices, &faces, initial);
        for face in &faces {
            for k in 0..3 {
                let (a, b) = (face[k] as usize, face[(k + 1) % 3] as usize);
                let ratio = flat[a].distance(flat[b]) / vertices[a].distance(vertices[b]);
                assert!((ratio - 1.0).abs() < 2e-3, "{ratio}");
            }
        }
    }
}
