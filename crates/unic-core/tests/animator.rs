//! The animator's contract: a step is the documented formulas, states continue to the byte, inputs
//! that do not belong are refused and change nothing, and no motion drives a displacement away.

#![allow(clippy::unwrap_used, reason = "a test says what went wrong by panicking")]

mod common;
#[path = "common/reference.rs"]
mod reference;

use common::*;
use glam::{Quat, Vec3};
use reference::Reference;
use std::sync::{
    Arc,
    atomic::{AtomicU64, AtomicUsize, Ordering},
};
use unic_core::{
    animator::{Animator, AnimatorError, AnimatorState, Display, Start, StepInput},
    config::{Corrects, IntersectionMode, StateConfig},
    intersection::{BodySnapshot, PaperIntersection},
    model::Model,
    network::Precision,
    parallel::{Serial, Threads},
    skeleton::Pose,
    subdivide::subdivided,
    surface::Surface,
};

/// Positions of the animator against the reference, metres: rounding of positions near 1 m, carried
/// on by networks that do not shrink it.
const TOLERANCE: f64 = 5e-5;

/// Every way to handle intersections.
const MODES: [IntersectionMode; 4] = [
    IntersectionMode::Off,
    IntersectionMode::Paper { relaxation_m: 0.005 },
    robust(Corrects::Display),
    robust(Corrects::State),
];

const fn robust(corrects: Corrects) -> IntersectionMode {
    IntersectionMode::Robust {
        margin_m: 0.003,
        corrects,
    }
}

#[test]
fn a_step_is_the_documented_formulas() {
    let poses = motion(21);
    for variant in variants() {
        let model = model(&variant);
        let mut reference = Reference::new(&model, &input(&poses, 0));
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        let mut moved = 0.0f32;
        for t in 1..poses.len() {
            let expected: Vec<Vec3> = reference
                .step(&input(&poses, t))
                .iter()
                .map(|p| p.as_vec3())
                .collect();
            let before = animator.garment().positions.to_vec();
            let found = animator.step(&input(&poses, t)).unwrap().positions;
            let error = largest_distance(found, &expected);
            assert!(
                f64::from(error) < TOLERANCE,
                "{}, frame {t}: {error} m",
                variant.name
            );
            moved = moved.max(largest_distance(found, &before));
        }
        assert!(
            moved > 0.02,
            "{}: a garment that hardly moves tests nothing: {moved} m",
            variant.name
        );
        let limit_counts = variant.name == "short limit";
        assert!(
            !limit_counts || reference.limited > 50,
            "{} outputs limited",
            reference.limited
        );
    }
}

#[test]
fn teacher_forcing_sees_given_positions_alone() {
    let poses = motion(12);
    for variant in variants() {
        let model = model(&variant);
        let (mut noise, rest) = (Noise(1), model.garment().rest.vertices.clone());
        let mut reference = Reference::new(&model, &input(&poses, 0));
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        for t in 1..poses.len() {
            let expected: Vec<Vec3> = reference
                .step(&input(&poses, t))
                .iter()
                .map(|p| p.as_vec3())
                .collect();
            let error = largest_distance(animator.step(&input(&poses, t)).unwrap().positions, &expected);
            assert!(
                f64::from(error) < TOLERANCE,
                "{}, frame {t}: {error} m",
                variant.name
            );
            let given: Vec<Vec3> = rest
                .iter()
                .map(|v| *v + poses[t].trans + noise.vector() * 0.03)
                .collect();
            reference.set_garment(&given);
            animator.set_garment(&given).unwrap();
            let shown = animator.garment().positions.iter().zip(&given).enumerate();
            let whole = shown.filter(|(v, _)| model.garment().share(*v) == 1.0);
            assert!(whole.fold(0.0, |largest, (_, (a, b))| a.distance(*b).max(largest)) < 1e-5);
        }
    }
}

/// The garment's rest shape where the skeleton carries it.
fn skinned(model: &Model, pose: &Pose) -> Vec<Vec3> {
    let (mut joints, mut transforms, mut positions) = (vec![], vec![], vec![]);
    let skeleton = &model.character().skeleton;
    skeleton.forward_kinematics(pose, &mut joints);
    skeleton.world_from_rest(&joints, &mut transforms);
    let (rest, weights) = (&model.garment().rest, &model.garment().weights);
    weights.skin(&rest.vertices, &transforms, &mut positions);
    positions
}

