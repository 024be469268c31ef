//! Cloth that lies taut over the shoulders.

use super::trunk_surface::{Spot, TrunkSurface};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, TAU};
use unic_core::{character::Character, surface::Surface};

/// The neck joint in SMPL's order: what lies lower is shoulder.
const NECK: usize = 12;

/// How much of the neck over its joint the surface knows of, metres: more than a collar's ridge needs.
const NECK_SHOWN_M: f32 = 0.04;

/// Joints whose skin does not lie under a yoke: head, forearms, hands.
const BARE_JOINTS: [usize; 7] = [15, 18, 19, 20, 21, 22, 23];

/// Heights between feet and armpits at which a yoke also encloses the trunk's outline, so that it
/// continues the cloth below without a kink: number of them, and their distance in metres.
const CONTINUED: usize = 8;
const CONTINUED_STEP_M: f32 = 0.01;

/// Slices from the midplane to the armhole.
const SLICES: usize = 24;

/// Points of a path from the foot to the ridge, and again to the other foot.
const HALF_PATH: usize = 48;

/// Passes of the 1-2-1 filter across slices.
const SLICE_PASSES: usize = 6;

/// Share of the distance to the skin that smoothing may not go below.
const CLEAR: f32 = 0.8;

/// Points on the circle that stands for the distance between skin and cloth.
const CIRCLE: usize = 12;

/// A surface over both shoulders: in every plane x = constant the tightest path over the body from
/// the front of a trunk outline to its back.
///
/// A place on it is named by a = 2/π asin(x / half width), from −1 (right armhole) over 0 (midplane) to
/// 1 (left armhole), which is finer where outlines turn to the side, and t along the path: 0 at the front, 0.5 on the ridge, 1 at the back. Nearer to
/// the midplane than the neck reaches, the ridge is the neck's front for t < 0.5 and its back from there.
#[derive(Clone, Debug)]
pub(crate) struct ShoulderSurface {
    half_width: f32,
    /// Paths of the left half, from the midplane outward, each from the front foot to the ridge and
    /// from the ridge to the back foot; the right half mirrors them.
    paths: Vec<Vec<Vec3>>,
}

impl ShoulderSurface {
    /// The surface on a trunk outline at `height`, both `level` metres off the body. Nearer than
    /// `neck_half_m` to the midplane the ridge passes behind the neck.
    pub(crate) fn new(
        character: &Character,
        trunk: &TrunkSurface,
        [height, level, neck_half_m]: [f32; 3],
    ) -> Self {
        let side = trunk.left_side(height, 0.0);
        let half_width = trunk.spot(height, side).at(level).x;
        let faces = yoke_faces(character);
        let hull = |x: f32| {
            let mut points = slice_points(&character.body.vertices, &faces, x);
            points.retain(|p| p.y > height);
            let mut points = inflated(&points, level);
            let heights = (1..=CONTINUED).map(|i| height + i as f32 * CONTINUED_STEP_M);
            points.extend(heights.flat_map(|h| feet(trunk, h, level, x)));
            taut(feet(trunk, height, level, x), &points)
        };
        let highest = |path: &[Vec2]| path.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        let nape = highest(&hull(neck_half_m.min(half_width)));
        let path = |slice: usize| {
            let x = half_width * (FRAC_PI_2 * slice as f32 / SLICES as f32).sin();
            let hull = hull(x);
            let ridge = if x < neck_half_m { nape } else { f32::MAX };
            let even = resampled(&hull, ridge.min(highest(&hull)));
            even.into_iter().map(|p| Vec3::new(x, p.y, p.x)).collect()
        };
        let mut paths: Vec<Vec<Vec3>> = (0..=SLICES).map(path).collect();
        (0..SLICE_PASSES).for_each(|_| smooth_slices(&mut paths));
        let skin = Surface::build(&character.body);
        for path in &mut paths {
            continue_trunk(path, trunk, [height, level]);
            let last = path.len() - 1;
            path[1..last]
                .iter_mut()
                .for_each(|p| *p = off_the_skin(&skin, *p, CLEAR * level));
            if path[0].x >= neck_half_m {
                let ridge = path[HALF_PATH].midpoint(path[HALF_PATH + 1]);
                path[HALF_PATH..HALF_PATH + 2].fill(ridge);
            }
        }
        Self { half_width, paths }
    }

