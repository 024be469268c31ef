//! The sash and its ties.

use super::{Cut, LAYER_GAP_M};
use crate::garments::{Fabric, GarmentError, Grid, GridShape, Sewing, Wrap};
use glam::Vec2;

/// Width of a tie, metres.
const TIE_M: f32 = 0.05;

/// From the midplane to the nearer edge of a tie, metres.
const TIE_FROM_MIDDLE_M: f32 = 0.006;

/// How much shorter the right tie is, metres.
const TIE_DIFFERENCE_M: f32 = 0.05;

/// Where the patterns lie.
const ORIGIN: Vec2 = Vec2::new(0.0, 2.5);

impl Cut<'_> {
    pub(super) fn sash(&self, sewing: &mut Sewing) -> Result<(), GarmentError> {
        let part = sewing.part("sash", Fabric::Silk);
        let [bottom, top] = [-0.5, 0.5].map(|side| self.waist + side * self.robe.sash_m);
        let girth = self
            .trunk
            .circumference(self.waist, self.sash_level(self.waist, 0.0));
        let shape = GridShape {
            columns: 2 * self.squares(0.5 * girth),
            rows: self.squares(self.robe.sash_m),
            wrap: Wrap::Closed,
        };
        let place = |u: f32, v: f32| {
            let height = bottom + v * (top - bottom);
            self.trunk
                .spot_under(height, u, self.level(height))
                .at(self.sash_level(height, u))
        };
        let pattern = |u: f32, v: f32| {
            let height = bottom + v * (top - bottom);
            let girth = self.trunk.circumference(height, self.sash_level(height, 0.0));
            ORIGIN + Vec2::new((u - 0.5) * girth, v * (top - bottom))
        };
        let sash = sewing.grid(part, shape, place, pattern);
        let all: Vec<u32> = (0..=shape.rows).flat_map(|row| sash.row(row)).collect();
        sewing.attach("sash", &all);
        self.tie(sewing, sash, top, ("tie_left", 1.0))?;
        self.tie(sewing, sash, top, ("tie_right", -1.0))
    }

    /// Off the trunk surface, over both fronts.
    fn sash_level(&self, height: f32, u: f32) -> f32 {
        let rise = self.rise(height, u.min(1.0 - u).abs());
        self.level(height) + LAYER_GAP_M * (1.0 + rise)
    }

    /// A strip that begins at the sash's upper edge, folds over it and hangs down before it.
    fn tie(
        &self,
        sewing: &mut Sewing,
        sash: Grid,
        top: f32,
        (name, sign): (&str, f32),
    ) -> Result<(), GarmentError> {
        let part = sewing.part(name, Fabric::Silk);
        let around = sash.shape().columns;
        let girth = self.trunk.circumference(top, self.sash_level(top, 0.0));
        let columns = (TIE_M / girth * around as f32).round().max(2.0) as usize;
        let first = (TIE_FROM_MIDDLE_M / girth * around as f32).ceil().max(1.0) as usize;
        // Folded over, the cloth shows its reverse: u runs the other way along the sash.
        let column = |i: usize| {
            let i = columns - i;
            if sign > 0.0 {
                first + i
            } else {
                around - first - columns + i
            }
        };
        let length = self.robe.tie_m + self.robe.sash_m - TIE_DIFFERENCE_M * (0.5 - 0.5 * sign);
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
            let girth_here = self.trunk.circumference(height, self.sash_level(height, 0.0));
            self.trunk
                .spot_under(height, beyond * girth / girth_here, self.level(height))
                .at(self.sash_level(height, 0.0) + fold)
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
