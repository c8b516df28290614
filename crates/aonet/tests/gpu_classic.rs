//! Classic methods on the GPU against their CPU twins.

mod common;
#[path = "common/device.rs"]
mod device;

use aonet::gpu::{Device, FrameViews, Layers, Offscreen, Options, wgpu};
use aonet::search::gpu::ClassicSession;
use aonet::search::{ArcsParams, Classic, Share};
use aonet::{AoImage, BentNormals, GBuffer, Margin, Projection, Size, glam};
use common::{
    behind_bars, frame, max_error, mean_error, params, spread, waves, waves_seen_by, waves_through,
    with_noise_behind,
};
use device::{Inputs, OPTIONS, device, inputs, read, read_texels, target, too_large};

/// Mean difference from the CPU's image: a tap between two pixels, or an occluder between two sectors, may fall on either.
/// Measured: 7e-5 on a frame of noise, 3e-5 on waves; of arcs 2e-5 with one layer, 3e-5 with two.
const MEAN_TOLERANCE: f32 = 2e-4;

fn session(device: &Device, method: &Classic, size: Size) -> ClassicSession {
    ClassicSession::new((&device.device, &device.queue), method, size, OPTIONS).unwrap()
}

/// A session that reads the layers that a frame has.
fn session_for(device: &Device, method: &Classic, gbuffer: &GBuffer) -> ClassicSession {
    let layers = if gbuffer.second().is_some() { Layers::Two } else { Layers::One };
    let options = Options { layers, ..OPTIONS };
    ClassicSession::new((&device.device, &device.queue), method, gbuffer.size(), options).unwrap()
}

/// One frame through a session.
fn run(device: &Device, session: &ClassicSession, gbuffer: &GBuffer) -> AoImage {
    let Inputs { normal, depth, second, frame } = inputs(device, gbuffer, params());
    let visibility = target(device, session.size(), OPTIONS.output);
    let view = session
        .bind(FrameViews { normal: &normal, depth: &depth, second: second.as_ref(), visibility: &visibility })
        .unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &view, &frame).unwrap();
    read(device, encoder, &visibility)
}

/// The method with parameters set by name.
fn with(name: &str, settings: &[(&str, f32)]) -> Classic {
    let mut method = Classic::named(name).unwrap();
    settings.iter().for_each(|(name, value)| method.set(name, *value).unwrap());
    method
}

/// Every method, and every branch that a parameter chooses.
fn methods() -> Vec<Classic> {
    vec![
        with("ssao", &[]),
        with("ssao:tuned", &[]),
        with(
            "ssao",
            &[
                ("hemisphere", 0.0),
                ("radius_scale", 0.1),
                ("range", 10.0),
                ("bias", 0.0),
                ("denoise_passes", 0.0),
            ],
        ),
        with("hbao", &[]),
        with("hbao:tuned", &[]),
        with("hbao", &[("attenuation", 0.3), ("strength", 1.5), ("denoise_passes", 0.0)]),
        with("ssdo", &[]),
        with("ssdo:tuned", &[]),
        with("ssdo", &[("depth_limit", 0.4), ("distribution", 2.0), ("denoise_passes", 0.0)]),
        with("gtao", &[]),
        with("gtao:tuned", &[]),
        with("gtao:low", &[("depth_levels", 1.0), ("denoise_passes", 0.0)]),
        with(
            "gtao",
            &[("depth_offset", 0.0), ("thin_occluder", 0.7), ("falloff", 0.0), ("denoise_passes", 2.0)],
        ),
        with("gtao", &[("depth_offset", 1.0), ("depth_levels", 3.0), ("radius_scale", 4.0)]),
        with("vbao", &[]),
        with("vbao:tuned", &[]),
        with("vbao", &[("cosine", 1.0), ("thickness", 0.1), ("denoise_passes", 0.0)]),
        with("agtao", &[]),
        with("agtao:tuned", &[]),
        with("agtao:tuned", &[("follow", 0.1)]),
    ]
    .into_iter()
    .chain(arcs())
    .collect()
}