    /// x of the left armhole, metres.
    pub(crate) fn half_width(&self) -> f32 {
        self.half_width
    }

    /// The coordinate a of a place with the given x, metres.
    pub(crate) fn across(&self, x: f32) -> f32 {
        (x / self.half_width).clamp(-1.0, 1.0).asin() / FRAC_PI_2
    }

    /// World position at (a, t).
    pub(crate) fn position(&self, a: f32, t: f32) -> Vec3 {
        let across = (a.abs() * SLICES as f32).clamp(0.0, SLICES as f32);
        let i = (across as usize).min(SLICES - 1);
        let (half, first) = if t < 0.5 { (t, 0) } else { (t - 0.5, HALF_PATH + 1) };
        let along = (half * (2 * HALF_PATH) as f32).clamp(0.0, HALF_PATH as f32);
        let j = (along as usize).min(HALF_PATH - 1);
        let of = |i: usize, j: usize| self.paths[i][first + j];
        let on = |i: usize| of(i, j).lerp(of(i, j + 1), along - j as f32);
        let left = on(i).lerp(on(i + 1), across - i as f32);
        Vec3::new(left.x * a.signum(), left.y, left.z)
    }

    pub(crate) fn spot(&self, a: f32, t: f32) -> Spot {
        const A: f32 = 0.04;
        const T: f32 = 0.01;
        let position = self.position(a, t);
        let (inner, outer) = ((a - A).max(-1.0), (a + A).min(1.0));
        let (front, back) = ((t - T).max(0.0), (t + T).min(1.0));
        let leftward = self.position(outer, t) - self.position(inner, t);
        let backward = self.position(a, back) - self.position(a, front);
        Spot {
            position,
            normal: leftward.cross(backward).normalize_or(Vec3::Y),
        }
    }

    /// Length of the path at `a` from the foot at the front to the ridge, metres.
    pub(crate) fn front_length(&self, a: f32) -> f32 {
        let at = |j: usize| self.position(a, 0.5 * j as f32 / HALF_PATH as f32);
        (0..HALF_PATH).map(|j| at(j).distance(at(j + 1))).sum()
    }
}

/// Bends the lowest part of a path to the trunk's outlines, so that the surface leaves the cloth below
/// without a kink.
fn continue_trunk(path: &mut [Vec3], trunk: &TrunkSurface, [height, level]: [f32; 2]) {
    let reach = CONTINUED as f32 * CONTINUED_STEP_M;
    for (j, point) in path.iter_mut().enumerate() {
        let above = (point.y - height) / reach;
        if above < 1.0 {
            let feet = feet(trunk, point.y, level, point.x);
            let foot = feet[usize::from(j > HALF_PATH)];
            let t = above.max(0.0);
            point.z += (foot.x - point.z) * (1.0 - t * t * (3.0 - 2.0 * t));
        }
    }
}

/// The point, or where it leaves the margin (metres) around the skin.
pub(crate) fn off_the_skin(skin: &Surface, point: Vec3, margin: f32) -> Vec3 {
    let Some(nearest) = skin.closest_within(point, 0.1) else {
        return point;
    };
    point + nearest.normal * (margin - nearest.signed_distance).max(0.0)
}

fn yoke_faces(character: &Character) -> Vec<[u32; 3]> {
    let top = NECK_SHOWN_M + character.skeleton.joints().get(NECK).map_or(f32::MAX, |j| j.y);
    let is_under = |&v: &u32| {
        let leading = character.weights.row(v as usize).next().map_or(0, |(j, _)| j);
        !BARE_JOINTS.contains(&leading) && character.body.vertices[v as usize].y < top
    };
    let faces = character.body.faces.iter();
    faces.filter(|face| face.iter().all(is_under)).copied().collect()
}

/// The points (z, y) of the trunk outline at `height` with the given x, front and back.
fn feet(trunk: &TrunkSurface, height: f32, level: f32, x: f32) -> [Vec2; 2] {
    let side = trunk.left_side(height, 0.0);
    [0.0, 0.5].map(|middle| {
        // x grows from the midplane to the side along either half of the outline.
        let (mut near, mut far) = (middle, side);
        for _ in 0..30 {
            let u = 0.5 * (near + far);
            let end = if trunk.spot(height, u).at(level).x < x {
                &mut near
            } else {
                &mut far
            };
            *end = u;
        }
        let foot = trunk.spot(height, near).at(level);
        Vec2::new(foot.z, height)
    })
}

