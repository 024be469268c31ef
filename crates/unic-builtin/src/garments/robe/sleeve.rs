//! A sleeve that widens towards the wrist.

use super::{Cut, LEVEL_M, Row, laid_flat, smooth, strip};
use crate::garments::{GarmentError, Sewing, Side, shoulder_surface::off_the_skin};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Points of a section from its lowest to its highest point, which has this number.
const HALF_SECTION: usize = 48;

/// Distance along the arm over which the armhole's shape gives way to the sleeve's, metres.
const BLEND_M: f32 = 0.16;

/// Stations at which the arm is measured.
const STATIONS: usize = 16;

/// Passes of the 1-2-1 filter over stations: an arm's bumps do not show through a wide sleeve.
const GIRTH_PASSES: usize = 4;

/// Half the thickness of the sleeve's hanging part, metres.
const HANGING_HALF_M: f32 = 0.022;

/// An arm with what a sleeve wants to know of it.
struct Arm<'a, 'b> {
    cut: &'a Cut<'b>,
    side: Side,
    /// Distances from the shoulder joint to the sleeve's ends, metres.
    from: f32,
    to: f32,
    /// The arm at even stations from `from` to `to`: its middle off the bone, and its radius, metres.
    girths: Vec<(Vec3, f32)>,
    /// Horizontal direction from the sleeve's beginning to its end, unit: all sections are across it.
    outward: Vec3,
    /// Depth of the sleeve under the bone at its beginning, metres.
    depth: f32,
}

impl Cut<'_> {
    pub(super) fn sleeve(
        &self,
        sewing: &mut Sewing,
        part: u32,
        side: Side,
        armhole: &[u32],
    ) -> Result<(), GarmentError> {
        let arm = Arm::new(self, side)?;
        let seam: Vec<Vec3> = armhole.iter().map(|&v| sewing.position(v)).collect();
        let begin = arm.section(0.0);
        let slope = arm.slope();
        // Sections hang straight down: where the arm slopes, rows are nearer than their vertices.
        let squares = self.squares(arm.mean_length() * (0.4 + 0.6 * slope.y));
        let origin = Vec2::new(1.2 * side.sign(), -1.5);
        let mut below = closed_row(sewing, armhole, slope, [origin; 3]);
        let mut before = resampled(&seam, HALF_SECTION);
        let mut laid = [origin; 3];
        for row in 1..=squares {
            let s = row as f32 / squares as f32;
            let section = arm.section(s);
            let fading = 1.0 - smooth(s * (arm.to - arm.from) / BLEND_M);
            let count = self.squares(length(&section)).max(8);
            let [shape, hole, start] = [&section, &seam, &begin].map(|l| resampled(l, count));
            let place = |i: usize| {
                let point = shape[i] + (hole[i] - start[i]) * fading;
                off_the_skin(self.skin, point, 0.8 * LEVEL_M)
            };
            let vertices: Vec<u32> = (0..count).map(|i| sewing.vertex(part, place(i))).collect();
            // Whatever the arm's slope and bend here, areas are kept.
            let here: Vec<Vec3> = vertices.iter().map(|&v| sewing.position(v)).collect();
            let here = resampled(&here, HALF_SECTION);
            let run = |points: std::ops::Range<usize>| {
                let steps = points.clone().map(|i| (here[i] - before[i]).with_y(0.0).length());
                steps.sum::<f32>() / points.len() as f32 / slope.y.max(0.3)
            };
            let (quarter, half) = (HALF_SECTION / 4, HALF_SECTION / 2);
            laid[0].y += run(quarter / 2..half - quarter / 2);
            laid[1].y += run(half - 1..half + 2);
            laid[2].y += run(half + quarter / 2..HALF_SECTION - quarter / 2);
            let above = closed_row(sewing, &vertices, slope, laid);
            before = here;
            strip(sewing, &below, &above);
            below = above;
        }
        Ok(())
    }
}

impl<'a, 'b> Arm<'a, 'b> {
    fn new(cut: &'a Cut<'b>, side: Side) -> Result<Self, GarmentError> {
        let (shoulder, axis) = cut.body.on_arm(side, 0.0);
        let from = (cut.shoulders.half_width() - shoulder.x.abs()) / axis.x.abs().max(0.2);
        let to: f32 = cut.body.arm_lengths(side).iter().sum();
        let girth = |i: usize| {
            let along = (from + (to - from) * i as f32 / STATIONS as f32).max(0.04);
            let ring = cut.body.arm_ring(side, along)?;
            let reach = (0..24).map(|k| ring.support(PI * k as f32 / 12.0));
            let off_bone = ring.origin() - cut.body.on_arm(side, along).0;
            Ok((off_bone, reach.fold(0.0, f32::max)))
        };
        let mut girths = (0..=STATIONS)
            .map(girth)
            .collect::<Result<Vec<_>, GarmentError>>()?;
        (0..GIRTH_PASSES).for_each(|_| smooth_girths(&mut girths));
        let [begin, end] = [from, to].map(|along| cut.body.on_arm(side, along).0);
        let outward = (end - begin).with_y(0.0).normalize_or(Vec3::X * side.sign());
        let depth = begin.y - cut.underarm;
        Ok(Self {
            cut,
            side,
            from,
            to,
            girths,
            outward,
            depth,
        })
    }