#[test]
fn a_mask_of_zero_is_skinning_and_a_mask_of_one_is_the_model() {
    let (poses, whole) = (motion(20), model(&variant("second order")));
    let graded: Vec<f32> = (0..whole.vertex_count())
        .map(|v| [0.0, 1.0, 0.4][v % 3])
        .collect();
    let masked = whole.with_mask(&graded).unwrap();
    let alone = run(&mut Animator::new(Arc::clone(&whole)), &poses);
    for (share, modes) in [(1.0, &MODES[..2]), (0.4, &MODES[..1]), (0.4, &MODES[3..])] {
        let model = Arc::new(masked.clone().with_sampling(share).unwrap());
        for &mode in modes {
            let mut animator = Animator::new(Arc::clone(&model));
            animator.set_intersection(mode);
            animator
                .reset(&input(&poses, 0), Start::Positions(&alone[0]))
                .unwrap();
            for t in 1..poses.len() {
                animator.set_garment(&alone[t]).unwrap();
                animator.step(&input(&poses, t)).unwrap();
                let state = animator.state().clone();
                let mut bare = Animator::new(Arc::clone(&model));
                bare.set_intersection(IntersectionMode::Off);
                let shown = bare.restore(state).unwrap().positions;
                for (v, skinned) in skinned(&model, &poses[t]).iter().enumerate().step_by(3) {
                    assert!(
                        shown[v].distance(*skinned) < 1e-6,
                        "{share}, {mode:?}, frame {t}, vertex {v}"
                    );
                }
            }
        }
    }
    let free = run(&mut Animator::new(Arc::new(masked)), &poses);
    for (free, alone) in free.iter().zip(&alone) {
        assert!((1..free.len()).step_by(3).all(|v| free[v] == alone[v]));
    }
}

#[test]
fn wind_moves_the_garment() {
    let poses = motion(20);
    for name in ["paper", "second order"] {
        let model = model(&variant(name));
        let [blown, still] = [1.0, 0.0].map(|factor| {
            let mut animator = Animator::new(Arc::clone(&model));
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
            for t in 1..poses.len() {
                let wind = wind(t) * factor;
                let input = StepInput {
                    wind,
                    ..input(&poses, t)
                };
                animator.step(&input).unwrap();
            }
            animator.garment().positions.to_vec()
        });
        let apart = largest_distance(&blown, &still);
        assert!(apart > 1e-3, "{name}: {apart} m");
    }
}

#[test]
fn a_mask_that_is_none_is_refused() {
    let whole = model(&variant("second order"));
    let count = whole.vertex_count();
    for mask in [
        vec![1.0; count - 1],
        vec![1.5; count],
        vec![f32::NAN; count],
        vec![-0.1; count],
    ] {
        assert!(whole.with_mask(&mask).is_err());
    }
    assert!(model(&variant("paper")).with_mask(&vec![0.5; count]).is_err());
    let twice = whole
        .with_mask(&vec![0.5; count])
        .unwrap()
        .with_mask(&vec![0.5; count])
        .unwrap();
    assert_eq!(
        twice.to_parts(),
        whole.with_mask(&vec![0.25; count]).unwrap().to_parts()
    );
}

#[test]
fn the_same_inputs_give_the_same_bytes_on_any_number_of_threads() {
    let poses = motion(8);
    for variant in variants() {
        let model = model(&variant);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap();
            let run_in = |mode| {
                let mut animator = Animator::new(Arc::clone(&model));
                animator.set_intersection(mode);
                run(&mut animator, &poses);
                (bits(animator.garment()), animator.state().clone())
            };
            pool.install(|| MODES.map(run_in))
        };
        let one = on(1);
        for threads in [2, 5] {
            assert!(on(threads) == one, "{}, {threads} threads", variant.name);
        }
        let own: [Arc<dyn Threads>; 3] = [
            Arc::new(Serial),
            Arc::new(Workers::new(3)),
            Arc::new(Workers::new(4)),
        ];
        for threads in own {
            let run_in = |mode| {
                let mut animator = Animator::new(Arc::clone(&model));
                animator.set_threads(Arc::clone(&threads));
                animator.set_intersection(mode);
                run(&mut animator, &poses);
                (bits(animator.garment()), animator.state().clone())
            };
            assert!(MODES.map(run_in) == one, "{}, {threads:?}", variant.name);
        }
    }
}

