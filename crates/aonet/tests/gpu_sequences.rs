//! Sessions on a device, called in any order with any numbers: every call returns, images lie in [0, 1], and wgpu has
//! nothing to report that a session did not.
//!
//! A thousand sequences take minutes: `cargo test --release -p aonet --features gpu --test gpu_sequences -- --ignored`.

mod common;
#[path = "common/device.rs"]
mod device;

use aonet::gpu::{
    BoundFrame, DepthEncoding, Describe, Device, FrameNumbers, FrameViews, Kernels, Layers, NormalEncoding,
    NormalSpace, Options, Precision, Session, wgpu,
};
use aonet::net::{Features, KernelWeights, Model};
use aonet::search::Classic;
use aonet::{AoParams, Camera, Size, net, search};
use common::{Random, model, small, weighing_shares};
use device::{device, read_texels, texture};
use std::sync::{Arc, Mutex};
use wgpu::{TextureFormat as Format, TextureUsages as Usages, TextureView};

const FORMATS: [Format; 8] = [
    Format::R8Unorm,
    Format::R16Float,
    Format::R32Float,
    Format::Rgba8Unorm,
    Format::Rgba16Float,
    Format::Rgba32Float,
    Format::R32Uint,
    Format::Depth32Float,
];
const USAGES: [Usages; 3] = [
    Usages::TEXTURE_BINDING.union(Usages::COPY_DST),
    Usages::RENDER_ATTACHMENT.union(Usages::COPY_SRC),
    Usages::COPY_SRC.union(Usages::COPY_DST),
];

/// How often something happened.
#[derive(Debug, Default)]
struct Counts {
    calls: usize,
    errors: usize,
    images: usize,
}

struct Sequence<'a> {
    device: &'a Device,
    random: Random,
    counts: &'a mut Counts,
}

