//! Triangle meshes on a surface, and cutting them along curves.

use super::Surfaces;
use glam::Vec3;
use std::collections::HashMap;

/// Triangle mesh on a surface with known curves: borders and seams.
#[derive(Clone, Debug, Default)]
pub(crate) struct Patch {
    /// Positions, metres.
    pub(crate) vertices: Vec<Vec3>,
    /// Cuts that each vertex lies on, as a bit set.
    pub(crate) bits: Vec<u8>,
    /// Triangles, counter-clockwise seen from outside.
    pub(crate) faces: Vec<[u32; 3]>,
    /// Panel of each face. A seam is a curve where two panels meet.
    pub(crate) labels: Vec<u8>,
}

/// Treatment of the side of a cut on which its field is positive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PositiveSide {
    /// Remove the faces there: the cut becomes a border.
    Remove,
    /// Add this number to the labels of the faces there: the cut becomes a seam.
    Label(u8),
}

impl Patch {
    /// Patch without cuts whose faces all belong to panel 0.
    pub(crate) fn new(vertices: Vec<Vec3>, faces: Vec<[u32; 3]>) -> Self {
        Self {
            bits: vec![0; vertices.len()],
            labels: vec![0; faces.len()],
            vertices,
            faces,
        }
    }

    /// Cuts the given panels where the field of the cut with index `cut` changes sign.
    ///
    /// No other panel may share an edge that is cut: its face would keep the uncut edge.
    pub(crate) fn cut(&mut self, surfaces: &Surfaces, cut: usize, panels: &[u8], beyond: PositiveSide) {
        let field = surfaces.cuts[cut];
        let mut values: Vec<f32> = self.vertices.iter().map(|&p| field(p)).collect();
        self.snap(surfaces, cut, panels, &mut values);
        // The new vertex on each cut edge, so that both faces at the edge share it.
        let mut crossing: HashMap<(u32, u32), u32> = HashMap::new();
        let (faces, labels) = (std::mem::take(&mut self.faces), std::mem::take(&mut self.labels));
        for (face, label) in faces.into_iter().zip(labels) {
            if !panels.contains(&label) {
                self.push(face, label);
                continue;
            }
            for piece in self.pieces(face, &values, &mut crossing, surfaces, cut) {
                // New vertices lie on the cut and have no entry: they count as zero.
                let side = |v: u32| values.get(v as usize).copied().unwrap_or(0.0);
                let is_beyond = piece.iter().any(|&v| side(v) > 0.0);
                match beyond {
                    PositiveSide::Remove if is_beyond => {}
                    PositiveSide::Label(more) if is_beyond => self.push(piece, label + more),
                    _ => self.push(piece, label),
                }
            }
        }
        self.drop_unused();
    }

