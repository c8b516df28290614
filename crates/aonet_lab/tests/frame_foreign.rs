//! Frame files as other programs lay them out.

use aonet::{Camera, GBuffer};
use aonet_lab::frame::{Frame, FrameHints, NormalSpace};
use aonet_scene::View;
use exr::image::write::layers::WritableLayers;
use exr::prelude::*;
use glam::{Vec3, Vec3A};
use half::f16;
use std::io::Cursor;

const SIZE: (usize, usize) = (37, 23);
const BACKGROUND: usize = 5;

fn view() -> View {
    let json =
        r#"{"eye":[0.3,1.1,3],"target":[0.1,0.2,-0.4],"fov_y_deg":47,"width":37,"height":23,"radius":0.7}"#;
    serde_json::from_str(json).unwrap()
}

fn hints() -> FrameHints {
    FrameHints { view: Some(view()), ..FrameHints::default() }
}

/// Depth and bumpy view-space normals; every [`BACKGROUND`]-th pixel is background.
fn pixels(camera: &Camera) -> (Vec<f32>, Vec<[f32; 3]>) {
    let pixel = |i: usize| {
        if i.is_multiple_of(BACKGROUND) {
            return (f32::INFINITY, [0.0; 3]);
        }
        let to_viewer = camera.to_viewer(camera.position_view(i % camera.width(), i / camera.width(), 1.0));
        let bump = 0.4 * Vec3A::new((i as f32 * 0.1).sin(), (i as f32 * 0.23).cos(), 0.0);
        (2.0 + (i as f32 * 0.37).sin(), (to_viewer + bump).normalize().to_array())
    };
    (0..camera.width() * camera.height()).map(pixel).unzip()
}

fn direct() -> GBuffer<'static> {
    let camera = view().camera().unwrap();
    let (depth, normal) = pixels(&camera);
    GBuffer::new(camera, depth, normal).unwrap()
}

fn channel(name: &str, samples: impl Into<Vec<f32>>) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F32(samples.into()))
}

fn halves(name: &str, samples: Vec<f32>) -> AnyChannel<FlatSamples> {
    AnyChannel::new(name, FlatSamples::F16(samples.into_iter().map(f16::from_f32).collect()))
}

fn vector(names: [&str; 3], vectors: &[[f32; 3]]) -> Vec<AnyChannel<FlatSamples>> {
    let axis = |(c, name): (usize, &&str)| channel(name, vectors.iter().map(|v| v[c]).collect::<Vec<_>>());
    names.iter().enumerate().map(axis).collect()
}

fn bytes<'a, L: WritableLayers<'a> + 'a>(image: &'a Image<L>) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

fn file(channels: Vec<AnyChannel<FlatSamples>>) -> Vec<u8> {
    bytes(&Image::from_channels(SIZE, AnyChannels::sort(channels.into_iter().collect())))
}

/// View space to Blender's world: +Z up, where glTF has +Y.
fn to_blender(camera: &Camera, n: [f32; 3]) -> [f32; 3] {
    let world_from_view = camera.view_from_world().matrix3.transpose();
    let [x, y, z] = (world_from_view * Vec3A::from(n)).to_array();
    [x, -z, y]
}

/// What Blender 4.5 writes with the passes Combined, Depth, Normal and Mist on; `depth` is the name of the depth.
fn blender(layer: &str, depth_name: &str) -> Vec<AnyChannel<FlatSamples>> {
    let camera = view().camera().unwrap();
    let (depth, normal) = pixels(&camera);
    let normal: Vec<_> = normal.into_iter().map(|n| to_blender(&camera, n)).collect();
    let depth: Vec<_> = depth.into_iter().map(|d| if d.is_finite() { d } else { 1e10 }).collect();
    let mut channels = vec![channel(&format!("{layer}.{depth_name}"), depth)];
    for other in ["Combined.R", "Combined.G", "Combined.B", "Combined.A", "Mist.Z"] {
        channels.push(channel(&format!("{layer}.{other}"), vec![0.25; normal.len()]));
    }
    let names = ["X", "Y", "Z"].map(|axis| format!("{layer}.Normal.{axis}"));
    channels.extend(vector([&names[0], &names[1], &names[2]], &normal));
    channels
}

