//! Cache of the fold tests of one pose.

use std::sync::atomic::{AtomicU8, Ordering};

const UNKNOWN: u8 = 0;
const OPEN: u8 = 1;
const FOLDED: u8 = 2;

/// Cache of whether body vertices lie in folds, for each contact class of garment vertices.
///
/// The first thread that needs an answer computes it. Two threads may compute the same one at once,
/// which does no harm: the result depends on the pose alone.
#[derive(Debug, Default)]
pub(super) struct FoldCache {
    vertices: usize,
    /// One of the constants above for each class and vertex.
    states: Vec<AtomicU8>,
}

impl FoldCache {
    pub(super) fn new(classes: usize, vertices: usize) -> Self {
        Self {
            vertices,
            states: (0..classes * vertices).map(|_| AtomicU8::new(UNKNOWN)).collect(),
        }
    }

    /// Forgets all answers; call it for every new pose.
    pub(super) fn clear(&mut self) {
        self.states
            .iter_mut()
            .for_each(|state| *state.get_mut() = UNKNOWN);
    }

    /// Returns the cached answer, or computes and stores it.
    pub(super) fn is_folded(&self, class: usize, vertex: u32, compute: impl FnOnce() -> bool) -> bool {
        let state = &self.states[class * self.vertices + vertex as usize];
        // Relaxed: nothing but the value itself passes between threads.
        match state.load(Ordering::Relaxed) {
            UNKNOWN => {
                let is_folded = compute();
                state.store(if is_folded { FOLDED } else { OPEN }, Ordering::Relaxed);
                is_folded
            }
            known => known == FOLDED,
        }
    }
}

impl Clone for FoldCache {
    /// Returns an empty cache of the same size.
    fn clone(&self) -> Self {
        Self::new(self.states.len() / self.vertices.max(1), self.vertices)
    }
}
