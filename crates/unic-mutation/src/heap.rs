//! Counting of the memory that a thread holds.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    ptr,
};

/// System allocator that counts the memory of each thread and refuses absurd requests.
///
/// The count of a thread is the memory that it has requested minus the memory that it has freed.
/// Work that a reader leaves to other threads is not counted.
#[derive(Clone, Copy, Debug)]
pub struct CountingAllocator;

/// Largest request that is granted, bytes.
///
/// No reader of a small file needs a gibibyte. Larger requests fail before the machine runs out of
/// memory.
const MOST: usize = 1 << 30;

thread_local! {
    // Signed, because a thread may free memory that another one has requested. Constant initial
    // values need no allocation, which would call the allocator again.
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

/// Starts a measurement and returns the memory that the thread holds now, bytes.
pub(super) fn mark() -> isize {
    let held = HELD.get();
    PEAK.set(held);
    held
}

/// Peak of the memory of the thread since the measurement began, beyond `mark`, bytes.
pub(super) fn peak_since(mark: isize) -> usize {
    usize::try_from(PEAK.get() - mark).unwrap_or(0)
}

/// Counts a request and passes it to the system unless it is absurd.
fn counted(layout: Layout, ask: impl FnOnce() -> *mut u8) -> *mut u8 {
    // A refused request counts in the peak too: it is a fault of the reader.
    let held = HELD.get() + layout.size() as isize;
    PEAK.set(PEAK.get().max(held));
    let pointer = match layout.size() {
        0..=MOST => ask(),
        _ => ptr::null_mut(),
    };
    if !pointer.is_null() {
        HELD.set(held);
    }
    pointer
}

// SAFETY: granted requests are the system allocator's, unchanged; refused ones get null, as the
// trait allows; the counters are cells of the thread that need no allocation of their own.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise about the layout is the system allocator's.
        counted(layout, || unsafe { System.alloc(layout) })
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as for `alloc`.
        counted(layout, || unsafe { System.alloc_zeroed(layout) })
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        HELD.set(HELD.get() - layout.size() as isize);
        // SAFETY: the pointer came from `alloc`, which took it from the system's allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}
