//! Compares what a C program got from the library with what the crate's own sessions compute for the same frame, bit by bit.
//! The files are those of `tests/equality.c`.

use aonet::frame::ClipDepth;
use aonet::net::cpu::{self, Precision};
use aonet::net::{Model, shipped};
use aonet::search::{self, Classic};
use aonet::{AoImage, AoParams, Camera, GBuffer, Margin, SecondLayer, Size, Window};

/// A file that is read from its beginning.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn bytes<const N: usize>(&mut self) -> [u8; N] {
        let (first, rest) = self.0.split_first_chunk().expect("a longer file");
        self.0 = rest;
        *first
    }

    fn whole(&mut self) -> usize {
        u32::from_le_bytes(self.bytes()) as usize
    }

    fn float(&mut self) -> f32 {
        f32::from_le_bytes(self.bytes())
    }

    fn floats(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.float()).collect()
    }
}

fn name(bytes: [u8; 32]) -> String {
    String::from_utf8(bytes.into_iter().take_while(|b| *b != 0).collect()).expect("a name")
}

fn session_run(
    method: &str,
    precision: Precision,
    gbuffer: &GBuffer,
    params: AoParams,
) -> aonet::Result<AoImage> {
    let window = gbuffer.window();
    let mut image = AoImage::open(window.size());
    match shipped::ALL.into_iter().find(|(name, _)| *name == method) {
        Some((_, bytes)) => {
            let options = cpu::Options { precision, ..cpu::Options::default() };
            let mut session = cpu::Session::with_options(&Model::from_bytes(bytes)?, window, options)?;
            session.run(gbuffer, params, &mut image)?;
        }
        None => {
            let options = search::Options::default();
            let mut session = search::Session::new(&Classic::named(method)?, window, options)?;
            session.run(gbuffer, params, &mut image)?;
        }
    }
    Ok(image)
}

/// The number of pixels that differ, of how many.
fn compare(bytes: &[u8]) -> aonet::Result<(usize, usize)> {
    let mut file = Reader(bytes);
    let method = name(file.bytes());
    let [width, height, x, y, precision, has_matrix, has_second] = std::array::from_fn(|_| file.whole());
    let window = Window::new(Size::new(width, height)?, Margin { x, y })?;
    let (fov_y, params) = (file.float(), AoParams::new(file.float())?);
    let matrix = file.floats(16);
    let camera = match has_matrix {
        0 => Camera::perspective(fov_y, window.size())?,
        _ => {
            let columns = std::array::from_fn(|c| std::array::from_fn(|r| matrix[4 * c + r]));
            Camera::from_clip_from_view(columns, ClipDepth::ZeroToOne, window.size())?
        }
    };
    let pixels = window.buffer_size().pixels();
    let (depth, normal, second) = (file.floats(pixels), file.floats(3 * pixels), file.floats(pixels));
    let found = file.floats(window.size().pixels());
    let normal = normal.as_chunks().0;
    let mut gbuffer = GBuffer::new(camera.with_margin(window.margin())?, &depth[..], normal)?
        .with_margin(window.margin())?;
    if has_second != 0 {
        gbuffer = gbuffer.with_second(SecondLayer { depth: second.into(), normal: None })?;
    }
    let precision = if precision == 1 { Precision::fastest() } else { Precision::F32 };
    let expected = session_run(&method, precision, &gbuffer, params)?;
    assert!(file.0.is_empty(), "a file of another length");
    let differs = |(a, b): &(&f32, &f32)| a.to_bits() != b.to_bits();
    let different = found.iter().zip(expected.visibility()).filter(differs).count();
    Ok((different, found.len()))
}

fn main() -> std::process::ExitCode {
    let mut is_equal = std::env::args().len() > 1;
    for path in std::env::args().skip(1) {
        let bytes = std::fs::read(&path).expect("a file of tests/equality.c");
        let (different, pixels) = compare(&bytes).expect("a frame of tests/equality.c");
        println!("{path}: {different} of {pixels} pixels differ");
        is_equal &= different == 0;
    }
    if is_equal { std::process::ExitCode::SUCCESS } else { std::process::ExitCode::FAILURE }
}
