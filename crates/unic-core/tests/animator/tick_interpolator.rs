//! Interpolation between ticks: the garment follows the shown pose.

use super::*;

/// The pose of a tick gives the garment of the tick, and a moved pose gives a moved garment.
#[test]
fn the_interpolated_garment_follows_the_shown_pose() {
    let poses = motion(9);
    for variant in variants() {
        let mut animator = Animator::new(model(&variant));
        let mut display = TickInterpolator::default();
        assert!(display.show(&animator, &poses[0], 1.0).is_err());
        animator.reset(&input(&poses, 0), Start::MeanShape).unwrap();
        display.cut(&animator);
        for t in 1..poses.len() {
            let before = animator.garment().positions.to_vec();
            animator.step(&input(&poses, t)).unwrap();
            display.tick(&animator);
            let shown = |d: &mut TickInterpolator, pose: &Pose, share| {
                d.show(&animator, pose, share).unwrap().positions.to_vec()
            };
            let now = shown(&mut display, &poses[t], 1.0);
            assert!(largest_distance(&now, animator.garment().positions) < 1e-5);
            let then = shown(&mut display, &poses[t - 1], 0.0);
            assert!(largest_distance(&then, &before) < 1e-5, "{}", variant.name);
            // The same pose elsewhere.
            let mut aside = poses[t].clone();
            aside.trans.x += 2.0;
            let moved: Vec<Vec3> = now.iter().map(|p| *p + Vec3::X * 2.0).collect();
            assert!(largest_distance(&shown(&mut display, &aside, 1.0), &moved) < 1e-5);
        }
    }
}
