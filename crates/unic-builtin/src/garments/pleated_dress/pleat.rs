//! The cross-section of one knife pleat.

use glam::Vec2;

/// One knife pleat at one height. Its section is a polyline in (x along the outline, y outward), both
/// metres: an inner layer, the rise to the visible face, the face up to the outer fold, and the layer
/// that runs back under it to the inner fold, where the next pleat begins.
///
/// x = 0 is where the pleat before ends; the face reaches to x = `face`, and y = 0 is its surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Pleat {
    /// Width that shows, metres.
    pub(super) face: f32,
    /// Width that is folded under, twice, metres. Less than `face` lest the next pleat's inner fold
    /// meet this one's rise.
    pub(super) depth: f32,
    /// Distance between neighbouring layers, metres.
    pub(super) gap: f32,
}

/// Squares along each side of a pleat's section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PleatColumns {
    sides: [usize; 4],
}

/// Number of the side that shows.
const FACE: usize = 2;

impl Pleat {
    /// Corners of the section: inner fold, foot and head of the rise, outer fold, next inner fold.
    fn corners(&self) -> [Vec2; 5] {
        let inner_fold = Vec2::new(-self.depth, -1.5 * self.gap);
        [
            inner_fold,
            Vec2::new(-0.05 * self.face, -2.0 * self.gap),
            Vec2::new((self.face - self.depth).min(0.3 * self.face), 0.0),
            Vec2::new(self.face, -0.5 * self.gap),
            inner_fold + Vec2::X * self.face,
        ]
    }

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
    /// Squares of about the given edge length.
    pub(super) fn for_edge(pleat: &Pleat, edge: f32) -> Self {
        let sides = pleat.sides().map(|side| (side / edge).round().max(2.0) as usize);
        Self { sides }
    }

    /// Columns of a pleat.
    pub(super) fn total(self) -> usize {
        self.sides.iter().sum()
    }

    /// Columns that show at the waist: from the head of the rise to the outer fold.
    pub(super) fn visible(self) -> usize {
        (0..self.total())
            .filter(|&column| self.is_visible(column))
            .count()
    }

    pub(super) fn is_visible(self, column: usize) -> bool {
        let (side, along) = self.place(column);
        side == FACE || (side == FACE + 1 && along == 0)
    }

    /// The section's point at a column.
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

    /// The side that a column lies on, and its number on it.
    fn place(self, column: usize) -> (usize, usize) {
        let mut along = column;
        for (side, &count) in self.sides.iter().enumerate() {
            if along < count {
                return (side, along);
            }
            along -= count;
        }
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
        // Points further apart along the cloth than a fold's two flanks, but near in the plane.
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
