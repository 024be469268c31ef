//! Contract: a view shows the frames of its time, errors and intersections in closed form, and the
//! predictions of an animator to the byte; files that do not fit leave it as it was.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on fails")]

use glam::Vec3;
use std::sync::Arc;
use unic_builtin::scale::{NetworkSize, random_model, walk};
use unic_core::{Animator, Model, Start, StepInput, clip::Clip, mesh::TriMesh};
use unic_raster::heat_colour;
use unic_viewer::{
    AnimatedMesh, AnimationSource, ClipSource, ModelSource, Painter, PainterChoice, PaneChoice, PaneFacts,
    Quantity, SheetLayout, Source, TrackKind, ViewSession, draw_sheet,
};

const FRAMES: usize = 12;

fn model() -> Arc<Model> {
    Arc::new(random_model(NetworkSize::Standard, 200).unwrap())
}

fn motion() -> Arc<Clip> {
    Arc::new(Clip {
        name: "walk".into(),
        fps: 30.0,
        poses: (0..FRAMES).map(walk).collect(),
        ground_height: 0.0,
        wind: Vec::new(),
    })
}

/// Garment of a model, skinned to a motion.
fn skinned(model: &Model, motion: &Clip) -> Vec<Vec<Vec3>> {
    let (skeleton, garment) = (&model.character().skeleton, model.garment());
    let frame = |pose| {
        let (mut joints, mut world_from_rest, mut positions) = (Vec::new(), Vec::new(), Vec::new());
        skeleton.forward_kinematics(pose, &mut joints);
        skeleton.world_from_rest(&joints, &mut world_from_rest);
        garment
            .weights
            .skin(&garment.rest.vertices, &world_from_rest, &mut positions);
        positions
    };
    motion.poses.iter().map(frame).collect()
}

/// Clip whose true garment is skinned and then moved by `offset`.
fn clip(model: &Model, offset: Vec3) -> Source {
    let motion = motion();
    let mut truth = skinned(model, &motion);
    truth
        .iter_mut()
        .flatten()
        .for_each(|position| *position += offset);
    Source::Clip(ClipSource {
        name: "walk".into(),
        character: Arc::new(model.character().clone()),
        garment: Arc::new(model.garment().clone()),
        motion,
        truth: Arc::new(truth),
        body: None,
    })
}

fn prediction(name: &str, model: &Arc<Model>) -> Source {
    Source::Model(ModelSource {
        name: name.into(),
        model: Arc::clone(model),
        motion: None,
    })
}

fn animation(name: &str, fps: f32, mesh: TriMesh, frames: Vec<Vec<Vec3>>) -> AnimationSource {
    AnimationSource {
        name: name.into(),
        fps,
        garment: AnimatedMesh {
            mesh: Arc::new(mesh),
            frames: Arc::new(frames),
        },
        body: None,
    }
}

/// Closed cube of side 1 m around (0, 1, 0).
fn cube() -> TriMesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
        Vec3::new(side(0), 1.0 + side(1), side(2))
    };
    let quads = [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ];
    let faces = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    TriMesh::new((0..8).map(corner).collect(), faces.collect()).unwrap()
}

fn shown_at(session: &mut ViewSession, seconds: f32) {
    session.set_seconds(seconds);
    session.wait_for(session.seconds());
    session.update();
}

#[test]
fn a_capture_and_models_are_compared_and_a_lone_source_has_one_pane() {
    let model = model();
    let kinds = |sources: Vec<Source>| -> Vec<TrackKind> {
        let session = ViewSession::new(sources).unwrap();
        session.tracks().iter().map(|track| track.kind()).collect()
    };
    use TrackKind::{Prediction, Skinning, Truth};
    assert_eq!(kinds(vec![clip(&model, Vec3::ZERO)]), [Truth]);
    let two = vec![
        prediction("a", &model),
        clip(&model, Vec3::ZERO),
        prediction("b", &model),
    ];
    assert_eq!(kinds(two), [Truth, Prediction, Prediction, Skinning]);
    let alone = ModelSource {
        name: "alone".into(),
        model,
        motion: Some(motion()),
    };
    assert_eq!(kinds(vec![Source::Model(alone)]), [Prediction]);
}

