//! Lists of scenes: `scenes.csv` and `cameras.csv` beside a folder of glTF files.

use super::plan::Preset;
use aonet_scene::error::{Error, Result};
use aonet_scene::staging::SceneSplit;
use aonet_scene::staging::{Candidate, SceneSpec};
use std::collections::BTreeMap;
use std::path::Path;

/// Scenes marked `extra` that are for validation; the other `extra` scenes are for training.
const HELD_OUT: [&str; 6] =
    ["garden", "hospital_ward", "kenney_town", "penguin", "semi_truck", "egyptian_cat"];

/// Scenes whose normals were not turned together with their triangles: no winding makes them consistent.
const BROKEN: [&str; 1] = ["mannequiny"];

/// The scenes that a preset takes from a folder with `scenes.csv` (columns `name`, `environment`,
/// `split` and, for the paper's preset, `core37`) and, where there is one, `cameras.csv`.
///
/// # Errors
/// When a list or a scene cannot be read, a column is missing or a value is not among the known ones.
pub fn scenes(dir: &Path, preset: Preset) -> Result<Vec<SceneSpec>> {
    let path = dir.join("scenes.csv");
    let table = Table::load(&path)?;
    let mut cameras = cameras(&dir.join("cameras.csv"))?;
    let mut scenes = Vec::new();
    for row in 0..table.rows.len() {
        let name = table.get(row, "name")?;
        let split = match table.get(row, "split")? {
            "train" => SceneSplit::Train,
            "extra" if HELD_OUT.contains(&name) => SceneSplit::Val,
            "extra" => SceneSplit::Train,
            "val" => SceneSplit::Val,
            "test" | "test_public" => SceneSplit::Test,
            other => return Err(Error::file(&path, "split train, extra, val, test or test_public", other)),
        };
        let wanted = match preset {
            Preset::Paper => table.flag(row, "core37")?,
            Preset::AnyRadius | Preset::Imported(_) => true,
        };
        if !wanted || BROKEN.contains(&name) {
            continue;
        }
        let scene = SceneSpec::from_file(&dir.join(format!("{name}.glb")), split)?;
        let mut scene = scene.with_environment(table.flag(row, "environment")?);
        scene.cameras = cameras.remove(name).unwrap_or_default();
        scenes.push(scene);
    }
    Ok(scenes)
}

/// Candidate cameras by scene; empty without a file.
fn cameras(path: &Path) -> Result<BTreeMap<String, Vec<Candidate>>> {
    let mut all: BTreeMap<String, Vec<Candidate>> = BTreeMap::new();
    if !path.exists() {
        return Ok(all);
    }
    let table = Table::load(path)?;
    for row in 0..table.rows.len() {
        let vector = |part: &str| -> Result<[f32; 3]> {
            let mut out = [0.0; 3];
            for (value, axis) in out.iter_mut().zip(["x", "y", "z"]) {
                *value = table.number(row, &format!("{part}_{axis}"))?;
            }
            Ok(out)
        };
        let candidate = Candidate { eye: vector("eye")?, target: vector("target")? };
        all.entry(table.get(row, "name")?.to_owned()).or_default().push(candidate);
    }
    Ok(all)
}

