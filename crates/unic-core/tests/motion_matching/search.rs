//! The fast search against the naive one.

use crate::common::{build, figure, figure_settings, human_database, winding};
use proptest::prelude::*;
use unic_core::motion_matching::{Continuing, Database, Query, SearchScratch, TagFilter, TaggedClip};

fn assert_same(database: &Database, query: &Query) {
    let found = database.search(query, &mut SearchScratch::default());
    assert_eq!(found, database.search_naive(query));
}

/// A small database in which every clip is there twice, so that every cost is there twice.
fn doubled(lengths: &[usize], seed: f32) -> Database {
    let clips: Vec<_> = lengths
        .iter()
        .enumerate()
        .map(|(i, n)| winding(*n, seed + i as f32))
        .collect();
    let tagged: Vec<TaggedClip> = (clips.iter().chain(&clips).enumerate())
        .map(|(i, clip)| TaggedClip::whole(clip, ["even", "odd"][i % 2]))
        .collect();
    Database::build(&figure(), &tagged, figure_settings()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn fast_and_naive_search_find_the_same_frame(
        lengths in prop::collection::vec(4usize..150, 1..5),
        seed in 0.0f32..6.0,
        frame in any::<prop::sample::Index>(),
        playing in any::<prop::sample::Index>(),
        noise in prop_oneof![Just(0.0f32), 0.0f32..3.0],
        bias in prop_oneof![Just(0.0f32), 0.0f32..2.0],
        required in 0u32..3,
        continues in any::<bool>(),
    ) {
        let database = doubled(&lengths, seed);
        let frame = frame.index(database.len());
        let playing = playing.index(database.len());
        let features: Vec<f32> = (database.features(frame).enumerate())
            .map(|(i, x)| x + noise * (i as f32 * 1.7 + seed).sin())
            .collect();
        assert_same(&database, &Query {
            features: &features,
            tags: TagFilter { required, excluded: 0 },
            window: playing.saturating_sub(5)..playing + 5,
            continuing: continues.then_some(Continuing { frame: playing, bias }),
        });
    }
}

#[test]
fn ties_go_to_the_lowest_index() {
    let database = doubled(&[40, 60], 0.4);
    for frame in [3, 50, 110, 180] {
        let features: Vec<f32> = database.features(frame).collect();
        let query = Query {
            features: &features,
            tags: TagFilter::default(),
            window: 0..0,
            continuing: None,
        };
        let found = database.search(&query, &mut SearchScratch::default()).unwrap();
        assert_eq!((found.frame, found.cost), (frame % 100, 0.0));
    }
}

#[test]
fn the_continuing_frame_is_kept_unless_another_is_better_by_the_bias() {
    let database = build(&figure(), &[winding(200, 0.4)], figure_settings());
    let features: Vec<f32> = database.features(20).collect();
    let search = |bias| {
        let query = Query {
            features: &features,
            tags: TagFilter::default(),
            window: 0..0,
            continuing: Some(Continuing { frame: 150, bias }),
        };
        database.search(&query, &mut SearchScratch::default()).unwrap()
    };
    assert_eq!(search(0.0).frame, 20);
    assert_eq!(search(1e6).frame, 150);
}

/// The tags of a query, clip ends and the window leave frames out.
#[test]
fn left_out_frames_are_not_found() {
    let database = doubled(&[40, 60], 0.4);
    let find = |frame: usize, tags: TagFilter, window| {
        let features: Vec<f32> = database.features(frame).collect();
        let query = Query {
            features: &features,
            tags,
            window,
            continuing: None,
        };
        assert_same(&database, &query);
        database
            .search(&query, &mut SearchScratch::default())
            .map(|found| found.frame)
    };
    let odd = TagFilter {
        required: database.tag_bit("odd").unwrap(),
        excluded: 0,
    };
    assert!(!(0..40).contains(&find(20, odd, 0..0).unwrap()));
    assert_eq!(find(20, TagFilter::default(), 0..40), Some(120));
    // The last three frames of a clip: the margin is a tenth of a second.
    assert_ne!(find(38, TagFilter::default(), 0..0), Some(38));
    assert_eq!(
        find(
            20,
            TagFilter {
                required: 4,
                excluded: 0
            },
            0..0
        ),
        None
    );
}

#[test]
fn searches_of_captured_size_agree() {
    let database = human_database();
    for frame in (0..database.len()).step_by(997) {
        let features: Vec<f32> = (database.features(frame).enumerate())
            .map(|(i, x)| x + 0.4 * (i as f32 + frame as f32).sin())
            .collect();
        assert_same(
            &database,
            &Query {
                features: &features,
                tags: TagFilter::default(),
                window: frame.saturating_sub(10)..frame + 10,
                continuing: Some(Continuing { frame, bias: 0.2 }),
            },
        );
    }
}
