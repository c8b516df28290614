//! Figures that are pictures: Figs. 5 to 8, on the first test frame of each of a few scenes.

use super::crops::{self, Window};
use super::measure::Measurements;
use super::rows::{AO_NET, HD, short_label};
use super::{Content, Item, Section, Subject, tables};
use crate::dataset::{FrameEntry, Manifest, Split};
use crate::eval::{self, Method};
use crate::picture::{self, Caption};
use aonet::metrics::{self, Scores};
use aonet::{AoImage, AoParams, GBuffer};
use aonet_scene::error::{Error, Result};
use image::{Rgb, RgbImage};
use serde_json::{Map, Value, json};

/// The learned methods of Table 1.
const METHODS: [&str; 4] = ["deep_ao", "deep_shading", AO_NET, "ours"];

/// Grey of a missing network's panel.
const MISSING: [u8; 3] = [90; 3];

/// A test frame.
struct TestFrame {
    entry: FrameEntry,
    gbuffer: GBuffer<'static>,
    params: AoParams,
    reference: AoImage,
}

/// A network's image of a frame.
struct Shot {
    ao: AoImage,
    scores: Scores,
}

type Panel = (RgbImage, Caption);

/// One of the four figures.
pub(super) fn figure(
    item: Item,
    subject: &Subject<'_>,
    measurements: &Measurements,
    progress: &dyn Fn(&str, usize, usize),
) -> Result<Section> {
    let Some(manifest) = subject.manifest else {
        return Err(Error::request(item.name(), "a dataset with test frames", "none"));
    };
    let (keys, count, columns): (&[&str], _, _) = match item {
        Item::Fig5 => (&["base", "base_patch"], 2, 5),
        Item::Fig6 => (&["base_patch", AO_NET], 3, 4),
        _ => (&METHODS, 4, METHODS.len() + 2),
    };
    let chosen = chosen(manifest, count);
    let (mut panels, mut views) = (Vec::new(), Vec::new());
    for (done, entry) in chosen.iter().enumerate() {
        let (gbuffer, params, reference) = eval::read(manifest, entry)?;
        let view = TestFrame { entry: (*entry).clone(), gbuffer, params, reference };
        let shots: Vec<Option<Shot>> =
            keys.iter().map(|k| shoot(subject, k, &view)).collect::<Result<_>>()?;
        let methods: Vec<(&str, &Option<Shot>)> = keys.iter().copied().zip(&shots).collect();
        let window = crops::busiest(&view.reference, &view.gbuffer);
        panels.extend(match item {
            Item::Fig5 => timed(&view, &methods, measurements)?,
            Item::Fig7 => all_methods(&view, &methods, subject)?,
            _ => zoomed(&view, &methods, window),
        });
        views.push(as_json(&view, &methods, window));
        progress("pictures", done + 1, chosen.len());
    }
    let content = Content::Pictures { panels, columns };
    Ok(Section { item, content, claims: Vec::new(), notes: notes(item), json: json!({ "views": views }) })
}

/// The first test frame of each of the first `count` scenes that have one, in the order of the plan.
fn chosen(manifest: &Manifest, count: usize) -> Vec<&FrameEntry> {
    let scenes = manifest.plan.scenes.iter();
    scenes.filter_map(|s| manifest.frames(Split::Test).find(|f| f.scene == s.name)).take(count).collect()
}

fn shoot(subject: &Subject<'_>, key: &str, view: &TestFrame) -> Result<Option<Shot>> {
    let Some(model) = subject.models.first(key) else { return Ok(None) };
    let method = Method::network(model, subject.threads);
    let (ao, _) = eval::run(&method, &view.gbuffer, view.params)?;
    let scores = metrics::compare(&view.reference, &ao, None)?.full;
    Ok(Some(Shot { ao, scores }))
}

/// The method's picture by `draw`, or a grey one labelled `not trained`.
fn panel(view: &TestFrame, (key, shot): (&str, &Option<Shot>), draw: impl FnOnce(&Shot) -> Panel) -> Panel {
    match shot {
        Some(shot) => draw(shot),
        None => {
            let size = (view.gbuffer.width() as u32, view.gbuffer.height() as u32);
            let grey = RgbImage::from_pixel(size.0, size.1, Rgb(MISSING));
            (grey, Caption::new(format!("{}: not trained", short_label(key))))
        }
    }
}