/// Comma-separated values with a header. // RFC 4180
struct Table<'a> {
    path: &'a Path,
    header: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl<'a> Table<'a> {
    fn load(path: &'a Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(Error::io(path))?;
        let text = String::from_utf8(bytes).map_err(|e| Error::file(path, "UTF-8", e))?;
        let mut rows = parse_csv(&text);
        if rows.is_empty() {
            return Err(Error::file(path, "a header", "nothing"));
        }
        let header = rows.remove(0);
        Ok(Self { path, header, rows })
    }

    fn get(&self, row: usize, column: &str) -> Result<&str> {
        let line = &self.rows[row];
        let Some(i) = self.header.iter().position(|h| h == column) else {
            return Err(Error::file(self.path, format!("a column {column}"), self.header.join(",")));
        };
        line.get(i).map(String::as_str).ok_or_else(|| {
            let expected = format!("{} values in row {}", self.header.len(), row + 1);
            Error::file(self.path, expected, line.len())
        })
    }

    fn flag(&self, row: usize, column: &str) -> Result<bool> {
        match self.get(row, column)? {
            "yes" => Ok(true),
            "no" => Ok(false),
            other => {
                let expected = format!("yes or no in column {column}, row {}", row + 1);
                Err(Error::file(self.path, expected, format!("{other:?}")))
            }
        }
    }

    fn number(&self, row: usize, column: &str) -> Result<f32> {
        let text = self.get(row, column)?;
        text.trim().parse().ok().filter(|v: &f32| v.is_finite()).ok_or_else(|| {
            let expected = format!("a finite number in column {column}, row {}", row + 1);
            Error::file(self.path, expected, format!("{text:?}"))
        })
    }
}

/// Rows of fields; quotes protect commas and line ends, and are doubled to mean themselves.
fn parse_csv(text: &str) -> Vec<Vec<String>> {
    let (mut rows, mut row, mut field, mut quoted) = (Vec::new(), Vec::new(), String::new(), false);
    let mut chars = text.trim_start_matches('\u{feff}').chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '"' if quoted && chars.peek() == Some(&'"') => field.extend(chars.next()),
            '"' => quoted = !quoted,
            ',' if !quoted => row.push(std::mem::take(&mut field)),
            '\n' if !quoted => {
                row.push(std::mem::take(&mut field));
                rows.push(std::mem::take(&mut row));
            }
            '\r' if !quoted => {}
            c => field.push(c),
        }
    }
    if !field.is_empty() || !row.is_empty() {
        row.push(field);
        rows.push(row);
    }
    rows.retain(|r| r.iter().any(|f| !f.is_empty()));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn csv_follows_the_rfc() {
        let text = "a,b\r\n1,\"x, \"\"y\"\"\nz\"\n\n2,\n3,4";
        let expected = [vec!["a", "b"], vec!["1", "x, \"y\"\nz"], vec!["2", ""], vec!["3", "4"]];
        assert_eq!(parse_csv(text), expected);
        assert!(parse_csv("").is_empty());
    }

    #[test]
    fn the_papers_scenes_are_29_and_8() {
        let Some(data) = std::env::var_os("AONET_DATA") else {
            eprintln!("skipped: AONET_DATA is not set");
            return;
        };
        let dir = Path::new(&data).join("scenes");
        let count = |preset| {
            let scenes = scenes(&dir, preset).unwrap();
            [SceneSplit::Train, SceneSplit::Val, SceneSplit::Test]
                .map(|split| scenes.iter().filter(|s| s.split == split).count())
        };
        assert_eq!(count(Preset::Paper), [29, 0, 8]);
        assert_eq!(count(Preset::AnyRadius), [65 + 28 - HELD_OUT.len() - BROKEN.len(), HELD_OUT.len(), 8]);
        let room = scenes(&dir, Preset::Paper).unwrap().into_iter().find(|s| s.name == "zen_room").unwrap();
        assert_eq!((room.cameras.len(), room.environment, room.ground), (4, true, false));
    }

    #[test]
    fn bad_tables_are_named_with_column_and_row() {
        let dir = tempfile::tempdir().unwrap();
        let error = |csv: &str| {
            std::fs::write(dir.path().join("scenes.csv"), csv).unwrap();
            scenes(dir.path(), Preset::Paper).unwrap_err().to_string()
        };
        assert!(error("").contains("header"));
        assert!(error("name,environment\nx,yes").contains("column split"));
        assert!(error("name,split\nx,dev").contains("dev"));
        assert!(error("name,split,core37\nx,train,maybe").contains("row 1"));
        assert!(error("name,split,core37\nx,train").contains("found 2"));
        assert!(error("name,split,core37\nx,train,yes").contains("x.glb"));
    }
}
