//! Motion that trials leave out.

use crate::batch::Stretch;
use unic_eval::PreparedClip;

/// Folds that the motions are dealt to: each leaves out about a third.
const FOLDS: usize = 3;

/// Number of motions that are judged at least, where there are so many. Fewer folds than
/// [`FOLDS`] reach it on captures with many clips.
const JUDGED_MOTIONS: usize = 6;

/// Pieces that a lone clip is cut into. The prior's coefficients of a piece are predicted without
/// it.
pub(crate) const PIECES: usize = 4;

/// Motion that a trial trains on, and motion that it is judged on.
pub(super) struct Fold {
    pub(super) train: Vec<Stretch>,
    pub(super) held_out: Vec<NumberedStretch>,
}

/// Held-out stretch with the number of its motion. A motion in several winds has one number.
#[derive(Clone, Debug)]
pub(super) struct NumberedStretch {
    pub(super) motion: usize,
    pub(super) stretch: Stretch,
}

impl std::ops::Deref for NumberedStretch {
    type Target = Stretch;

    fn deref(&self) -> &Stretch {
        &self.stretch
    }
}

/// Deals motions to folds. Empty where no motion can be left out.
pub(super) fn folds(clips: &[PreparedClip]) -> Vec<Fold> {
    let stretches = stretches(clips);
    let motions = 1 + stretches.iter().map(|s| s.motion).max().unwrap_or(0);
    if motions < 2 {
        return Vec::new();
    }
    let count = FOLDS.min(motions);
    let of_fold = |fold: usize| {
        let (held_out, train): (Vec<_>, Vec<_>) =
            stretches.iter().cloned().partition(|s| s.motion % count == fold);
        Fold {
            train: train.into_iter().map(|s| s.stretch).collect(),
            held_out,
        }
    };
    let judged = |fold: usize| (0..motions).filter(|motion| motion % count == fold).count();
    let mut enough = 0;
    let folds = (0..count).take_while(|&fold| {
        let is_wanted = enough < JUDGED_MOTIONS;
        enough += judged(fold);
        is_wanted
    });
    folds.map(of_fold).collect()
}

/// Number of folds of a sizing on these clips, 0 where no motion can be left out.
pub(crate) fn fold_count(clips: &[PreparedClip]) -> usize {
    folds(clips).len()
}

/// Stretches of all clips that hold a pair of frames at least.
fn stretches(clips: &[PreparedClip]) -> Vec<NumberedStretch> {
    let whole = |(clip, motion): (usize, usize)| NumberedStretch {
        motion,
        stretch: Stretch {
            clip,
            frames: 0..clips[clip].len(),
        },
    };
    let stretches: Vec<NumberedStretch> = match clips {
        [clip] => pieces(clip.len()),
        _ => unic_eval::motion_numbers(clips)
            .into_iter()
            .enumerate()
            .map(whole)
            .collect(),
    };
    stretches.into_iter().filter(|s| s.frames.len() > 1).collect()
}

fn pieces(frames: usize) -> Vec<NumberedStretch> {
    let most = frames.div_ceil(PIECES).max(1);
    let piece = |(motion, start): (usize, usize)| NumberedStretch {
        motion,
        stretch: Stretch {
            clip: 0,
            frames: start..frames.min(start + most),
        },
    };
    (0..frames).step_by(most).enumerate().map(piece).collect()
}