fn assert_same(found: &GBuffer, tolerance: f32) {
    let expected = direct();
    assert_eq!(found.camera(), expected.camera());
    let worst = |a: &[f32], b: &[f32]| {
        let apart = |(a, b): (&f32, &f32)| if a == b { 0.0 } else { (a - b).abs() };
        a.iter().zip(b).map(apart).fold(0.0, f32::max)
    };
    let depth = worst(found.depth(), expected.depth());
    let normal = worst(found.normal().as_flattened(), expected.normal().as_flattened());
    assert!(depth <= tolerance && normal <= tolerance, "depth {depth}, normal {normal}");
}

fn error(channels: Vec<AnyChannel<FlatSamples>>) -> String {
    Frame::from_bytes(&file(channels), &hints()).unwrap_err().to_string()
}

#[test]
fn blender_layouts_are_the_same_frame() {
    for layer in ["ViewLayer", "View Layer", "RenderLayer", "ViewLayer.001"] {
        for depth in ["Depth.Z", "Depth.V", "Depth.Depth"] {
            let frame = Frame::from_bytes(&file(blender(layer, depth)), &hints()).unwrap();
            assert_same(&frame.gbuffer, 1e-6);
            assert_eq!((frame.radius, frame.ao), (Some(0.7), None));
        }
    }
}

#[test]
fn world_normals_ask_for_a_view() {
    let hints = FrameHints { fov_y_deg: Some(47.0), ..FrameHints::default() };
    let file = file(blender("ViewLayer", "Depth.Z"));
    let message = Frame::from_bytes(&file, &hints).unwrap_err().to_string();
    assert!(message.contains("a view") && message.contains("world"), "{message}");
}

#[test]
fn averaged_normals_of_blender_are_brought_back_to_unit_length() {
    let mut channels = blender("L", "Depth.Z");
    for channel in channels.iter_mut().filter(|c| c.name.to_string().contains("Normal")) {
        let FlatSamples::F32(samples) = &mut channel.sample_data else { unreachable!() };
        samples.iter_mut().enumerate().for_each(|(i, v)| *v *= 0.3 + 0.1 * (i % 7) as f32);
    }
    assert_same(&Frame::from_bytes(&file(channels), &hints()).unwrap().gbuffer, 1e-6);
}

/// The camera of [`view`] as our script for Blender writes it into the note of a render.
fn note() -> String {
    let camera = view().camera().unwrap();
    let list = |numbers: &[f32]| serde_json::to_string(numbers).unwrap();
    format!(
        r#"aonet:camera {{"view_from_world":{},"fov_y":0.8,"ortho_height":null,"near":0,"focal_px":{},"centre_px":{},"radius":0.7}}"#,
        list(&camera.view_from_world().to_cols_array()),
        list(&camera.focal_px()),
        list(&camera.centre_px())
    )
}

#[test]
fn a_note_of_blender_may_hold_the_camera() {
    let with = |note: String| {
        let mut parts = parts(false);
        let note = AttributeValue::Text(Text::from(note.as_str()));
        parts[0].attributes.other.insert(Text::from("Note"), note);
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(SIZE));
        bytes(&Image { attributes, layer_data: parts.into_iter().collect::<Layers<_>>() })
    };
    let frame = Frame::from_bytes(&with(note()), &FrameHints::default()).unwrap();
    assert_same(&frame.gbuffer, 1e-6);
    assert_eq!((frame.radius, frame.view), (Some(0.7), None));
    let message = Frame::from_bytes(&with(note().replace("near", "far")), &FrameHints::default());
    let message = message.unwrap_err().to_string();
    assert!(message.contains("aonet:camera") && message.contains("near"), "{message}");
    let other = Frame::from_bytes(&with("rainy, 3 pm".to_owned()), &FrameHints::default());
    assert!(other.unwrap_err().to_string().contains("a view or a vertical field of view"));
}