/// Threads of an engine: started anew for every run, with what the job allocates on any of them counted and
/// what they themselves cost left out.
#[derive(Debug)]
struct Workers {
    lanes: usize,
    runs: AtomicUsize,
    allocations: AtomicU64,
}

impl Workers {
    fn new(lanes: usize) -> Self {
        Self {
            lanes,
            runs: AtomicUsize::new(0),
            allocations: AtomicU64::new(0),
        }
    }

    fn count(&self, job: &(dyn Fn() + Sync)) {
        let counted = allocation_counter::measure(job);
        self.allocations.fetch_add(counted.count_total, Ordering::Relaxed);
    }
}

impl Threads for Workers {
    fn lanes(&self) -> usize {
        self.lanes
    }

    fn run(&self, jobs: usize, job: &(dyn Fn() + Sync)) {
        self.runs.fetch_add(1, Ordering::Relaxed);
        allocation_counter::opt_out(|| {
            std::thread::scope(|scope| {
                for _ in 0..jobs {
                    scope.spawn(|| self.count(job));
                }
            });
        });
    }
}

#[test]
fn a_reset_forgets_everything() {
    let poses = motion(10);
    for variant in variants() {
        let mut animator = Animator::new(model(&variant));
        let first = run(&mut animator, &poses);
        let state = animator.state().clone();
        assert_eq!(run(&mut animator, &poses), first, "{}", variant.name);
        assert_eq!(animator.state(), &state);
    }
}

#[test]
fn a_saved_state_continues_to_the_byte() {
    let poses = motion(10);
    for variant in variants() {
        let model = model(&variant);
        // Before the first step too: the start is completed by it.
        for cut in [0, 1, 2, 5] {
            let mut animator = Animator::new(Arc::clone(&model));
            run(&mut animator, &poses[..=cut]);
            let saved = serde_json::to_string(animator.state()).unwrap();
            let at_cut = bits(animator.garment());
            let go_on = |animator: &mut Animator| -> Vec<_> {
                (cut + 1..poses.len())
                    .map(|t| {
                        animator.step(&input(&poses, t)).unwrap();
                        bits(animator.garment())
                    })
                    .collect()
            };
            let expected = go_on(&mut animator);
            let state: AnimatorState = serde_json::from_str(&saved).unwrap();
            for mut other in [animator, Animator::new(Arc::clone(&model))] {
                other.restore(state.clone()).unwrap();
                assert!(bits(other.garment()) == at_cut, "{}, cut at {cut}", variant.name);
                assert!(go_on(&mut other) == expected, "{}, cut at {cut}", variant.name);
            }
        }
    }
}

#[test]
fn animators_that_share_a_model_are_independent() {
    let model = model(&variant("second order"));
    let (poses, mut others) = (motion(8), motion(16));
    others.reverse();
    let alone = run(&mut Animator::new(Arc::clone(&model)), &poses);
    let (mut a, mut b) = (
        Animator::new(Arc::clone(&model)),
        Animator::new(Arc::clone(&model)),
    );
    a.reset(&input(&poses, 0), Start::MeanShape).unwrap();
    b.reset(&input(&others, 0), Start::MeanShape).unwrap();
    for (t, alone) in alone.iter().enumerate().skip(1) {
        b.step(&input(&others, t)).unwrap();
        assert_eq!(a.step(&input(&poses, t)).unwrap().positions, alone);
        b.step(&input(&others, t + 7)).unwrap();
    }
}

