//! Work on slices on all threads, to the same bytes for any number of them.

/// Calls `task` with the index of its first item for every `size` items, on all threads.
pub(crate) fn for_each_chunk<T: Send>(
    items: &mut [T],
    size: usize,
    task: impl Fn(usize, &mut [T]) + Sync + Send,
) {
    #[cfg(feature = "rayon")]
    {
        use rayon::prelude::*;
        let chunks = items.par_chunks_mut(size).enumerate();
        chunks.for_each(|(i, chunk)| task(i * size, chunk));
    }
    #[cfg(not(feature = "rayon"))]
    for (i, chunk) in items.chunks_mut(size).enumerate() {
        task(i * size, chunk);
    }
}
