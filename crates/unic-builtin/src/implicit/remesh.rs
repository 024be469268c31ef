//! Near-uniform triangles: splits, collapses, flips and tangential smoothing.

use super::{Patch, Surfaces};
use glam::Vec3;

/// How large triangles should be.
#[derive(Clone, Copy)]
pub(crate) struct Sizing<'a> {
    /// Wanted length of edges at a place, metres.
    pub(crate) edge: &'a (dyn Fn(Vec3) -> f32 + Sync),
    /// Rounds of all operations.
    pub(crate) rounds: usize,
}

/// Edges longer than this times the wanted length are split, shorter than [`SHORT`] collapsed: a split
/// then never makes an edge to be collapsed.
const LONG: f32 = 4.0 / 3.0;
const SHORT: f32 = 0.8;

/// Remeshes a patch after Botsch & Kobbelt 2004, "A remeshing approach to multiresolution modeling".
///
/// Borders and seams stay curves of their cuts; corners, where two cuts meet, stay where they are.
pub(crate) fn remesh(patch: &mut Patch, surfaces: &Surfaces, sizing: Sizing) {
    // The lattice's triangles are much smaller than wanted: without them the rest is quick.
    let mut mesh = Remeshing::new(patch, surfaces, sizing);
    while mesh.collapse() > mesh.vertices.len() / 50 {}
    for _ in 0..sizing.rounds {
        mesh.split();
        mesh.collapse();
        mesh.flip(Flip::Valence);
        mesh.relax();
    }
    for _ in 0..3 {
        mesh.flip(Flip::Angle);
        mesh.relax();
    }
    mesh.flip(Flip::Angle);
    *patch = mesh.finished();
}

/// When an edge is flipped.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Flip {
    /// Towards six neighbours a vertex, four at a border.
    Valence,
    /// Towards Delaunay: while the opposite angles sum to more than π.
    Angle,
}

struct Remeshing<'a> {
    surfaces: &'a Surfaces<'a>,
    sizing: Sizing<'a>,
    vertices: Vec<Vec3>,
    /// Wanted edge length at each vertex.
    wanted: Vec<f32>,
    bits: Vec<u8>,
    /// Dead faces have three equal corners.
    faces: Vec<[u32; 3]>,
    labels: Vec<u8>,
    /// Live faces around each vertex.
    around: Vec<Vec<u32>>,
}

/// The faces on an edge: one at a border, else two.
#[derive(Clone, Copy)]
struct EdgeFaces {
    first: u32,
    second: Option<u32>,
}

impl<'a> Remeshing<'a> {
    fn new(patch: &Patch, surfaces: &'a Surfaces<'a>, sizing: Sizing<'a>) -> Self {
        let mut around = vec![Vec::new(); patch.vertices.len()];
        for (f, face) in patch.faces.iter().enumerate() {
            face.iter().for_each(|&v| around[v as usize].push(f as u32));
        }
        Self {
            surfaces,
            sizing,
            wanted: patch.vertices.iter().map(|&p| (sizing.edge)(p)).collect(),
            vertices: patch.vertices.clone(),
            bits: patch.bits.clone(),
            faces: patch.faces.clone(),
            labels: patch.labels.clone(),
            around,
        }
    }

    fn finished(self) -> Patch {
        let live = |f: &[u32; 3]| f[0] != f[1];
        let labels = self.faces.iter().zip(&self.labels).filter(|(f, _)| live(f));
        let mut patch = Patch {
            labels: labels.map(|(_, l)| *l).collect(),
            faces: self.faces.iter().copied().filter(live).collect(),
            vertices: self.vertices,
            bits: self.bits,
        };
        patch.drop_unused();
        patch
    }

    fn at(&self, v: u32) -> Vec3 {
        self.vertices[v as usize]
    }

    fn edges(&self) -> Vec<[u32; 2]> {
        unic_core::topology::edges(&self.faces)
    }

    /// Length over the wanted length.
    fn relative_length(&self, a: u32, b: u32) -> f32 {
        let wanted = 0.5 * (self.wanted[a as usize] + self.wanted[b as usize]);
        self.at(a).distance(self.at(b)) / wanted
    }

    /// None when the edge is gone or not manifold.
    fn faces_on(&self, a: u32, b: u32) -> Option<EdgeFaces> {
        let has = |f: &&u32| self.faces[**f as usize].contains(&b);
        let mut faces = self.around[a as usize].iter().filter(has).copied();
        let edge = EdgeFaces {
            first: faces.next()?,
            second: faces.next(),
        };
        faces.next().is_none().then_some(edge)
    }

