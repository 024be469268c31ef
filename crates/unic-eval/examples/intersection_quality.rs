//! What the ways of handling intersections do to a free-running model: vertices and triangles that cut
//! into the body, and what that costs in error and jitter.
//!
//! ```text
//! cargo run --release -p unic-eval --example intersection_quality -- CAPTURE MODEL FRAMES CLIP...
//! ```
//!
//! Inside is by the closest triangle, outside the folds of the body (`unic_core::folds`, interpolated between the
//! corners of faces), whose share of the skin is `mask`. A crossing is an edge of the garment through a triangle of the
//! body or the reverse; `pushing` are those by parts that may push the garment there (not by a hand in front of it),
//! `convex` those farther than 5 cm from any concave edge of the body. `paper` is the paper's indicator, `open` the same
//! outside the folds. `state` and `display` say what robust handling corrects; `corrected` is the ground truth after
//! the corrections of `display`, and `to it` the error of the others against that.

use glam::Vec3;
use std::{
    collections::{HashMap, HashSet},
    path::Path,
    sync::Arc,
    time::Instant,
};
use unic_core::{
    animator::{Animator, Start, StepInput},
    closest::ClosestVertex,
    config::{Corrects, IntersectionMode},
    folds::Folds,
    intersection::{BodySnapshot, ContactParts, DisplayPass, PosedVertices, RobustBody, RobustIntersection},
    mesh::TriMesh,
    model::Model,
    skeleton::Skeleton,
    surface::{Surface, SurfacePoint},
    topology::edges,
    transform::Rigid,
};
use unic_io::{Capture, CapturedClip};

/// Interpolated over a face between corners that lie in folds, 1, and those that do not, 0: from here on a place
/// counts as in a fold.
const MASK_SHARE: f32 = 0.5;

/// The part of a face's area that does, by the number of such corners.
const MASKED: [f64; 4] = [0.0, 0.25, 0.75, 1.0];

fn is_masked(folds: &Folds, faces: &[[u32; 3]], hit: &SurfacePoint) -> bool {
    let weights = faces[hit.face as usize]
        .into_iter()
        .zip(hit.barycentric.to_array());
    let folded = weights.filter(|(corner, _)| folds.vertices()[*corner as usize]);
    folded.map(|(_, weight)| weight).sum::<f32>() > MASK_SHARE
}

/// A crossing nearer than this to a concave edge lies in a fold of the skin, metres.
const CONCAVE_M: f32 = 0.05;

type Anything<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Anything<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [capture, model, frames, clips @ ..] = arguments.as_slice() else {
        return Err("usage: intersection_quality CAPTURE MODEL FRAMES CLIP...".into());
    };
    let capture = Capture::open(Path::new(capture))?;
    let model = Arc::new(Model::from_bytes(&std::fs::read(model)?)?);
    let frames: usize = frames.parse()?;
    println!(
        "{:14} {:>8} {:>8} {:>8} {:>10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>8} {:>9} {:>9}",
        "",
        "RMSE mm",
        "to it",
        "jitter",
        "inside %",
        "folded %",
        "paper %",
        "open %",
        "crossings",
        "pushing",
        "convex",
        "collapsed",
        "mask %",
        "ms"
    );
    for name in clips {
        let clip = capture.load_clip(name)?;
        println!("{name}");
        let mut corrected = Corrected::new(&capture);
        for (name, shows) in [("truth", false), ("corrected", true)] {
            let mut measure = Measure::new(&capture, &clip);
            for frame in 1..frames.min(clip.clip.len()) {
                let captured = clip.garment.frame(frame);
                let body = posed(&capture, &clip, frame);
                let shown = if shows {
                    corrected.of(&body, captured)
                } else {
                    captured
                };
                measure.add(frame, shown, 0.0);
            }
            measure.print(name);
        }
        let robust = |corrects| IntersectionMode::Robust {
            margin_m: IntersectionMode::MARGIN_M,
            corrects,
        };
        for (name, mode) in [
            ("off", IntersectionMode::Off),
            ("paper", IntersectionMode::Paper { relaxation_m: 0.005 }),
            ("display", robust(Corrects::Display)),
            ("state", robust(Corrects::State)),
        ] {
            run(&capture, &clip, frames, name, &model, mode)?;
        }
    }
    Ok(())
}

/// The ground truth, put through what robust handling does to shown positions.
struct Corrected {
    body: RobustBody,
    pass: DisplayPass,
    positions: Vec<Vec3>,
}

impl Corrected {
    fn new(capture: &Capture) -> Self {
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

    fn of(&mut self, body: &[Vec3], garment: &[Vec3]) -> &[Vec3] {
        self.body.pose(body);
        self.positions.clear();
        self.positions.extend_from_slice(garment);
        let posed = PosedVertices {
            body: &self.body,
            vertices: body,
            colliders: &[],
        };
        self.pass.apply(posed, &mut self.positions);
        &self.positions
    }
}

fn run(
    capture: &Capture,
    clip: &CapturedClip,
    frames: usize,
    name: &str,
    model: &Arc<Model>,
    mode: IntersectionMode,
) -> Anything<()> {
    let mut animator = Animator::new(model.clone());
    animator.set_intersection(mode);
    let input = |t: usize| StepInput {
        pose: &clip.clip.poses[t],
        next_pose: clip.clip.poses.get(t + 1),
        ground_height: clip.clip.ground_height,
        wind: clip.clip.wind_at(t),
    };
    animator.reset(&input(0), Start::Positions(clip.garment.frame(0)))?;
    let mut measure = Measure::new(capture, clip);
    for frame in 1..frames.min(clip.clip.len()) {
        let start = Instant::now();
        let shown = animator.step(&input(frame))?;
        let ms = start.elapsed().as_secs_f64() * 1e3;
        measure.add(frame, shown.positions, ms);
    }
    measure.print(name);
    Ok(())
}

/// A clip's body, frame by frame, and sums over the frames.
struct Measure<'a> {
    capture: &'a Capture,
    clip: &'a CapturedClip,
    corrected: Corrected,
    surface: Surface,
    folds: Folds,
    snapshot: BodySnapshot,
    cloth: Surface,
    parts: ContactParts,
    body_edges: Vec<[u32; 2]>,
    /// A body face at each.
    faces_at_edges: Vec<u32>,
    garment_edges: Vec<[u32; 2]>,
    before: [Vec<Vec3>; 2],
    sums: Sums,
    ms: Vec<f64>,
}

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
    crossings: usize,
    pushing: usize,
    convex: usize,
    collapsed: usize,
    mask: f64,
}