/// A part for each pass, as Blender 5 has it; `short` leaves the part's name out of the channels' names.
fn parts(short: bool) -> Vec<Layer<AnyChannels<FlatSamples>>> {
    let mut layers: Vec<Layer<AnyChannels<FlatSamples>>> = Vec::new();
    for channel in blender("ViewLayer", "Depth.Z") {
        let name = channel.name.to_string();
        let (part, axis) = name.rsplit_once('.').unwrap();
        let channel = AnyChannel { name: Text::from(if short { axis } else { name.as_str() }), ..channel };
        match layers.iter_mut().find(|l| l.attributes.layer_name == Some(Text::from(part))) {
            Some(layer) => {
                layer.channel_data.list.push(channel);
                layer.channel_data.list.sort_by_key(|c| c.name.to_string());
            }
            None => {
                let channels = AnyChannels::sort([channel].into_iter().collect());
                layers.push(Layer::new(
                    SIZE,
                    LayerAttributes::named(part),
                    Encoding::SMALL_LOSSLESS,
                    channels,
                ));
            }
        }
    }
    layers
}

#[test]
fn parts_of_a_multi_part_file_are_layers() {
    for short in [true, false] {
        let attributes = ImageAttributes::new(IntegerBounds::from_dimensions(SIZE));
        let file = bytes(&Image { attributes, layer_data: parts(short).into_iter().collect::<Layers<_>>() });
        assert_same(&Frame::from_bytes(&file, &hints()).unwrap().gbuffer, 1e-6);
    }
}

#[test]
fn names_of_engines_are_known() {
    let (depth, normal) = pixels(direct().camera());
    for (normals, depth_name) in [
        (["N.X", "N.Y", "N.Z"], "Z"),
        (["normals.R", "normals.G", "normals.B"], "depth.R"),
        (["Normal.x", "Normal.y", "Normal.z"], "Depth"),
        (["normal.X", "normal.Y", "normal.Z"], "depth.Y"),
    ] {
        let mut channels = vector(normals, &normal);
        channels.push(channel(depth_name, depth.clone()));
        channels.push(channel("ao", vec![0.5; depth.len()]));
        let frame = Frame::from_bytes(&file(channels), &hints()).unwrap();
        assert_same(&frame.gbuffer, 1e-6);
        let expected = depth.iter().map(|d| if d.is_finite() { 0.5 } else { 1.0 });
        assert!(frame.ao.unwrap().visibility().iter().copied().eq(expected));
    }
}

#[test]
fn world_normals_of_gltf_are_taken_when_said_so() {
    let camera = *direct().camera();
    let (depth, normal) = pixels(&camera);
    let world_from_view = camera.view_from_world().matrix3.transpose();
    let world: Vec<_> = normal.iter().map(|n| (world_from_view * Vec3A::from(*n)).to_array()).collect();
    let mut channels = vector(["N.X", "N.Y", "N.Z"], &world);
    channels.push(channel("Z", depth));
    let file = file(channels);
    let hints = FrameHints { normals: Some(NormalSpace::World), ..hints() };
    assert_same(&Frame::from_bytes(&file, &hints).unwrap().gbuffer, 1e-6);
}

#[test]
fn missing_channels_are_listed_with_those_there() {
    let (depth, normal) = pixels(direct().camera());
    let message = error(vec![channel("Z", depth), channel("N.X", vec![0.0; normal.len()])]);
    assert!(message.contains("normal.X") && message.contains("N.X, Z"), "{message}");
    let message = error(vector(["N.X", "N.Y", "N.Z"], &normal));
    assert!(message.contains("depth") && message.contains("N.X, N.Y, N.Z"), "{message}");
    let many = (0..500).map(|i| channel(&format!("c{i}"), vec![0.0; normal.len()])).collect();
    assert!(error(many).len() < 1000);
}

