//! Cross-section of one knife pleat.

use glam::Vec2;

/// One knife pleat at one height.
///
/// Its section is a polyline with four sides, x along the outline and y outward, in metres:
///
/// 1. the inner layer,
/// 2. the rise to the visible face,
/// 3. the visible face up to the outer fold,
/// 4. the layer that runs back under the face to the inner fold, where the next pleat begins.
///
/// The face of the pleat before ends at x = 0. This one's reaches to x = `face` and lies near
/// y = 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pleat {
    /// Visible width, metres.
    pub(super) face: f32,
    /// Width that is folded under, twice, metres. It is less than `face`, so that the next pleat's
    /// inner fold does not meet this one's rise.
    pub(super) depth: f32,
    /// Distance between neighbouring layers, metres.
    pub(super) gap: f32,
}

/// Number of squares along each side of a pleat's section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PleatColumns {
    sides: [usize; 4],
}

/// Index of the visible side.
const FACE: usize = 2;

impl Pleat {
    /// Corners of the section: inner fold, lower and upper end of the rise, outer fold, next inner
    /// fold.
    fn corners(&self) -> [Vec2; 5] {
        let inner_fold = Vec2::new(-self.depth, -1.5 * self.gap);
        // Depths of the three layers, in gaps: the visible one lies between 0 and −0.5, the layer
        // that runs back between −0.5 and −1.5, the inner one of the next pleat between −1.5 and
        // −2.
        [
            inner_fold,
            Vec2::new(-0.05 * self.face, -2.0 * self.gap),
            Vec2::new((self.face - self.depth).min(0.3 * self.face), 0.0),
            Vec2::new(self.face, -0.5 * self.gap),
            inner_fold + Vec2::X * self.face,
        ]
    }

    /// Lengths of the sides, metres.
    fn sides(&self) -> [f32; 4] {
        let corners = self.corners();
        std::array::from_fn(|side| corners[side].distance(corners[side + 1]))
    }

    /// Width of the cloth in one pleat, metres.
    pub(super) fn length(&self) -> f32 {
        self.sides().iter().sum()
    }
}

impl PleatColumns {
    /// Numbers of squares of about the given edge length, metres.
    pub(super) fn for_edge(pleat: &Pleat, edge: f32) -> Self {
        let sides = pleat.sides().map(|side| (side / edge).round().max(2.0) as usize);
        Self { sides }
    }

    /// Number of columns of a pleat.
    pub(super) fn total(self) -> usize {
        self.sides.iter().sum()
    }

    /// Number of visible columns, from the upper end of the rise to the outer fold.
    pub(super) fn visible(self) -> usize {
        (0..self.total())
            .filter(|&column| self.is_visible(column))
            .count()
    }

    /// Returns true for a column on the visible face, both of its ends included.
    pub(super) fn is_visible(self, column: usize) -> bool {
        let (side, along) = self.place(column);
        side == FACE || (side == FACE + 1 && along == 0)
    }

    /// Point of the section at a column, metres.
    pub(super) fn point(self, pleat: &Pleat, column: usize) -> Vec2 {
        let (side, along) = self.place(column);
        let corners = pleat.corners();
        corners[side].lerp(corners[side + 1], along as f32 / self.sides[side] as f32)
    }

    /// Width of the cloth from the pleat's inner fold to a column, metres.
    pub(super) fn along(self, pleat: &Pleat, column: usize) -> f32 {
        let (side, along) = self.place(column);
        let sides = pleat.sides();
        sides[..side].iter().sum::<f32>() + sides[side] * along as f32 / self.sides[side] as f32
    }

    /// Side of a column, and number of the column on that side.
    fn place(self, column: usize) -> (usize, usize) {
        let mut along = column;
        for (side, &count) in self.sides.iter().enumerate() {
            if along < count {
                return (side, along);
            }
            along -= count;
        }
        // The column behind the last one is the end of the last side.
        (self.sides.len() - 1, self.sides[3])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PLEAT: Pleat = Pleat {
        face: 0.03,
        depth: 0.02,
        gap: 0.004,
    };

    #[test]
    fn a_pleat_ends_where_the_next_begins() {
        let corners = PLEAT.corners();
        assert!((corners[4] - corners[0] - Vec2::new(PLEAT.face, 0.0)).length() < 1e-7);
        let columns = PleatColumns::for_edge(&PLEAT, 0.005);
        let width: f32 = columns.along(&PLEAT, columns.total());
        assert!((width - PLEAT.length()).abs() < 1e-6);
    }

    #[test]
    fn layers_of_neighbouring_pleats_keep_apart() {
        let columns = PleatColumns::for_edge(&PLEAT, 0.001);
        let count = columns.total();
        let section: Vec<Vec2> = (0..3 * count)
            .map(|c| columns.point(&PLEAT, c % count) + Vec2::X * PLEAT.face * (c / count) as f32)
            .collect();
        // Points that are far apart along the cloth must not be close to each other in the plane.
        for i in count..2 * count {
            for j in 0..3 * count {
                if i.abs_diff(j) > 12 {
                    assert!(
                        section[i].distance(section[j]) > 0.5 * PLEAT.gap,
                        "columns {i} and {j}"
                    );
                }
            }
        }
    }
}
