//! The system's allocator, counting what each thread allocates and holds.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

struct Counting;

#[global_allocator]
static ALLOCATOR: Counting = Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    /// Bytes that the thread holds, less those that it has freed for others.
    static HELD: Cell<i64> = const { Cell::new(0) };
    static MOST_HELD: Cell<i64> = const { Cell::new(0) };
}

fn count(layout: Layout) {
    ALLOCATIONS.set(ALLOCATIONS.get() + 1);
    hold(layout.size().cast_signed());
}

fn hold(bytes: isize) {
    let held = HELD.get() + bytes as i64;
    HELD.set(held);
    MOST_HELD.set(MOST_HELD.get().max(held));
}

// SAFETY: hands every call on to `System` unchanged. The counters are constant-initialised cells
// without a destructor, so touching them neither allocates nor fails.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count(layout);
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count(layout);
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        hold(-layout.size().cast_signed());
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.dealloc(block, layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        // Large blocks grow where they are.
        hold(size.cast_signed() - layout.size().cast_signed());
        // SAFETY: the caller's promises are those of `System`.
        unsafe { System.realloc(block, layout, size) }
    }
}

/// The number of allocations in `action`.
#[allow(dead_code)] // not by fuzz targets
pub(crate) fn allocations(action: impl FnOnce()) -> u64 {
    let before = ALLOCATIONS.get();
    action();
    ALLOCATIONS.get() - before
}

/// The most bytes that `action` holds at one time.
pub(crate) fn most_held(action: impl FnOnce()) -> u64 {
    let before = HELD.get();
    MOST_HELD.set(before);
    action();
    u64::try_from(MOST_HELD.get() - before).unwrap_or(0)
}