/// Connected arcs with each preset, without a filter, and with many taps.
fn arcs() -> [Classic; 5] {
    let bare = [("denoise_passes", 0.0)];
    let many = [
        ("slices", 3.0),
        ("steps", 16.0),
        ("distribution", 2.0),
        ("angle_bias", 0.0),
        ("hidden_close", 1.5),
        ("hidden_deep", 0.3),
        ("off", 0.7),
        ("power", 1.5),
        ("between", 1.0),
    ];
    let presets = ["arcs", "arcs:tuned", "arcs:deep"].map(|name| with(name, &[]));
    let [plain, tuned, deep] = presets;
    [plain, tuned, deep, with("arcs", &bare), with("arcs", &many)]
}

#[test]
fn every_method_gives_the_cpus_image() {
    let Some(device) = device() else { return };
    let parallel = waves_through(Projection::Orthographic { height: 4.0 }, Size::px(61, 83));
    let off_centre = waves_seen_by(common::off_centre(Size::px(120, 83)));
    for gbuffer in [
        frame(Size::px(1, 1), 4),
        frame(Size::px(33, 17), 4),
        frame(Size::px(130, 70), 4),
        waves(Size::px(120, 83)),
        parallel,
        off_centre,
    ] {
        let size = gbuffer.size();
        for method in methods() {
            let expected = method.run(&gbuffer, params()).unwrap();
            let found = run(&device, &session(&device, &method, size), &gbuffer);
            let (mean, most) = (mean_error(&found, &expected), max_error(&found, &expected));
            eprintln!("{} at {size:?}: mean {mean:e}, largest {most:e}", method.name());
            if size.width() > 1 {
                assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {size:?}, {method:?}");
            }
            assert!(mean <= MEAN_TOLERANCE, "{size:?}: {mean:e}, {method:?}");
        }
    }
}

#[test]
fn methods_of_two_layers_are_the_cpus() {
    let Some(device) = device() else { return };
    let parallel = waves_through(Projection::Orthographic { height: 4.0 }, Size::px(61, 83));
    let off_centre = waves_seen_by(common::off_centre(Size::px(120, 83)));
    for gbuffer in [
        with_noise_behind(frame(Size::px(1, 1), 4), 5),
        with_noise_behind(frame(Size::px(33, 17), 4), 5),
        with_noise_behind(frame(Size::px(130, 70), 4), 5),
        behind_bars(&waves(Size::px(120, 83))),
        behind_bars(&parallel),
        behind_bars(&off_centre),
    ] {
        let size = gbuffer.size();
        let bitmasks = ["vbao", "vbao:tuned", "vbao:deep"].map(|name| with(name, &[]));
        for method in arcs().into_iter().chain(bitmasks) {
            let expected = method.run(&gbuffer, params()).unwrap();
            let session = session_for(&device, &method, &gbuffer);
            let found = run(&device, &session, &gbuffer);
            let (mean, most) = (mean_error(&found, &expected), max_error(&found, &expected));
            eprintln!("two layers at {size:?}: mean {mean:e}, largest {most:e}");
            assert!(mean <= MEAN_TOLERANCE, "{size:?}: {mean:e}, {method:?}");
            if size.width() > 1 {
                assert!(spread(&expected, &gbuffer) > 0.05, "nothing to see: {size:?}, {method:?}");
                let alone = method.run(&alone(&gbuffer), params()).unwrap();
                let change = mean_error(&found, &alone);
                eprintln!("the second layer changes {change:e}");
                assert!(change > 5.0 * MEAN_TOLERANCE, "{size:?}: {change:e}, {method:?}");
            }
        }
    }
}

/// The first layer of a frame.
fn alone(gbuffer: &GBuffer) -> GBuffer<'static> {
    GBuffer::new(*gbuffer.camera(), gbuffer.depth().to_vec(), gbuffer.normal().to_vec()).unwrap()
}

#[test]
fn sessions_in_memory_read_the_layers_that_they_have() {
    let Some(device) = device() else { return };
    let gbuffer = behind_bars(&waves(Size::px(120, 83)));
    let (method, mut found) = (with("arcs", &[]), AoImage::open(gbuffer.size()));
    for (layers, expected) in [(Layers::One, &alone(&gbuffer)), (Layers::Two, &gbuffer)] {
        let mut session = Offscreen::classic_in_layers(&device, &method, gbuffer.size(), layers).unwrap();
        session.run(&gbuffer, params(), &mut found).unwrap();
        let mean = mean_error(&found, &method.run(expected, params()).unwrap());
        assert!(mean <= MEAN_TOLERANCE, "{layers:?}: {mean:e}");
        let flat = session.run(&alone(&gbuffer), params(), &mut found).map_err(|e| e.to_string());
        assert_eq!(flat.is_err_and(|e| e.contains("layers")), layers == Layers::Two);
    }
}