    /// The sleeve's section at the share s of its length: a drop around the arm that hangs straight
    /// down, in a vertical plane across the sleeve. A closed loop from the lowest
    /// point in the armhole's direction.
    fn section(&self, s: f32) -> Vec<Vec3> {
        let (middle, axis) = self
            .cut
            .body
            .on_arm(self.side, self.from + s * (self.to - self.from));
        let (off_bone, radius) = self.girth(s);
        let middle = middle + off_bone;
        let outward = self.outward;
        // u × v is outward with v along the arm: u rises on the side of across.
        let across = outward.cross(Vec3::Y);
        let radius = radius + LEVEL_M + 0.004;
        let top = radius / axis.with_y(0.0).length().max(0.4);
        // An arm that bends forward meets the plane of the section aslant.
        let across = across / axis.with_y(0.0).normalize_or(outward).dot(outward).max(0.6);
        let depth = self.depth + s * (self.cut.robe.sleeve_m - self.depth);
        let point = |half: f32| {
            let rise = 0.5 - 0.5 * (PI * half).cos();
            let height = rise * (top + depth) - depth;
            let hanging = smooth((-height - radius) / 0.1);
            let thickness = radius + (HANGING_HALF_M.min(radius) - radius) * hanging;
            [thickness * (PI * half).sin().max(0.0).sqrt(), height]
        };
        let half = |sign: f32| {
            move |i: usize| {
                let [x, y] = point(i as f32 / HALF_SECTION as f32);
                middle + across * (x * sign) + Vec3::Y * y
            }
        };
        let up = (0..HALF_SECTION).map(half(-1.0));
        let down = (1..=HALF_SECTION).rev().map(half(1.0));
        up.chain(down).collect()
    }

    fn girth(&self, s: f32) -> (Vec3, f32) {
        let at = (s * STATIONS as f32).clamp(0.0, STATIONS as f32 - 1e-3);
        let (i, t) = (at as usize, at.fract());
        let ((a, p), (b, q)) = (self.girths[i], self.girths[i + 1]);
        (a.lerp(b, t), p + (q - p) * t)
    }

    /// The direction straight down, seen on the sleeve laid out with its upper edge along y: cosine and
    /// sine of the angle between.
    fn slope(&self) -> Vec2 {
        let edge = self.section(1.0)[HALF_SECTION] - self.section(0.0)[HALF_SECTION];
        let along = -edge.normalize_or(Vec3::X).y;
        Vec2::new(along, (1.0 - along * along).max(0.0).sqrt())
    }

    /// Mean of the lengths along the sleeve's top and bottom.
    fn mean_length(&self) -> f32 {
        let sections: Vec<Vec<Vec3>> = (0..=10).map(|i| self.section(i as f32 / 10.0)).collect();
        sections
            .windows(2)
            .map(|pair| mean_distance(&pair[0], &pair[1]))
            .sum()
    }
}

/// The 1-2-1 filter; the ends stay.
fn smooth_girths(girths: &mut [(Vec3, f32)]) {
    let before = girths.to_vec();
    for (i, girth) in girths.iter_mut().enumerate().skip(1).take(before.len() - 2) {
        let (a, b, c) = (before[i - 1], before[i], before[i + 1]);
        *girth = (b.0 * 0.5 + (a.0 + c.0) * 0.25, b.1 * 0.5 + (a.1 + c.1) * 0.25);
    }
}

fn mean_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    let sum: f32 = a.iter().zip(b).map(|(a, b)| a.distance(*b)).sum();
    sum / a.len() as f32
}

fn length(ring: &[Vec3]) -> f32 {
    (0..ring.len())
        .map(|i| ring[i].distance(ring[(i + 1) % ring.len()]))
        .sum()
}

/// A closed loop by even steps from its first point.
fn resampled(ring: &[Vec3], count: usize) -> Vec<Vec3> {
    let at = |i: usize| ring[i % ring.len()];
    let mut along = vec![0.0];
    for i in 0..ring.len() {
        along.push(along[i] + at(i).distance(at(i + 1)));
    }
    let point = |k: usize| {
        let s = along[ring.len()] * k as f32 / count as f32;
        let next = along.partition_point(|a| *a <= s).clamp(1, ring.len());
        let t = (s - along[next - 1]) / (along[next] - along[next - 1]).max(1e-9);
        at(next - 1).lerp(at(next), t)
    };
    (0..count).map(point).collect()
}

/// A closed row laid flat on both sides of the sleeve's upper edge, its first vertex named again at the
/// end: with the given origins for its first half, the edge, and its second half.
fn closed_row(sewing: &Sewing, vertices: &[u32], slope: Vec2, origins: [Vec2; 3]) -> Row {
    let mut closed = vertices.to_vec();
    closed.extend(vertices.first());
    let straight = laid_flat(sewing, &closed, 0.5, Vec2::ZERO);
    let half = straight.first().map_or(1.0, |(_, p)| p.x.abs().max(1e-6));
    let sheared = |x: f32| {
        let side = if x < 0.0 { origins[0] } else { origins[2] };
        let origin = origins[1].lerp(side, (4.0 * x.abs() / half).min(1.0));
        origin + Vec2::new(x * slope.y, x.abs() * slope.x)
    };
    straight.into_iter().map(|(v, p)| (v, sheared(p.x))).collect()
}