    /// On a border or a seam.
    fn is_curve(&self, edge: EdgeFaces) -> bool {
        let label = |f: u32| self.labels[f as usize];
        edge.second
            .is_none_or(|second| label(second) != label(edge.first))
    }

    fn opposite(&self, face: u32, a: u32, b: u32) -> u32 {
        let corners = self.faces[face as usize];
        corners.into_iter().find(|&v| v != a && v != b).unwrap_or(a)
    }

    fn split(&mut self) {
        for [a, b] in self.edges() {
            if self.relative_length(a, b) > LONG
                && let Some(edge) = self.faces_on(a, b)
            {
                self.split_edge(a, b, edge);
            }
        }
    }

    fn split_edge(&mut self, a: u32, b: u32, edge: EdgeFaces) {
        let shared = self.bits[a as usize] & self.bits[b as usize];
        let bits = if self.is_curve(edge) { shared } else { 0 };
        let middle = self.surfaces.projected(self.at(a).midpoint(self.at(b)), bits);
        let new = self.vertices.len() as u32;
        self.vertices.push(middle);
        self.wanted.push((self.sizing.edge)(middle));
        self.bits.push(bits);
        self.around.push(Vec::new());
        for face in [Some(edge.first), edge.second].into_iter().flatten() {
            let old = self.faces[face as usize];
            let replaced = |from: u32| old.map(|v| if v == from { new } else { v });
            let second = self.faces.len() as u32;
            let opposite = self.opposite(face, a, b);
            // The old face keeps a, its twin takes b.
            self.faces[face as usize] = replaced(b);
            self.faces.push(replaced(a));
            self.labels.push(self.labels[face as usize]);
            self.around[b as usize].retain(|&f| f != face);
            self.around[b as usize].push(second);
            self.around[opposite as usize].push(second);
            self.around[new as usize].extend([face, second]);
        }
    }

    /// Returns the number of edges collapsed.
    fn collapse(&mut self) -> usize {
        let mut count = 0;
        for [a, b] in self.edges() {
            if self.relative_length(a, b) >= SHORT {
                continue;
            }
            let Some(edge) = self.faces_on(a, b) else {
                continue;
            };
            // Either end may go, if its curves allow it.
            for (gone, kept) in [(a, b), (b, a)] {
                if self.may_collapse(gone, kept, edge) {
                    self.collapse_edge(gone, kept, edge);
                    count += 1;
                    break;
                }
            }
        }
        count
    }

    fn may_collapse(&self, gone: u32, kept: u32, edge: EdgeFaces) -> bool {
        let (gone_bits, kept_bits) = (self.bits[gone as usize], self.bits[kept as usize]);
        let slides = self.is_curve(edge) && gone_bits.count_ones() == 1 && gone_bits & kept_bits != 0;
        if gone_bits != 0 && !slides {
            return false;
        }
        let faces = 1 + usize::from(edge.second.is_some());
        let (of_gone, of_kept) = (self.neighbours(gone), self.neighbours(kept));
        let common = of_gone.iter().filter(|v| of_kept.contains(v)).count();
        // More common neighbours than faces would pinch the surface.
        common == faces
            && of_gone.len() > 2
            && of_gone.iter().all(|&v| self.stays_short(v, kept))
            && self.stays_unfolded(gone, kept)
    }

    fn stays_short(&self, v: u32, kept: u32) -> bool {
        v == kept || self.relative_length(v, kept) < LONG
    }

    /// No face around `gone` turns by more than about 45 degrees. Slivers, as cuts leave them, have
    /// no normal to speak of: they are compared with the surface around.
    fn stays_unfolded(&self, gone: u32, kept: u32) -> bool {
        let around = self.around[gone as usize]
            .iter()
            .chain(&self.around[kept as usize]);
        let corners = |f: &u32| self.faces[*f as usize].map(|v| self.at(v));
        let mean: Vec3 = around.map(|f| normal(corners(f))).sum();
        self.around[gone as usize].iter().all(|f| {
            let face = self.faces[*f as usize];
            if face.contains(&kept) {
                return true;
            }
            let [a, b, c] = corners(f);
            let before = normal([a, b, c]);
            let after = normal(face.map(|v| self.at(if v == gone { kept } else { v })));
            let longest = (b - a)
                .length_squared()
                .max((c - b).length_squared())
                .max((a - c).length_squared());
            let is_sliver = before.length() < 0.2 * longest;
            let (reference, least) = if is_sliver { (mean, 0.4) } else { (before, 0.7) };
            after.length() > 0.0 && reference.dot(after) > least * reference.length() * after.length()
        })
    }

