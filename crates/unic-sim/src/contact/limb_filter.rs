//! A contact filter for bare limbs: which contacts between cloth and body are ignored.
//!
//! Captured arms reach into bellies and hips, which real arms cannot. Cloth between the two would
//! be dragged along and stay displaced. The filter prevents that:
//!
//! - A bare limb that comes closer than [`NEAR_M`] to a covered part of the body passes through the
//!   garment, as it passes through the body.
//! - On the way back such a limb may end up beneath the cloth and would lift it. A limb that the
//!   garment does not enclose therefore collides with the cloth's outer side only.
//! - A part of such a limb that is beneath the cloth is ignored together with its surroundings. A
//!   hand that is half beneath the cloth would otherwise drag it along with its fingers.
//! - Cloth inside an ignored limb moves to the covered part beneath it.
//! - Cloth on the part that a limb is attached to always collides with the limb, as a sleeve does
//!   with the forearm.

mod limbs;

use super::settings::MAX_TRACKED_DEPTH_M;
use glam::Vec3;
pub(crate) use limbs::{BareLimbs, hits_in_bind_pose};
use limbs::{LimbSet, LimbVertex};
use rayon::prelude::*;
use unic_core::{folds::Folds, mesh::vertex_normals, surface::Surface};

/// Largest distance between a bare limb and a covered part that leaves no room for cloth, metres.
const NEAR_M: f32 = 0.003;

/// Largest distance at which cloth decides whether a point of a limb is beneath it, metres.
const BESIDE_M: f32 = 0.02;

/// Radius around each seed within which the limb is ignored, metres: half the thickness of a
/// forearm. Cloth that has passed its near side would otherwise collide with the far side.
const AROUND_M: f32 = 0.03;

/// The contacts that are ignored in one pose.
#[derive(Clone, Debug, Default)]
pub(super) struct LimbFilter {
    limbs: BareLimbs,
    /// True for each face of the body that is ignored; empty when none is.
    ignored_faces: Vec<bool>,
    /// Points of limbs that are too close to a covered part or beneath the cloth.
    seeds: Vec<Seed>,
    /// True for each vertex of the body that is near a seed.
    ignored_vertices: Vec<bool>,
    /// Lower and upper corner of a box that contains the ignored vertices and the inside of the
    /// limbs next to them; `None` when there are none.
    bounds: Option<[Vec3; 2]>,
    /// Normal of each particle, away from the body.
    cloth_normals: Vec<Vec3>,
    /// Normal of each face of the body, not normalised.
    body_normals: Vec<Vec3>,
}

/// A point around which a limb is ignored.
#[derive(Clone, Copy, Debug)]
struct Seed {
    position: Vec3,
    limb: LimbSet,
}

impl LimbFilter {
    pub(super) fn new(limbs: BareLimbs) -> Self {
        Self {
            limbs,
            ..Self::default()
        }
    }

    /// Updates the filter for a pose. `surface` has been refitted to the body's vertices at
    /// `positions`, `particles` are the positions of the cloth, in metres.
    pub(super) fn update(
        &mut self,
        surface: &Surface,
        folds: &Folds,
        positions: &[Vec3],
        particles: &[Vec3],
    ) {
        self.update_normals(surface, positions, particles);
        self.find_near_covered(surface, folds, positions);
        self.find_beneath_cloth(positions, particles);
        self.spread(surface, positions);
    }

