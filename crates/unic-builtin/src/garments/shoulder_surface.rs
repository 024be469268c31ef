//! Taut surface over the shoulders, to lay cloth over.

use super::trunk_surface::{SurfacePoint, TrunkSurface};
use glam::{Vec2, Vec3};
use std::f32::consts::{FRAC_PI_2, TAU};
use unic_core::{character::Character, surface::Surface};

/// Neck joint in SMPL's order.
const NECK: usize = 12;

/// Height above the neck joint up to which the neck counts, metres: more than a collar's ridge
/// needs.
const NECK_SHOWN_M: f32 = 0.04;

/// Joints whose skin is not under a yoke: head, forearms, hands.
const BARE_JOINTS: [usize; 7] = [15, 18, 19, 20, 21, 22, 23];

/// Number of heights above the base at which the surface also encloses the outline of the trunk.
///
/// With them the surface continues the cloth below without a kink.
const CONTINUED: usize = 8;

/// Distance between these heights, metres.
const CONTINUED_STEP_M: f32 = 0.01;

/// Number of slices from the midplane to the armhole.
const SLICES: usize = 24;

/// Number of steps of a path from one of its ends to the ridge.
const HALF_PATH: usize = 48;

/// Passes of the 1-2-1 filter across slices.
const SLICE_PASSES: usize = 6;

/// Least distance from the skin after smoothing, as a share of the wanted distance.
const CLEAR: f32 = 0.8;

/// Number of points on the circle that inflates the body by the distance of the cloth.
const CIRCLE: usize = 12;

/// Surface over both shoulders: the tightest paths over the body in planes x = constant.
///
/// Each path leads from the front of a trunk outline, the base, over the shoulder to its back. A
/// point is given by two coordinates:
///
/// - a = 2/π asin(x / half width): −1 at the right armhole, 0 on the midplane, 1 at the left
///   armhole. It is finer towards the armholes, where outlines turn to the side.
/// - t along the path: 0 at the front, 0.5 on the ridge, 1 at the back.
///
/// Across the neck the ridge has a gap: it is the neck's front for t < 0.5 and its back from
/// t = 0.5 on.
#[derive(Clone, Debug)]
pub(crate) struct ShoulderSurface {
    /// x of the left armhole, metres.
    half_width: f32,
    /// Paths of the left half, from the midplane outward, metres; the right half mirrors them.
    ///
    /// Each holds `HALF_PATH + 1` points from the front up to the ridge, and as many down to the
    /// back.
    paths: Vec<Vec<Vec3>>,
}