#[test]
fn given_positions_are_reproduced_at_the_start_and_stay_when_it_is_completed() {
    let poses = motion(6);
    for variant in variants() {
        let model = model(&variant);
        let mut noise = Noise(2);
        let given: Vec<Vec3> = model
            .garment()
            .rest
            .vertices
            .iter()
            .map(|v| *v + noise.vector() * 0.05)
            .collect();
        let mut animator = Animator::new(Arc::clone(&model));
        // A state left over from elsewhere must not shine through.
        run(&mut animator, &poses);
        let found = animator
            .reset(&input(&poses, 0), Start::Positions(&given))
            .unwrap();
        let skinned = skinned(&model, &poses[0]);
        let blended = |(v, given): (usize, &Vec3)| skinned[v].lerp(*given, model.garment().share(v));
        let expected: Vec<Vec3> = given.iter().enumerate().map(blended).collect();
        assert!(
            largest_distance(found.positions, &expected) < 1e-5,
            "{}",
            variant.name
        );
    }
}

/// A garment that the field does not move and the decay does not pull keeps the place that it was
/// given, although the prior of frame 0 is only known at frame 1.
#[test]
fn completing_the_start_moves_nothing() {
    let poses = motion(3);
    let still = [poses[0].clone(), poses[1].clone()];
    let mut parts = parts(&variant("second order"));
    let StateConfig::Displacement(config) = &mut parts.config.state else {
        unreachable!()
    };
    // d_1 is d_0 to 1 part in 30,000.
    config.memory_s = 1000.0;
    let last = parts.field.last_mut().unwrap();
    last.weight.fill(0.0);
    last.bias.fill(0.0);
    let model = Arc::new(Model::new(parts).unwrap());
    let mut reference = Reference::new(&model, &input(&still, 0));
    let mut animator = Animator::new(Arc::clone(&model));
    let start = animator
        .reset(&input(&still, 0), Start::MeanShape)
        .unwrap()
        .positions
        .to_vec();
    let expected: Vec<Vec3> = reference
        .step(&input(&still, 1))
        .iter()
        .map(|p| p.as_vec3())
        .collect();
    assert!(largest_distance(animator.step(&input(&still, 1)).unwrap().positions, &expected) < 1e-5);
    // The body stands still: frames 0 and 1 have the same pose, the prior the same shape.
    let stand = [poses[0].clone(), poses[0].clone()];
    animator.reset(&input(&stand, 0), Start::MeanShape).unwrap();
    let found = animator.step(&input(&stand, 1)).unwrap().positions;
    assert!(largest_distance(found, &start) < 1e-5);
}

fn posed_body(animator: &Animator) -> BodySnapshot {
    let (mut vertices, mut body) = (Vec::new(), BodySnapshot::default());
    animator.body(&mut vertices);
    body.prepare(&vertices, &animator.model().character().body.faces);
    body
}

/// A garment that hangs 9 cm too far in.
fn tight(name: &str) -> Arc<Model> {
    let mut parts = parts(&variant(name));
    let inwards = |v: &Vec3| -v.with_y(0.0).normalize() * 0.09;
    parts.prior.mean = parts.garment.rest.vertices.iter().map(inwards).collect();
    Arc::new(Model::new(parts).unwrap())
}

#[test]
fn paper_mode_leaves_no_vertex_inside_and_enters_the_state() {
    let rule = PaperIntersection { relaxation_m: 0.005 };
    let poses = motion(15);
    for name in ["position in the heading frame", "second order", "pose only"] {
        let model = tight(name);
        let (mut paper, mut off) = (Animator::new(Arc::clone(&model)), Animator::new(model));
        paper.set_intersection(IntersectionMode::Paper {
            relaxation_m: rule.relaxation_m,
        });
        for animator in [&mut paper, &mut off] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        for t in 1..poses.len() {
            let found = paper.step(&input(&poses, t)).unwrap().positions.to_vec();
            let left = off.step(&input(&poses, t)).unwrap().positions.to_vec();
            let body = posed_body(&off);
            assert!(
                left.iter().any(|&p| body.is_inside(p)),
                "{name}, frame {t}: nothing to correct"
            );
            assert!(!found.iter().any(|&p| body.is_inside(p)), "{name}, frame {t}");
            let corrected: Vec<Vec3> = left
                .iter()
                .map(|&p| rule.correct(&body, p).unwrap_or(p))
                .collect();
            assert!(largest_distance(&found, &corrected) < 1e-4, "{name}, frame {t}");
            // The next step starts from the corrected garment.
            off.set_garment(&corrected).unwrap();
        }
    }
}

