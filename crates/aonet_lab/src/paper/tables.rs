//! Tables 1 to 4 and the ablations, from measurements.

use super::claims;
use super::measure::{Measured, Measurements, Needs, OverSeeds};
use super::rows::{self, AO_NET, HD, SIZES};
use super::{Content, Item, Section, Subject};
use crate::eval;
use crate::table::number;
use aonet::Size;
use serde_json::{Value, json};

/// A row of any table, owned, because the ablations have rows from a folder.
struct Line {
    key: String,
    label: String,
    paper: rows::PaperNumbers,
}

fn lines(item: Item, subject: &Subject<'_>) -> Vec<Line> {
    let known: &[rows::PaperRow] = match item {
        Item::Table1 => &rows::TABLE_1,
        Item::Table2 => &rows::TABLE_2,
        Item::Table3 => &rows::TABLE_3,
        Item::Table4 => &rows::TABLE_4,
        Item::Ablations => &rows::ABLATIONS,
        Item::Fig5 => &rows::TABLE_4[..2],
        Item::Fig2 | Item::Fig3 | Item::Fig6 | Item::Fig7 | Item::Fig8 => &[],
    };
    let line = |r: &rows::PaperRow| Line { key: r.key.to_owned(), label: r.label.to_owned(), paper: r.paper };
    let others = if item == Item::Ablations { subject.models.others() } else { Vec::new() };
    let other = |key: String| Line { label: key.clone(), key, paper: rows::PaperNumbers::default() };
    known.iter().map(line).chain(others.into_iter().map(other)).collect()
}

/// Adds the measurements that `item` needs.
pub(super) fn add_needs(item: Item, subject: &Subject<'_>, needs: &mut Needs) {
    let sizes: &[Size] = if item == Item::Table2 { &SIZES } else { &[HD] };
    let scored = matches!(item, Item::Table1 | Item::Table3 | Item::Table4 | Item::Ablations);
    needs.constant |= scored;
    for line in lines(item, subject) {
        needs.times.extend(sizes.iter().map(|size| (line.key.clone(), *size)));
        if scored {
            needs.scores.insert(line.key);
        }
    }
}

/// One of the tables.
pub(super) fn table(item: Item, subject: &Subject<'_>, m: &Measurements) -> Section {
    let lines = lines(item, subject);
    let (header, mut cells) = match item {
        Item::Table2 => timed(&lines, m),
        _ => scored(&lines, m),
    };
    mark_best(&header, &mut cells);
    let claims = match item {
        Item::Table1 => claims::table_1(m),
        Item::Table2 => claims::table_2(m),
        Item::Table3 => claims::table_3(m),
        Item::Table4 => claims::table_4(m),
        _ => Vec::new(),
    };
    let json = json!({
        "rows": lines.iter().map(|line| as_json(line, m)).collect::<Vec<_>>(),
        "constant": m.constant.map(|(value, scores)| json!({ "visibility": value, "scores": scores })),
    });
    Section {
        item,
        content: Content::Table { header, rows: cells },
        claims,
        notes: notes(item, &lines, m),
        json,
    }
}

fn as_json(line: &Line, m: &Measurements) -> Value {
    let measured = m.row(&line.key);
    json!({
        "row": line.key, "label": line.label, "trained": measured.is_some(), "measured": measured,
        "ssim": measured.and_then(Measured::ssim), "psnr": measured.and_then(Measured::psnr), "paper": line.paper,
    })
}

const SCORES: [&str; 4] = ["SSIM", "PSNR dB", "SSIM fg", "PSNR fg"];
const SIZE_COLUMNS: [&str; 5] = ["parameters", "MAC/px", "MB f16", "steps", "crops"];

fn scored(lines: &[Line], m: &Measurements) -> (Vec<String>, Vec<Vec<String>>) {
    let in_paper = lines.iter().any(|line| line.paper.ssim.is_some());
    let paper: &[&str] = if in_paper { &["paper SSIM", "paper PSNR", "paper ms"] } else { &[] };
    let header = [&[""], &SCORES[..], &["ms"], paper, &SIZE_COLUMNS].concat();
    let row = |line: &Line| {
        let measured = m.row(&line.key);
        let scores = match measured {
            Some(row) => {
                let (ssim, psnr) = (row.score(|r| r.ssim_foreground), row.score(|r| r.psnr_foreground));
                [(row.ssim(), 4), (row.psnr(), 2), (ssim, 4), (psnr, 2)]
                    .map(|(v, d)| over_seeds(v, d))
                    .to_vec()
            }
            None => absent(SCORES.len()),
        };
        let ms = measured.and_then(|row| row.ms_at(HD));
        let paper = [number(line.paper.ssim, 4), number(line.paper.psnr, 2), number(line.paper.ms, 2)];
        let paper = if in_paper { paper.to_vec() } else { Vec::new() };
        [vec![name(line, measured)], scores, vec![number(ms, 1)], paper, size_cells(measured)].concat()
    };
    let mut cells = vec![constant(m, header.len())];
    cells.extend(lines.iter().map(row));
    (header.into_iter().map(str::to_owned).collect(), cells)
}

