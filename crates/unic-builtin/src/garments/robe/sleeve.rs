//! Sleeves that widen towards the wrist.

use super::{LEVEL_M, PatternVertex, RobeLayout, laid_flat, smooth, strip};
use crate::garments::{ArmPoint, GarmentError, Sewing, Side, shoulder_surface::off_the_skin};
use glam::{Vec2, Vec3};
use std::f32::consts::PI;

/// Number of steps of a section from its lowest point to its highest point.
const HALF_SECTION: usize = 48;

/// Distance along the arm over which the armhole's shape blends into the sleeve's, metres.
const BLEND_M: f32 = 0.16;

/// Number of steps between the places at which the arm is measured.
const STATIONS: usize = 16;

/// Passes of the 1-2-1 filter over these places: bumps of the arm do not show through a wide
/// sleeve.
const GIRTH_PASSES: usize = 4;

/// Half the thickness of the sleeve below the arm, metres.
const HANGING_HALF_M: f32 = 0.022;

/// Thickness of an arm at one place.
#[derive(Clone, Copy)]
struct ArmGirth {
    /// Displacement of the arm's middle from the bone, metres.
    off_bone: Vec3,
    /// Largest radius about the middle, metres.
    radius: f32,
}

/// Measures of the arm in a sleeve.
struct Arm<'a, 'b> {
    robe: &'a RobeLayout<'b>,
    side: Side,
    /// Distance from the shoulder joint to the sleeve's beginning, metres.
    from: f32,
    /// Distance from the shoulder joint along the arm to the sleeve's end, metres.
    to: f32,
    /// Girths of the arm at even distances from `from` to `to`.
    girths: Vec<ArmGirth>,
    /// Horizontal unit direction from the sleeve's beginning to its end; sections are
    /// perpendicular.
    outward: Vec3,
    /// Depth of the sleeve under the bone at its beginning, metres.
    depth: f32,
}

