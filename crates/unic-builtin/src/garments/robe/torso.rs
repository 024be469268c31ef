//! Back and fronts, from the hem over the shoulders.

use super::{LAYER_GAP_M, RobeLayout, laid_flat, smooth, strip};
use crate::garments::{Fabric, Sewing};
use glam::{Vec2, Vec3};

/// Distance from the side seam within which the left front rises over the right one, metres.
const RISE_M: f32 = 0.06;

/// Indices of the three panels, by growing u. A row of the torso begins at the left front's edge.
const LEFT_FRONT: usize = 0;
const BACK: usize = 1;
const RIGHT_FRONT: usize = 2;

/// Number of segments by which the length of a line across the shoulders is measured.
const FINE: usize = 128;

/// Origins of the patterns of the three panels, metres.
const ORIGINS: [Vec2; 3] = [Vec2::new(-1.5, 0.0), Vec2::ZERO, Vec2::new(1.5, 0.0)];

/// Share of each panel's rows at which their patterns are aligned: the side seams of the fronts,
/// and the middle of the back.
const ANCHORS: [f32; 3] = [1.0, 0.5, 0.0];

/// Vertices of the torso that other pieces are sewn to.
pub(super) struct Torso {
    /// Left and right armhole: closed loops from the underarm, without repeating the first vertex.
    ///
    /// They run in the direction of u of a tube whose v runs along the arm.
    pub(super) armholes: [Vec<u32>; 2],
    /// Edge from the left hem up the front, around the neck and down to the right hem.
    pub(super) edge: Vec<EdgeVertex>,
    /// Row at the waist.
    pub(super) waist: Vec<u32>,
}

/// A vertex of the edge that the collar is sewn to.
#[derive(Clone, Debug)]
pub(super) struct EdgeVertex {
    pub(super) vertex: u32,
    /// Positions on the continuation of the panel beyond its edge, one for each row of the collar,
    /// metres.
    pub(super) beyond: Vec<Vec3>,
    /// Blend weight of a standing collar: 0 on the fronts, 1 around the neck.
    pub(super) upright: f32,
}

/// One row of the three panels.
///
/// Below the armholes neighbouring panels share their last and first vertices.
struct TorsoRow {
    /// Vertices of each panel by growing u.
    panels: [Vec<u32>; 3],
    /// Positions on the continuation of the left and the right front, one for each row of the
    /// collar, metres.
    beyond: [Vec<Vec3>; 2],
}

/// Torso under construction: a tube from the hem to the armholes, and a yoke over the shoulders.
struct TorsoLayout<'a, 'b> {
    robe: &'a RobeLayout<'b>,
    parts: [u32; 3],
    tube_rows: usize,
    yoke_rows: usize,
}

impl RobeLayout<'_> {
    /// Adds the fronts and the back.
    pub(super) fn torso(&self, sewing: &mut Sewing) -> Torso {
        let names = ["front_left", "back", "front_right"];
        let layout = TorsoLayout {
            robe: self,
            parts: names.map(|name| sewing.part(name, Fabric::Silk)),
            tube_rows: self.squares((self.underarm - self.hem) * (1.0 + self.design.flare.powi(2)).sqrt()),
            yoke_rows: self.squares(self.shoulders.front_length(0.7)),
        };
        let mut rows: Vec<TorsoRow> = (0..=layout.tube_rows)
            .map(|j| layout.tube_row(sewing, j))
            .collect();
        rows.extend((1..layout.yoke_rows).map(|k| layout.yoke_row(sewing, k)));
        let ridge = layout.ridge(sewing);
        rows.push(TorsoRow {
            panels: [ridge.left.clone(), ridge.back_row(), ridge.right.clone()],
            beyond: layout.yoke_beyond(0.5),
        });
        layout.panels(sewing, &rows);
        let share = (self.waist - self.hem) / (self.underarm - self.hem);
        let waist = &rows[(share * layout.tube_rows as f32).round() as usize];
        Torso {
            armholes: layout.armholes(&rows),
            edge: layout.edge(sewing, &rows, &ridge.neck),
            waist: waist.panels.concat(),
        }
    }

    /// Height of the left front over the right one as a share of [`LAYER_GAP_M`], at the share u
    /// from the midplane.
    ///
    /// It is 1 in the middle and falls to 0 at the side seam, where the left front joins the back.
    pub(super) fn rise(&self, height: f32, u: f32) -> f32 {
        let girth = self.trunk.circumference(height, self.level(height));
        smooth((self.trunk.left_side(height, self.level(height)) - u) * girth / RISE_M)
    }

    /// Width of the fronts beyond the midplane at a distance above the waist along the front,
    /// metres.
    ///
    /// It is negative where they do not reach the midplane.
    fn reach(&self, above_waist: f32) -> f32 {
        let full = self.underarm - self.waist + self.shoulders.front_length(0.3);
        let t = (above_waist / full).clamp(0.0, 1.0);
        self.design.overlap_m - t * (self.design.overlap_m + self.neck_half_m)
    }

    /// Coordinate across the shoulders of the left front's edge at the share t of a path.
    fn yoke_edge(&self, t: f32) -> f32 {
        let along = 2.0 * t * self.shoulders.front_length(0.3);
        self.shoulders
            .across(-self.reach(self.underarm - self.waist + along))
    }
}

