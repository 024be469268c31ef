//! Measurement of a clip's garment beside the body and the ground truth, summed over frames.

use crate::crossings::{CrossingCounts, Crossings};
use glam::Vec3;
use std::collections::HashSet;
use unic_core::{
    IntersectionMode,
    folds::Folds,
    intersection::{BodySnapshot, CollisionScene, DisplayPass, RobustBody, RobustIntersection},
    skeleton::Skeleton,
    surface::{Surface, SurfacePoint},
    transform::Rigid,
};
use unic_io::{Capture, CapturedClip};

/// Share of folded corners at a point, interpolated over its face, from which the point counts as
/// in a fold.
const MASK_SHARE: f32 = 0.5;

/// Share of a face's area in a fold, by its number of folded corners.
const MASKED: [f64; 4] = [0.0, 0.25, 0.75, 1.0];

/// Returns whether a point of the body lies in a fold.
fn is_masked(folds: &Folds, faces: &[[u32; 3]], hit: &SurfacePoint) -> bool {
    let weights = faces[hit.face as usize]
        .into_iter()
        .zip(hit.barycentric.to_array());
    let folded = weights.filter(|(corner, _)| folds.vertices()[*corner as usize]);
    folded.map(|(_, weight)| weight).sum::<f32>() > MASK_SHARE
}

/// Corrects a garment as robust handling corrects shown positions.
pub(crate) struct Corrected {
    body: RobustBody,
    pass: DisplayPass,
    positions: Vec<Vec3>,
}

impl Corrected {
    pub(crate) fn new(capture: &Capture) -> Self {
        let body = RobustBody::new(&capture.character, &capture.garment);
        let rule = RobustIntersection {
            margin_m: IntersectionMode::MARGIN_M,
        };
        Self {
            pass: DisplayPass::new(rule, &capture.garment, &body),
            body,
            positions: Vec::new(),
        }
    }

    /// Returns the corrected garment.
    pub(crate) fn of(&mut self, body: &[Vec3], garment: &[Vec3]) -> &[Vec3] {
        self.body.pose(body);
        self.positions.clear();
        self.positions.extend_from_slice(garment);
        let posed = CollisionScene {
            body: &self.body,
            vertices: body,
            colliders: &[],
            skinned: None,
        };
        self.pass.apply(posed, &mut self.positions);
        &self.positions
    }
}

/// Sums over the frames of a clip.
pub(crate) struct Measure<'a> {
    capture: &'a Capture,
    clip: &'a CapturedClip,
    corrected: Corrected,
    surface: Surface,
    folds: Folds,
    snapshot: BodySnapshot,
    crossings: Crossings,
    before: [Vec<Vec3>; 2],
    sums: Sums,
    ms: Vec<f64>,
}

/// Sums over frames.
#[derive(Default)]
struct Sums {
    frames: usize,
    vertices: usize,
    squared: f64,
    squared_corrected: f64,
    second: f64,
    seconds: usize,
    inside: usize,
    folded: usize,
    paper: usize,
    open: usize,
    /// Numbers of crossings.
    crossings: CrossingCounts,
    collapsed: usize,
    mask: f64,
}

impl<'a> Measure<'a> {
    pub(crate) fn new(capture: &'a Capture, clip: &'a CapturedClip) -> Self {
        let body = &capture.character.body;
        Self {
            capture,
            clip,
            corrected: Corrected::new(capture),
            surface: Surface::build(body),
            folds: Folds::default(),
            snapshot: BodySnapshot::default(),
            crossings: Crossings::new(capture),
            before: [Vec::new(), Vec::new()],
            sums: Sums::default(),
            ms: Vec::new(),
        }
    }

