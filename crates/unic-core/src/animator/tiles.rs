//! Work on all vertices, a tile at a time, on all threads.

use crate::{
    network::TILE,
    parallel::{for_each, for_each_chunk, lanes},
};

/// Calls `task` with the index of its first item for every [`TILE`] of items, on all threads.
pub(super) fn for_each_tile<T: Send>(items: &mut [T], task: impl Fn(usize, &mut [T]) + Sync + Send) {
    for_each_chunk(items, TILE, task);
}

/// As [`for_each_tile`], for tasks that need buffers: neighbouring tiles share one of `buffers`,
/// which are kept, so that nothing is allocated once every one of them has been used.
pub(super) fn for_each_tile_with<T: Send, B: Send + Default>(
    items: &mut [T],
    buffers: &mut Vec<B>,
    task: impl Fn(usize, &mut [T], &mut B) + Sync + Send,
) {
    let tiles = items.len().div_ceil(TILE);
    let run = tiles.div_ceil(RUNS * lanes()).max(1) * TILE;
    buffers.resize_with(items.len().div_ceil(run), B::default);
    let runs = items.chunks_mut(run).zip(buffers).enumerate();
    for_each(runs, |(i, (items, buffer))| {
        for (k, tile) in items.chunks_mut(TILE).enumerate() {
            task(i * run + k * TILE, tile, buffer);
        }
    });
}

/// Runs of tiles that share a buffer: a few a thread, because threads are not equally fast.
const RUNS: usize = 4;