/// Vertices on the ridge of the shoulders.
struct Ridge {
    /// Left shoulder, from neck to armhole.
    left: Vec<u32>,
    /// Back of the neck, from left to right, without its ends.
    neck: Vec<u32>,
    /// Right shoulder, from armhole to neck.
    right: Vec<u32>,
}

impl Ridge {
    /// Vertices of the ridge as the last row of the back, from left to right.
    fn back_row(&self) -> Vec<u32> {
        let across = self.left.iter().rev().chain(&self.neck);
        across.chain(self.right.iter().rev()).copied().collect()
    }
}

impl TorsoLayout<'_, '_> {
    /// Adds row `j` of the tube, counted from the hem.
    fn tube_row(&self, sewing: &mut Sewing, j: usize) -> TorsoRow {
        let robe = self.robe;
        let height = robe.hem + (robe.underarm - robe.hem) * j as f32 / self.tube_rows as f32;
        let level = robe.level(height);
        let girth = robe.trunk.circumference(height, level);
        let reach = robe.reach(height - robe.waist) / girth;
        let side = robe.trunk.left_side(height, level);
        // Shares u at which the panels begin and end.
        let ends = [-reach, side, 1.0 - side, 1.0 + reach];
        let place = |u: f32| {
            // The right front continues beyond u = 1, and lies below. The left front has u near
            // zero.
            let rise = if u < 0.5 { robe.rise(height, u) } else { 0.0 };
            robe.trunk
                .point_on_offset(height, u, level)
                .raised_by(level + LAYER_GAP_M * rise)
        };
        let mut panels: [Vec<u32>; 3] = Default::default();
        for panel in 0..3 {
            let (from, to) = (ends[panel], ends[panel + 1]);
            let squares = robe.squares((to - from) * girth);
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
            let step = sign * self.robe.design.collar_m / (self.collar_rows() as f32 * girth);
            (1..=self.collar_rows())
                .map(|row| place(u + step * row as f32))
                .collect()
        };
        TorsoRow {
            panels,
            beyond: [beyond(ends[0], -1.0), beyond(ends[3], 1.0)],
        }
    }

    /// Number of rows of the collar.
    fn collar_rows(&self) -> usize {
        self.robe.squares(self.robe.design.collar_m)
    }

    /// Adds row `k` of the yoke, counted from the armholes' lower ends.
    fn yoke_row(&self, sewing: &mut Sewing, k: usize) -> TorsoRow {
        let t = 0.5 * k as f32 / self.yoke_rows as f32;
        let edge = self.robe.yoke_edge(t);
        TorsoRow {
            panels: [
                self.yoke_line(sewing, LEFT_FRONT, [edge, 1.0], t),
                self.yoke_line(sewing, BACK, [1.0, -1.0], 1.0 - t),
                self.yoke_line(sewing, RIGHT_FRONT, [-1.0, -edge], t),
            ],
            beyond: self.yoke_beyond(t),
        }
    }

    /// Positions on the continuation of both fronts at the share t of the paths, metres.
    fn yoke_beyond(&self, t: f32) -> [Vec<Vec3>; 2] {
        let (shoulders, rows) = (self.robe.shoulders, self.collar_rows());
        let edge = shoulders.position(self.robe.yoke_edge(t), t).x;
        let x = |row: usize| edge - self.robe.design.collar_m * row as f32 / rows as f32;
        [(LEFT_FRONT, 1.0), (RIGHT_FRONT, -1.0)].map(|(panel, sign)| {
            let a = |row: usize| sign * shoulders.across(x(row));
            (1..=rows).map(|row| self.yoke_place(panel, a(row), t)).collect()
        })
    }

    /// Position of a panel at the coordinates (a, t) of the shoulder surface, metres.
    fn yoke_place(&self, panel: usize, a: f32, t: f32) -> Vec3 {
        let rise = if panel == LEFT_FRONT {
            self.yoke_rise(a, t)
        } else {
            0.0
        };
        self.robe
            .shoulders
            .surface_point(a, t)
            .raised_by(LAYER_GAP_M * rise)
    }

