//! Tangential smoothing of vertices.

use super::{Remeshing, normal};
use glam::Vec3;

impl Remeshing<'_> {
    /// Moves every vertex along the surface or its curve towards the middle of its neighbours.
    pub(super) fn relax(&mut self) {
        // All targets come from the old positions: the result does not depend on an order.
        let targets: Vec<Vec3> = (0..self.vertices.len() as u32).map(|v| self.relaxed(v)).collect();
        self.vertices = targets;
    }

    /// Smoothed position of a vertex. Corners and unused vertices stay.
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
        // Damped, so that smoothing does not oscillate.
        let moved = self.surfaces.projected(p + step * 0.8, bits);
        // The projection may have landed on another part of the surface.
        let is_sound = moved.distance(p) < 0.5 * self.wanted[v as usize];
        if is_sound { moved } else { p }
    }

    /// Mean of the centres of the faces around a vertex, weighted by area over squared wanted
    /// length.
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

    /// Middle of a vertex's two neighbours on the same curve; elsewhere the vertex itself.
    fn curve_middle(&self, v: u32) -> Vec3 {
        let mut on_curve = self.neighbours(v);
        on_curve.retain(|&n| self.faces_on(v, n).is_some_and(|e| self.is_curve(e)));
        match on_curve[..] {
            [a, b] => self.at(a).midpoint(self.at(b)),
            _ => self.at(v),
        }
    }
}
