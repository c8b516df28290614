//! Sessions that come and go leave no memory behind. One test alone, as the allocator counts the whole program.
#![allow(unsafe_code, reason = "a global allocator that counts")]

mod common;

use aonet::net::cpu::Session;
use aonet::net::{Features, KernelWeights};
use aonet::search::{self, Classic};
use aonet::{AoImage, Size};
use common::{frame, model, params, small};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

struct Counting;

static LIVE_BYTES: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE_BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        LIVE_BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// New sessions for frames of changing sizes.
fn frames(count: usize) {
    let model = model(small(Features::normal_radius_horizon(), 4, KernelWeights::Off), 1);
    let methods = Classic::all();
    for i in 0..count {
        let gbuffer = frame(Size::px(1 + i % 23, 1 + i % 17), i as u64);
        let mut image = AoImage::open(gbuffer.size());
        Session::new(&model, gbuffer.size(), 1 + i % 2).unwrap().run(&gbuffer, params(), &mut image).unwrap();
        let options = search::Options { threads: 1 + i % 2, ..search::Options::default() };
        let mut session = search::Session::new(&methods[i % methods.len()], gbuffer.size(), options).unwrap();
        session.run(&gbuffer, params(), &mut image).unwrap();
    }
}

/// Bytes that live after some frames and no longer before them.
fn growth(count: usize) -> usize {
    frames(100);
    let before = LIVE_BYTES.load(Ordering::Relaxed);
    frames(count);
    LIVE_BYTES.load(Ordering::Relaxed).saturating_sub(before)
}

/// What the standard library may keep for threads that have just ended.
const SLACK_BYTES: usize = 4096;

fn check(count: usize) {
    let found = growth(count);
    assert!(found <= SLACK_BYTES, "{found} bytes more after {count} frames");
}

#[test]
fn some_thousand_frames() {
    check(2_000);
}

#[test]
#[ignore = "takes minutes; run it alone"]
fn many_frames() {
    check(100_000);
}