impl RobeLayout<'_> {
    /// Adds a sleeve that is sewn to an armhole.
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
        // Sections are vertical: where the arm slopes, the distance of rows is less than the length
        // along the arm between them.
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
            // Rows of the pattern advance by the horizontal distance of the sections, divided by
            // the sine of the slope, so that areas are kept whatever the slope and bend of the arm.
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
    fn new(robe: &'a RobeLayout<'b>, side: Side) -> Result<Self, GarmentError> {
        let shoulder = robe.body.on_arm(side, 0.0);
        // Distance along the arm to the plane of the armhole.
        let from = (robe.shoulders.half_width() - shoulder.position.x.abs()) / shoulder.axis.x.abs().max(0.2);
        let to: f32 = robe.body.arm_lengths(side).iter().sum();
        let girth = |i: usize| {
            let along = (from + (to - from) * i as f32 / STATIONS as f32).max(0.04);
            let ring = robe.body.arm_ring(side, along)?;
            let reach = (0..24).map(|k| ring.support(PI * k as f32 / 12.0));
            Ok(ArmGirth {
                off_bone: ring.origin() - robe.body.on_arm(side, along).position,
                radius: reach.fold(0.0, f32::max),
            })
        };
        let mut girths = (0..=STATIONS)
            .map(girth)
            .collect::<Result<Vec<_>, GarmentError>>()?;
        (0..GIRTH_PASSES).for_each(|_| smooth_girths(&mut girths));
        let [begin, end] = [from, to].map(|along| robe.body.on_arm(side, along).position);
        let outward = (end - begin).with_y(0.0).normalize_or(Vec3::X * side.sign());
        let depth = begin.y - robe.underarm;
        Ok(Self {
            robe,
            side,
            from,
            to,
            girths,
            outward,
            depth,
        })
    }

    /// Section of the sleeve at the share s of its length, metres.
    ///
    /// It is a drop around the arm in a vertical plane across the sleeve: a closed loop from the
    /// lowest point, in the direction of the armhole's vertices.
    fn section(&self, s: f32) -> Vec<Vec3> {
        let along = self.from + s * (self.to - self.from);
        let ArmPoint { position, axis } = self.robe.body.on_arm(self.side, along);
        let ArmGirth { off_bone, radius } = self.girth(s);
        let middle = position + off_bone;
        let outward = self.outward;
        // u × v points outward with v along the arm: the loop first rises against `across`.
        let across = outward.cross(Vec3::Y);
        let radius = radius + LEVEL_M + 0.004;
        // A vertical plane cuts a sloping arm obliquely: the section is higher than the arm is
        // thick.
        let top = radius / axis.with_y(0.0).length().max(0.4);
        // It also cuts an arm that bends forward obliquely: there the section is wider.
        let across = across / axis.with_y(0.0).normalize_or(outward).dot(outward).max(0.6);
        let depth = self.depth + s * (self.robe.design.sleeve_m - self.depth);
        let point = |half: f32| {
            let rise = 0.5 - 0.5 * (PI * half).cos();
            let height = rise * (top + depth) - depth;
            let hanging = smooth((-height - radius) / 0.1);
            let thickness = radius + (HANGING_HALF_M.min(radius) - radius) * hanging;
            // The square root makes the ends of the section round.
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

    /// Girth of the arm at the share s of the sleeve's length, interpolated.
    fn girth(&self, s: f32) -> ArmGirth {
        // Just below the last index, so that the next one exists.
        let at = (s * STATIONS as f32).clamp(0.0, STATIONS as f32 - 1e-3);
        let (i, t) = (at as usize, at.fract());
        let (a, b) = (self.girths[i], self.girths[i + 1]);
        ArmGirth {
            off_bone: a.off_bone.lerp(b.off_bone, t),
            radius: a.radius + (b.radius - a.radius) * t,
        }
    }

    /// Cosine and sine of the angle between the sleeve's upper edge and the vertical.
    fn slope(&self) -> Vec2 {
        let edge = self.section(1.0)[HALF_SECTION] - self.section(0.0)[HALF_SECTION];
        let along = -edge.normalize_or(Vec3::X).y;
        Vec2::new(along, (1.0 - along * along).max(0.0).sqrt())
    }

    /// Mean length of the sleeve over all points of its sections, metres.
    fn mean_length(&self) -> f32 {
        let sections: Vec<Vec<Vec3>> = (0..=10).map(|i| self.section(i as f32 / 10.0)).collect();
        sections
            .windows(2)
            .map(|pair| mean_distance(&pair[0], &pair[1]))
            .sum()
    }
}

/// One pass of the 1-2-1 filter; both ends stay.
fn smooth_girths(girths: &mut [ArmGirth]) {
    let before = girths.to_vec();
    for (i, girth) in girths.iter_mut().enumerate().skip(1).take(before.len() - 2) {
        let (a, b, c) = (before[i - 1], before[i], before[i + 1]);
        *girth = ArmGirth {
            off_bone: b.off_bone * 0.5 + (a.off_bone + c.off_bone) * 0.25,
            radius: b.radius * 0.5 + (a.radius + c.radius) * 0.25,
        };
    }
}

fn mean_distance(a: &[Vec3], b: &[Vec3]) -> f32 {
    let sum: f32 = a.iter().zip(b).map(|(a, b)| a.distance(*b)).sum();
    sum / a.len() as f32
}

/// Length of a closed loop, metres.
fn length(ring: &[Vec3]) -> f32 {
    (0..ring.len())
        .map(|i| ring[i].distance(ring[(i + 1) % ring.len()]))
        .sum()
}

/// Resamples a closed loop by even steps from its first point.
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

/// Closed row of vertices laid flat on both sides of the sleeve's upper edge; it ends with its
/// first vertex.
///
/// `origins` are the origins of the row's first half, of the upper edge, and of the second half.
fn closed_row(sewing: &Sewing, vertices: &[u32], slope: Vec2, origins: [Vec2; 3]) -> Vec<PatternVertex> {
    let mut closed = vertices.to_vec();
    closed.extend(vertices.first());
    let straight = laid_flat(sewing, &closed, 0.5, Vec2::ZERO);
    let half = straight.first().map_or(1.0, |v| v.pattern.x.abs().max(1e-6));
    // Vertical sections are oblique to a sloping upper edge: each half is sheared.
    let sheared = |x: f32| {
        let side = if x < 0.0 { origins[0] } else { origins[2] };
        let origin = origins[1].lerp(side, (4.0 * x.abs() / half).min(1.0));
        origin + Vec2::new(x * slope.y, x.abs() * slope.x)
    };
    let placed = |v: PatternVertex| PatternVertex {
        vertex: v.vertex,
        pattern: sheared(v.pattern.x),
    };
    straight.into_iter().map(placed).collect()
}
