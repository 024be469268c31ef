//! Frames of garment and motion that belong together.

use super::notes::Notes;
use crate::args::ImportArgs;
use anyhow::{Result, bail};
use std::{ops::Range, path::Path};
use unic_io::counted;

/// Frames of the motion and of the garment that make the clip, of equal number.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Alignment {
    pub(super) motion: Range<usize>,
    pub(super) garment: Range<usize>,
    motion_frames: usize,
    garment_frames: usize,
}

impl Alignment {
    /// Takes the part that garment and motion have in common, cut to `--frames`.
    ///
    /// # Errors
    /// Fewer than two frames in common, `--frames` outside of them.
    pub(super) fn new(args: &ImportArgs, garment_frames: usize, motion_frames: usize) -> Result<Self> {
        let common = common(garment_frames, motion_frames, args.offset);
        let path = args.garment.display();
        if common.len() < 2 {
            bail!(
                "{path}: expected at least two frames in common with the motion, found {} of the garment and \
                 {motion_frames} of the motion with --offset {}",
                garment_frames,
                args.offset
            );
        }
        let motion = match args.frames.clone() {
            None => common,
            Some(asked) if asked.start >= common.start && asked.end <= common.end && asked.len() > 1 => asked,
            Some(asked) => bail!(
                "{path}: expected at least two --frames within {}..{}, found {}..{}",
                common.start,
                common.end,
                asked.start,
                asked.end
            ),
        };
        // Both sums are frames of the garment, because `common` holds no others.
        let shifted = |frame: usize| (frame as i64 + args.offset) as usize;
        Ok(Self {
            garment: shifted(motion.start)..shifted(motion.end),
            motion,
            motion_frames,
            garment_frames,
        })
    }

    /// Notes what is left out.
    pub(super) fn describe(&self, path: &Path, notes: &mut Notes) {
        if self.motion.len() == self.motion_frames && self.motion_frames == self.garment_frames {
            return;
        }
        let text = format!(
            "frames {} to {} of {} go with frames {} to {} of {} of the garment; {} imported",
            self.motion.start,
            self.motion.end - 1,
            self.motion_frames,
            self.garment.start,
            self.garment.end - 1,
            self.garment_frames,
            counted(self.motion.len(), "frame"),
        );
        notes.add(path, &text);
    }
}

/// Frames t of the motion for which the garment has a frame t + `offset`.
fn common(garment_frames: usize, motion_frames: usize, offset: i64) -> Range<usize> {
    // Saturating: offsets are what a user types.
    let clamped = |frame: i64| frame.clamp(0, motion_frames as i64) as usize;
    let start = clamped(offset.saturating_neg());
    let end = clamped((garment_frames as i64).saturating_sub(offset));
    start..end.max(start)
}

#[cfg(test)]
mod tests {
    use super::common;

    #[test]
    fn only_frames_of_both_are_common() {
        for (garment, motion, offset, expected) in [
            (10, 10, 0, 0..10),
            (8, 10, 0, 0..8),
            (10, 8, 0, 0..8),
            (15, 10, 5, 0..10),
            (12, 10, 5, 0..7),
            (10, 10, -3, 3..10),
            (4, 10, -3, 3..7),
            (4, 10, 4, 0..0),
            (4, 10, 9, 0..0),
            (4, 10, -12, 10..10),
            (4, 10, i64::MIN, 10..10),
            (4, 10, i64::MAX, 0..0),
        ] {
            assert_eq!(
                common(garment, motion, offset),
                expected,
                "{garment} {motion} {offset}"
            );
        }
    }
}