#[test]
fn background_has_many_forms() {
    let (depth, normal) = pixels(direct().camera());
    let background = |i: usize| i.is_multiple_of(BACKGROUND);
    let depths = |value: f32| depth.iter().map(move |d| if d.is_finite() { *d } else { value });
    let rest = |depth: AnyChannel<FlatSamples>, normal: &[[f32; 3]]| {
        let mut channels = vector(["N.X", "N.Y", "N.Z"], normal);
        channels.push(depth);
        channels
    };
    let up = [0.0, 0.0, 1.0];
    let filled: Vec<_> = (0..normal.len()).map(|i| if background(i) { up } else { normal[i] }).collect();
    let load = |channels| Frame::from_bytes(&file(channels), &hints()).unwrap().gbuffer;
    assert_same(&load(rest(channel("Z", depth.clone()), &filled)), 1e-6);
    assert_same(&load(rest(channel("Z", depths(1e9).collect::<Vec<_>>()), &filled)), 1e-6);
    assert_same(&load(rest(halves("Z", depths(65504.0).collect()), &filled)), 1e-2);
    for hidden in [1.0, 0.0, -1.0, f32::NAN] {
        assert_same(&load(rest(channel("Z", depths(hidden).collect::<Vec<_>>()), &normal)), 1e-6);
        let mask: Vec<_> = (0..normal.len()).map(|i| f32::from(u8::from(!background(i)))).collect();
        let mut masked = rest(channel("Z", depths(hidden).collect::<Vec<_>>()), &filled);
        masked.push(channel("mask", mask));
        assert_same(&load(masked), 1e-6);
    }
    let far = depths(65504.0).collect::<Vec<_>>();
    assert_eq!(load(rest(channel("Z", far), &filled)).depth()[0], 65504.0, "no background in 32 bits");
}

#[test]
fn impossible_pixels_are_named() {
    let (depth, normal) = pixels(direct().camera());
    let at = 2 * SIZE.0 + 3;
    for bad in [f32::NAN, 0.0, -1.0] {
        let mut depth = depth.clone();
        depth[at] = bad;
        let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
        channels.push(channel("Z", depth));
        let message = error(channels);
        assert!(message.contains("depth at (3, 2)"), "{message}");
    }
    for bad in [[f32::NAN, 0.0, 1.0], [0.0, 0.0, 3.0], [0.0, 0.1, 0.1]] {
        let mut normal = normal.clone();
        normal[at] = bad;
        let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
        channels.push(channel("Z", depth.clone()));
        let message = error(channels);
        assert!(message.contains("normal at (3, 2)"), "{message}");
    }
    let colours: Vec<_> = normal.iter().map(|n| n.map(|c| 0.5 * c + 0.5)).collect();
    let mut channels = vector(["N.X", "N.Y", "N.Z"], &colours);
    channels.push(channel("Z", depth));
    let message = error(channels);
    assert!(message.contains("n * 0.5 + 0.5"), "{message}");
}

#[test]
fn every_lossless_encoding_is_read() {
    let expected = Vec3::from(direct().normal()[1]);
    assert!(expected.is_normalized());
    let compressions = [
        Compression::Uncompressed,
        Compression::RLE,
        Compression::ZIP1,
        Compression::ZIP16,
        Compression::PIZ,
    ];
    for compression in compressions {
        for blocks in [Blocks::ScanLines, Blocks::Tiles(Vec2(16, 8)), Blocks::Tiles(Vec2(64, 64))] {
            for line_order in [LineOrder::Increasing, LineOrder::Decreasing] {
                let encoding = Encoding { compression, blocks, line_order };
                let channels = AnyChannels::sort(blender("L", "Depth.Z").into_iter().collect());
                let layer = Layer::new(SIZE, LayerAttributes::default(), encoding, channels);
                let file = bytes(&Image::from_layer(layer));
                assert_same(&Frame::from_bytes(&file, &hints()).unwrap().gbuffer, 1e-6);
            }
        }
    }
}

