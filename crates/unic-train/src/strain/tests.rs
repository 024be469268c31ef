//! Contract: limits of lengths follow from lengths in training, and from where the cloth lies.

use super::*;
use std::iter::zip;

#[test]
fn limits_are_mean_and_deviations_of_the_lengths() {
    let frame = |x: f32| vec![Vec3::ZERO, Vec3::new(x, 0.0, 0.0)];
    let frames = [frame(1.0), frame(1.2), frame(0.8), frame(1.0)];
    let frames: Vec<&[Vec3]> = frames.iter().map(Vec::as_slice).collect();
    let limit = limit_of(lengths_of(&[0, 1], &frames), 2.0);
    let deviation = 0.02f32.sqrt();
    assert!(
        (limit.shortest - (1.0 - 2.0 * deviation)).abs() < 1e-5,
        "{limit:?}"
    );
    assert!(
        (limit.longest - (1.0 + 2.0 * deviation)).abs() < 1e-5,
        "{limit:?}"
    );
}

/// A sheet of 30 by 30 vertices.
fn sheet() -> TriMesh {
    let at = |i: u32| 0.012 * Vec3::new((i % 30) as f32, (i / 30) as f32, 0.0);
    let corners = (0..900u32).filter(|i| i % 30 < 29 && i / 30 < 29);
    let faces = corners.flat_map(|i| [[i, i + 1, i + 31], [i, i + 31, i + 30]]);
    TriMesh::new((0..900).map(at).collect(), faces.collect()).unwrap()
}

/// Lengths of a sheet that shrinks and grows by a share. `gap` is the distance of a place from the body.
fn measured(sheet: &TriMesh, share: f32, gap: impl Fn(Vec3) -> f32) -> MeasuredStrain {
    let scaled = |scale: f32| sheet.vertices.iter().map(|v| *v * scale).collect::<Vec<_>>();
    let frames = [1.0 - share, 1.0 + share].map(scaled);
    let frames: Vec<&[Vec3]> = frames.iter().map(Vec::as_slice).collect();
    MeasuredStrain::of_frames(sheet, &ProjectionConfig::default(), &frames, 0.5, |ends| {
        ends.iter().map(|&v| gap(sheet.vertices[v as usize])).collect()
    })
}

#[test]
fn chords_may_become_much_longer_than_in_training_and_long_ones_shorter() {
    let rest = sheet();
    let limits = measured(&rest, 0.1, |_| 0.0).limits(0.0);
    let (pairs, edges) = (
        limited_pairs(&ProjectionConfig::default(), &rest),
        welded_edges(&rest).len(),
    );
    assert_eq!(limits.len(), pairs.len());
    assert!(pairs.len() > edges);
    let mut counts = [0; 3];
    for (i, ([a, b], limit)) in pairs.into_iter().zip(limits).enumerate() {
        let length = rest.vertices[a as usize].distance(rest.vertices[b as usize]);
        // The lengths deviate by a tenth.
        let [shortest, longest] = match i < edges {
            true => [1.0 - 0.05, 1.0 + 0.05],
            false if length > LONGEST_CHORD_M => [0.0, 1.1 * CHORD_STRETCH],
            false => [1.0 - 0.1 * MOST_CHORD_DEVIATIONS, 1.1 * CHORD_STRETCH],
        };
        counts[usize::from(i >= edges) + usize::from(length > LONGEST_CHORD_M)] += 1;
        assert!(
            (limit.shortest / length - shortest).abs() < 1e-4,
            "{i}: {limit:?}"
        );
        assert!((limit.longest / length - longest).abs() < 1e-4, "{i}: {limit:?}");
    }
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
}

#[test]
fn chords_of_cloth_that_hangs_free_alone_follow_the_setting() {
    let rest = sheet();
    // On the body to the left, half free in the middle, free to the right.
    let gap = |v: Vec3| match v.x {
        x if x < 0.1 => 0.01,
        x if x < 0.2 => 0.03,
        _ => 0.05,
    };
    let strain = measured(&rest, 0.1, gap);
    assert!(strain.hangs_free());
    let (wide, narrow) = (strain.limits(MOST_CHORD_DEVIATIONS), strain.limits(0.5));
    assert_eq!(wide, measured(&rest, 0.1, |_| 0.0).limits(0.5));
    let (mut counts, edges) = ([0; 3], welded_edges(&rest).len());
    let pairs = limited_pairs(&ProjectionConfig::default(), &rest);
    for (i, ([a, b], (wide, narrow))) in pairs.into_iter().zip(wide.iter().zip(narrow)).enumerate() {
        let [a, b] = [a, b].map(|v| rest.vertices[v as usize]);
        let length = a.distance(b);
        // The nearer end decides.
        let share = match gap(a).min(gap(b)) {
            _ if i < edges || length > LONGEST_CHORD_M => 0.0,
            gap if gap < 0.02 => 0.0,
            gap if gap < 0.04 => 0.5,
            _ => 1.0,
        };
        counts[(2.0 * share) as usize] += 1;
        // A tenth is three quarters taut.
        let raised = 0.1 * length * 0.75 * share * (MOST_CHORD_DEVIATIONS - 0.5);
        assert!(
            (narrow.shortest - wide.shortest - raised).abs() < 1e-5,
            "{i}: {narrow:?}"
        );
        assert_eq!(narrow.longest, wide.longest);
    }
    assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
}

#[test]
fn chords_of_cloth_that_folds_keep_their_range() {
    let rest = sheet();
    for (share, taut) in [(0.07, true), (0.17, false)] {
        let strain = measured(&rest, share, |_| 1.0);
        assert_eq!(strain.hangs_free(), taut);
        let longer = zip(strain.limits(0.0), strain.limits(MOST_CHORD_DEVIATIONS))
            .filter(|(tight, wide)| tight.shortest > wide.shortest);
        assert_eq!(longer.count() > 0, taut);
    }
}