fn constant(m: &Measurements, columns: usize) -> Vec<String> {
    let mut cells = match m.constant {
        Some((value, row)) => vec![
            format!("constant image {value:.3}"),
            number(row.ssim, 4),
            number(row.psnr, 2),
            number(row.ssim_foreground, 4),
            number(row.psnr_foreground, 2),
        ],
        None => vec!["constant image".into(), "not measured".into()],
    };
    cells.resize(columns, "-".into());
    cells
}

fn timed(lines: &[Line], m: &Measurements) -> (Vec<String>, Vec<Vec<String>>) {
    let of = |prefix: &str| SIZES.map(|size| format!("{prefix}{size}")).to_vec();
    let header =
        [vec![String::new()], of(""), of("paper "), SIZE_COLUMNS.map(str::to_owned).to_vec()].concat();
    let row = |(line, paper): (&Line, &Option<[f64; 3]>)| {
        let measured = m.row(&line.key);
        let times = match measured {
            Some(row) => SIZES.map(|size| number(row.ms_at(size), 1)).to_vec(),
            None => absent(SIZES.len()),
        };
        let paper = [0, 1, 2].map(|i| number(paper.map(|p| p[i]), 2));
        // Run-times do not depend on radii: no mark.
        [vec![line.label.clone()], times, paper.to_vec(), size_cells(measured)].concat()
    };
    (header, lines.iter().zip(&rows::TABLE_2_MS).map(row).collect())
}

fn name(line: &Line, measured: Option<&Measured>) -> String {
    let mark = if measured.is_some_and(|row| !row.radius_fits) { " *" } else { "" };
    format!("{}{mark}", line.label)
}

/// Cells of a row without a network.
fn absent(count: usize) -> Vec<String> {
    let mut cells = vec!["-".to_owned(); count];
    cells[0] = "not trained".into();
    cells
}

fn size_cells(measured: Option<&Measured>) -> Vec<String> {
    let Some(row) = measured else { return vec!["-".into(); SIZE_COLUMNS.len()] };
    let told = |count: u64| if count > 0 { count.to_string() } else { "-".into() };
    vec![
        row.parameters.map_or_else(|| "-".into(), |count| count.to_string()),
        number(row.macs_per_pixel, 0),
        number(row.f16_bytes.map(|bytes| bytes as f64 / 1e6), 2),
        told(row.steps),
        told(row.crops.unwrap_or(0)),
    ]
}

fn over_seeds(value: Option<OverSeeds>, digits: usize) -> String {
    let Some(OverSeeds { mean, spread }) = value else { return "-".into() };
    spread.map_or_else(|| number(mean, digits), |s| format!("{mean:.digits$} ±{s:.digits$}"))
}

/// Puts `**` around the highest score and the shortest time of each of our columns that has at least two.
fn mark_best(header: &[String], cells: &mut [Vec<String>]) {
    for (c, name) in header.iter().enumerate() {
        let time = name == "ms" || SIZES.iter().any(|size| *name == size.to_string());
        if !time && !SCORES.contains(&name.as_str()) {
            continue;
        }
        let value = |row: &Vec<String>| row[c].split(' ').next().and_then(|v| v.parse::<f64>().ok());
        let values: Vec<f64> = cells.iter().filter_map(value).collect();
        let best = values.iter().copied().fold(None, |best: Option<f64>, v| match best {
            Some(b) if time => Some(b.min(v)),
            Some(b) => Some(b.max(v)),
            None => Some(v),
        });
        if values.len() < 2 {
            continue;
        }
        for row in cells.iter_mut().filter(|row| value(row) == best) {
            row[c] = format!("**{}**", row[c]);
        }
    }
}

fn notes(item: Item, lines: &[Line], m: &Measurements) -> Vec<String> {
    let mut notes = Vec::new();
    if item != Item::Table2 {
        notes.push(
            "SSIM and PSNR: means over the frames; fg: foreground only. The paper's are on its own frames."
                .into(),
        );
    }
    let trained = || lines.iter().filter_map(|line| m.row(&line.key));
    if item != Item::Table2 && trained().any(|row| row.scores.len() > 1) {
        let seeds = trained().map(|row| row.scores.len()).max().unwrap_or(1);
        notes.push(format!("Rows of several seeds (up to {seeds}): mean ± half of the range."));
    }
    if item != Item::Table2 && trained().any(|row| !row.radius_fits) {
        notes.push("* trained for another choice of radius than the frames have.".into());
    }
    if lines.iter().any(|line| line.key == AO_NET) && m.row(AO_NET).is_none() {
        notes.push(format!("The paper's network is the file {AO_NET}.safetensors; it is not there."));
    }
    notes
}

/// Whether a model's rows are marked as trained for another choice of radius: for captions.
pub(super) fn mark(subject: &Subject<'_>, key: &str) -> &'static str {
    let model = subject.models.first(key).zip(subject.manifest);
    if model.is_some_and(|(model, manifest)| !eval::radius_fits(model, manifest)) { " *" } else { "" }
}
