//! Values of features, their scales, mirrored clips, contacts and refusals.

use crate::common::{
    FIGURE_MIRROR, FPS, SPEED, build, figure, figure_settings, gliding, human_database, winding,
};
use unic_core::motion_matching::{
    Database, DatabaseError, Feature, FeatureGroup, TagRange, TaggedClip, View,
};

/// Features of a frame before they were normalised.
fn raw(database: &Database, frame: usize) -> Vec<f32> {
    let scale = database.scale();
    let scales = scale.means.iter().zip(&scale.scales);
    database
        .features(frame)
        .zip(scales)
        .map(|(x, (mean, scale))| x / scale + mean)
        .collect()
}

fn assert_near(found: &[f32], expected: &[f32]) {
    for (a, b) in found.iter().zip(expected) {
        assert!((a - b).abs() < 2e-4, "{found:?} {expected:?}");
    }
}

/// A steady glide has the same features in every frame and in every direction: the feet under the
/// hips, one velocity, and a straight trajectory.
#[test]
fn features_of_a_glide_have_their_closed_form() {
    for yaw in [0.0, 1.0, -2.5] {
        let database = build(
            &figure(),
            &[gliding(90, yaw), winding(60, 0.3)],
            figure_settings(),
        );
        let expected = [
            [0.1, 0.1, 0.0, -0.1, 0.1, 0.0].as_slice(),
            &[0.0, 0.0, SPEED].repeat(3),
            &[0.0, SPEED / 3.0, 0.0, SPEED * 2.0 / 3.0, 0.0, SPEED],
            &[0.0, 1.0].repeat(3),
        ]
        .concat();
        for frame in [0, 31, 89] {
            assert_near(&raw(&database, frame), &expected);
        }
    }
}

#[test]
fn past_features_lie_behind() {
    let group = |feature| FeatureGroup { feature, weight: 1.0 };
    let mut settings = figure_settings();
    settings.groups = vec![
        group(Feature::TrajectoryPositions(vec![-0.5, 0.5])),
        group(Feature::JointPosition(5)),
    ];
    let database = build(&figure(), &[gliding(90, 0.4), winding(60, 0.3)], settings);
    assert_near(&raw(&database, 40)[..4], &[0.0, -0.5 * SPEED, 0.0, 0.5 * SPEED]);
}

/// All numbers of a group have one scale, by which the root mean square of their standard
/// deviations is the weight.
#[test]
fn each_group_has_one_standard_deviation() {
    let database = build(
        &figure(),
        &[winding(200, 0.3), winding(300, 1.7)],
        figure_settings(),
    );
    let rows: Vec<Vec<f32>> = (0..database.len())
        .map(|f| database.features(f).collect())
        .collect();
    let mut first = 0;
    for group in &database.settings().groups {
        let numbers = first..first + group.feature.len();
        let scales = &database.scale().scales[numbers.clone()];
        assert!(scales.iter().all(|s| *s == scales[0]));
        let squares = numbers
            .clone()
            .flat_map(|i| rows.iter().map(move |row| row[i] * row[i]));
        let mean = squares.sum::<f32>() / (rows.len() * numbers.len()) as f32;
        assert!(
            (mean.sqrt() - group.weight).abs() < 1e-2,
            "{:?}: {}",
            group.feature,
            mean.sqrt()
        );
        first = numbers.end;
    }
}