/// Points (z, y) in which faces cross the planes at x and −x: a body that is not quite symmetric gets
/// a symmetric garment.
fn slice_points(vertices: &[Vec3], faces: &[[u32; 3]], x: f32) -> Vec<Vec2> {
    let mut points = Vec::new();
    for face in faces {
        let corners = face.map(|v| vertices[v as usize]);
        for plane in [x, -x] {
            for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                let (p, q) = (corners[a], corners[b]);
                if (p.x < plane) != (q.x < plane) {
                    let cut = p.lerp(q, (plane - p.x) / (q.x - p.x));
                    points.push(Vec2::new(cut.z, cut.y));
                }
            }
        }
    }
    points
}

/// Every point replaced by a circle: the hull of circles is the offset hull.
fn inflated(points: &[Vec2], radius: f32) -> Vec<Vec2> {
    let circle = |k: usize| Vec2::from_angle(TAU * k as f32 / CIRCLE as f32) * radius;
    let around = |p: &Vec2| {
        let p = *p;
        (0..CIRCLE).map(move |k| p + circle(k))
    };
    points.iter().flat_map(around).collect()
}

/// The convex hull of points and the two feet, from the front foot over the top to the back foot:
/// Andrew's monotone chain, over y so that both feet, its lowest points, come first.
fn taut([front, back]: [Vec2; 2], points: &[Vec2]) -> Vec<Vec2> {
    let mut sorted: Vec<Vec2> = points.iter().copied().filter(|p| p.y > front.y).collect();
    sorted.sort_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
    let chain = |foot: Vec2, sign: f32| {
        let mut chain = vec![foot];
        for &p in &sorted {
            while let [.., o, a] = chain[..]
                && (a - o).perp_dot(p - a) * sign <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let (mut path, down) = (chain(front, 1.0), chain(back, -1.0));
    path.extend(down.iter().rev().skip(1));
    path
}

/// The path by even steps from its front foot to where it first reaches the ridge's height, and from
/// where it last does to its back foot.
fn resampled(path: &[Vec2], ridge: f32) -> Vec<Vec2> {
    let mut backwards = path.to_vec();
    backwards.reverse();
    let mut even = even_steps(&climb(path, ridge));
    even.extend(even_steps(&climb(&backwards, ridge)).into_iter().rev());
    even
}

/// The path up to where it first reaches a height.
fn climb(path: &[Vec2], height: f32) -> Vec<Vec2> {
    let first = path.iter().position(|p| p.y >= height).unwrap_or(0).max(1);
    let (below, above) = (path[first - 1], path[first]);
    let t = (height - below.y) / (above.y - below.y).max(1e-9);
    let mut climb = path[..first].to_vec();
    climb.push(below.lerp(above, t.clamp(0.0, 1.0)));
    climb
}

fn even_steps(path: &[Vec2]) -> Vec<Vec2> {
    let mut along = vec![0.0];
    for pair in path.windows(2) {
        along.push(along[along.len() - 1] + pair[0].distance(pair[1]));
    }
    let length = along[along.len() - 1];
    let at = |step: usize| {
        let s = length * step as f32 / HALF_PATH as f32;
        let next = along.partition_point(|a| *a <= s).min(path.len() - 1);
        let last = next.saturating_sub(1);
        let t = (s - along[last]) / (along[next] - along[last]).max(1e-9);
        path[last].lerp(path[next], t.clamp(0.0, 1.0))
    };
    (0..=HALF_PATH).map(at).collect()
}

/// The 1-2-1 filter over slices; the midplane mirrors, and the feet stay.
fn smooth_slices(paths: &mut [Vec<Vec3>]) {
    let before = paths.to_vec();
    for slice in 0..=SLICES {
        for j in 1..2 * HALF_PATH + 1 {
            let inner = before[slice.abs_diff(1)][j];
            let outer = before[(slice + 1).min(SLICES)][j];
            let mean = before[slice][j] * 0.5 + (inner + outer) * 0.25;
            paths[slice][j] = Vec3::new(before[slice][j].x, mean.y, mean.z);
        }
    }
}
