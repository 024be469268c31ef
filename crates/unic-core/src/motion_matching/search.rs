//! Search: the frame whose features are closest to a query.

use super::{database::Database, index::SearchScratch};
use std::ops::Range;

/// Query of a search.
#[derive(Clone, Debug)]
pub struct Query<'a> {
    /// Normalised features.
    pub features: &'a [f32],
    /// Tags of the frames that are searched.
    pub tags: TagFilter,
    /// Frames that are left out, such as those around the present pose.
    pub window: Range<usize>,
    /// Frame that plays now and may go on; none where it ends. The tags hold for it too.
    pub continuing: Option<Continuing>,
}

/// Frame that plays now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Continuing {
    /// Its index.
    pub frame: usize,
    /// Amount by which another frame's cost must be lower.
    pub bias: f32,
}

/// Condition on the tags of a frame, as bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct TagFilter {
    /// Tags that a frame must have.
    pub required: u32,
    /// Tags that a frame must not have.
    pub excluded: u32,
}

impl TagFilter {
    /// Returns whether a frame with these tags is searched.
    pub fn accepts(self, tags: u32) -> bool {
        tags & self.required == self.required && tags & self.excluded == 0
    }
}

/// Frame that a search has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Match {
    /// Its index.
    pub frame: usize,
    /// Sum of squared feature differences; of the continuing frame, less the bias.
    pub cost: f32,
}

impl Database {
    /// Finds the frame with the lowest cost; of several, that with the lowest index. The continuing
    /// frame is kept unless another one is better.
    ///
    /// The result has the same bits as that of [`Database::search_naive`], on every machine.
    /// Returns none if the filter accepts no frame and none continues.
    ///
    /// # Panics
    /// When the query has another number of features.
    pub fn search(&self, query: &Query, scratch: &mut SearchScratch) -> Option<Match> {
        assert_eq!(
            query.features.len(),
            self.index.dimensions(),
            "features of the query"
        );
        let filter = FrameFilter::new(self, query);
        let best = self.start(query);
        self.index.search(query.features, &filter, best, scratch).found()
    }

    /// Finds the same frame as [`Database::search`] by comparing all of them one by one.
    ///
    /// # Panics
    /// When the query has another number of features.
    pub fn search_naive(&self, query: &Query) -> Option<Match> {
        assert_eq!(
            query.features.len(),
            self.index.dimensions(),
            "features of the query"
        );
        let mut best = self.start(query);
        for frame in 0..self.index.frames() {
            let is_outside = !query.window.contains(&frame);
            if is_outside && self.index.is_searchable(frame) && query.tags.accepts(self.frames.tags[frame]) {
                let cost = self.index.distance(frame, query.features);
                if cost < best.cost {
                    best = Candidate::frame(frame, cost);
                }
            }
        }
        best.found()
    }

    /// Returns whether a search with these tags finds a frame.
    pub(super) fn has_searchable(&self, tags: TagFilter) -> bool {
        (0..self.len()).any(|frame| self.index.is_searchable(frame) && tags.accepts(self.tags(frame)))
    }

    /// Candidate before any comparison: the continuing frame.
    fn start(&self, query: &Query) -> Candidate {
        match query.continuing {
            Some(Continuing { frame, bias }) if query.tags.accepts(self.tags(frame)) => Candidate {
                cost: self.index.distance(frame, query.features) - bias,
                rank: 0,
                frame,
            },
            _ => Candidate::NONE,
        }
    }
}

/// Best frame so far. Equal costs are ordered by rank: the continuing frame, then frames by index.
#[derive(Clone, Copy, Debug)]
pub(super) struct Candidate {
    pub(super) cost: f32,
    rank: usize,
    frame: usize,
}

impl Candidate {
    /// No frame, worse than all others.
    const NONE: Self = Self {
        cost: f32::INFINITY,
        rank: 0,
        frame: usize::MAX,
    };

    #[inline(always)]
    pub(super) fn frame(frame: usize, cost: f32) -> Self {
        Self {
            cost,
            rank: frame + 1,
            frame,
        }
    }

    #[inline(always)]
    pub(super) fn is_better(&self, other: &Self) -> bool {
        self.cost < other.cost || (self.cost == other.cost && self.rank < other.rank)
    }

    fn found(self) -> Option<Match> {
        (self.frame != usize::MAX).then_some(Match {
            frame: self.frame,
            cost: self.cost,
        })
    }
}

/// Condition on single frames.
pub(super) struct FrameFilter<'a> {
    tags: TagFilter,
    window: Range<usize>,
    frame_tags: &'a [u32],
}

impl<'a> FrameFilter<'a> {
    fn new(database: &'a Database, query: &Query) -> Self {
        Self {
            tags: query.tags,
            window: query.window.clone(),
            frame_tags: &database.frames.tags,
        }
    }

    #[inline(always)]
    pub(super) fn accepts(&self, frame: usize) -> bool {
        !self.window.contains(&frame) && self.tags.accepts(self.frame_tags[frame])
    }
}
