//! What a thread asks of the allocator: how often, and how much at once.

#![allow(unsafe_code, reason = "a counting allocator")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

/// Memory (bytes) that reading a record may take however small the file is: what is kept of each of at most a thousand columns.
#[allow(dead_code, reason = "not every user reads records")]
pub const ANY_FILE: usize = 512 << 10;

/// Memory that reading a record may reserve, in sizes of the file. What it touches is less: `tests/reader_memory.rs` holds that at ten.
#[allow(dead_code, reason = "not every user reads records")]
pub const FILES: usize = 16;

/// Memory (bytes) that reading a scene may take however small the file is: `beads = 1000` are three words.
#[allow(dead_code, reason = "not every user reads scenes")]
pub const ANY_SCENE: usize = 2 << 20;

struct Counting;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
    /// Bytes held now, and the most so far. What another thread frees counts there.
    static HELD: Cell<(isize, isize)> = const { Cell::new((0, 0)) };
}

fn add(bytes: usize) {
    let _ = CALLS.try_with(|calls| calls.set(calls.get() + 1));
    let _ = HELD.try_with(|held| {
        let (now, most) = held.get();
        let now = now + bytes.cast_signed();
        held.set((now, most.max(now)));
    });
}

fn subtract(bytes: usize) {
    let _ = HELD.try_with(|held| {
        let (now, most) = held.get();
        held.set((now - bytes.cast_signed(), most));
    });
}

// SAFETY: everything is handed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: as our caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        add(layout.size());
        // SAFETY: as our caller promises.
        unsafe { System.alloc_zeroed(layout) }
    }

    // A vector that grows allocates again as far as these tests are concerned.
    unsafe fn realloc(&self, place: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        subtract(layout.size());
        add(size);
        // SAFETY: as our caller promises.
        unsafe { System.realloc(place, layout, size) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        subtract(layout.size());
        // SAFETY: as our caller promises.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of this thread so far.
#[allow(dead_code, reason = "not every user counts them")]
pub fn calls() -> u64 {
    CALLS.with(Cell::get)
}

/// What a call returns, and the most memory (bytes) this thread held during it beyond what it held before.
#[allow(dead_code, reason = "not every user weighs")]
pub fn peak_of<T>(call: impl FnOnce() -> T) -> (T, usize) {
    let before = HELD.with(|held| {
        let (now, _) = held.get();
        held.set((now, now));
        now
    });
    let value = call();
    (value, (HELD.with(Cell::get).1 - before).max(0).cast_unsigned())
}
