//! Collar band along the edges of both fronts and around the neck.

use super::{LEVEL_M, PatternVertex, RobeLayout, strip, torso::Torso};
use crate::garments::{Fabric, Sewing, shoulder_surface::off_the_skin};
use glam::{Vec2, Vec3};

/// Passes of the 1-2-1 filter along the standing edge.
const PASSES: usize = 10;

/// Origin of the pattern, metres.
const ORIGIN: Vec2 = Vec2::new(-3.0, -0.5);

impl RobeLayout<'_> {
    /// Adds the collar, sewn to the edge of the torso.
    pub(super) fn collar(&self, sewing: &mut Sewing, torso: &Torso) {
        let part = sewing.part("collar", Fabric::Silk);
        let edge: Vec<u32> = torso.edge.iter().map(|e| e.vertex).collect();
        let seam: Vec<Vec3> = edge.iter().map(|&v| sewing.position(v)).collect();
        let standing = self.standing(torso, &seam);
        let along = running_length(&seam);
        let rows = self.squares(self.design.collar_m);
        let flat = |i: usize, row: usize| {
            let width = self.design.collar_m * row as f32 / rows as f32;
            ORIGIN + Vec2::new(along[i], width)
        };
        let first = |(i, &vertex): (usize, &u32)| PatternVertex {
            vertex,
            pattern: flat(i, 0),
        };
        let mut below: Vec<PatternVertex> = edge.iter().enumerate().map(first).collect();
        for row in 1..=rows {
            let share = row as f32 / rows as f32;
            let place = |i: usize| {
                // On the fronts the band continues the panel, around the neck it stands.
                let laid = torso.edge[i].beyond[row - 1];
                laid.lerp(seam[i].lerp(standing[i], share), torso.edge[i].upright)
            };
            let above: Vec<PatternVertex> = (0..seam.len())
                .map(|i| PatternVertex {
                    vertex: sewing.vertex(part, place(i)),
                    pattern: flat(i, row),
                })
                .collect();
            strip(sewing, &below, &above);
            below = above;
        }
    }

    /// Positions of the free edge of a standing band, metres: straight above the seam, off the
    /// neck, and smooth along the band.
    fn standing(&self, torso: &Torso, seam: &[Vec3]) -> Vec<Vec3> {
        let free = |p: &Vec3| off_the_skin(self.skin, *p + Vec3::Y * self.design.collar_m, 0.8 * LEVEL_M);
        let mut standing: Vec<Vec3> = seam.iter().map(free).collect();
        for _ in 0..PASSES {
            let before = standing.clone();
            for i in 1..seam.len().saturating_sub(1) {
                // Where the band lies flat, its standing position has no weight.
                if torso.edge[i].upright > 0.0 {
                    standing[i] = before[i] * 0.5 + (before[i - 1] + before[i + 1]) * 0.25;
                }
            }
        }
        standing
    }
}

/// Length of a polyline up to each of its points, metres.
fn running_length(points: &[Vec3]) -> Vec<f32> {
    let mut along = vec![0.0];
    for pair in points.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    along
}
