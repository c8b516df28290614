//! All sections as one self-contained page.

use super::claims::{Claim, Verdict};
use super::{Content, Section, base64};
use crate::picture::{Caption, PAPER};
use aonet::metrics::ERROR_SCALE;
use aonet_scene::error::{Error, Result};
use image::imageops::FilterType;
use image::{DynamicImage, ImageFormat, RgbImage};
use std::fmt::Write;
use std::io::Cursor;

const STYLE: &str = include_str!("report.css");

/// Widest picture in the page (px): the width of a column in a desktop's window.
const PANEL_WIDTH: u32 = 480;

/// Narrowest column of pictures (px); a narrower window scrolls sideways.
const COLUMN_WIDTH: u32 = 150;

/// Pictures narrower than this are enlarged without smoothing (px).
const CROP_WIDTH: u32 = 240;

/// One HTML page: tables, charts and pictures inside it, no scripts, no external resources.
///
/// # Errors
/// When a picture cannot be encoded.
pub fn report(sections: &[Section]) -> Result<String> {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>AO-Net: tables and figures</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n\
         <h1>AO-Net: tables and figures</h1>\n\
         <p>The paper's tables and figures, made again from trained networks. Grey columns are the paper's numbers, on its \
         own frames and GPU: gaps between rows compare, absolute values do not.</p>\n"
    );
    tally(&mut page, sections);
    for section in sections {
        add(&mut page, section)?;
    }
    page += "</body>\n</html>\n";
    Ok(page)
}

/// The number of claims that hold.
fn tally(page: &mut String, sections: &[Section]) {
    let all: Vec<&Claim> = sections.iter().flat_map(|s| &s.claims).collect();
    let verdicts = [Verdict::Reproduced, Verdict::NotReproduced, Verdict::NotMeasured];
    let counts = verdicts.map(|v| format!("{} {}", all.iter().filter(|c| c.verdict == v).count(), badge(v)));
    *page += &format!("<p>Claims of the paper: {}</p>\n", counts.join(", "));
}

fn badge(verdict: Verdict) -> String {
    let class = verdict.name().replace(' ', "_");
    format!("<span class=\"verdict {class}\">{}</span>", verdict.name())
}

fn add(page: &mut String, section: &Section) -> Result<()> {
    *page += &format!("<h2 id=\"{}\">{}</h2>\n", section.item.name(), escaped(section.item.title()));
    match &section.content {
        Content::Table { header, rows } => table(page, header, rows),
        Content::Chart(svg) => *page += &format!("<div class=\"wide\">{svg}</div>\n"),
        Content::Pictures { panels, columns } => pictures(page, panels, *columns)?,
    }
    if !section.claims.is_empty() {
        *page += "<ul>\n";
        for claim in &section.claims {
            let ours = if claim.ours.is_empty() {
                String::new()
            } else {
                format!("ours: {} ", escaped(&claim.ours))
            };
            *page += &format!("<li>{} &rarr; {ours}{}</li>\n", escaped(&claim.paper), badge(claim.verdict));
        }
        *page += "</ul>\n";
    }
    let notes: Vec<String> = section.notes.iter().map(|note| escaped(note)).collect();
    *page += &format!("<p class=\"notes\">{}</p>\n", notes.join("<br>\n"));
    Ok(())
}

fn table(page: &mut String, header: &[String], rows: &[Vec<String>]) {
    let class = |c: usize| if header[c].starts_with("paper") { " class=\"paper\"" } else { "" };
    let line = |tag: &str, cells: &[String]| -> String {
        let cell = |(c, text): (usize, &String)| format!("<{tag}{}>{}</{tag}>", class(c), bold(text));
        format!("<tr>{}</tr>\n", cells.iter().enumerate().map(cell).collect::<String>())
    };
    *page += "<div class=\"wide\"><table>\n";
    *page += &line("th", header);
    rows.iter().for_each(|row| *page += &line("td", row));
    *page += "</table></div>\n";
}