#[test]
fn a_changed_parameter_is_noticed() {
    let Some(device) = device() else { return };
    // Light passes behind bars.
    let (waves, bars) = (waves(Size::px(120, 83)), alone(&behind_bars(&waves(Size::px(120, 83)))));
    for (name, parameter, value) in [
        ("ssao", "hemisphere", 0.0),
        ("ssao", "range", 0.5),
        ("hbao", "strength", 0.9),
        ("ssdo", "depth_limit", 0.5),
        ("gtao", "falloff", 0.5),
        ("gtao", "depth_levels", 1.0),
        ("gtao", "denoise_passes", 2.0),
        ("gtao", "denoise_keep", 0.2),
        ("vbao", "thickness", 0.5),
        ("vbao", "cosine", 1.0),
        ("agtao", "angle_bias", 6.0),
        ("agtao", "follow", 1.0),
        ("arcs", "hit", 1.3),
        ("arcs", "hidden_close", 0.2),
        ("arcs", "hidden_middle", 1.4),
        ("arcs", "hidden_deep", 0.9),
        ("arcs", "off", 0.8),
        ("arcs", "angle_bias", 6.0),
        ("arcs", "between", 1.0),
    ] {
        let gbuffer = if name == "arcs" || parameter == "follow" { &bars } else { &waves };
        let expected = with(name, &[]).run(gbuffer, params()).unwrap();
        let changed = with(name, &[(parameter, value)]);
        let found = run(&device, &session(&device, &changed, Size::px(120, 83)), gbuffer);
        let mean = mean_error(&found, &expected);
        eprintln!("{name}, {parameter}: {mean:e}");
        assert!(mean > MEAN_TOLERANCE, "{name}, {parameter}: {mean:e}");
    }
}

#[test]
fn a_resized_session_and_a_new_one_agree() {
    let Some(device) = device() else { return };
    let (gbuffer, size) = (frame(Size::px(70, 40), 6), Size::px(70, 40));
    for method in [with("gtao", &[]), with("ssao", &[])] {
        let mut resized = session(&device, &method, Size::px(20, 90));
        resized.resize(size).unwrap();
        assert!(too_large(&device).is_none_or(|size| resized.resize(size).is_err()));
        assert_eq!(resized.size(), size, "an error changes nothing");
        let new = run(&device, &session(&device, &method, size), &gbuffer);
        assert_eq!(run(&device, &resized, &gbuffer), new);
    }
}

#[test]
fn passes_have_names_and_methods_without_shaders_are_errors() {
    let Some(device) = device() else { return };
    let labels = |method: &Classic| {
        session(&device, method, Size::px(20, 10))
            .pass_labels()
            .iter()
            .map(|l| l.to_string())
            .collect::<Vec<_>>()
    };
    assert_eq!(labels(&with("gtao", &[])), ["pyramid", "gtao", "denoise", "image"]);
    assert_eq!(labels(&with("vbao:tuned", &[])), ["vbao", "denoise", "denoise", "denoise", "image"]);
    assert_eq!(labels(&with("arcs", &[])), ["surfels", "arcs", "denoise", "image"]);
    let deep = behind_bars(&waves(Size::px(20, 10)));
    let deep = session_for(&device, &with("arcs", &[]), &deep);
    assert_eq!(deep.pass_labels(), ["surfels", "arcs", "denoise", "image"]);
    let new =
        |method| ClassicSession::new((&device.device, &device.queue), &method, Size::px(20, 10), OPTIONS);
    let error = new(with("nnao", &[])).unwrap_err().to_string();
    assert!(error.contains("agtao or arcs") && error.contains("nnao"), "{error}");
    let Classic::Gtao(mut broken) = with("gtao", &[]) else { panic!("another method") };
    broken.steps = 0;
    assert!(new(Classic::Gtao(broken)).unwrap_err().to_string().contains("steps"));
}

