//! The steps of the reduced model allocate nothing.

#![allow(unsafe_code, reason = "a counting allocator")]
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
};

use granchain::{model, scene};

struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: everything is handed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        // SAFETY: as our caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, place: *mut u8, layout: Layout) {
        // SAFETY: as our caller promises.
        unsafe { System.dealloc(place, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn a_run_twice_as_long_allocates_as_often() {
    for (name, more) in [("rigid", "alpha=1"), ("annulus", "alpha=2"), ("annulus", "chain.precompression=0.05 N")] {
        let count = |duration: &str| {
            let base = ["model.kind=reduced", "model.mesh_density=6", duration, more].map(str::to_owned);
            let scene = scene::load(name, &base).unwrap();
            let prepared = model::prepare(&scene).unwrap();
            let before = COUNT.with(Cell::get);
            let response = prepared.run(&scene, &mut |_| true).unwrap();
            (COUNT.with(Cell::get) - before, response.work.steps)
        };
        let (short, long) = (count("duration=30 us"), count("duration=60 us"));
        assert_eq!((short.0, 2 * short.1), (long.0, long.1), "{name} {more}: {short:?} {long:?}");
    }
}