#[test]
fn predictions_are_those_of_an_animator_in_free_running() {
    let model = model();
    let mut session = ViewSession::new(vec![clip(&model, Vec3::ZERO), prediction("a", &model)]).unwrap();
    let motion = motion();
    let truth = skinned(&model, &motion);
    let mut animator = Animator::new(Arc::clone(&model));
    let mut expected = Vec::new();
    for frame in 0..FRAMES {
        let input = StepInput::of_clip(&motion, frame);
        let garment = match frame {
            0 => animator.reset(&input, Start::Positions(&truth[0])).unwrap(),
            _ => animator.step(&input).unwrap(),
        };
        let pairs = garment.positions.iter().zip(&truth[frame]);
        let squares: f64 = pairs.map(|(a, b)| f64::from(a.distance_squared(*b))).sum();
        expected.push((squares / truth[frame].len() as f64).sqrt() as f32);
    }
    shown_at(&mut session, f32::MAX);
    assert_eq!(session.frame(1), FRAMES - 1);
    assert_eq!(session.tracks()[1].rmse_m(), expected);
    let stages = session.tracks()[1].progress().unwrap().stages;
    assert_eq!(stages.steps(), FRAMES - 1);
    let sum: f64 = stages.mean_ms().map(|(_, ms)| ms).sum();
    assert!((sum - stages.step_ms()).abs() < 1e-9 && sum > 0.0);
}

#[test]
fn errors_are_distances_and_their_colours_those_of_the_scale() {
    let model = model();
    // The skinned garment is 10 mm from the truth everywhere.
    let offset = Vec3::new(0.006, 0.008, 0.0);
    let mut session = ViewSession::new(vec![clip(&model, offset), prediction("a", &model)]).unwrap();
    session.quantity = Quantity::Error;
    session.heat_most_m = 0.02;
    shown_at(&mut session, 0.2);
    let skinning = 2;
    assert_eq!(session.tracks()[skinning].kind(), TrackKind::Skinning);
    let PaneFacts::Error { rmse_m, most_m } = session.facts(skinning) else {
        panic!("{:?}", session.facts(skinning));
    };
    assert!((rmse_m - 0.01).abs() < 1e-6 && (most_m - 0.01).abs() < 1e-6);
    assert_eq!(session.facts(0), PaneFacts::None);
    let half = heat_colour(0.5);
    session
        .with_scene(skinning, 1.0, |scene, _| {
            let colours = scene.parts[1].colours.unwrap();
            assert_eq!(colours.len(), model.vertex_count());
            for colour in colours {
                assert!(
                    colour.iter().zip(half).all(|(a, b)| (a - b).abs() < 1e-3),
                    "{colour:?}"
                );
            }
            Ok(())
        })
        .unwrap();
}

#[test]
fn vertices_inside_the_body_are_counted_with_their_depth() {
    let garment = TriMesh::new(
        vec![
            Vec3::new(0.0, 1.0, 0.495),
            Vec3::new(0.1, 1.0, 0.52),
            Vec3::new(0.0, 1.2, 0.53),
        ],
        vec![[0, 1, 2]],
    )
    .unwrap();
    let frames = vec![garment.vertices.clone()];
    let mut source = animation("patch", 30.0, garment, frames);
    let body = cube();
    source.body = Some(AnimatedMesh {
        frames: Arc::new(vec![body.vertices.clone()]),
        mesh: Arc::new(body),
    });
    let mut session = ViewSession::new(vec![Source::Animation(source)]).unwrap();
    session.quantity = Quantity::Intersections;
    session.update();
    let PaneFacts::Intersections { vertices, deepest_m } = session.facts(0) else {
        panic!("{:?}", session.facts(0));
    };
    assert_eq!(vertices, 1);
    assert!((deepest_m - 0.005).abs() < 1e-5, "{deepest_m}");
    // The body is drawn smaller, so that it does not hide the vertex.
    session
        .with_scene(0, 1.0, |scene, _| {
            let unic_viewer::Shape::Host(body) = scene.parts[0].shape else {
                panic!()
            };
            let extent = body.iter().map(|vertex| vertex.position.z).fold(0.0, f32::max);
            assert!(extent < 0.4975 && extent > 0.47, "{extent}");
            Ok(())
        })
        .unwrap();
}