#[test]
fn a_lost_device_is_an_error() {
    let Some(device) = device() else { return };
    let (method, gbuffer) = (with("gtao", &[]), frame(Size::px(20, 10), 1));
    let mut resized = session(&device, &method, Size::px(20, 10));
    let mut offscreen = Offscreen::classic(&device, &method, Size::px(20, 10)).unwrap();
    let mut image = AoImage::open(Size::px(20, 10));
    offscreen.run(&gbuffer, params(), &mut image).unwrap();
    assert!(mean_error(&image, &method.run(&gbuffer, params()).unwrap()) <= MEAN_TOLERANCE);
    device.device.destroy();
    let found = offscreen.run(&gbuffer, params(), &mut image).unwrap_err().to_string();
    assert!(found.contains("device"), "{found}");
    assert!(
        resized.resize(Size::px(30, 10)).is_err()
            && Offscreen::classic(&device, &method, Size::px(20, 10)).is_err()
    );
}

#[test]
fn a_margin_is_cropped() {
    let Some(device) = device() else { return };
    let margin = aonet::Margin { x: 20, y: 13 };
    let guarded = waves_seen_by(common::off_centre(Size::px(120, 83))).with_margin(margin).unwrap();
    let mut found = AoImage::open(guarded.window().size());
    for method in [with("gtao", &[]), with("agtao:tuned", &[])] {
        let expected = method.run(&guarded, params()).unwrap();
        let mut session = Offscreen::classic(&device, &method, guarded.window()).unwrap();
        session.run(&guarded, params(), &mut found).unwrap();
        assert!(spread(&expected, &guarded.without_margin()) > 0.05);
        let mean = mean_error(&found, &expected);
        assert!(mean <= MEAN_TOLERANCE, "{}: {mean:e}", method.name());
    }
    let mut session = Offscreen::classic(&device, &with("gtao", &[]), guarded.size()).unwrap();
    assert!(session.run(&guarded, params(), &mut found).unwrap_err().to_string().contains("margin"));
}

#[test]
fn shares_are_drawn_in_the_colours_of_the_cpus() {
    let Some(device) = device() else { return };
    let bars = behind_bars(&waves(Size::px(75, 41)));
    for gbuffer in [bars.clone().without_second(), bars] {
        let (arcs, size) = (ArcsParams::default(), gbuffer.size());
        let mut session =
            aonet::search::Session::new(&Classic::Arcs(arcs), gbuffer.window(), Default::default()).unwrap();
        let shares = session.shares(&gbuffer, params()).unwrap();
        let layers = if gbuffer.second().is_some() { Layers::Two } else { Layers::One };
        let options = Options { layers, output: wgpu::TextureFormat::Rgba8Unorm, ..OPTIONS };
        let session = ClassicSession::shares((&device.device, &device.queue), &arcs, size, options).unwrap();
        let Inputs { normal, depth, second, frame } = inputs(&device, &gbuffer, params());
        let picture = target(&device, size, options.output);
        let views =
            FrameViews { normal: &normal, depth: &depth, second: second.as_ref(), visibility: &picture };
        let mut encoder = device.device.create_command_encoder(&Default::default());
        session.encode(&mut encoder, &session.bind(views).unwrap(), &frame).unwrap();
        let found = read_texels(&device, encoder, &picture);
        let mixed = |i: usize, c: usize| {
            let of = |share: Share| shares.plane(share)[i] * f32::from(share.colour()[c]);
            Share::ALL.map(of).iter().sum::<f32>()
        };
        let expected = |i: usize| [mixed(i, 0), mixed(i, 1), mixed(i, 2), 255.0];
        let off = found.chunks_exact(4).enumerate().flat_map(|(i, texel)| {
            let expected = expected(i);
            (0..4).map(move |c| (f32::from(texel[c]) - expected[c]).abs())
        });
        let mean = off.sum::<f32>() / found.len() as f32;
        let coloured = found.chunks_exact(4).filter(|texel| texel[0].abs_diff(texel[2]) > 20).count();
        assert!(coloured > size.pixels() / 10, "{coloured} pixels have a colour");
        // Rounding to whole steps alone is a quarter of a step in the mean.
        assert!(mean < 0.5, "{mean} of 255");
    }
}

/// Mean angle from the CPU's bent normals (degrees). Measured: 0.003 on a frame of noise, 0.001 on waves.
const BENT_TOLERANCE: f32 = 0.02;

/// The mean angle between two images of directions (degrees).
fn mean_angle(a: &BentNormals, b: &BentNormals) -> f32 {
    let angle = |(a, b): (&[f32; 3], &[f32; 3])| match (glam::Vec3::from(*a), glam::Vec3::from(*b)) {
        (a, b) if a == b => 0.0,
        (a, b) => a.angle_between(b).to_degrees(),
    };
    a.directions().iter().zip(b.directions()).map(angle).sum::<f32>() / a.directions().len() as f32
}

