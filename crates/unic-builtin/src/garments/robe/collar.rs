//! The band along both fronts' edges and around the neck.

use super::{Cut, LEVEL_M, strip, torso::Torso};
use crate::garments::{Fabric, Sewing, shoulder_surface::off_the_skin};
use glam::{Vec2, Vec3};

/// Passes of the 1-2-1 filter along the standing edge.
const PASSES: usize = 10;

/// Where the pattern lies.
const ORIGIN: Vec2 = Vec2::new(-3.0, -0.5);

impl Cut<'_> {
    pub(super) fn collar(&self, sewing: &mut Sewing, torso: &Torso) {
        let part = sewing.part("collar", Fabric::Silk);
        let edge: Vec<u32> = torso.edge.iter().map(|e| e.vertex).collect();
        let feet: Vec<Vec3> = edge.iter().map(|&v| sewing.position(v)).collect();
        let standing = self.standing(torso, &feet);
        let along = running_length(&feet);
        let rows = self.squares(self.robe.collar_m);
        let flat = |i: usize, row: usize| {
            let width = self.robe.collar_m * row as f32 / rows as f32;
            ORIGIN + Vec2::new(along[i], width)
        };
        let mut below: Vec<(u32, Vec2)> = edge.iter().enumerate().map(|(i, v)| (*v, flat(i, 0))).collect();
        for row in 1..=rows {
            let share = row as f32 / rows as f32;
            let place = |i: usize| {
                let laid = torso.edge[i].beyond[row - 1];
                laid.lerp(feet[i].lerp(standing[i], share), torso.edge[i].upright)
            };
            let above: Vec<(u32, Vec2)> = (0..feet.len())
                .map(|i| (sewing.vertex(part, place(i)), flat(i, row)))
                .collect();
            strip(sewing, &below, &above);
            below = above;
        }
    }

    /// The free edge where the band stands: straight above its seam, off the neck, and smooth along
    /// the band.
    fn standing(&self, torso: &Torso, feet: &[Vec3]) -> Vec<Vec3> {
        let free = |foot: &Vec3| off_the_skin(self.skin, *foot + Vec3::Y * self.robe.collar_m, 0.8 * LEVEL_M);
        let mut standing: Vec<Vec3> = feet.iter().map(free).collect();
        for _ in 0..PASSES {
            let before = standing.clone();
            for i in 1..feet.len().saturating_sub(1) {
                if torso.edge[i].upright > 0.0 {
                    standing[i] = before[i] * 0.5 + (before[i - 1] + before[i + 1]) * 0.25;
                }
            }
        }
        standing
    }
}

fn running_length(points: &[Vec3]) -> Vec<f32> {
    let mut along = vec![0.0];
    for pair in points.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    along
}
