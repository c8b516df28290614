//! A session allocates nothing once it exists: neither on the calling thread nor on its own.
#![allow(unsafe_code, reason = "a global allocator that counts")]

mod common;

use aonet::net::cpu::{Options, Precision, Session};
use aonet::net::{Features, KernelWeights, Ranges};
use aonet::search::{self, Classic};
use aonet::{AoImage, BentNormals, Margin, Size};
use common::{frame, model, params, small};
use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

struct Counting;

static ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call goes to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

/// How many allocations `work` makes, on all threads.
fn allocations(work: impl FnOnce()) -> usize {
    let before = ALLOCATIONS.load(Ordering::Relaxed);
    work();
    ALLOCATIONS.load(Ordering::Relaxed) - before
}

fn classic_methods() {
    let gbuffer = frame(Size::px(50, 30), 4);
    let mut image = AoImage::open(gbuffer.size());
    for (method, threads) in Classic::all().into_iter().flat_map(|method| [(method, 1), (method, 3)]) {
        let options = search::Options { threads, ..search::Options::default() };
        let mut session = search::Session::new(&method, gbuffer.size(), options).unwrap();
        let count = allocations(|| {
            for _ in 0..200 {
                session.run(&gbuffer, params(), &mut image).unwrap();
            }
        });
        assert_eq!(count, 0, "{}, {threads} threads", method.name());
        if method.has_bent_normals() {
            let mut session = search::Session::with_bent_normals(&method, gbuffer.size(), options).unwrap();
            let mut bent = BentNormals::zeros(gbuffer.size());
            let count = allocations(|| {
                for _ in 0..200 {
                    session.run_with_bent_normals(&gbuffer, params(), &mut image, &mut bent).unwrap();
                }
            });
            assert_eq!(count, 0, "bent normals, {}, {threads} threads", method.name());
        }
    }
}

fn main() {
    assert!(allocations(|| drop(std::hint::black_box(vec![1u8; 10]))) > 0, "the counter counts");
    classic_methods();
    for kernel in [KernelWeights::Off, KernelWeights::Linear, KernelWeights::Softmax] {
        for (patch, features) in
            [(1, Features::normal_depth_normalized()), (4, Features::normal_radius_horizon())]
        {
            let model = model(small(features, patch, kernel), 3);
            let gbuffer = frame(Size::px(50, 30), 4);
            let mut image = AoImage::open(Size::px(50, 30));
            let mut ranges = Ranges::new();
            let mut session = Session::new(&model, aonet::Size::px(50, 30), 1).unwrap();
            session.calibrate(&gbuffer, params(), &mut image, &mut ranges).unwrap();
            let model = model.with_ranges(ranges).unwrap();
            for (threads, precision) in
                [1, 3].into_iter().flat_map(|n| Precision::available().map(move |p| (n, p)))
            {
                let options = Options { threads, precision, ..Options::default() };
                let mut session = Session::with_options(&model, Size::px(50, 30), options).unwrap();
                let margin = Margin { x: 8, y: 5 };
                let guarded = gbuffer.clone().with_margin(margin).unwrap();
                let mut picture = AoImage::open(guarded.window().size());
                let mut behind = Session::with_options(&model, guarded.window(), options).unwrap();
                // Far more runs than a queue of jobs that grows block by block would hide.
                let count = allocations(|| {
                    for _ in 0..200 {
                        session.run(&gbuffer, params(), &mut image).unwrap();
                        behind.run(&guarded, params(), &mut picture).unwrap();
                    }
                });
                assert_eq!(count, 0, "{kernel:?}, patches of {patch}, {precision}, {threads} threads");
            }
        }
    }
}