/// The features of a mirrored frame are those of the frame with feet exchanged and x reversed.
#[test]
fn mirrored_clips_are_mirror_images() {
    let mut settings = figure_settings();
    settings.mirror = Some(FIGURE_MIRROR.to_vec());
    let clips = [winding(100, 0.3), gliding(40, 0.9)];
    let database = build(&figure(), &clips, settings);
    let half = database.len() / 2;
    assert_eq!(database.clips()[0].view, View::Direct);
    assert_eq!(database.clips()[2].view, View::Mirrored);
    for frame in 0..half {
        let (a, b) = (raw(&database, frame), raw(&database, half + frame));
        let swapped = [3, 4, 5, 0, 1, 2, 9, 10, 11, 6, 7, 8, 12, 13, 14]
            .into_iter()
            .chain(15..27);
        let lateral = |i: usize| if i < 15 { i.is_multiple_of(3) } else { i % 2 == 1 };
        for (i, j) in swapped.enumerate() {
            let expected = if lateral(i) { -b[i] } else { b[i] };
            assert!((a[j] - expected).abs() < 2e-4, "frame {frame}, number {i}");
        }
        let [left, right] = database.contacts(frame);
        assert_eq!(database.contacts(half + frame), [right, left]);
    }
}

/// Walks stand on one foot or two, and swing the other one.
#[test]
fn contacts_are_found_in_walks() {
    let database = human_database();
    let clip = database
        .clips()
        .iter()
        .find(|c| c.name == "control_circles")
        .unwrap();
    let frames = clip.first + 90..clip.first + 150;
    for side in [0, 1] {
        let stands = frames.clone().filter(|f| database.contacts(*f)[side]).count();
        assert!((20..50).contains(&stands), "{stands} of 60");
    }
}

#[test]
fn tags_cover_their_frames() {
    let clip = gliding(30, 0.0);
    let range = |tag: &str, frames| TagRange {
        tag: tag.into(),
        frames,
    };
    let tagged = TaggedClip {
        clip: &clip,
        tags: vec![range("slow", 0..10), range("fast", 5..99)],
    };
    let database = Database::build(&figure(), &[tagged], figure_settings()).unwrap();
    assert_eq!(database.tag_names(), ["slow", "fast"]);
    assert_eq!(
        (database.tag_bit("fast"), database.tag_bit("other")),
        (Some(2), None)
    );
}

#[test]
fn unusable_clips_and_settings_are_refused() {
    let skeleton = figure();
    let refused = |clips: &[unic_core::clip::Clip], settings| {
        let tagged: Vec<TaggedClip> = clips.iter().map(TaggedClip::untagged).collect();
        Database::build(&skeleton, &tagged, settings).unwrap_err()
    };
    assert_eq!(refused(&[], figure_settings()), DatabaseError::NoFrames);
    assert_eq!(
        refused(&[gliding(2, 0.0)], figure_settings()),
        DatabaseError::NoFrames
    );
    let mut slow = gliding(30, 0.0);
    slow.fps = FPS / 2.0;
    let rates = refused(&[gliding(30, 0.0), slow], figure_settings());
    assert!(matches!(rates, DatabaseError::FrameRate { .. }), "{rates}");
    let mut broken = gliding(30, 0.0);
    broken.poses[7].trans.x = f32::NAN;
    let pose = refused(&[broken], figure_settings());
    assert!(matches!(pose, DatabaseError::Pose { frame: 7, .. }), "{pose}");
    // Differences and sums of coordinates have to stay finite.
    for far in [f32::NAN, f32::INFINITY, 1e38] {
        let (mut ground, mut away) = (gliding(30, 0.0), gliding(30, 0.0));
        ground.ground_height = far;
        away.poses[7].trans.x = far;
        for clip in [ground, away] {
            let error = refused(&[clip], figure_settings());
            assert!(
                matches!(error, DatabaseError::Content { .. } | DatabaseError::Pose { .. }),
                "{far}: {error}"
            );
        }
    }
    let mut settings = figure_settings();
    settings.legs[1].toe = 9;
    let joint = refused(&[gliding(30, 0.0)], settings);
    assert_eq!(joint, DatabaseError::Joint { joint: 9, joints: 9 });
    let mut settings = figure_settings();
    settings.groups[0].weight = f32::NAN;
    assert!(matches!(
        refused(&[gliding(30, 0.0)], settings),
        DatabaseError::Number { .. }
    ));
}