    /// Computes the normals of the cloth and of the body's faces, which decide what is beneath.
    fn update_normals(&mut self, surface: &Surface, positions: &[Vec3], particles: &[Vec3]) {
        if self.limbs.outside_limbs == 0 {
            return;
        }
        vertex_normals(particles, &self.limbs.garment_faces, &mut self.cloth_normals);
        for (normal, sign) in self.cloth_normals.iter_mut().zip(&self.limbs.normal_signs) {
            *normal *= *sign;
        }
        // Only the sign of a dot product is used, so that the length does not matter.
        let normal = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| positions[v as usize]);
            (b - a).cross(c - a)
        };
        self.body_normals.clear();
        self.body_normals.extend(surface.faces().iter().map(normal));
    }

    /// Replaces the seeds with the limb vertices that are too close to a covered part.
    fn find_near_covered(&mut self, surface: &Surface, folds: &Folds, positions: &[Vec3]) {
        let BareLimbs {
            limb_of_face,
            attached_limbs_of_face,
            vertices,
            ..
        } = &self.limbs;
        self.seeds.clear();
        self.seeds
            .par_extend(vertices.par_iter().filter_map(|&LimbVertex { vertex, limb }| {
                let position = positions[vertex as usize];
                // The part that the limb is attached to is always close and does not count.
                let is_covered = |face: u32| {
                    let attached = attached_limbs_of_face[face as usize] & limb;
                    limb_of_face[face as usize] | attached == 0
                };
                // A vertex deep inside a covered part is far from its surface. It lies in a fold,
                // as do fingers that touch each other; these have no covered face near them.
                let reach = if folds.vertices()[vertex as usize] {
                    AROUND_M
                } else {
                    NEAR_M
                };
                let is_close = surface.closest_where(position, reach, is_covered).is_some();
                is_close.then_some(Seed { position, limb })
            }));
    }

    /// Adds the limb vertices that are on the inner side of the cloth next to them as seeds.
    fn find_beneath_cloth(&mut self, positions: &[Vec3], particles: &[Vec3]) {
        let BareLimbs {
            never_ignored,
            vertices,
            outside_limbs,
            ..
        } = &self.limbs;
        for limb in (0..LimbSet::BITS)
            .map(|index| 1 << index)
            .filter(|limb| outside_limbs & limb != 0)
        {
            let of_limb = vertices.iter().filter(|v| v.limb == limb);
            let of_limb: Vec<Vec3> = of_limb.map(|v| positions[v.vertex as usize]).collect();
            let low = of_limb.iter().copied().fold(Vec3::INFINITY, Vec3::min) - BESIDE_M;
            let high = of_limb.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max) + BESIDE_M;
            let is_beside = |&i: &usize| {
                let p = particles[i];
                never_ignored[i] & limb == 0 && p.cmpge(low).all() && p.cmple(high).all()
            };
            let mut cloth: Vec<usize> = (0..particles.len()).filter(is_beside).collect();
            // Sorted along one axis, so that each query searches a thin slab of the cloth only.
            cloth.sort_by(|&a, &b| particles[a].x.total_cmp(&particles[b].x));
            let beneath = of_limb
                .par_iter()
                .filter(|p| self.is_beneath(**p, &cloth, particles));
            let beneath: Vec<Seed> = beneath.map(|&position| Seed { position, limb }).collect();
            self.seeds.extend(beneath);
        }
    }

    /// Returns whether a point is on the inner side of the nearest particle, if one is within
    /// [`BESIDE_M`]. `cloth` lists particles by growing x.
    fn is_beneath(&self, p: Vec3, cloth: &[usize], particles: &[Vec3]) -> bool {
        let from = cloth.partition_point(|&i| particles[i].x < p.x - BESIDE_M);
        let to = cloth.partition_point(|&i| particles[i].x <= p.x + BESIDE_M);
        let distance = |i: usize| particles[i].distance_squared(p);
        let near = cloth[from..to].iter().copied();
        let nearest = near.min_by(|&a, &b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.filter(|&i| distance(i) < BESIDE_M * BESIDE_M);
        nearest.is_some_and(|i| (p - particles[i]).dot(self.cloth_normals[i]) < 0.0)
    }

    /// Marks the vertices and faces of each limb that are near its seeds.
    fn spread(&mut self, surface: &Surface, positions: &[Vec3]) {
        let BareLimbs {
            limb_of_face,
            vertices,
            ..
        } = &self.limbs;
        self.ignored_vertices.clear();
        self.ignored_vertices.resize(positions.len(), false);
        self.bounds = None;
        if self.seeds.is_empty() {
            self.ignored_faces.clear();
            return;
        }
        let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        for &LimbVertex { vertex, limb } in vertices {
            let p = positions[vertex as usize];
            let is_near =
                |seed: &Seed| seed.limb == limb && seed.position.distance_squared(p) < AROUND_M * AROUND_M;
            if self.seeds.iter().any(is_near) {
                self.ignored_vertices[vertex as usize] = true;
                (low, high) = (low.min(p), high.max(p));
            }
        }
        // Particles inside a limb are searched for down to this depth below its surface.
        self.bounds = Some([low - MAX_TRACKED_DEPTH_M, high + MAX_TRACKED_DEPTH_M]);
        let has_ignored = |face: &[u32; 3]| face.iter().any(|&v| self.ignored_vertices[v as usize]);
        self.ignored_faces.clear();
        let faces = surface.faces().iter().zip(limb_of_face);
        self.ignored_faces
            .extend(faces.map(|(face, limb)| *limb != 0 && has_ignored(face)));
    }

    /// Returns whether a face belongs to a covered part of the body.
    pub(super) fn is_covered(&self, face: u32) -> bool {
        self.limbs
            .limb_of_face
            .get(face as usize)
            .is_none_or(|&limb| limb == 0)
    }

    /// Returns whether a point may lie inside an ignored part of a limb; a quick test before exact
    /// ones.
    pub(super) fn may_contain(&self, p: Vec3) -> bool {
        let is_within = |[low, high]: [Vec3; 2]| p.cmpge(low).all() && p.cmple(high).all();
        self.bounds.is_some_and(is_within)
    }

    /// Returns whether contact between a particle and a face is ignored; false for an index that is
    /// no face.
    pub(super) fn ignores(&self, particle: usize, face: u32) -> bool {
        let face = face as usize;
        let limb = self.limbs.limb_of_face.get(face).copied().unwrap_or(0);
        if limb == 0 || self.limbs.never_ignored[particle] & limb != 0 {
            return false;
        }
        let is_ignored = self.ignored_faces.get(face).is_some_and(|&is| is);
        is_ignored || (self.limbs.outside_limbs & limb != 0 && self.faces_inner_side(particle, face))
    }

    /// Returns whether a face of the body would touch the inner side of the cloth: both normals
    /// point the same way.
    fn faces_inner_side(&self, particle: usize, face: usize) -> bool {
        let normals = self.cloth_normals.get(particle).zip(self.body_normals.get(face));
        normals.is_some_and(|(cloth, body)| cloth.dot(*body) > 0.0)
    }
}

#[cfg(test)]
pub(super) mod tests;