#[test]
fn robust_mode_shows_no_vertex_inside() {
    let poses = motion(15);
    for (name, corrects) in ["second order", "pose only"]
        .into_iter()
        .flat_map(|name| [Corrects::Display, Corrects::State].map(|corrects| (name, corrects)))
    {
        let model = tight(name);
        let [mut animator, mut off, mut bare] = [(); 3].map(|()| Animator::new(Arc::clone(&model)));
        animator.set_intersection(robust(corrects));
        for animator in [&mut animator, &mut off] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        for t in 1..poses.len() {
            let shown = animator.step(&input(&poses, t)).unwrap().positions.to_vec();
            let left = off.step(&input(&poses, t)).unwrap().positions.to_vec();
            let mut surface = Surface::build(&model.character().body);
            let mut vertices = Vec::new();
            off.body(&mut vertices);
            surface.refit(&vertices);
            let is_inside = |&&p: &&Vec3| surface.closest(p).unwrap().signed_distance < -1e-4;
            assert!(
                left.iter().find(is_inside).is_some(),
                "{name}, frame {t}: nothing to correct"
            );
            assert_eq!(
                shown.iter().find(is_inside),
                None,
                "{name}, {corrects:?}, frame {t}"
            );
            // The state behind what is shown.
            let kept = bare.restore(animator.state().clone()).unwrap().positions.to_vec();
            match corrects {
                Corrects::Display => assert_eq!(kept, left, "{name}, frame {t}"),
                Corrects::State => assert_eq!(kept.iter().find(is_inside), None, "{name}, frame {t}"),
            }
        }
    }
}

#[test]
fn a_restored_state_shows_what_the_step_showed() {
    let poses = motion(6);
    for mode in MODES {
        let [mut ahead, mut restored] = [(); 2].map(|()| Animator::new(tight("second order")));
        ahead.set_intersection(mode);
        restored.set_intersection(mode);
        run(&mut ahead, &poses);
        restored.restore(ahead.state().clone()).unwrap();
        assert_eq!(bits(restored.garment()), bits(ahead.garment()), "{mode:?}");
    }
}

#[test]
fn what_does_not_belong_is_refused_and_changes_nothing() {
    let (poses, model) = (motion(6), model(&variant("second order")));
    let mut animator = Animator::new(Arc::clone(&model));
    let expected = run(&mut animator, &poses);
    run(&mut animator, &poses[..4]);
    let (state, shown) = (animator.state().clone(), bits(animator.garment()));

    let vertices = model.vertex_count();
    let mut fewer = poses[4].clone();
    fewer.local.pop();
    let joints = AnimatorError::Joints {
        expected: JOINTS,
        found: JOINTS - 1,
    };
    let changed = |change: &dyn Fn(&mut Pose)| {
        let mut pose = poses[4].clone();
        change(&mut pose);
        pose
    };
    let bad = [
        (fewer, joints),
        (changed(&|p| p.trans.x = f32::NAN), AnimatorError::Pose),
        (changed(&|p| p.trans.y = 1e30), AnimatorError::Pose),
        (
            changed(&|p| p.local[2] = Quat::from_xyzw(0.0, f32::NAN, 0.0, 1.0)),
            AnimatorError::Pose,
        ),
        (
            changed(&|p| p.local[2] = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0)),
            AnimatorError::Pose,
        ),
    ];
    for (pose, error) in &bad {
        let alone = StepInput {
            pose,
            next_pose: None,
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        let ahead = StepInput {
            pose: &poses[4],
            next_pose: Some(pose),
            ground_height: 0.0,
            wind: Vec3::ZERO,
        };
        for input in [alone, ahead] {
            assert_eq!(animator.step(&input).unwrap_err(), *error);
            assert_eq!(animator.reset(&input, Start::MeanShape).unwrap_err(), *error);
        }
    }
    for ground_height in [f32::NAN, f32::INFINITY, 1e20] {
        let input = StepInput {
            ground_height,
            wind: Vec3::ZERO,
            ..input(&poses, 4)
        };
        assert_eq!(animator.step(&input).unwrap_err(), AnimatorError::Pose);
        let input = StepInput {
            wind: Vec3::Y * ground_height,
            ..self::input(&poses, 4)
        };
        assert_eq!(animator.step(&input).unwrap_err(), AnimatorError::Pose);
    }
    let mut positions = vec![Vec3::ZERO; vertices];
    positions[7].z = f32::INFINITY;
    let count = AnimatorError::Vertices {
        expected: vertices,
        found: 3,
    };
    for (positions, error) in [
        (&positions[..], AnimatorError::Position { vertex: 7 }),
        (&positions[..3], count),
    ] {
        assert_eq!(animator.set_garment(positions).unwrap_err(), error);
        assert_eq!(
            animator
                .reset(&input(&poses, 0), Start::Positions(positions))
                .unwrap_err(),
            error
        );
    }
    let mesh = subdivided(&model.garment().rest).0;
    let foreign = Animator::new(Arc::new(model.with_mesh(mesh).unwrap()))
        .state()
        .clone();
    assert!(matches!(
        animator.restore(foreign),
        Err(AnimatorError::Vertices { .. })
    ));
    let kept = serde_json::to_value(&state).unwrap();
    assert!(!kept["recurrence"].as_array().unwrap().is_empty());
    for numbers in [serde_json::json!([]), serde_json::json!([1.0, 2.0])] {
        let mut foreign = kept.clone();
        foreign["recurrence"] = numbers;
        let foreign = serde_json::from_value(foreign).unwrap();
        assert!(matches!(animator.restore(foreign), Err(AnimatorError::State(_))));
    }

    assert_eq!(animator.state(), &state);
    assert!(bits(animator.garment()) == shown);
    for (t, expected) in expected.iter().enumerate().skip(4) {
        assert_eq!(animator.step(&input(&poses, t)).unwrap().positions, expected);
    }
}

