//! Loops over all vertices, tile by tile, on all threads.

use crate::{
    network::TILE,
    parallel::{for_each, for_each_chunk, thread_count},
};

/// Calls `task` for every [`TILE`] of items, on all threads; `task` gets the index of the first
/// one.
pub(super) fn for_each_tile<T: Send>(items: &mut [T], task: impl Fn(usize, &mut [T]) + Sync + Send) {
    for_each_chunk(items, TILE, task);
}

/// Calls `task` like [`for_each_tile`], with a scratch buffer for each call.
///
/// A run of neighbouring tiles shares one of `buffers`. The caller keeps them, so that later calls
/// allocate nothing.
pub(super) fn for_each_tile_with<T: Send, B: Send + Default>(
    items: &mut [T],
    buffers: &mut Vec<B>,
    task: impl Fn(usize, &mut [T], &mut B) + Sync + Send,
) {
    let tiles = items.len().div_ceil(TILE);
    let run_len = tiles.div_ceil(RUNS_PER_THREAD * thread_count()).max(1) * TILE;
    // Allocates when the number of runs grows, in practice in the first call.
    buffers.resize_with(items.len().div_ceil(run_len), B::default);
    let runs = items.chunks_mut(run_len).zip(buffers).enumerate();
    for_each(runs, |(i, (items, buffer))| {
        for (k, tile) in items.chunks_mut(TILE).enumerate() {
            task(i * run_len + k * TILE, tile, buffer);
        }
    });
}

/// Runs of tiles for each thread. Several, because threads are not equally fast; few, because each
/// has a buffer.
const RUNS_PER_THREAD: usize = 4;
