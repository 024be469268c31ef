//! Back and fronts, from the hem over the shoulders.

use super::{Cut, LAYER_GAP_M, laid_flat, smooth, strip};
use crate::garments::{Fabric, Sewing};
use glam::{Vec2, Vec3};

/// Distance from the side seam within which the left front rises over the right one, metres.
const RISE_M: f32 = 0.06;

/// Points at which a line across the shoulders is followed to find its length.
const FINE: usize = 128;

/// Where the three panels' patterns lie.
const ORIGINS: [Vec2; 3] = [Vec2::new(-1.5, 0.0), Vec2::ZERO, Vec2::new(1.5, 0.0)];

/// Share of each panel's rows at which their patterns are aligned: the side seams, and the middle of
/// the back.
const ANCHORS: [f32; 3] = [1.0, 0.5, 0.0];

/// What the other pieces are sewn to.
pub(super) struct Torso {
    /// Left and right: closed loops from the underarm, the first vertex not repeated; their direction
    /// is that of a tube's u whose v runs along the arm.
    pub(super) armholes: [Vec<u32>; 2],
    /// From the left hem up the front, around the neck and down to the right hem.
    pub(super) edge: Vec<EdgeVertex>,
    /// The row at the waist.
    pub(super) waist: Vec<u32>,
}

/// A vertex of the edge that the collar is sewn to.
#[derive(Clone, Debug)]
pub(super) struct EdgeVertex {
    pub(super) vertex: u32,
    /// Where the panel would go on, row by row of the collar.
    pub(super) beyond: Vec<Vec3>,
    /// 0 on the fronts, 1 around the neck.
    pub(super) upright: f32,
}

/// One row of the three panels: left front, back, right front, all by growing u. Under the armholes
/// neighbours share their last and first vertices.
struct Rows {
    panels: [Vec<u32>; 3],
    /// Where the left and the right front would go on, row by row of the collar.
    beyond: [Vec<Vec3>; 2],
}

struct Layout<'a, 'b> {
    cut: &'a Cut<'b>,
    parts: [u32; 3],
    tube_rows: usize,
    yoke_rows: usize,
}

impl Cut<'_> {
    pub(super) fn torso(&self, sewing: &mut Sewing) -> Torso {
        let names = ["front_left", "back", "front_right"];
        let layout = Layout {
            cut: self,
            parts: names.map(|name| sewing.part(name, Fabric::Silk)),
            tube_rows: self.squares((self.underarm - self.hem) * (1.0 + self.robe.flare.powi(2)).sqrt()),
            yoke_rows: self.squares(self.shoulders.front_length(0.7)),
        };
        let mut rows: Vec<Rows> = (0..=layout.tube_rows)
            .map(|j| layout.tube_row(sewing, j))
            .collect();
        rows.extend((1..layout.yoke_rows).map(|k| layout.yoke_row(sewing, k)));
        let ridge = layout.ridge(sewing);
        rows.push(Rows {
            panels: [ridge[0].clone(), back_of(&ridge), ridge[2].clone()],
            beyond: layout.yoke_beyond(0.5),
        });
        layout.panels(sewing, &rows);
        let share = (self.waist - self.hem) / (self.underarm - self.hem);
        let waist = &rows[(share * layout.tube_rows as f32).round() as usize];
        Torso {
            armholes: layout.armholes(&rows),
            edge: layout.edge(sewing, &rows, &ridge[1]),
            waist: waist.panels.concat(),
        }
    }

    /// Share of a layer's gap by which what lies on the right front is raised, at |u| from the middle.
    pub(super) fn rise(&self, height: f32, u: f32) -> f32 {
        let girth = self.trunk.circumference(height, self.level(height));
        smooth((self.trunk.left_side(height, self.level(height)) - u) * girth / RISE_M)
    }

    /// How far the fronts reach beyond the middle at a distance above the waist along the front,
    /// metres; negative where they do not reach it.
    fn reach(&self, above_waist: f32) -> f32 {
        let full = self.underarm - self.waist + self.shoulders.front_length(0.3);
        let t = (above_waist / full).clamp(0.0, 1.0);
        self.robe.overlap_m - t * (self.robe.overlap_m + self.neck_half_m)
    }

    /// Where the left front's edge lies across the shoulders.
    fn yoke_edge(&self, t: f32) -> f32 {
        let along = 2.0 * t * self.shoulders.front_length(0.3);
        self.shoulders
            .across(-self.reach(self.underarm - self.waist + along))
    }
}