/// Lengths of the states of all vertices.
fn state_lengths(animator: &Animator) -> Vec<f32> {
    let state = serde_json::to_value(animator.state()).unwrap();
    let vertices = state["vertices"].as_array().unwrap();
    let value = |v: &serde_json::Value| serde_json::from_value::<Vec3>(v["value"].clone()).unwrap();
    vertices.iter().map(|v| value(v).length()).collect()
}

#[test]
fn no_motion_drives_a_displacement_beyond_its_bound() {
    for name in [
        "second order",
        "short limit",
        "displacement in the paper's layout",
    ] {
        let variant = variant(name);
        let StateConfig::Displacement(config) = &variant.state else {
            unreachable!()
        };
        let bound = config.scale_m * config.output_limit / (1.0 - config.decay(1.0 / FPS));
        let mut animator = Animator::new(model(&variant));
        let mut noise = Noise(9);
        let (mut start, mut longest) = (0.0f32, 0.0f32);
        let decay = config.decay(1.0 / FPS);
        for step in 0..2000 {
            // Ever farther teleports, to the edge of what is accepted.
            let reach = 10f32.powf(7.9 * step as f32 / 2000.0 - 2.0);
            let local = (0..JOINTS)
                .map(|_| Quat::from_scaled_axis(noise.vector() * 3.0))
                .collect();
            let pose = Pose {
                trans: noise.vector() * reach,
                local,
            };
            let frame = animator
                .step(&StepInput {
                    pose: &pose,
                    next_pose: None,
                    ground_height: 0.0,
                    wind: Vec3::ZERO,
                })
                .unwrap();
            assert!(
                frame.positions.iter().chain(frame.normals).all(|p| p.is_finite()),
                "{name}, step {step}"
            );
            let length = state_lengths(&animator).into_iter().fold(0.0, f32::max);
            start = if step == 0 { length } else { start * decay };
            assert!(
                length <= (start + bound) * 1.0001,
                "{name}, step {step}: {length} m, bound {bound} m"
            );
            longest = longest.max(length - start);
        }
        assert!(
            longest > 0.3 * bound,
            "{name}: the bound of {bound} m is never neared, {longest} m"
        );
    }
}

/// The whole motion turned about the vertical and moved sideways.
fn moved(poses: &[Pose], root: Vec3, yaw: f32, by: Vec3) -> Vec<Pose> {
    let turn = Quat::from_rotation_y(yaw);
    let pose = |pose: &Pose| {
        let mut moved = pose.clone();
        moved.local[0] = turn * pose.local[0];
        moved.trans = turn * (root + pose.trans) + by - root;
        moved
    };
    poses.iter().map(pose).collect()
}

