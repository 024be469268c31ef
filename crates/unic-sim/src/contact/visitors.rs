//! Bare limbs that come too close to dressed parts of the body, and come out under the cloth.
//!
//! Captured arms reach into bellies and hips, which real ones cannot. Cloth between them would be
//! scooped up, and stay. So a limb that comes closer than [`NEAR_M`] passes through the garment, as it
//! does through the body. On the way back it may come out under the cloth, which it would lift. So a
//! limb that the garment does not cover touches the cloth's outer side alone, and what of it is under
//! the cloth passes through with all that is around it: fingers that are half through would take the
//! cloth along. What of the cloth is inside a limb that passes sinks to the dressed part beneath. Only
//! what hangs on the part that the limb grows from, a sleeve at its elbow, always feels it.

mod limbs;

use super::SIDE_DEPTH_M;
use glam::Vec3;
pub(crate) use limbs::Limbs;
use rayon::prelude::*;
use unic_core::{folds::Folds, mesh::vertex_normals, surface::Surface};

/// A bare limb this close to a dressed part leaves no room for cloth between them, metres.
const NEAR_M: f32 = 0.003;

/// Cloth farther from a limb than this says nothing about it, metres.
const BESIDE_M: f32 = 0.02;

/// So far around what is close the limb lets cloth through, metres: half a forearm, or
/// cloth that has passed its near side would be caught by the far one.
const AROUND_M: f32 = 0.03;

/// Which faces let the garment through in one pose.
#[derive(Clone, Debug, Default)]
pub(super) struct Visitors {
    limbs: Limbs,
    /// Of each face: it is of a limb that is too close to a dressed part there; empty when none is.
    visiting: Vec<bool>,
    /// Vertices that are close themselves, with their bits.
    close: Vec<(Vec3, u32)>,
    is_visiting: Vec<bool>,
    /// Corners of the box around what visits and the inside next to it; empty when nothing does.
    bounds: Option<[Vec3; 2]>,
    /// Of each particle: outward.
    cloth_normals: Vec<Vec3>,
    /// Of each face of the body.
    body_normals: Vec<Vec3>,
}

impl Visitors {
    pub(super) fn new(limbs: Limbs) -> Self {
        Self {
            limbs,
            ..Self::default()
        }
    }