    /// Adds a frame. `ms` is the time that it took, milliseconds.
    pub(crate) fn add(&mut self, frame: usize, garment: &[Vec3], ms: f64) {
        let body = posed(self.capture, self.clip, frame);
        self.surface.refit(&body);
        self.folds.find(&self.surface);
        self.snapshot.prepare(&body, &self.capture.character.body.faces);
        self.ms.push(ms);
        let faces = &self.capture.character.body.faces;
        let sums = &mut self.sums;
        sums.frames += 1;
        sums.vertices += garment.len();
        let truth = self.clip.garment.frame(frame);
        let corrected = self.corrected.of(&body, truth);
        for ((p, g), c) in garment.iter().zip(truth).zip(corrected) {
            sums.squared += f64::from(p.distance_squared(*g));
            sums.squared_corrected += f64::from(p.distance_squared(*c));
            let hit = self.surface.closest(*p);
            let is_below = self.snapshot.is_inside(*p);
            sums.paper += usize::from(is_below);
            let folded = hit.is_some_and(|hit| is_masked(&self.folds, faces, &hit));
            sums.open += usize::from(is_below && !folded);
            if hit.is_some_and(|hit| hit.signed_distance < 0.0) {
                sums.folded += usize::from(folded);
                sums.inside += usize::from(!folded);
            }
        }
        let [one, two] = &self.before;
        if one.len() == garment.len() && two.len() == garment.len() {
            sums.seconds += garment.len();
            for ((x, y), z) in garment.iter().zip(one).zip(two) {
                sums.second += f64::from((*x - 2.0 * *y + *z).length_squared());
            }
        }
        self.before.swap(0, 1);
        self.before[0] = garment.to_vec();
        let places: HashSet<[u32; 3]> = garment.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        let rest = &self.capture.garment.rest.vertices;
        let at_rest: HashSet<[u32; 3]> = rest.iter().map(|p| p.to_array().map(f32::to_bits)).collect();
        sums.collapsed += at_rest.len().saturating_sub(places.len());
        let areas = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| body[v as usize]);
            f64::from((b - a).cross(c - a).length())
        };
        let masked =
            |(face, corners): (u32, &[u32; 3])| areas(corners) * MASKED[self.folds.folded_corners(face)];
        sums.mask += (0..).zip(faces).map(masked).sum::<f64>() / faces.iter().map(areas).sum::<f64>();
        let is_open = |p: Vec3| {
            let hit = self.surface.closest(p);
            hit.is_some_and(|hit| !is_masked(&self.folds, faces, &hit))
        };
        let found = self.crossings.count(&self.surface, &body, garment, is_open);
        sums.crossings.all += found.all;
        sums.crossings.pushing += found.pushing;
        sums.crossings.convex += found.convex;
    }

    pub(crate) fn print(&self, name: &str) {
        let s = &self.sums;
        let share = |n: usize| 100.0 * n as f64 / s.vertices as f64;
        let a_frame = |n: usize| n as f64 / s.frames as f64;
        let mut ms = self.ms.clone();
        ms.sort_by(f64::total_cmp);
        println!(
            "{name:14} {:8.2} {:8.2} {:8.3} {:10.4} {:9.4} {:9.4} {:9.4} {:9.2} {:9.2} {:9.3} {:8} {:9.2} {:9.2}",
            1e3 * (s.squared / s.vertices as f64).sqrt(),
            1e3 * (s.squared_corrected / s.vertices as f64).sqrt(),
            1e3 * (s.second / s.seconds as f64).sqrt(),
            share(s.inside),
            share(s.folded),
            share(s.paper),
            share(s.open),
            a_frame(s.crossings.all),
            a_frame(s.crossings.pushing),
            a_frame(s.crossings.convex),
            s.collapsed,
            100.0 * s.mask / s.frames as f64,
            ms[ms.len() / 2],
        );
    }
}

/// Returns the body in a frame: the clip's own, or by linear blend skinning.
pub(crate) fn posed(capture: &Capture, clip: &CapturedClip, frame: usize) -> Vec<Vec3> {
    if let Some(body) = &clip.body {
        return body.frame(frame).to_vec();
    }
    let character = &capture.character;
    let transforms = world_from_rest(&character.skeleton, clip, frame);
    let mut vertices = Vec::new();
    character
        .weights
        .skin(&character.body.vertices, &transforms, &mut vertices);
    vertices
}

fn world_from_rest(skeleton: &Skeleton, clip: &CapturedClip, frame: usize) -> Vec<Rigid> {
    let (mut joints, mut transforms) = (Vec::new(), Vec::new());
    skeleton.forward_kinematics(&clip.clip.poses[frame], &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    transforms
}