    fn collapse_edge(&mut self, gone: u32, kept: u32, edge: EdgeFaces) {
        for face in [Some(edge.first), edge.second].into_iter().flatten() {
            for v in self.faces[face as usize] {
                self.around[v as usize].retain(|&f| f != face);
            }
            self.faces[face as usize] = [kept; 3];
        }
        for face in std::mem::take(&mut self.around[gone as usize]) {
            let corners = &mut self.faces[face as usize];
            *corners = corners.map(|v| if v == gone { kept } else { v });
            self.around[kept as usize].push(face);
        }
    }

    /// Distinct neighbours, ascending.
    fn neighbours(&self, v: u32) -> Vec<u32> {
        let faces = self.around[v as usize].iter();
        let mut found: Vec<u32> = faces
            .flat_map(|&f| self.faces[f as usize])
            .filter(|&n| n != v)
            .collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn flip(&mut self, when: Flip) {
        for [a, b] in self.edges() {
            self.flip_edge(a, b, when);
        }
    }

    fn flip_edge(&mut self, a: u32, b: u32, when: Flip) -> Option<()> {
        let edge = self.faces_on(a, b).filter(|e| !self.is_curve(*e))?;
        let (first, second) = (edge.first, edge.second?);
        // Turned so that the first face goes from a to b.
        let (a, b) = if goes(self.faces[first as usize], a, b) {
            (a, b)
        } else {
            (b, a)
        };
        let (c, d) = (self.opposite(first, a, b), self.opposite(second, a, b));
        if self.faces_on(c, d).is_some() || self.neighbours(c).contains(&d) {
            return None;
        }
        let improves = match when {
            Flip::Valence => self.valence_gain([a, b, c, d]) > 0,
            Flip::Angle => self.angle_at(c, a, b) + self.angle_at(d, a, b) > std::f32::consts::PI + 0.01,
        };
        let (new_first, new_second) = ([a, d, c], [d, b, c]);
        let may_lose = [a, b].into_iter().all(|v| self.may_lose_a_face(v));
        if !improves || !may_lose || !self.keeps_shape([a, b, c, d]) {
            return None;
        }
        self.faces[first as usize] = new_first;
        self.faces[second as usize] = new_second;
        self.around[b as usize].retain(|&f| f != first);
        self.around[a as usize].retain(|&f| f != second);
        self.around[c as usize].push(second);
        self.around[d as usize].push(first);
        Some(())
    }

    /// An interior vertex keeps three faces, a border's one.
    fn may_lose_a_face(&self, v: u32) -> bool {
        let faces = self.around[v as usize].len();
        let is_border = self.neighbours(v).len() > faces;
        faces > if is_border { 1 } else { 3 }
    }

    /// By how much a flip brings the four vertices nearer to their ideal valences, in squares.
    fn valence_gain(&self, [a, b, c, d]: [u32; 4]) -> i32 {
        let excess = |v: u32| {
            let faces = self.around[v as usize].len() as i32;
            let neighbours = self.neighbours(v).len() as i32;
            // A border vertex has one neighbour more than faces, and stands for half a disc.
            if neighbours > faces {
                neighbours - 4
            } else {
                faces - 6
            }
        };
        let cost = |v: u32, change: i32| (excess(v) + change).pow(2) - excess(v).pow(2);
        -(cost(a, -1) + cost(b, -1) + cost(c, 1) + cost(d, 1))
    }

    /// A flip neither folds the surface nor makes a sliver.
    fn keeps_shape(&self, [a, b, c, d]: [u32; 4]) -> bool {
        let face = |x, y, z| normal([x, y, z].map(|v| self.at(v)));
        let old = (face(a, b, c) + face(b, a, d)).normalize_or_zero();
        let sound =
            |n: Vec3, longest: f32| n.dot(old) > 0.7 * n.length() && n.length() > 0.15 * longest * longest;
        let longest = self.at(c).distance(self.at(d));
        sound(face(a, d, c), longest) && sound(face(d, b, c), longest)
    }

    fn angle_at(&self, corner: u32, a: u32, b: u32) -> f32 {
        (self.at(a) - self.at(corner)).angle_between(self.at(b) - self.at(corner))
    }

    /// Moves every vertex towards the middle of its neighbours along the surface or its curve.
    fn relax(&mut self) {
        let targets: Vec<Vec3> = (0..self.vertices.len() as u32).map(|v| self.relaxed(v)).collect();
        self.vertices = targets;
    }

    fn relaxed(&self, v: u32) -> Vec3 {
        let (p, bits) = (self.at(v), self.bits[v as usize]);
        if bits.count_ones() > 1 || self.around[v as usize].is_empty() {
            return p;
        }
        let target = if bits == 0 {
            self.disc_centre(v)
        } else {
            self.curve_middle(v)
        };
        let normal = self.surfaces.normal(p);
        let step = (target - p) - normal * normal.dot(target - p);
        let moved = self.surfaces.projected(p + step * 0.8, bits);
        let is_sound = moved.distance(p) < 0.5 * self.wanted[v as usize];
        if is_sound { moved } else { p }
    }

    /// Mean of the centres of the faces around, weighted by their area in units of the wanted length.
    fn disc_centre(&self, v: u32) -> Vec3 {
        let (mut sum, mut total) = (Vec3::ZERO, 0.0);
        for &f in &self.around[v as usize] {
            let face = self.faces[f as usize];
            let corners = face.map(|c| self.at(c));
            let wanted: f32 = face.iter().map(|&c| self.wanted[c as usize]).sum();
            let weight = normal(corners).length() / (wanted * wanted);
            sum += (corners[0] + corners[1] + corners[2]) / 3.0 * weight;
            total += weight;
        }
        if total > 0.0 { sum / total } else { self.at(v) }
    }

    /// Middle of the two neighbours on the same curve.
    fn curve_middle(&self, v: u32) -> Vec3 {
        let mut on_curve = self.neighbours(v);
        on_curve.retain(|&n| self.faces_on(v, n).is_some_and(|e| self.is_curve(e)));
        match on_curve[..] {
            [a, b] => self.at(a).midpoint(self.at(b)),
            _ => self.at(v),
        }
    }
}

/// Twice the area along the normal.
fn normal([a, b, c]: [Vec3; 3]) -> Vec3 {
    (b - a).cross(c - a)
}

/// Whether the face's border runs from a to b.
fn goes(face: [u32; 3], a: u32, b: u32) -> bool {
    (0..3).any(|k| (face[k], face[(k + 1) % 3]) == (a, b))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::implicit::{Beyond, Lattice, mirrored, polygonise};
    use unic_core::topology::edges;

    /// A ball, its half cut at the midplane, cut off at the top and with a seam around it.
    #[test]
    fn curves_and_the_surface_keep_their_vertices() {
        let ball = |p: Vec3| p.length() - 0.3;
        let (midplane, top, seam) = (|p: Vec3| -p.x, |p: Vec3| p.y - 0.2, |p: Vec3| p.z + 0.05);
        let surfaces = Surfaces {
            surface: &ball,
            cuts: vec![&midplane, &top, &seam],
        };
        let lattice = Lattice {
            origin: Vec3::new(-0.03, -0.35, -0.35),
            end: Vec3::splat(0.35),
            step: 0.012,
        };
        let (vertices, faces) = polygonise(&ball, lattice);
        let mut patch = Patch::new(vertices, faces);
        patch.cut(&surfaces, 0, &[0], Beyond::Remove);
        patch.cut(&surfaces, 1, &[0], Beyond::Remove);
        patch.cut(&surfaces, 2, &[0], Beyond::Label(1));
        let edge = |_: Vec3| 0.02;
        remesh(
            &mut patch,
            &surfaces,
            Sizing {
                edge: &edge,
                rounds: 6,
            },
        );
        for (&p, &bits) in patch.vertices.iter().zip(&patch.bits) {
            assert!(ball(p).abs() < 1e-4, "{p} off the ball");
            for (cut, field) in surfaces.cuts.iter().enumerate() {
                assert!(bits & 1 << cut == 0 || field(p).abs() < 1e-3, "{p} off cut {cut}");
            }
        }
        let (whole, image) = mirrored(&patch, 0, |label| label);
        let edges = edges(&whole.faces);
        let euler = whole.vertices.len() as i64 + whole.faces.len() as i64 - edges.len() as i64;
        assert_eq!(euler, 1, "a disc");
        let is_own_inverse = |(v, &i): (usize, &u32)| image[i as usize] as usize == v;
        assert!(image.iter().enumerate().all(is_own_inverse));
        let length = |[a, b]: &[u32; 2]| whole.vertices[*a as usize].distance(whole.vertices[*b as usize]);
        let (short, long) = edges
            .iter()
            .map(length)
            .fold((1f32, 0f32), |(s, l), x| (s.min(x), l.max(x)));
        assert!(
            short > 0.4 * 0.02 && long < 1.6 * 0.02,
            "edges from {short} to {long}"
        );
        // Faces of the front and the back lie on their own sides of the seam.
        for (face, label) in whole.faces.iter().zip(&whole.labels) {
            let middle = face.iter().map(|&v| whole.vertices[v as usize]).sum::<Vec3>() / 3.0;
            assert_eq!(*label == 1, seam(middle) > 0.0);
        }
    }
}