impl<'a> Measure<'a> {
    fn new(capture: &'a Capture, clip: &'a CapturedClip) -> Self {
        let body = &capture.character.body;
        let body_edges = edges(&body.faces);
        let mut face_at = HashMap::new();
        for (face, &[a, b, c]) in (0..).zip(&body.faces) {
            face_at.extend([[a, b], [b, c], [c, a]].map(|[u, v]| ([u.min(v), u.max(v)], face)));
        }
        Self {
            parts: ContactParts::new(&capture.character, &capture.garment),
            faces_at_edges: body_edges.iter().map(|edge| face_at[edge]).collect(),
            capture,
            clip,
            corrected: Corrected::new(capture),
            surface: Surface::build(body),
            folds: Folds::default(),
            snapshot: BodySnapshot::default(),
            cloth: Surface::build(&capture.garment.rest),
            body_edges,
            garment_edges: edges(&capture.garment.rest.faces),
            before: [Vec::new(), Vec::new()],
            sums: Sums::default(),
            ms: Vec::new(),
        }
    }

    fn add(&mut self, frame: usize, garment: &[Vec3], ms: f64) {
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
            |(face, corners): (u32, &[u32; 3])| areas(corners) * MASKED[self.folds.corners_of_face(face)];
        sums.mask += (0..).zip(faces).map(masked).sum::<f64>() / faces.iter().map(areas).sum::<f64>();
        self.crossings(&body, garment);
    }

    fn crossings(&mut self, body: &[Vec3], garment: &[Vec3]) {
        self.cloth.refit(garment);
        let (faces, cloth_faces) = (
            &self.capture.character.body.faces,
            &self.capture.garment.rest.faces,
        );
        let is_open = |p: Vec3| {
            let hit = self.surface.closest(p);
            hit.is_some_and(|hit| !is_masked(&self.folds, faces, &hit))
        };
        let pushes =
            |face, corners: &[u32]| corners.iter().all(|&v| self.parts.face_pushes(face, v as usize));
        let mut places = Vec::new();
        for edge in &self.garment_edges {
            let [a, b] = edge.map(|v| garment[v as usize]);
            if let Some((p, face)) = crossing(&self.surface, a, b).filter(|(p, _)| is_open(*p)) {
                places.push(p);
                self.sums.pushing += usize::from(pushes(face, edge));
            }
        }
        for (&[a, b], &beside) in self.body_edges.iter().zip(&self.faces_at_edges) {
            let hit = crossing(&self.cloth, body[a as usize], body[b as usize]);
            if let Some((p, face)) = hit.filter(|(p, _)| is_open(*p)) {
                places.push(p);
                self.sums.pushing += usize::from(pushes(beside, &cloth_faces[face as usize]));
            }
        }
        self.sums.crossings += places.len();
        if places.is_empty() {
            return;
        }
        let concave = ClosestVertex::build(&concave_edges(&self.capture.character.body, body));
        let is_convex = |p: &&Vec3| concave.nearest(**p).is_none_or(|(_, d)| d > CONCAVE_M);
        self.sums.convex += places.iter().filter(is_convex).count();
    }

    fn print(&self, name: &str) {
        let s = &self.sums;
        let share = |n: usize| 100.0 * n as f64 / s.vertices as f64;
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
            s.crossings as f64 / s.frames as f64,
            s.pushing as f64 / s.frames as f64,
            s.convex as f64 / s.frames as f64,
            s.collapsed,
            100.0 * s.mask / s.frames as f64,
            ms[ms.len() / 2],
        );
    }
}

/// Where the way from a to b goes through a surface.
fn crossing(surface: &Surface, a: Vec3, b: Vec3) -> Option<(Vec3, u32)> {
    let (length, direction) = ((b - a).length(), (b - a).normalize_or_zero());
    let hit = surface.first_along(a, direction, length)?;
    (hit.distance < length).then(|| (a + direction * hit.distance, hit.face))
}

/// Middles of the edges over which the body bends inwards.
fn concave_edges(mesh: &TriMesh, at: &[Vec3]) -> Vec<Vec3> {
    let mut opposite = HashMap::new();
    let mut middles = Vec::new();
    for &[a, b, c] in &mesh.faces {
        for [u, v, w] in [[a, b, c], [b, c, a], [c, a, b]] {
            opposite.insert([u, v], w);
        }
    }
    for (&[u, v], &w) in &opposite {
        let Some(&x) = opposite.get(&[v, u]).filter(|_| u < v) else {
            continue;
        };
        let [u, v, w, x] = [u, v, w, x].map(|i| at[i as usize]);
        let normal = (v - u).cross(w - u);
        if (x - u).dot(normal) > 0.0 {
            middles.push((u + v) * 0.5);
        }
    }
    middles
}

fn posed(capture: &Capture, clip: &CapturedClip, frame: usize) -> Vec<Vec3> {
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
