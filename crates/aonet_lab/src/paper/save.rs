//! Writes sections as files: Markdown, SVG, PNG and JSON.

use super::{Content, Section};
use crate::picture;
use crate::table::{Style, table};
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Width of a sheet of pictures (px).
const SHEET_WIDTH: u32 = 1920;

impl Section {
    /// Title, table if it is one, claims and notes, as Markdown.
    pub fn markdown(&self) -> String {
        let mut text = format!("# {}\n\n", self.item.title());
        if let Content::Table { header, rows } = &self.content {
            let header: Vec<&str> = header.iter().map(String::as_str).collect();
            text += &table(&header, rows, Style::Markdown);
            text += "\n";
        }
        for claim in &self.claims {
            text += &format!("* {}\n", claim.line());
        }
        if !self.claims.is_empty() {
            text += "\n";
        }
        text + &self.notes.join("\n") + "\n"
    }
}

/// Writes the files of a section into a folder that exists: `NAME.md`, `NAME.svg` or `NAME.png`, and `NAME.json`.
/// Returns the first.
///
/// # Errors
/// Names the file that cannot be written.
pub fn save(section: &Section, dir: &Path) -> Result<PathBuf> {
    let at = |extension: &str| dir.join(format!("{}.{extension}", section.item.name()));
    let json =
        serde_json::to_string_pretty(&section.json).map_err(|e| Error::file(&at("json"), "JSON", e))?;
    atomic_file::write(&at("json"), format!("{json}\n").as_bytes())?;
    let path = match &section.content {
        Content::Table { .. } => {
            atomic_file::write(&at("md"), section.markdown().as_bytes())?;
            at("md")
        }
        Content::Chart(svg) => {
            atomic_file::write(&at("svg"), svg.as_bytes())?;
            at("svg")
        }
        Content::Pictures { panels, columns } => {
            picture::save_png(&picture::sheet_of_width(panels, *columns, SHEET_WIDTH)?, &at("png"))?;
            at("png")
        }
    };
    Ok(path)
}