    /// For the body's pose of the last refit, with its vertices at `positions`, and particles.
    pub(super) fn find(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3], particles: &[Vec3]) {
        self.find_sides(surface, positions, particles);
        self.find_close(surface, folds, positions);
        self.find_under(positions, particles);
        self.spread(surface, positions);
    }

    /// Which way the cloth and the body's faces look.
    fn find_sides(&mut self, surface: &Surface, positions: &[Vec3], particles: &[Vec3]) {
        if self.limbs.outer == 0 {
            return;
        }
        vertex_normals(particles, &self.limbs.garment, &mut self.cloth_normals);
        for (normal, sign) in self.cloth_normals.iter_mut().zip(&self.limbs.outward) {
            *normal *= *sign;
        }
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        };
        self.body_normals.clear();
        self.body_normals.extend(surface.faces().iter().map(normal));
    }

    fn find_close(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3]) {
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
    }

    /// Vertices that are on the inner side of the cloth next to them: a hand that is half through would
    /// take it along on its fingers.
    fn find_under(&mut self, positions: &[Vec3], particles: &[Vec3]) {
        let Limbs {
            felt,
            vertices,
            outer,
            ..
        } = &self.limbs;
        for limb in (0..u32::BITS)
            .map(|limb| 1 << limb)
            .filter(|bit| outer & bit != 0)
        {
            let of_limb = vertices.iter().filter(|(_, bit)| *bit == limb);
            let of_limb: Vec<Vec3> = of_limb.map(|(vertex, _)| positions[*vertex as usize]).collect();
            let low = of_limb.iter().copied().fold(Vec3::INFINITY, Vec3::min) - BESIDE_M;
            let high = of_limb.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) + BESIDE_M;
            let is_beside = |&i: &usize| {
                let p = particles[i];
                felt[i] & limb == 0 && p.cmpge(low).all() && p.cmple(high).all()
            };
            let mut cloth: Vec<usize> = (0..particles.len()).filter(is_beside).collect();
            cloth.sort_by(|&a, &b| particles[a].x.total_cmp(&particles[b].x));
            let under = of_limb
                .par_iter()
                .filter(|p| self.is_beneath(**p, &cloth, particles));
            let under: Vec<(Vec3, u32)> = under.map(|p| (*p, limb)).collect();
            self.close.extend(under);
        }
    }

    /// Whether a point is on the inner side of the particle next to it, if one is near. `cloth` is sorted
    /// by x.
    fn is_beneath(&self, p: Vec3, cloth: &[usize], particles: &[Vec3]) -> bool {
        let from = cloth.partition_point(|&i| particles[i].x < p.x - BESIDE_M);
        let to = cloth.partition_point(|&i| particles[i].x <= p.x + BESIDE_M);
        let distance = |i: usize| particles[i].distance_squared(p);
        let near = cloth[from..to].iter().copied();
        let nearest = near.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.filter(|&i| distance(i) < BESIDE_M * BESIDE_M);
        nearest.is_some_and(|i| (p - particles[i]).dot(self.cloth_normals[i]) < 0.0)
    }

    /// Spreads what is close over the limb.
    fn spread(&mut self, surface: &Surface, positions: &[Vec3]) {
        let Limbs {
            of_face, vertices, ..
        } = &self.limbs;
        self.is_visiting.clear();
        self.is_visiting.resize(positions.len(), false);
        self.bounds = None;
        if self.close.is_empty() {
            self.visiting.clear();
            return;
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &(vertex, bit) in vertices {
            let p = positions[vertex as usize];
            let is_near = |(q, of): &(Vec3, u32)| *of == bit && q.distance_squared(p) < AROUND_M * AROUND_M;
            if self.close.iter().any(is_near) {
                self.is_visiting[vertex as usize] = true;
                (low, high) = (low.min(p), high.max(p));
            }
        }
        self.bounds = Some([low - SIDE_DEPTH_M, high + SIDE_DEPTH_M]);
        let is_visiting = |face: &[u32; 3]| face.iter().any(|&v| self.is_visiting[v as usize]);
        self.visiting.clear();
        let faces = surface.faces().iter().zip(of_face);
        self.visiting
            .extend(faces.map(|(face, bit)| *bit != 0 && is_visiting(face)));
    }

    /// Whether the garment covers a face.
    pub(super) fn is_dressed(&self, face: u32) -> bool {
        self.limbs.of_face.get(face as usize).is_none_or(|&bit| bit == 0)
    }

    /// Whether a place may lie inside a limb that passes through the cloth.
    pub(super) fn may_hold(&self, p: Vec3) -> bool {
        let is_within = |[low, high]: [Vec3; 2]| p.cmpge(low).all() && p.cmple(high).all();
        self.bounds.is_some_and(is_within)
    }

    /// Whether a particle passes through a face; false for what is no face.
    pub(super) fn pass(&self, particle: usize, face: u32) -> bool {
        let face = face as usize;
        let bit = self.limbs.of_face.get(face).copied().unwrap_or(0);
        if bit == 0 || self.limbs.felt[particle] & bit != 0 {
            return false;
        }
        let is_visiting = self.visiting.get(face).is_some_and(|&is| is);
        is_visiting || (self.limbs.outer & bit != 0 && self.is_under(particle, face))
    }

    /// Whether the face looks at the inner side of the cloth.
    fn is_under(&self, particle: usize, face: usize) -> bool {
        let normals = self.cloth_normals.get(particle).zip(self.body_normals.get(face));
        normals.is_some_and(|(cloth, body)| cloth.dot(*body) > 0.0)
    }
}

#[cfg(test)]
pub(super) mod tests;