#[test]
fn time_stays_within_the_longest_motion_and_each_source_has_its_own_rate() {
    let still = |count: usize| vec![cube().vertices; count];
    let slow = animation("slow", 10.0, cube(), still(10));
    let fast = animation("fast", 60.0, cube(), still(30));
    let mut session = ViewSession::new(vec![Source::Animation(slow), Source::Animation(fast)]).unwrap();
    assert_eq!((session.duration(), session.fps()), (1.0, 60.0));
    session.set_seconds(0.3);
    assert_eq!([session.frame(0), session.frame(1)], [3, 18]);
    session.step(-1);
    assert_eq!([session.frame(0), session.frame(1)], [2, 17]);
    session.set_seconds(0.9);
    assert_eq!([session.frame(0), session.frame(1)], [9, 29]);
    session.set_seconds(f32::NAN);
    assert_eq!(session.seconds(), 0.0);
    session.set_seconds(0.95);
    session.advance(0.1);
    assert_eq!(session.seconds(), 0.0);
}

#[test]
fn what_does_not_fit_is_refused_in_a_sentence_and_changes_nothing() {
    let model = model();
    let mut session = ViewSession::new(vec![Source::Animation(animation(
        "still",
        30.0,
        cube(),
        vec![cube().vertices],
    ))])
    .unwrap();
    let message = session
        .add(vec![prediction("a", &model)])
        .unwrap_err()
        .to_string();
    assert_eq!(
        message,
        "a: expected a motion of 24 joints at 30 fps for the model, found none"
    );
    let short = animation("short", 30.0, cube(), vec![vec![Vec3::ZERO]]);
    let message = session
        .add(vec![Source::Animation(short)])
        .unwrap_err()
        .to_string();
    assert!(message.starts_with("short: expected frames"), "{message}");
    assert_eq!(session.tracks().len(), 1);
    assert!(ViewSession::new(Vec::new()).is_err());
}

#[test]
fn a_newer_model_of_a_name_takes_its_place_when_it_is_computed() {
    let model = model();
    let mut session = ViewSession::new(vec![clip(&model, Vec3::ZERO), prediction("a", &model)]).unwrap();
    shown_at(&mut session, f32::MAX);
    let before = session.tracks()[1].rmse_m();
    assert_eq!(before.len(), FRAMES);
    session.panes = PaneChoice::Only(1);
    let newer = Arc::new(random_model(NetworkSize::Paper, 200).unwrap());
    session.add(vec![prediction("a", &newer)]).unwrap();
    assert_eq!(session.tracks().len(), 3);
    assert_eq!(session.panes, PaneChoice::Only(1));
    // The earlier one is shown complete until the newer one is.
    assert_eq!(session.tracks()[1].rmse_m(), before);
    for _ in 0..1000 {
        session.update();
        if session.tracks()[1].rmse_m() != before {
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(10));
    }
    let after = session.tracks()[1].rmse_m();
    assert!(after.len() == FRAMES && after != before);
}

#[test]
fn sheets_have_captions_panes_and_the_scale() {
    let model = model();
    let mut session = ViewSession::new(vec![clip(&model, Vec3::X * 0.03), prediction("a", &model)]).unwrap();
    session.quantity = Quantity::Error;
    shown_at(&mut session, 0.2);
    let size = [640, 360];
    let sheet = |session: &ViewSession| {
        let layout = SheetLayout::new(session.visible().len(), size).unwrap();
        let mut painter = Painter::new(PainterChoice::Software, layout.pane_size()).unwrap();
        draw_sheet(session, &layout, |scene, camera| painter.picture(scene, camera)).unwrap()
    };
    let all = sheet(&session);
    assert_eq!([all.width(), all.height()], size);
    let bytes = heat_colour(0.0).map(|channel| (channel * 255.0).round() as u8);
    let has = |image: &unic_raster::Image, colour: [u8; 3]| image.pixels().contains(&colour);
    assert!(has(&all, bytes), "the dark end of the scale");
    session.panes = PaneChoice::Only(2);
    session.update();
    let one = sheet(&session);
    assert!(one.pixels() != all.pixels());
    session.quantity = Quantity::Lit;
    session.update();
    assert!(!has(&sheet(&session), bytes));
    assert!(SheetLayout::new(3, [20, 10]).is_err());
}