/// The row on the shoulders' ridge: left shoulder from neck to armhole, neck from left to right, right
/// shoulder from armhole to neck.
type Ridge = [Vec<u32>; 3];

/// The same vertices as the back's last row, from left to right.
fn back_of([left, neck, right]: &Ridge) -> Vec<u32> {
    let across = left.iter().rev().chain(neck);
    across.chain(right.iter().rev()).copied().collect()
}

impl Layout<'_, '_> {
    fn tube_row(&self, sewing: &mut Sewing, j: usize) -> Rows {
        let cut = self.cut;
        let height = cut.hem + (cut.underarm - cut.hem) * j as f32 / self.tube_rows as f32;
        let level = cut.level(height);
        let girth = cut.trunk.circumference(height, level);
        let reach = cut.reach(height - cut.waist) / girth;
        let side = cut.trunk.left_side(height, level);
        let ends = [-reach, side, 1.0 - side, 1.0 + reach];
        let place = |u: f32| {
            // Beyond u = 1 the right front goes on; shares of the left front are near zero.
            let rise = if u < 0.5 { cut.rise(height, u) } else { 0.0 };
            cut.trunk
                .spot_under(height, u, level)
                .at(level + LAYER_GAP_M * rise)
        };
        let mut panels: [Vec<u32>; 3] = Default::default();
        for panel in 0..3 {
            let (from, to) = (ends[panel], ends[panel + 1]);
            let squares = cut.squares((to - from) * girth);
            let shared = panel
                .checked_sub(1)
                .and_then(|before| panels[before].last().copied());
            panels[panel].extend(shared);
            for i in usize::from(shared.is_some())..=squares {
                let u = from + (to - from) * i as f32 / squares as f32;
                let vertex = sewing.vertex(self.parts[panel], place(u));
                panels[panel].push(vertex);
            }
        }
        let beyond = |u: f32, sign: f32| {
            let step = sign * self.cut.robe.collar_m / (self.collar_rows() as f32 * girth);
            (1..=self.collar_rows())
                .map(|row| place(u + step * row as f32))
                .collect()
        };
        Rows {
            panels,
            beyond: [beyond(ends[0], -1.0), beyond(ends[3], 1.0)],
        }
    }

    fn collar_rows(&self) -> usize {
        self.cut.squares(self.cut.robe.collar_m)
    }

    fn yoke_row(&self, sewing: &mut Sewing, k: usize) -> Rows {
        let t = 0.5 * k as f32 / self.yoke_rows as f32;
        let edge = self.cut.yoke_edge(t);
        Rows {
            panels: [
                self.yoke_line(sewing, 0, [edge, 1.0], t),
                self.yoke_line(sewing, 1, [1.0, -1.0], 1.0 - t),
                self.yoke_line(sewing, 2, [-1.0, -edge], t),
            ],
            beyond: self.yoke_beyond(t),
        }
    }

    fn yoke_beyond(&self, t: f32) -> [Vec<Vec3>; 2] {
        let (shoulders, rows) = (self.cut.shoulders, self.collar_rows());
        let edge = shoulders.position(self.cut.yoke_edge(t), t).x;
        let x = |row: usize| edge - self.cut.robe.collar_m * row as f32 / rows as f32;
        [(0, 1.0), (2, -1.0)].map(|(panel, sign)| {
            let a = |row: usize| sign * shoulders.across(x(row));
            (1..=rows).map(|row| self.yoke_place(panel, a(row), t)).collect()
        })
    }

    fn yoke_place(&self, panel: usize, a: f32, t: f32) -> Vec3 {
        let rise = if panel == 0 { self.yoke_rise(a, t) } else { 0.0 };
        self.cut.shoulders.spot(a, t).at(LAYER_GAP_M * rise)
    }

    fn ridge(&self, sewing: &mut Sewing) -> Ridge {
        let neck = self.cut.yoke_edge(0.5);
        let left = self.yoke_line(sewing, 0, [neck, 1.0], 0.5);
        let right = self.yoke_line(sewing, 2, [-1.0, -neck], 0.5);
        let mut across = self.yoke_line(sewing, 1, [neck, -neck], 0.5);
        across.remove(0);
        across.pop();
        [left, across, right]
    }