#[test]
fn the_garment_moves_along_when_the_world_is_turned_and_shifted() {
    let poses = motion(40);
    for variant in variants() {
        let model = model(&variant);
        let root = model.character().skeleton.joints()[0];
        let (yaw, by) = (2.2, Vec3::new(2.0, 0.0, -3.0));
        let own = run(&mut Animator::new(Arc::clone(&model)), &poses);
        let (poses_there, mut elsewhere) = (moved(&poses, root, yaw, by), Animator::new(Arc::clone(&model)));
        let there: Vec<Vec<Vec3>> = (0..poses.len())
            .map(|t| {
                let input = StepInput {
                    wind: Quat::from_rotation_y(yaw) * wind(t),
                    ..input(&poses_there, t)
                };
                let frame = match t {
                    0 => elsewhere.reset(&input, Start::MeanShape),
                    _ => elsewhere.step(&input),
                };
                frame.unwrap().positions.to_vec()
            })
            .collect();
        for (t, (own, there)) in own.iter().zip(&there).enumerate() {
            let along: Vec<Vec3> = own.iter().map(|p| Quat::from_rotation_y(yaw) * *p + by).collect();
            let error = largest_distance(&along, there);
            assert!(error < 1e-4, "{}, frame {t}: {error} m", variant.name);
        }
    }
}

#[test]
fn another_mesh_of_the_same_garment_moves_the_same_way() {
    let poses = motion(30);
    for variant in variants() {
        let model = model(&variant);
        let rest = model.garment().rest.clone();
        let own = run(&mut Animator::new(Arc::clone(&model)), &poses);
        let same = Arc::new(model.with_mesh(rest.clone()).unwrap());
        let (finer, parents) = subdivided(&rest);
        let finer = Arc::new(model.with_mesh(finer).unwrap());
        assert_eq!(finer.vertex_count(), parents.len());
        let same = run(&mut Animator::new(same), &poses);
        let finer = run(&mut Animator::new(finer), &poses);
        for t in 0..poses.len() {
            let (on_same, on_finer) = (
                largest_distance(&own[t], &same[t]),
                largest_distance(&own[t], &finer[t][..rest.vertices.len()]),
            );
            assert!(
                on_same < 1e-4 && on_finer < 1e-4,
                "{}, frame {t}: {on_same} {on_finer} m",
                variant.name
            );
        }
    }
}

/// Neither on the calling thread nor on those that an engine lends.
#[test]
fn a_step_allocates_nothing_once_it_is_warm() {
    let poses = motion(12);
    let cases = variants()
        .into_iter()
        .flat_map(|v| MODES.map(|mode| (v.clone(), mode)));
    for ((variant, mode), precision) in cases.zip(Precision::ALL.into_iter().cycle()) {
        let model = Model::clone(&model(&variant)).with_precision(precision);
        let share = if precision == Precision::Bf16 { 0.5 } else { 1.0 };
        let model = Arc::new(model.with_sampling(share).unwrap());
        for lanes in [1, 3] {
            let workers = Arc::new(Workers::new(lanes));
            let mut animator = Animator::new(Arc::clone(&model));
            animator.set_threads(Arc::clone(&workers) as Arc<dyn Threads>);
            animator.set_intersection(mode);
            run(&mut animator, &poses[..4]);
            workers.allocations.store(0, Ordering::Relaxed);
            let counted = allocation_counter::measure(|| {
                for t in 4..poses.len() {
                    animator.step(&input(&poses, t)).unwrap();
                }
            });
            let lent = workers.allocations.load(Ordering::Relaxed);
            let counts = (counted.count_total, lent);
            assert_eq!(counts, (0, 0), "{}, {mode:?}, {lanes} lanes", variant.name);
            let has_run = workers.runs.load(Ordering::Relaxed) > 0;
            assert_eq!(has_run, lanes > 1, "{}, {mode:?}", variant.name);
        }
    }
}

