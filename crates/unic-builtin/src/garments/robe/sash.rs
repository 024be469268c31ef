//! Sash and ties.

use super::{LAYER_GAP_M, RobeLayout};
use crate::garments::{Fabric, GarmentError, Grid, GridShape, Sewing, Side, Wrap};
use glam::Vec2;

/// Width of a tie, metres.
const TIE_M: f32 = 0.05;

/// Distance from the midplane to the nearer edge of a tie, metres.
const TIE_FROM_MIDDLE_M: f32 = 0.006;

/// Difference in length between the left tie and the right one, which is shorter, metres.
const TIE_DIFFERENCE_M: f32 = 0.05;

/// Origin of the patterns, metres.
const ORIGIN: Vec2 = Vec2::new(0.0, 2.5);

impl RobeLayout<'_> {
    /// Adds the sash and both ties.
    pub(super) fn sash(&self, sewing: &mut Sewing) -> Result<(), GarmentError> {
        let part = sewing.part("sash", Fabric::Silk);
        let [bottom, top] = [-0.5, 0.5].map(|side| self.waist + side * self.design.sash_m);
        let girth = self
            .trunk
            .circumference(self.waist, self.sash_level(self.waist, 0.0));
        let shape = GridShape {
            columns: 2 * self.squares(0.5 * girth),
            rows: self.squares(self.design.sash_m),
            wrap: Wrap::Closed,
        };
        let place = |u: f32, v: f32| {
            let height = bottom + v * (top - bottom);
            self.trunk
                .point_on_offset(height, u, self.level(height))
                .raised_by(self.sash_level(height, u))
        };
        let pattern = |u: f32, v: f32| {
            let height = bottom + v * (top - bottom);
            let girth = self.trunk.circumference(height, self.sash_level(height, 0.0));
            ORIGIN + Vec2::new((u - 0.5) * girth, v * (top - bottom))
        };
        let sash = sewing.grid(part, shape, place, pattern);
        let all: Vec<u32> = (0..=shape.rows).flat_map(|row| sash.row(row)).collect();
        sewing.attach("sash", &all);
        self.tie(sewing, sash, top, Side::Left)?;
        self.tie(sewing, sash, top, Side::Right)
    }

    /// Distance of the sash from the trunk surface, over both fronts, metres.
    fn sash_level(&self, height: f32, u: f32) -> f32 {
        let rise = self.rise(height, u.min(1.0 - u).abs());
        self.level(height) + LAYER_GAP_M * (1.0 + rise)
    }

    /// Adds a tie: a strip that begins at the sash's upper edge (at height `top`), folds over it
    /// and falls down in front of it.
    fn tie(&self, sewing: &mut Sewing, sash: Grid, top: f32, side: Side) -> Result<(), GarmentError> {
        let name = match side {
            Side::Left => "tie_left",
            Side::Right => "tie_right",
        };
        let sign = side.sign();
        let part = sewing.part(name, Fabric::Silk);
        let around = sash.shape().columns;
        let girth = self.trunk.circumference(top, self.sash_level(top, 0.0));
        let columns = (TIE_M / girth * around as f32).round().max(2.0) as usize;
        let first = (TIE_FROM_MIDDLE_M / girth * around as f32).ceil().max(1.0) as usize;
        // Folded over, the cloth shows its back: u runs the other way along the sash.
        let column = |i: usize| {
            let i = columns - i;
            if sign > 0.0 {
                first + i
            } else {
                around - first - columns + i
            }
        };
        let length = self.design.tie_m + self.design.sash_m - TIE_DIFFERENCE_M * (0.5 - 0.5 * sign);
        let rows = self.squares(length);
        let shape = GridShape {
            columns,
            rows,
            wrap: Wrap::Open,
        };
        let place = |u: f32, v: f32| {
            let share = column((u * columns as f32).round() as usize) as f32 / around as f32;
            let beyond = if share > 0.5 { share - 1.0 } else { share };
            // The last row is the seam; the row before it lies on the fold.
            let below = (1.0 - v) * length - self.edge;
            let height = top - below.max(-0.001);
            let fold = if below < -0.5 * self.edge {
                0.0
            } else {
                LAYER_GAP_M
            };
            // The tie keeps its width: shares of the top's girth become shares of the girth here.
            let girth_here = self.trunk.circumference(height, self.sash_level(height, 0.0));
            self.trunk
                .point_on_offset(height, beyond * girth / girth_here, self.level(height))
                .raised_by(self.sash_level(height, 0.0) + fold)
        };
        let origin = ORIGIN + Vec2::new(1.5 + 0.2 * sign, 0.0);
        let tie = sewing.grid(part, shape, place, |u, v| {
            origin + Vec2::new(u * TIE_M, v * length)
        });
        let seam: Vec<u32> = (0..=columns)
            .map(|i| sash.at(column(i), sash.shape().rows))
            .collect();
        sewing.sew(&seam, &tie.row(rows))
    }
}