/// The data window of `direct`, seen through a display window that is moved by `shift` and of size `display`.
fn through_window(shift: (i32, i32), display: (usize, usize)) -> Frame {
    let channels = AnyChannels::sort(blender("L", "Depth.Z").into_iter().collect());
    let attributes = LayerAttributes { layer_position: Vec2(7, -9), ..LayerAttributes::default() };
    let mut image = Image::from_layer(Layer::new(SIZE, attributes, Encoding::SMALL_LOSSLESS, channels));
    let corner = Vec2(7 + shift.0, -9 + shift.1);
    image.attributes.display_window = IntegerBounds::new(corner, display);
    // Parallel rays: whether a normal faces the viewer does not depend on the window.
    let view = View { width: display.0, height: display.1, ortho_height: Some(1.0), ..view() };
    Frame::from_bytes(&bytes(&image), &FrameHints { view: Some(view), ..FrameHints::default() }).unwrap()
}

#[test]
fn the_display_window_crops_and_pads() {
    let expected = direct();
    for (shift, display) in [((0, 0), SIZE), ((4, 3), (20, 11)), ((-6, -5), (60, 40)), ((30, -4), (50, 10))] {
        let gbuffer = through_window(shift, display).gbuffer;
        let (size, margin) = (gbuffer.window().size(), gbuffer.window().margin());
        assert_eq!((size.width(), size.height()), display);
        // What is there on both sides is a guard band.
        let around =
            |shift: i32, data: usize, display: usize| shift.min(data as i32 - shift - display as i32).max(0);
        let found = (margin.x as i32, margin.y as i32);
        assert_eq!(found, (around(shift.0, SIZE.0, display.0), around(shift.1, SIZE.1, display.1)));
        for (i, depth) in gbuffer.depth().iter().enumerate() {
            let (x, y) = ((i % gbuffer.width()) as i32, (i / gbuffer.width()) as i32);
            let (x, y) = (x + shift.0 - found.0, y + shift.1 - found.1);
            let inside = (0..SIZE.0 as i32).contains(&x) && (0..SIZE.1 as i32).contains(&y);
            let stored =
                if inside { expected.depth()[x as usize + y as usize * SIZE.0] } else { f32::INFINITY };
            assert_eq!(*depth, stored, "at ({x}, {y}) of {shift:?}");
        }
    }
    let outside = through_window((100, 0), (8, 8)).gbuffer;
    assert!((0..64).all(|i| !outside.is_foreground(i)));
}

#[test]
fn a_nan_in_the_guard_band_alone_is_refused() {
    let (mut depth, normal) = pixels(direct().camera());
    let load = |depth: &[f32]| {
        let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
        channels.push(channel("Z", depth));
        let mut image = Image::from_channels(SIZE, AnyChannels::sort(channels.into_iter().collect()));
        image.attributes.display_window = IntegerBounds::new(Vec2(4, 3), (SIZE.0 - 8, SIZE.1 - 6));
        let (width, height) = (SIZE.0 - 8, SIZE.1 - 6);
        let view = View { width, height, ortho_height: Some(1.0), ..view() };
        Frame::from_bytes(&bytes(&image), &FrameHints { view: Some(view), ..FrameHints::default() })
    };
    let window = load(&depth).unwrap().gbuffer.window();
    assert_eq!((window.margin().x, window.margin().y), (4, 3));
    depth[2 * SIZE.0 + 3] = f32::NAN;
    let message = load(&depth).unwrap_err().to_string();
    assert!(message.contains("depth at (3, 2)") && message.contains("NaN"), "{message}");
}

#[test]
fn a_second_layer_in_front_of_the_first_is_refused() {
    let (depth, normal) = pixels(direct().camera());
    let with = |second: Vec<f32>| {
        let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
        channels.extend([channel("Z", depth.clone()), channel("second.depth", second)]);
        Frame::from_bytes(&file(channels), &hints())
    };
    let behind: Vec<f32> = depth.iter().map(|d| d + 0.5).collect();
    assert!(with(behind.clone()).unwrap().gbuffer.second().is_some());
    for bad in [0.1, f32::NAN, -1.0] {
        let mut second = behind.clone();
        second[2 * SIZE.0 + 3] = bad;
        let message = with(second).unwrap_err().to_string();
        assert!(message.contains("second depth at (3, 2)"), "{message}");
    }
}