fn error_panel(view: &TestFrame, shot: &Shot) -> Result<Panel> {
    let text = format!("{:.2} dB, SSIM {:.4}", shot.scores.psnr, shot.scores.ssim);
    Ok((picture::error(&view.reference, &shot.ao)?, Caption::new(text)))
}

/// Fig. 5: reference, every method with its time, every method's error.
fn timed(view: &TestFrame, methods: &[(&str, &Option<Shot>)], m: &Measurements) -> Result<Vec<Panel>> {
    let mut panels =
        vec![(picture::ao(&view.reference), Caption::new(format!("reference, {}", view.entry.scene)))];
    for &(key, shot) in methods {
        let ms = m.row(key).and_then(|row| row.ms_at(HD));
        let time = ms.map_or_else(String::new, |ms| format!(", {ms:.0} ms at 1280x720"));
        let caption = format!("{}{time}", short_label(key));
        panels.push(panel(view, (key, shot), |s| (picture::ao(&s.ao), Caption::new(caption))));
    }
    for &(key, shot) in methods {
        let error = shot.as_ref().map(|s| error_panel(view, s)).transpose()?;
        panels.push(panel(view, (key, shot), |_| error.unwrap_or_default()));
    }
    Ok(panels)
}

/// Fig. 7: normals, reference and methods; below them depth, the colours of errors, and errors.
fn all_methods(
    view: &TestFrame,
    methods: &[(&str, &Option<Shot>)],
    subject: &Subject<'_>,
) -> Result<Vec<Panel>> {
    let mut above = vec![
        (picture::normals(&view.gbuffer), Caption::new("normals")),
        (picture::ao(&view.reference), Caption::new("reference")),
    ];
    let blank = RgbImage::from_pixel(
        view.gbuffer.width() as u32,
        view.gbuffer.height() as u32,
        picture::PAPER.into(),
    );
    let mut below = vec![
        (picture::depth(&view.gbuffer), Caption::new(format!("depth, {}", view.entry.scene))),
        (blank, Caption { text: "error".into(), error_legend: true }),
    ];
    for &(key, shot) in methods {
        let name = format!("{}{}", short_label(key), tables::mark(subject, key));
        above.push(panel(view, (key, shot), |s| (picture::ao(&s.ao), Caption::new(name))));
        let error = shot.as_ref().map(|s| error_panel(view, s)).transpose()?;
        below.push(panel(view, (key, shot), |_| error.unwrap_or_default()));
    }
    above.extend(below);
    Ok(above)
}

/// Figs. 6 and 8: reference with the window; the window of the reference and of every method.
fn zoomed(view: &TestFrame, methods: &[(&str, &Option<Shot>)], window: Window) -> Vec<Panel> {
    let reference = picture::ao(&view.reference);
    let mut panels = vec![
        (crops::outlined(reference.clone(), window), Caption::new(view.entry.scene.as_str())),
        (crops::cut(&reference, window), Caption::new("reference")),
    ];
    for &(key, shot) in methods {
        panels.push(panel(view, (key, shot), |s| {
            let psnr = crops::psnr(&view.reference, &s.ao, window);
            (
                crops::cut(&picture::ao(&s.ao), window),
                Caption::new(format!("{}: {psnr:.2} dB", short_label(key))),
            )
        }));
    }
    panels
}

fn as_json(view: &TestFrame, methods: &[(&str, &Option<Shot>)], window: Window) -> Value {
    let scores = |s: &Shot| json!({ "ssim": s.scores.ssim, "psnr": s.scores.psnr, "window_psnr": crops::psnr(&view.reference, &s.ao, window) });
    let methods: Map<_, _> =
        methods.iter().map(|(k, s)| ((*k).to_owned(), s.as_ref().map_or(Value::Null, scores))).collect();
    json!({ "scene": view.entry.scene, "file": view.entry.file, "window": window, "methods": methods })
}

fn notes(item: Item) -> Vec<String> {
    let views = "Views: the first test frame of each of the first scenes of the dataset's plan.";
    let errors =
        "Errors: blue too dark, red too bright, full colour from 0.25 on; PSNR and SSIM of the frame.";
    let window =
        "The window is the sixth of the frame's sides in which the reference varies most; PSNR inside it.";
    let second = match item {
        Item::Fig5 | Item::Fig7 => errors,
        _ => window,
    };
    vec![format!("{views} {second}")]
}