    /// A line of vertices of a panel at constant t, by even steps.
    fn yoke_line(&self, sewing: &mut Sewing, panel: usize, [from, to]: [f32; 2], t: f32) -> Vec<u32> {
        let at = |i: usize| self.yoke_place(panel, from + (to - from) * i as f32 / FINE as f32, t);
        let fine: Vec<Vec3> = (0..=FINE).map(at).collect();
        let mut along = vec![0.0];
        for pair in fine.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        let squares = self.cut.squares(along[FINE]);
        let place = |i: usize| {
            let s = along[FINE] * i as f32 / squares as f32;
            let next = along.partition_point(|a| *a < s).clamp(1, FINE);
            let t = (s - along[next - 1]) / (along[next] - along[next - 1]).max(1e-9);
            fine[next - 1].lerp(fine[next], t.min(1.0))
        };
        (0..=squares)
            .map(|i| sewing.vertex(self.parts[panel], place(i)))
            .collect()
    }

    /// The left front lies on the right one up to where their collars part.
    fn yoke_rise(&self, a: f32, t: f32) -> f32 {
        let from_armhole = self.cut.shoulders.half_width() - self.cut.shoulders.position(a, t).x;
        smooth(from_armhole / RISE_M) * (1.0 - smooth((t - 0.36) / 0.12))
    }

    fn panels(&self, sewing: &mut Sewing, rows: &[Rows]) {
        let yoke_step = self.cut.shoulders.front_length(0.6) / self.yoke_rows as f32;
        for panel in 0..3 {
            let mut y = 0.0;
            let flat = |sewing: &Sewing, row: &Rows, y: f32| {
                laid_flat(
                    sewing,
                    &row.panels[panel],
                    ANCHORS[panel],
                    ORIGINS[panel] + Vec2::Y * y,
                )
            };
            let mut below = flat(sewing, &rows[0], 0.0);
            for j in 1..rows.len() {
                let side = |row: &Rows| sewing.position(row.panels[1][0]);
                y += match j <= self.tube_rows {
                    true => side(&rows[j]).distance(side(&rows[j - 1])),
                    false => yoke_step,
                };
                let above = flat(sewing, &rows[j], y);
                strip(sewing, &below, &above);
                below = above;
            }
        }
    }

    fn armholes(&self, rows: &[Rows]) -> [Vec<u32>; 2] {
        let yoke = &rows[self.tube_rows..];
        let last = |row: &Rows, panel: usize| row.panels[panel].last().copied();
        let first = |row: &Rows, panel: usize| row.panels[panel].first().copied();
        // Up the back and down the front on the left, the other way round on the right.
        let up = yoke.iter().filter_map(|row| first(row, 1));
        let down = yoke[1..yoke.len() - 1]
            .iter()
            .rev()
            .filter_map(|row| last(row, 0));
        let left = up.chain(down).collect();
        let up = yoke.iter().filter_map(|row| first(row, 2));
        let down = yoke[1..yoke.len() - 1]
            .iter()
            .rev()
            .filter_map(|row| last(row, 1));
        [left, up.chain(down).collect()]
    }

    fn edge(&self, sewing: &Sewing, rows: &[Rows], neck: &[u32]) -> Vec<EdgeVertex> {
        let upright = |j: usize| {
            let t = j.saturating_sub(self.tube_rows) as f32 / self.yoke_rows as f32;
            smooth((t - 0.4) / 0.35)
        };
        let front = |panel: usize, j: usize, row: &Rows| {
            let line = &row.panels[panel];
            EdgeVertex {
                vertex: if panel == 0 { line[0] } else { line[line.len() - 1] },
                beyond: row.beyond[panel / 2].clone(),
                upright: upright(j),
            }
        };
        let left = rows.iter().enumerate().map(|(j, row)| front(0, j, row));
        let right = rows.iter().enumerate().rev().map(|(j, row)| front(2, j, row));
        let neck = neck.iter().map(|&vertex| EdgeVertex {
            vertex,
            beyond: vec![sewing.position(vertex); self.collar_rows()],
            upright: 1.0,
        });
        left.chain(neck).chain(right).collect()
    }
}