    /// Adds the vertices on the ridge of the shoulders.
    fn ridge(&self, sewing: &mut Sewing) -> Ridge {
        let edge = self.robe.yoke_edge(0.5);
        let left = self.yoke_line(sewing, LEFT_FRONT, [edge, 1.0], 0.5);
        let right = self.yoke_line(sewing, RIGHT_FRONT, [-1.0, -edge], 0.5);
        // The ends of the neck are vertices of the shoulders.
        let mut neck = self.yoke_line(sewing, BACK, [edge, -edge], 0.5);
        neck.remove(0);
        neck.pop();
        Ridge { left, neck, right }
    }

    /// Adds a line of vertices of a panel between two coordinates a at constant t, by even steps.
    fn yoke_line(&self, sewing: &mut Sewing, panel: usize, [from, to]: [f32; 2], t: f32) -> Vec<u32> {
        let at = |i: usize| self.yoke_place(panel, from + (to - from) * i as f32 / FINE as f32, t);
        let fine: Vec<Vec3> = (0..=FINE).map(at).collect();
        let mut along = vec![0.0];
        for pair in fine.windows(2) {
            along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
        }
        let squares = self.robe.squares(along[FINE]);
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

    /// Height of the left front over the right one as a share of [`LAYER_GAP_M`] on the shoulders.
    ///
    /// It is 1 up to the place where the two collars part, and 0 at the armhole.
    fn yoke_rise(&self, a: f32, t: f32) -> f32 {
        let from_armhole = self.robe.shoulders.half_width() - self.robe.shoulders.position(a, t).x;
        smooth(from_armhole / RISE_M) * (1.0 - smooth((t - 0.36) / 0.12))
    }

    /// Adds the triangles of the panels with their pattern coordinates.
    fn panels(&self, sewing: &mut Sewing, rows: &[TorsoRow]) {
        let yoke_step = self.robe.shoulders.front_length(0.6) / self.yoke_rows as f32;
        for panel in 0..3 {
            let mut y = 0.0;
            let flat = |sewing: &Sewing, row: &TorsoRow, y: f32| {
                laid_flat(
                    sewing,
                    &row.panels[panel],
                    ANCHORS[panel],
                    ORIGINS[panel] + Vec2::Y * y,
                )
            };
            let mut below = flat(sewing, &rows[0], 0.0);
            for j in 1..rows.len() {
                let side = |row: &TorsoRow| sewing.position(row.panels[BACK][0]);
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

    /// Vertices of the left and the right armhole.
    fn armholes(&self, rows: &[TorsoRow]) -> [Vec<u32>; 2] {
        let yoke = &rows[self.tube_rows..];
        let last = |row: &TorsoRow, panel: usize| row.panels[panel].last().copied();
        let first = |row: &TorsoRow, panel: usize| row.panels[panel].first().copied();
        // Up the back and down the front on the left, the other way round on the right.
        let up = yoke.iter().filter_map(|row| first(row, BACK));
        let down = yoke[1..yoke.len() - 1]
            .iter()
            .rev()
            .filter_map(|row| last(row, LEFT_FRONT));
        let left = up.chain(down).collect();
        let up = yoke.iter().filter_map(|row| first(row, RIGHT_FRONT));
        let down = yoke[1..yoke.len() - 1]
            .iter()
            .rev()
            .filter_map(|row| last(row, BACK));
        [left, up.chain(down).collect()]
    }

    /// Edge that the collar is sewn to.
    fn edge(&self, sewing: &Sewing, rows: &[TorsoRow], neck: &[u32]) -> Vec<EdgeVertex> {
        let upright = |j: usize| {
            let t = j.saturating_sub(self.tube_rows) as f32 / self.yoke_rows as f32;
            smooth((t - 0.4) / 0.35)
        };
        let left = |(j, row): (usize, &TorsoRow)| EdgeVertex {
            vertex: row.panels[LEFT_FRONT][0],
            beyond: row.beyond[0].clone(),
            upright: upright(j),
        };
        let right = |(j, row): (usize, &TorsoRow)| EdgeVertex {
            vertex: row.panels[RIGHT_FRONT][row.panels[RIGHT_FRONT].len() - 1],
            beyond: row.beyond[1].clone(),
            upright: upright(j),
        };
        let up = rows.iter().enumerate().map(left);
        let down = rows.iter().enumerate().rev().map(right);
        // Around the neck the collar stands: the continuation has no weight.
        let neck = neck.iter().map(|&vertex| EdgeVertex {
            vertex,
            beyond: vec![sewing.position(vertex); self.collar_rows()],
            upright: 1.0,
        });
        up.chain(neck).chain(down).collect()
    }
}
