//! What has been found out about folds in one pose.

use std::sync::atomic::{AtomicU8, Ordering};

const UNKNOWN: u8 = 0;
const OPEN: u8 = 1;
const FOLDED: u8 = 2;

/// Whether body vertices lie in folds, for each of several kinds of onlooker. Whoever asks first finds
/// out; all threads would find the same.
#[derive(Debug, Default)]
pub(super) struct FoldMemory {
    vertices: usize,
    /// By kind and vertex.
    known: Vec<AtomicU8>,
}

impl FoldMemory {
    pub(super) fn new(kinds: usize, vertices: usize) -> Self {
        Self {
            vertices,
            known: (0..kinds * vertices).map(|_| AtomicU8::new(UNKNOWN)).collect(),
        }
    }

    /// For another pose.
    pub(super) fn forget(&mut self) {
        self.known.iter_mut().for_each(|known| *known.get_mut() = UNKNOWN);
    }

    pub(super) fn is_folded(&self, kind: usize, vertex: u32, find_out: impl FnOnce() -> bool) -> bool {
        let known = &self.known[kind * self.vertices + vertex as usize];
        match known.load(Ordering::Relaxed) {
            UNKNOWN => {
                let is_folded = find_out();
                known.store(if is_folded { FOLDED } else { OPEN }, Ordering::Relaxed);
                is_folded
            }
            known => known == FOLDED,
        }
    }
}

impl Clone for FoldMemory {
    /// Knows nothing.
    fn clone(&self) -> Self {
        Self::new(self.known.len() / self.vertices.max(1), self.vertices)
    }
}
