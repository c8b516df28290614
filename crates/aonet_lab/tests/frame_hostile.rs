//! Damaged and hostile frame files: an error each, no panic, no memory that the file's length does not justify.

use aonet_lab::frame::{Frame, FrameHints};
use aonet_scene::View;
use exr::prelude::*;
use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Cursor;
use std::sync::atomic::{AtomicUsize, Ordering};

/// The largest single allocation since [`LARGEST`] was last cleared.
struct Watched;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

#[allow(unsafe_code, reason = "an allocator that records sizes and otherwise is the system's")]
// SAFETY: every call is handed to `System` unchanged.
unsafe impl GlobalAlloc for Watched {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }
    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        LARGEST.fetch_max(size, Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Watched = Watched;

const SIZE: (usize, usize) = (19, 37);

fn hints() -> FrameHints {
    let json = r#"{"eye":[0,0,3],"target":[0,0,0],"width":19,"height":37,"radius":0.7}"#;
    FrameHints { view: Some(serde_json::from_str::<View>(json).unwrap()), ..FrameHints::default() }
}

fn samples(n: usize, half: bool) -> FlatSamples {
    let values = (0..SIZE.0 * SIZE.1).map(move |i| match n {
        0 => 2.0 + (i as f32 * 0.7).sin(),
        3 => 1.0,
        _ => 0.0,
    });
    match half {
        true => FlatSamples::F16(values.map(f16::from_f32).collect()),
        false => FlatSamples::F32(values.collect()),
    }
}

fn file(compression: Compression, blocks: Blocks, half: bool) -> Vec<u8> {
    let names = ["depth", "normal.X", "normal.Y", "normal.Z"];
    let list = names.iter().enumerate().map(|(n, name)| AnyChannel::new(*name, samples(n, half))).collect();
    let encoding = Encoding { compression, blocks, line_order: LineOrder::Increasing };
    let layer = Layer::new(SIZE, LayerAttributes::default(), encoding, AnyChannels::sort(list));
    let mut bytes = Cursor::new(Vec::new());
    Image::from_layer(layer).write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn files() -> Vec<Vec<u8>> {
    use Compression::{B44, B44A, DWAA, DWAB, PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    let mut files = Vec::new();
    for compression in [Uncompressed, RLE, ZIP1, ZIP16, PIZ, PXR24, B44, B44A, DWAA(None), DWAB(None)] {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 16))] {
            files.extend([false, true].map(|half| file(compression, blocks, half)));
        }
    }
    files
}

/// Loads, and checks the largest allocation against what DEFLATE could justify, floats made of halves, and the
/// room that the padding of a small data window may take.
fn load(bytes: &[u8]) -> aonet::Result<Frame> {
    LARGEST.store(0, Ordering::Relaxed);
    let frame = Frame::from_bytes(bytes, &hints());
    let (largest, limit) = (LARGEST.load(Ordering::Relaxed), 2200 * bytes.len() + (16 << 20));
    assert!(largest <= limit, "{largest} bytes allocated for {}", bytes.len());
    frame
}

#[test]
fn whole_files_load_and_truncated_ones_do_not() {
    for bytes in files() {
        assert!(load(&bytes).is_ok());
        let step = (bytes.len() / 150).max(1);
        for end in (0..bytes.len()).step_by(step).chain([bytes.len() - 1]) {
            assert!(load(&bytes[..end]).is_err(), "{end} of {}", bytes.len());
        }
    }
}

#[test]
fn mutated_files_do_not_panic_or_overallocate() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut random = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state % below as u64) as usize
    };
    let files = files();
    let rounds = std::env::var("AONET_FUZZ_ROUNDS").ok().and_then(|n| n.parse().ok()).unwrap_or(40);
    for bytes in files.iter().cycle().take(rounds * files.len()) {
        let mut bytes = bytes.clone();
        for _ in 0..1 + random(4) {
            let reach = if random(2) == 0 { bytes.len() } else { 420.min(bytes.len()) };
            let at = random(reach);
            match random(4) {
                0 => bytes[at] ^= 1 << random(8),
                1 => bytes[at] = [0, 1, 0x7f, 0x80, 0xff][random(5)],
                2 => bytes[at] = random(256) as u8,
                _ => bytes.iter_mut().skip(at).take(4).for_each(|b| *b = 0xff),
            }
        }
        let _ = load(&bytes);
    }
}

/// Overwrites the 16 bytes of a window attribute.
fn with_window(mut bytes: Vec<u8>, name: &[u8], window: [i32; 4]) -> Vec<u8> {
    let at = bytes.windows(name.len()).position(|w| w == name).unwrap() + name.len() + b"\0box2i\0".len() + 4;
    bytes[at..at + 16].copy_from_slice(&window.map(i32::to_le_bytes).concat());
    bytes
}

#[test]
fn absurd_sizes_are_refused() {
    for bytes in files() {
        for [width, height] in
            [[0, 0], [i32::MAX, i32::MAX], [30_000, 30_000], [i32::MAX, 36], [18, i32::MAX]]
        {
            for name in [b"dataWindow".as_slice(), b"displayWindow"] {
                let window = [0, 0, width, height];
                assert!(load(&with_window(bytes.clone(), name, window)).is_err(), "{window:?}");
            }
            let both = with_window(bytes.clone(), b"dataWindow", [0, 0, width, height]);
            assert!(load(&with_window(both, b"displayWindow", [0, 0, width, height])).is_err());
        }
        for window in [[5, 5, 4, 4], [i32::MIN, 0, i32::MAX, 5], [i32::MIN, i32::MIN, i32::MIN, i32::MIN]] {
            assert!(load(&with_window(bytes.clone(), b"displayWindow", window)).is_err(), "{window:?}");
            assert!(load(&with_window(bytes.clone(), b"dataWindow", window)).is_err(), "{window:?}");
        }
    }
}

#[test]
fn deep_data_and_other_files_are_refused() {
    let mut deep = file(Compression::ZIP1, Blocks::ScanLines, false);
    deep[5] |= 0x08;
    assert!(load(&deep).is_err());
    for bytes in [&b""[..], b"v/1\x01", b"\x89PNG\r\n\x1a\n", &[0; 4096]] {
        let message = load(bytes).unwrap_err().to_string();
        assert!(message.contains("OpenEXR"), "{message}");
    }
}