impl Sequence<'_> {
    fn chance(&mut self, share: f32) -> bool {
        self.random.unit() < share
    }

    fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[((self.random.unit() * all.len() as f32) as usize).min(all.len() - 1)]
    }

    /// Of a few sizes, so that two often agree.
    fn size(&mut self) -> Size {
        let [width, height] = [(); 2].map(|()| self.one_of(&[1, 8, 17, 40]));
        Size::px(width, height)
    }

    fn options(&mut self) -> Options {
        use NormalEncoding::{Octahedral, OctahedralUnorm, Plain, Unorm};
        Options {
            precision: self.one_of(&[Precision::F32, Precision::F16]),
            kernels: self.one_of(&[Kernels::Plain, Kernels::Subgroups]),
            normals: self.one_of(&[Plain, Unorm, Octahedral, OctahedralUnorm]),
            normal_space: self.one_of(&[NormalSpace::View, NormalSpace::World]),
            depth: self.one_of(&[DepthEncoding::Reversed, DepthEncoding::Standard, DepthEncoding::Linear]),
            layers: self.one_of(&[Layers::One, Layers::Two]),
            output: if self.chance(0.7) { Format::R32Float } else { self.one_of(&FORMATS) },
        }
    }

    fn counted<T>(&mut self, result: aonet::Result<T>) -> Option<T> {
        self.counts.calls += 1;
        self.counts.errors += usize::from(result.is_err());
        result.ok()
    }

    /// A texture that fits a session of this size and format, or often does not.
    fn view(&mut self, size: Size, (format, usage): (Format, Usages)) -> TextureView {
        let fits = !self.chance(0.08);
        let size = if fits || self.chance(0.5) { size } else { self.size() };
        let format = if fits || self.chance(0.5) { format } else { self.one_of(&FORMATS) };
        let usage = if fits { usage } else { self.one_of(&USAGES) };
        texture(self.device, size, format, usage).create_view(&Default::default())
    }

    /// Numbers of a frame that fit a size, or do not.
    fn frame(&mut self, size: Size) -> FrameNumbers {
        let size = if self.chance(0.1) { self.size() } else { size };
        let angle = self.one_of(&[0.001, 0.6, 1.5, 3.1]);
        let radius = self.one_of(&[1e-30, 0.01, 0.5, 1e30]);
        let far = self.one_of(&[f32::INFINITY, 100.0, 1e-20, f32::NAN, -1.0]);
        let camera = Camera::perspective(angle, size).unwrap();
        FrameNumbers { camera, far, params: AoParams::new(radius).unwrap() }
    }

    /// Binds, encodes and submits a frame, and reads it back where all succeeded.
    fn run<M: Describe>(&mut self, session: &Session<M>, options: &Options, old: &mut Option<BoundFrame>) {
        let size = session.size();
        let [normal, depth, second] = [Format::Rgba32Float, Format::R32Float, Format::R32Float]
            .map(|format| self.view(size, (format, USAGES[0])));
        let visibility = self.view(size, (options.output, USAGES[1]));
        let second = (options.layers == Layers::Two || self.chance(0.3)).then_some(&second);
        let views = FrameViews { normal: &normal, depth: &depth, second, visibility: &visibility };
        let Some(bound) = self.counted(session.bind(views)) else { return };
        let mut encoder = self.device.device.create_command_encoder(&Default::default());
        let frame = self.frame(size);
        if let Some(old) = old.as_ref().filter(|_| self.random.unit() < 0.3) {
            let result = session.encode(&mut encoder, old, &frame);
            self.counted(result);
        }
        let result = session.encode(&mut encoder, &bound, &frame);
        *old = Some(bound);
        if self.counted(result).is_some() && options.output == Format::R32Float {
            let texels = read_texels(self.device, encoder, &visibility);
            let value = |texel: &[u8]| f32::from_le_bytes(texel.try_into().unwrap());
            assert!(texels.chunks_exact(4).map(value).all(|v| (0.0..=1.0).contains(&v)), "visibility");
            self.counts.images += 1;
        } else {
            self.device.queue.submit([encoder.finish()]);
        }
    }

    fn drive<M: Describe>(&mut self, session: aonet::Result<Session<M>>, options: &Options) {
        let Some(mut session) = self.counted(session) else { return };
        let mut old = None;
        for _ in 0..6 {
            let size = self.size();
            match self.one_of(&[0, 0, 0, 0, 1, 2]) {
                1 => drop(self.counted(session.resize(size))),
                2 => session = self.counted(session.sibling(size)).unwrap_or(session),
                _ => self.run(&session, options, &mut old),
            }
        }
    }

    fn play(&mut self, networks: &[Model], methods: &[Classic]) {
        let on = (&self.device.device, &self.device.queue);
        let (size, options) = (self.size(), self.options());
        match self.chance(0.5) {
            true => {
                let at = (self.random.unit() * networks.len() as f32) as usize;
                self.drive(net::gpu::Session::new(on, &networks[at], size, options), &options);
            }
            false => {
                let at = (self.random.unit() * methods.len() as f32) as usize;
                self.drive(search::gpu::ClassicSession::new(on, &methods[at], size, options), &options);
            }
        }
    }
}

fn play(count: u64) {
    let Some(mut device) = device() else { return };
    let networks = [
        model(small(Features::normal_projected_radius(), 4, KernelWeights::Linear), 1),
        model(small(Features::normal_radius_horizon(), 2, KernelWeights::Off), 2),
        model(weighing_shares(2), 3),
    ];
    let methods = Classic::all();
    let mut counts = Counts::default();
    let unreported = Arc::new(Mutex::new(Vec::new()));
    for seed in 0..count {
        let heard = Arc::clone(&unreported);
        device
            .device
            .on_uncaptured_error(Arc::new(move |error| heard.lock().unwrap().push(error.to_string())));
        let mut sequence = Sequence { device: &device, random: Random::new(seed), counts: &mut counts };
        sequence.play(&networks, &methods);
        assert!(unreported.lock().unwrap().is_empty(), "sequence {seed}: {:?}", unreported.lock().unwrap());
        if seed % 50 == 49 {
            // A lost device: every call returns, and sessions fail.
            device.device.destroy();
            let options = Options { output: Format::R32Float, ..Options::default() };
            let on = (&device.device, &device.queue);
            assert!(net::gpu::Session::new(on, &networks[0], Size::px(8, 8), options).is_err());
            device = Device::wait_for().unwrap();
        }
    }
    eprintln!("{count} sequences: {counts:?}");
    assert!(counts.images * 3 > counts.calls / 10 && counts.errors * 50 > counts.calls, "{counts:?}");
}

#[test]
fn some_sequences() {
    play(12);
}

#[test]
#[ignore = "takes minutes"]
fn a_thousand_sequences() {
    play(1000);
}