#[test]
fn integers_and_subsampling_are_refused() {
    let (_, normal) = pixels(direct().camera());
    let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
    channels.push(AnyChannel::new("Z", FlatSamples::U32(vec![1; normal.len()])));
    let message = error(channels);
    assert!(message.contains('Z') && message.contains("integers"), "{message}");
    // `xSampling` and `ySampling` follow the name, the type and four reserved bytes of a channel.
    let (depth, normal) = pixels(direct().camera());
    let mut channels = vector(["N.X", "N.Y", "N.Z"], &normal);
    channels.push(channel("Zed", vec![0.0; depth.len()]));
    channels.push(channel("Z", depth));
    let mut bytes = file(channels);
    let at = bytes.windows(4).position(|w| w == b"Zed\0").unwrap() + 4 + 8;
    assert_eq!(bytes[at..at + 8], [1, 0, 0, 0, 1, 0, 0, 0]);
    bytes[at] = 37;
    let message = Frame::from_bytes(&bytes, &hints()).unwrap_err().to_string();
    assert!(message.contains("subsampling"), "{message}");
}

/// A frame with a second file that has these channels.
fn with_second(
    first: Vec<AnyChannel<FlatSamples>>,
    second: Vec<AnyChannel<FlatSamples>>,
    hints: &FrameHints,
) -> std::result::Result<Frame, String> {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = [("first.exr", first), ("second.exr", second)].map(|(name, channels)| {
        let path = folder.path().join(name);
        std::fs::write(&path, file(channels)).unwrap();
        path
    });
    Frame::load_with_second(&a, &b, hints).map_err(|error| error.to_string())
}

#[test]
fn second_files_may_be_blenders_or_depth_alone() {
    let first = || blender("View Layer", "Depth.Z");
    let camera = view().camera().unwrap();
    let (depth, normal) = pixels(&camera);
    let same = with_second(first(), first(), &hints()).unwrap().gbuffer;
    let second = same.second().unwrap();
    assert_eq!(second.depth, same.depth());
    for (found, expected) in second.normal.as_ref().unwrap().iter().zip(&normal) {
        assert!(Vec3::from(*found).distance(Vec3::from(*expected)) < 1e-5, "{found:?} {expected:?}");
    }
    // 1e10 is Blender's background.
    let behind: Vec<f32> =
        depth.iter().enumerate().map(|(i, d)| if i % 3 == 0 { 1e10 } else { d + 1.0 }).collect();
    let alone = with_second(first(), vec![channel("Z", behind)], &hints()).unwrap().gbuffer;
    let second = alone.second().unwrap();
    assert!(second.normal.is_none());
    for (i, (found, first)) in second.depth.iter().zip(&depth).enumerate() {
        let expected = if i % 3 == 0 { f32::INFINITY } else { first + 1.0 };
        assert_eq!(*found, expected, "{i}");
    }
}

#[test]
fn second_files_without_sense_are_refused() {
    let first = || blender("View Layer", "Depth.Z");
    let camera = view().camera().unwrap();
    let (depth, normal) = pixels(&camera);
    let mut torn = depth.clone();
    torn[38] = f32::NAN;
    let colours: Vec<_> = normal.iter().map(|n| n.map(|c| 0.5 * c + 0.5)).collect();
    let names = ["normal.X", "normal.Y", "normal.Z"];
    let with_colours = [vec![channel("depth", depth.clone())], vector(names, &colours)].concat();
    for (channels, word) in [
        (vec![channel("Z", torn)], "second depth at (1, 1)"),
        (vec![channel("height", depth.clone())], "height"),
        (vec![channel("Z", vec![0.0; depth.len()])], "at least the first depth"),
        (with_colours, "colours"),
    ] {
        let message = with_second(first(), channels, &hints()).unwrap_err();
        assert!(message.contains(word) && message.contains("second.exr"), "{word}: {message}");
    }
    // Without a view the frame is in view space, and normals in world space cannot be turned.
    let in_view_space = [vec![channel("depth", depth)], vector(names, &normal)].concat();
    let no_view = FrameHints { fov_y_deg: Some(47.0), ..FrameHints::default() };
    let message = with_second(in_view_space, first(), &no_view).unwrap_err();
    assert!(message.contains("world space") && message.contains("second.exr"), "{message}");
}