    /// Moves vertices close to the cut onto it, so that no sliver is cut off.
    ///
    /// Close means within a quarter of the shortest edge. Vertices on other cuts are not moved.
    fn snap(&mut self, surfaces: &Surfaces, cut: usize, panels: &[u8], values: &mut [f32]) {
        let mut nearest = vec![f32::MAX; self.vertices.len()];
        for (face, _) in self
            .faces
            .iter()
            .zip(&self.labels)
            .filter(|(_, l)| panels.contains(l))
        {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let (a, b) = (face[a] as usize, face[b] as usize);
                let length = self.vertices[a].distance(self.vertices[b]);
                nearest[a] = nearest[a].min(length);
                nearest[b] = nearest[b].min(length);
            }
        }
        for v in 0..values.len() {
            if nearest[v] < f32::MAX && values[v].abs() < 0.25 * nearest[v] {
                let target = surfaces.onto_cut(self.vertices[v], cut);
                // A field that is no true distance may send a vertex far away, over its neighbours.
                let is_near = target.distance(self.vertices[v]) < 0.5 * nearest[v];
                if self.bits[v] == 0 && is_near {
                    self.vertices[v] = target;
                }
                if values[v].abs() < 1e-5 || (self.bits[v] == 0 && is_near) {
                    self.bits[v] |= 1 << cut;
                    values[v] = 0.0;
                }
            }
        }
    }

    /// Pieces of a face cut along the zeros of linearly interpolated values.
    ///
    /// `crossing` holds the new vertices on edges that earlier faces have cut.
    fn pieces(
        &mut self,
        face: [u32; 3],
        values: &[f32],
        crossing: &mut HashMap<(u32, u32), u32>,
        surfaces: &Surfaces,
        cut: usize,
    ) -> Vec<[u32; 3]> {
        let value = |v: u32| values[v as usize];
        let mut outline = Vec::with_capacity(5);
        for k in 0..3 {
            let (a, b) = (face[k], face[(k + 1) % 3]);
            outline.push(a);
            if value(a) * value(b) < 0.0 {
                // The same order of both ends from either face, for the same rounding.
                let key = (a.min(b), a.max(b));
                let made = crossing.entry(key).or_insert_with(|| {
                    let (p, q) = (self.vertices[key.0 as usize], self.vertices[key.1 as usize]);
                    let (v, w) = (value(key.0), value(key.1));
                    let shared = self.bits[key.0 as usize] & self.bits[key.1 as usize];
                    let linear = p.lerp(q, v / (v - w));
                    self.vertices.push(crossing_point(surfaces, linear, shared, cut));
                    self.bits.push(shared | 1 << cut);
                    self.vertices.len() as u32 - 1
                });
                outline.push(*made);
            }
        }
        split_outline(&outline, values)
    }

    fn push(&mut self, face: [u32; 3], label: u8) {
        self.faces.push(face);
        self.labels.push(label);
    }

    /// Removes vertices without faces and numbers the others in the order of the faces.
    pub(crate) fn drop_unused(&mut self) {
        let mut number = vec![u32::MAX; self.vertices.len()];
        let mut kept = 0;
        for corner in self.faces.iter_mut().flatten() {
            let number = &mut number[*corner as usize];
            if *number == u32::MAX {
                *number = kept;
                kept += 1;
            }
            *corner = *number;
        }
        let mut vertices = vec![Vec3::ZERO; kept as usize];
        let mut bits = vec![0; kept as usize];
        for (old, &new) in number.iter().enumerate().filter(|(_, n)| **n != u32::MAX) {
            vertices[new as usize] = self.vertices[old];
            bits[new as usize] = self.bits[old];
        }
        (self.vertices, self.bits) = (vertices, bits);
    }
}

/// Point where an edge crosses a cut, near the linear estimate.
///
/// It lies on the cut and on those other cuts, `shared`, that the edge lies on.
fn crossing_point(surfaces: &Surfaces, linear: Vec3, shared: u8, cut: usize) -> Vec3 {
    if shared == 0 {
        return surfaces.onto_cut(linear, cut);
    }
    // A corner of two cuts: alternating projections onto either cut converge in a few rounds.
    let other = shared.trailing_zeros() as usize;
    let turn = |p, _| surfaces.onto_cut(surfaces.onto_cut(p, other), cut);
    let corner = (0..8).fold(linear, turn);
    surfaces.onto_cut(corner, other)
}

/// Splits a triangle along a line. No resulting triangle lies on both sides of the line.
///
/// `outline` holds the corners and, between them, the new points on the line: those without an
/// entry in `values`.
fn split_outline(outline: &[u32], values: &[f32]) -> Vec<[u32; 3]> {
    let is_zero = |v: u32| values.get(v as usize).is_none_or(|x| *x == 0.0);
    let is_new = |v: u32| v as usize >= values.len();
    let at = |k: usize| outline[k % outline.len()];
    match outline.len() {
        3 => vec![[at(0), at(1), at(2)]],
        4 => {
            // One crossing: the line ends at the opposite corner.
            let new = (0..4).find(|&k| is_new(at(k))).unwrap_or(0);
            debug_assert!(is_zero(at(new + 2)));
            vec![
                [at(new), at(new + 1), at(new + 2)],
                [at(new), at(new + 2), at(new + 3)],
            ]
        }
        _ => {
            // Two crossings cut off the corner between them.
            let lone = (0..5)
                .find(|&k| is_new(at(k + 4)) && is_new(at(k + 1)))
                .unwrap_or(0);
            let [n0, p, q, n1] = [1, 2, 3, 4].map(|i| at(lone + i));
            vec![[at(lone), n0, n1], [n0, p, q], [n0, q, n1]]
        }
    }
}