/// The field runs at the samples alone; what it says there and what follows for the others is the same on any
/// number of threads, and a saved state goes on.
#[test]
fn a_sampled_garment_is_the_samples_and_what_follows_from_them() {
    let poses = motion(8);
    for variant in variants() {
        let full = model(&variant);
        let sampled = Arc::new(Model::clone(&full).with_sampling(0.4).unwrap());
        let samples = sampled.sampling().unwrap().samples().to_vec();
        assert!(samples.len() < full.vertex_count() / 2);
        let [mut all, mut few] = [&full, &sampled].map(|m| Animator::new(Arc::clone(m)));
        for animator in [&mut all, &mut few] {
            animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        }
        let mut distance = 0f32;
        for t in 1..poses.len() {
            let truth = all.step(&input(&poses, t)).unwrap().positions.to_vec();
            let found = few.step(&input(&poses, t)).unwrap().positions;
            for &v in &samples {
                let error = (found[v as usize] - truth[v as usize]).length();
                assert!(error < 1e-4, "{}, frame {t}, sample {v}: {error} m", variant.name);
            }
            distance = distance.max(largest_distance(found, &truth));
        }
        assert!(distance > 1e-3, "{}: every vertex was evaluated", variant.name);
        let whole = Arc::new(Model::clone(&sampled).with_sampling(1.0).unwrap());
        assert_eq!(run(&mut Animator::new(whole), &poses), run(&mut all, &poses));
    }
}

#[test]
fn every_precision_and_sampling_gives_the_same_bytes_on_any_number_of_threads() {
    let poses = motion(6);
    for (variant, precision) in variants().into_iter().zip(Precision::ALL.into_iter().cycle()) {
        let model = Model::clone(&model(&variant)).with_precision(precision);
        let model = Arc::new(model.with_sampling(0.5).unwrap());
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
            pool.unwrap()
                .install(|| run(&mut Animator::new(Arc::clone(&model)), &poses))
        };
        let one = on(1);
        assert!(on(2) == one && on(5) == one, "{}, {precision:?}", variant.name);
        let mut animator = Animator::new(Arc::clone(&model));
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        animator.step(&input(&poses, 1)).unwrap();
        let mut other = Animator::new(Arc::clone(&model));
        other.restore(animator.state().clone()).unwrap();
        assert!(other.step(&input(&poses, 2)).unwrap().positions == one[2]);
    }
}

#[test]
fn coarser_precisions_stay_near() {
    let poses = motion(12);
    for variant in variants() {
        let exact = model(&variant);
        let truth = run(&mut Animator::new(Arc::clone(&exact)), &poses);
        for (precision, metres) in [
            (Precision::Bf16, 0.02),
            (Precision::Int16, 0.002),
            (Precision::Int8, 0.05),
        ] {
            let model = Arc::new(Model::clone(&exact).with_precision(precision));
            let found = run(&mut Animator::new(model), &poses);
            let error = largest_distance(&found[11], &truth[11]);
            assert!(
                error > 0.0 && error < metres,
                "{}, {precision:?}: {error} m",
                variant.name
            );
        }
    }
}

/// At a tick's own pose a display shows the tick; between two, the displacements' mean on the pose between.
#[test]
fn a_display_follows_the_body_between_ticks() {
    let poses = motion(9);
    for variant in variants() {
        let mut animator = Animator::new(model(&variant));
        let mut display = Display::default();
        assert!(display.show(&animator, &poses[0], 1.0).is_err());
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        display.cut(&animator);
        for t in 1..poses.len() {
            let before = animator.garment().positions.to_vec();
            animator.step(&input(&poses, t)).unwrap();
            display.tick(&animator);
            let shown = |d: &mut Display, pose: &Pose, share| {
                d.show(&animator, pose, share).unwrap().positions.to_vec()
            };
            let now = shown(&mut display, &poses[t], 1.0);
            assert!(largest_distance(&now, animator.garment().positions) < 1e-5);
            let then = shown(&mut display, &poses[t - 1], 0.0);
            assert!(largest_distance(&then, &before) < 1e-5, "{}", variant.name);
            // Carried along by a body that has been moved as a whole.
            let mut aside = poses[t].clone();
            aside.trans.x += 2.0;
            let moved: Vec<Vec3> = now.iter().map(|p| *p + Vec3::X * 2.0).collect();
            assert!(largest_distance(&shown(&mut display, &aside, 1.0), &moved) < 1e-5);
        }
    }
}