#[test]
fn bent_normals_are_the_cpus() {
    use aonet::search::{Options, Session};
    let Some(device) = device() else { return };
    let guarded = waves(Size::px(90, 60)).with_margin(Margin { x: 9, y: 7 }).unwrap();
    for gbuffer in [frame(Size::px(130, 70), 4), waves(Size::px(120, 83)), guarded] {
        let window = gbuffer.window();
        for name in ["gtao", "gtao:tuned", "agtao", "agtao:tuned", "arcs", "arcs:tuned"] {
            let method = Classic::named(name).unwrap();
            let (mut image, mut expected) = (AoImage::open(window.size()), BentNormals::zeros(window.size()));
            let mut session = Session::with_bent_normals(&method, window, Options::default()).unwrap();
            session.run_with_bent_normals(&gbuffer, params(), &mut image, &mut expected).unwrap();
            let (mut visibility, mut found) = (image.clone(), BentNormals::zeros(window.size()));
            let mut session =
                Offscreen::classic_with_bent_normals(&device, &method, window, Layers::One).unwrap();
            session.run_with_bent_normals(&gbuffer, params(), &mut visibility, &mut found).unwrap();
            let angle = mean_angle(&found, &expected);
            eprintln!("{name} at {window}: {angle} degrees");
            assert!(angle < BENT_TOLERANCE, "{name}: {angle} degrees");
            assert!(mean_error(&visibility, &image) <= MEAN_TOLERANCE, "{name}");
            // Bent normals are not the normals.
            let mut normals = BentNormals::zeros(window.size());
            window.crop(gbuffer.normal(), normals.directions_mut());
            assert!(mean_angle(&normals, &expected) > 1.0, "{name}: nothing to see");
        }
    }
}

#[test]
fn bent_normals_need_a_texture_of_theirs() {
    let Some(device) = device() else { return };
    let (on, size) = ((&device.device, &device.queue), Size::px(20, 10));
    let method = Classic::named("agtao").unwrap();
    let half = wgpu::TextureFormat::Rgba16Float;
    let session = ClassicSession::with_bent_normals(on, &method, size, OPTIONS, half).unwrap();
    let gbuffer = waves(size);
    let Inputs { normal, depth, frame, .. } = inputs(&device, &gbuffer, params());
    let visibility = target(&device, size, OPTIONS.output);
    let views = FrameViews { normal: &normal, depth: &depth, second: None, visibility: &visibility };
    let error = session.bind(views).unwrap_err().to_string();
    assert!(error.contains("bent normals texture"), "{error}");
    for wrong in
        [target(&device, Size::px(10, 10), half), target(&device, size, wgpu::TextureFormat::Rgba8Unorm)]
    {
        assert!(session.bind_with_bent_normals(views, &wrong).is_err());
    }
    let bent = target(&device, size, half);
    let without = ClassicSession::new(on, &method, size, OPTIONS).unwrap();
    assert!(without.bind_with_bent_normals(views, &bent).is_err());
    let refused = ClassicSession::with_bent_normals(on, &method, size, OPTIONS, OPTIONS.output).unwrap_err();
    assert!(refused.to_string().contains("Rgba16Float"), "{refused}");
    let vbao = Classic::named("vbao").unwrap();
    assert!(ClassicSession::with_bent_normals(on, &vbao, size, OPTIONS, half).is_err());
    // In 8 bits they are n/2 + 1/2.
    let eight = wgpu::TextureFormat::Rgba8Unorm;
    let session = ClassicSession::with_bent_normals(on, &method, size, OPTIONS, eight).unwrap();
    let bent = target(&device, size, eight);
    let view = session.bind_with_bent_normals(views, &bent).unwrap();
    let mut encoder = device.device.create_command_encoder(&Default::default());
    session.encode(&mut encoder, &view, &frame).unwrap();
    assert_eq!(session.pass_labels().last(), Some(&"bent normals"));
    for texel in read_texels(&device, encoder, &bent).chunks_exact(4) {
        let length = texel[..3].iter().map(|b| (f32::from(*b) / 127.5 - 1.0).powi(2)).sum::<f32>().sqrt();
        assert!(texel[3] == 255 && (length - 1.0).abs() < 0.02, "{texel:?}");
    }
}