/// `**a**` as bold text.
fn bold(cell: &str) -> String {
    match cell.strip_prefix("**").and_then(|c| c.strip_suffix("**")) {
        Some(inner) => format!("<b>{}</b>", escaped(inner)),
        None => escaped(cell),
    }
}

fn pictures(page: &mut String, panels: &[(RgbImage, Caption)], columns: usize) -> Result<()> {
    let grid = format!("grid-template-columns: repeat({columns}, minmax({COLUMN_WIDTH}px, 1fr))");
    *page += &format!("<div class=\"wide\"><div class=\"panels\" style=\"{grid}\">\n");
    for (picture, caption) in panels {
        let class = if picture.width() < CROP_WIDTH { " class=\"crop\"" } else { "" };
        let text = escaped(&caption.text);
        *page += &format!("<figure{class}>");
        if picture.pixels().any(|p| p.0 != PAPER) {
            let png = base64::encode(&png(picture)?);
            *page += &format!("<img alt=\"{text}\" src=\"data:image/png;base64,{png}\">");
        }
        *page += &format!("<figcaption>{text}");
        if caption.error_legend {
            // Writing to a string cannot fail.
            let _ = write!(page, " &minus;{ERROR_SCALE}<span class=\"legend\"></span>+{ERROR_SCALE}");
        }
        *page += "</figcaption></figure>\n";
    }
    *page += "</div></div>\n";
    Ok(())
}

/// The picture as PNG: not wider than needed, and with one channel if it is grey.
fn png(picture: &RgbImage) -> Result<Vec<u8>> {
    let mut image = DynamicImage::ImageRgb8(picture.clone());
    if picture.width() > PANEL_WIDTH {
        image = image.resize(PANEL_WIDTH, u32::MAX, FilterType::Triangle);
    }
    let grey = picture.pixels().all(|p| p.0[0] == p.0[1] && p.0[1] == p.0[2]);
    let image = if grey { DynamicImage::ImageLuma8(image.to_luma8()) } else { image };
    let mut bytes = Cursor::new(Vec::new());
    let written = image.write_to(&mut bytes, ImageFormat::Png);
    written.map_err(|e| Error::request("report", "pictures that PNG can hold", e))?;
    Ok(bytes.into_inner())
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::Item;
    use image::Rgb;

    #[test]
    fn cells_and_captions_cannot_break_out() {
        let content = Content::Table {
            header: vec!["".into(), "paper x".into()],
            rows: vec![vec!["<b>\"&".into(), "**1.0**".into()]],
        };
        let claims = vec![Claim::new("a < b", None)];
        let section = |content| Section {
            item: Item::Table1,
            content,
            claims: claims.clone(),
            notes: vec!["<script>".into()],
            json: serde_json::json!({}),
        };
        let grey = RgbImage::from_pixel(600, 300, Rgb([9; 3]));
        let caption = Caption { text: "x\"><script>".into(), error_legend: true };
        let pictures = Content::Pictures { panels: vec![(grey, caption)], columns: 1 };
        let page = report(&[section(content), section(pictures)]).unwrap();
        assert!(!page.contains("<script") && page.contains("&lt;b&gt;&quot;&amp;"), "{page}");
        assert!(page.contains("<td class=\"paper\"><b>1.0</b></td>"), "{page}");
        assert!(page.contains("2 <span class=\"verdict not_measured\">"), "{page}");
    }

    #[test]
    fn pictures_are_shrunk_and_grey_where_they_can_be() {
        let decoded = |picture: &RgbImage| image::load_from_memory(&png(picture).unwrap()).unwrap();
        let grey = decoded(&RgbImage::from_pixel(960, 100, Rgb([7; 3])));
        assert_eq!((grey.width(), grey.height(), grey.color()), (480, 50, image::ColorType::L8));
        let red = decoded(&RgbImage::from_pixel(100, 50, Rgb([200, 0, 0])));
        assert_eq!((red.width(), red.color()), (100, image::ColorType::Rgb8));
    }
}
