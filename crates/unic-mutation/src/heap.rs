//! How much memory a thread holds.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    ptr,
};

/// The system's allocator, which counts what each thread holds and refuses absurd requests.
///
/// A thread's count is what it has asked for less what it has given back: work that a reader leaves to
/// other threads is not counted.
#[derive(Clone, Copy, Debug)]
pub struct Counting;

/// No reader of a small file asks for a gibibyte: it gets none, before the machine has none left.
const MOST: usize = 1 << 30;

thread_local! {
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

/// Starts a measurement: what the thread holds now, bytes.
pub(super) fn mark() -> isize {
    let held = HELD.get();
    PEAK.set(held);
    held
}

/// Most that the thread has held since, beyond what it held then, bytes.
pub(super) fn peak_since(mark: isize) -> usize {
    usize::try_from(PEAK.get() - mark).unwrap_or(0)
}

/// Counts a request, granted or not, and asks the system for it unless it is absurd.
fn counted(layout: Layout, ask: impl FnOnce() -> *mut u8) -> *mut u8 {
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

// SAFETY: granted requests are the system allocator's, unchanged; refused ones get null, as the trait
// allows; the counters are cells of the thread that need no allocation of their own.
unsafe impl GlobalAlloc for Counting {
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