impl ShoulderSurface {
    /// Computes the surface above a trunk outline at `height`, `level` metres off the body.
    ///
    /// Nearer than `neck_half_m` to the midplane the ridge has a gap for the neck. All in metres.
    pub(crate) fn new(
        character: &Character,
        trunk: &TrunkSurface,
        height: f32,
        level: f32,
        neck_half_m: f32,
    ) -> Self {
        let side = trunk.left_side(height, 0.0);
        let half_width = trunk.surface_point(height, side).raised_by(level).x;
        let faces = yoke_faces(character);
        let hull = |x: f32| {
            let mut points = slice_points(&character.body.vertices, &faces, x);
            points.retain(|p| p.y > height);
            let mut points = inflated(&points, level);
            let heights = (1..=CONTINUED).map(|i| height + i as f32 * CONTINUED_STEP_M);
            points.extend(heights.flat_map(|h| path_ends(trunk, h, level, x)));
            taut(path_ends(trunk, height, level, x), &points)
        };
        let highest = |path: &[Vec2]| path.iter().map(|p| p.y).fold(f32::MIN, f32::max);
        // Paths across the neck end at the height of the path beside it.
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
        // Smoothing moves points into the body and off the trunk's outlines: both are corrected.
        let skin = Surface::build(&character.body);
        for path in &mut paths {
            continue_trunk(path, trunk, height, level);
            let last = path.len() - 1;
            path[1..last]
                .iter_mut()
                .for_each(|p| *p = off_the_skin(&skin, *p, CLEAR * level));
            // Beside the neck both halves meet on the ridge again.
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

    /// Coordinate a of points with the given x, metres.
    pub(crate) fn across(&self, x: f32) -> f32 {
        (x / self.half_width).clamp(-1.0, 1.0).asin() / FRAC_PI_2
    }

    /// World position at (a, t), by bilinear interpolation, metres.
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

    /// Position and normal at (a, t).
    pub(crate) fn surface_point(&self, a: f32, t: f32) -> SurfacePoint {
        // Half the steps of the differences that give the normal: about those of slices and paths.
        const A: f32 = 0.04;
        const T: f32 = 0.01;
        let position = self.position(a, t);
        let (inner, outer) = ((a - A).max(-1.0), (a + A).min(1.0));
        let (front, back) = ((t - T).max(0.0), (t + T).min(1.0));
        let leftward = self.position(outer, t) - self.position(inner, t);
        let backward = self.position(a, back) - self.position(a, front);
        SurfacePoint {
            position,
            normal: leftward.cross(backward).normalize_or(Vec3::Y),
        }
    }

    /// Length of the path at `a` from the front to the ridge, metres.
    pub(crate) fn front_length(&self, a: f32) -> f32 {
        let at = |j: usize| self.position(a, 0.5 * j as f32 / HALF_PATH as f32);
        (0..HALF_PATH).map(|j| at(j).distance(at(j + 1))).sum()
    }
}

/// Blends the lowest part of a path into the outlines of the trunk, so that the surface continues
/// the cloth below without a kink.
fn continue_trunk(path: &mut [Vec3], trunk: &TrunkSurface, height: f32, level: f32) {
    let reach = CONTINUED as f32 * CONTINUED_STEP_M;
    for (j, point) in path.iter_mut().enumerate() {
        let above = (point.y - height) / reach;
        if above < 1.0 {
            let ends = path_ends(trunk, point.y, level, point.x);
            let end = ends[usize::from(j > HALF_PATH)];
            let t = above.max(0.0);
            point.z += (end.x - point.z) * (1.0 - t * t * (3.0 - 2.0 * t));
        }
    }
}

/// Moves a point that is too close to the skin outward to the distance `margin`, metres.
pub(crate) fn off_the_skin(skin: &Surface, point: Vec3, margin: f32) -> Vec3 {
    let Some(nearest) = skin.closest_within(point, 0.1) else {
        return point;
    };
    point + nearest.normal * (margin - nearest.signed_distance).max(0.0)
}

/// Faces of the body that the surface passes over: trunk, upper arms and the root of the neck.
fn yoke_faces(character: &Character) -> Vec<[u32; 3]> {
    let top = NECK_SHOWN_M + character.skeleton.joints().get(NECK).map_or(f32::MAX, |j| j.y);
    let is_under = |&v: &u32| {
        let leading = character.weights.row(v as usize).next().map_or(0, |(j, _)| j);
        !BARE_JOINTS.contains(&leading) && character.body.vertices[v as usize].y < top
    };
    let faces = character.body.faces.iter();
    faces.filter(|face| face.iter().all(is_under)).copied().collect()
}

/// Points (z, y) with the given x on the trunk outline at `height`: front, then back. Metres.
fn path_ends(trunk: &TrunkSurface, height: f32, level: f32, x: f32) -> [Vec2; 2] {
    let side = trunk.left_side(height, 0.0);
    [0.0, 0.5].map(|middle| {
        // x grows from the midplane to the side along either half of the outline: bisection. After
        // 30 halvings the interval is below the resolution of f32.
        let (mut near, mut far) = (middle, side);
        for _ in 0..30 {
            let u = 0.5 * (near + far);
            let end = if trunk.surface_point(height, u).raised_by(level).x < x {
                &mut near
            } else {
                &mut far
            };
            *end = u;
        }
        let found = trunk.surface_point(height, near).raised_by(level);
        Vec2::new(found.z, height)
    })
}

/// Points (z, y) in which faces cross the planes at x and −x.
///
/// Both planes together give a symmetric garment on a body that is not quite symmetric.
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

/// Replaces every point by points on a circle: the hull of circles is the offset hull.
fn inflated(points: &[Vec2], radius: f32) -> Vec<Vec2> {
    let circle = |k: usize| Vec2::from_angle(TAU * k as f32 / CIRCLE as f32) * radius;
    let around = |p: &Vec2| {
        let p = *p;
        (0..CIRCLE).map(move |k| p + circle(k))
    };
    points.iter().flat_map(around).collect()
}

/// Convex hull of points and the two ends of a path, from the front end over the top to the back
/// end.
fn taut([front, back]: [Vec2; 2], points: &[Vec2]) -> Vec<Vec2> {
    // Andrew's monotone chain, sorted by y: both ends are the lowest points and come first.
    let mut sorted: Vec<Vec2> = points.iter().copied().filter(|p| p.y > front.y).collect();
    sorted.sort_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
    let chain = |end: Vec2, sign: f32| {
        let mut chain = vec![end];
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
    // Both chains end at the highest point; the second one is reversed without it.
    let (mut path, down) = (chain(front, 1.0), chain(back, -1.0));
    path.extend(down.iter().rev().skip(1));
    path
}

/// Resamples a path by even steps: from the front end to where it first reaches the ridge's height,
/// and from where it last does to the back end.
fn resampled(path: &[Vec2], ridge: f32) -> Vec<Vec2> {
    let mut backwards = path.to_vec();
    backwards.reverse();
    let mut even = even_steps(&climb(path, ridge));
    even.extend(even_steps(&climb(&backwards, ridge)).into_iter().rev());
    even
}

/// Part of a path up to where it first reaches a height.
fn climb(path: &[Vec2], height: f32) -> Vec<Vec2> {
    let first = path.iter().position(|p| p.y >= height).unwrap_or(0).max(1);
    let (below, above) = (path[first - 1], path[first]);
    let t = (height - below.y) / (above.y - below.y).max(1e-9);
    let mut climb = path[..first].to_vec();
    climb.push(below.lerp(above, t.clamp(0.0, 1.0)));
    climb
}

/// Resamples a path by [`HALF_PATH`] even steps.
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

/// One pass of the 1-2-1 filter over slices; both ends of the paths stay.
fn smooth_slices(paths: &mut [Vec<Vec3>]) {
    let before = paths.to_vec();
    for slice in 0..=SLICES {
        for j in 1..2 * HALF_PATH + 1 {
            // The slice beside the midplane has its mirror image as its other neighbour, the last
            // slice has itself.
            let inner = before[slice.abs_diff(1)][j];
            let outer = before[(slice + 1).min(SLICES)][j];
            let mean = before[slice][j] * 0.5 + (inner + outer) * 0.25;
            paths[slice][j] = Vec3::new(before[slice][j].x, mean.y, mean.z);
        }
    }
}
