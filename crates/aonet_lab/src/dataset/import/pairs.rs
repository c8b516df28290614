//! Matches the files of three folders.

use super::{ImportedFrom, Unmatched};
use aonet_scene::error::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What separates a word from the rest of a file's name.
const SEPARATORS: [char; 3] = ['_', '-', '.'];

/// The files of a frame: normals, depth, AO.
pub(super) struct Triple {
    /// Their name below their folders, with `/` between its parts.
    pub(super) name: String,
    pub(super) files: [PathBuf; 3],
    bytes: [u64; 3],
}

impl Triple {
    pub(super) fn source(&self) -> ImportedFrom {
        ImportedFrom { name: self.name.clone(), bytes: self.bytes }
    }
}

/// Matched files, sorted by name.
pub(super) struct Pairs {
    /// At least one.
    pub(super) triples: Vec<Triple>,
    /// Files without partners.
    pub(super) skipped: usize,
}

/// A file and its length (bytes).
type Found = (PathBuf, u64);

/// The files of a folder by name.
type Files = BTreeMap<String, Found>;

/// # Errors
/// When a folder cannot be read or has no images, no files match, or a file without partners is refused.
pub(super) fn pair(folders: [&Path; 3], unmatched: Unmatched) -> Result<Pairs> {
    let mut listed = [Files::new(), Files::new(), Files::new()];
    for (files, folder) in listed.iter_mut().zip(folders) {
        list(folder, "", files)?;
        if files.is_empty() {
            return Err(Error::file(folder, "OpenEXR images (*.exr) in the folder or below", "none"));
        }
    }
    let common = |files: &[Files; 3]| files[0].keys().filter(|name| in_all(files, name)).count();
    let mut best = listed;
    for affix in [Affix::Last, Affix::First] {
        let shorter = best.each_ref().map(|files| affix.taken_off(files));
        if common(&shorter) > common(&best) {
            best = shorter;
        }
    }
    let matched = common(&best);
    let skipped = best.iter().map(Files::len).sum::<usize>() - 3 * matched;
    if skipped > 0 && (unmatched == Unmatched::Refuse || matched == 0) {
        return Err(alone(&best, folders));
    }
    let names: Vec<String> = best[0].keys().filter(|name| in_all(&best, name)).cloned().collect();
    let triple = |name: String| {
        let of = |i: usize| best[i][&name].clone();
        let [normal, depth, ao] = [of(0), of(1), of(2)];
        Triple { name, files: [normal.0, depth.0, ao.0], bytes: [normal.1, depth.1, ao.1] }
    };
    Ok(Pairs { triples: names.into_iter().map(triple).collect(), skipped })
}

fn in_all(files: &[Files; 3], name: &str) -> bool {
    files.iter().all(|files| files.contains_key(name))
}

/// The first file without a partner.
fn alone(files: &[Files; 3], folders: [&Path; 3]) -> Error {
    for i in [0, 1, 2] {
        for (name, (path, _)) in &files[i] {
            if let Some(j) = (0..3).find(|&j| !files[j].contains_key(name)) {
                let expected = format!("an image called {name} in {} as well", folders[j].display());
                return Error::file(path, expected, "none");
            }
        }
    }
    Error::request("files", "one without partners", "none")
}

/// Adds the images of a folder and of the folders in it, whose names follow `prefix`. Links to folders are not followed,
/// because they may form a cycle.
fn list(folder: &Path, prefix: &str, files: &mut Files) -> Result<()> {
    for entry in std::fs::read_dir(folder).map_err(Error::io(folder))? {
        let entry = entry.map_err(Error::io(folder))?;
        let (path, file_name) = (entry.path(), entry.file_name());
        let file_name = file_name.to_string_lossy();
        if file_name.starts_with('.') {
            continue;
        }
        if entry.file_type().map_err(Error::io(&path))?.is_dir() {
            list(&path, &format!("{prefix}{file_name}/"), files)?;
            continue;
        }
        let Some((stem, "exr")) = file_name
            .rsplit_once('.')
            .map(|(stem, e)| (stem, if e.eq_ignore_ascii_case("exr") { "exr" } else { "" }))
        else {
            continue;
        };
        let bytes = path.metadata().map_err(Error::io(&path))?.len();
        if let Some((other, _)) = files.insert(format!("{prefix}{stem}"), (path.clone(), bytes)) {
            return Err(Error::file(&path, "a name of its own", other.display()));
        }
    }
    Ok(())
}

/// Position of the word that all files of a folder share.
#[derive(Clone, Copy)]
enum Affix {
    /// `_word` at the end.
    Last,
    /// `word_` at the start.
    First,
}

impl Affix {
    /// The files under names without their shared word, if they have one.
    fn taken_off(self, files: &Files) -> Files {
        let rest = |name: &str| -> Option<(String, String)> {
            let at = name.rfind('/').map_or(0, |slash| slash + 1);
            let (folder, file) = name.split_at(at);
            let cut = match self {
                Self::Last => file.rfind(SEPARATORS)?,
                Self::First => file.find(SEPARATORS)? + 1,
            };
            let (first, last) = file.split_at(cut);
            let (kept, word) = match self {
                Self::Last => (first, last),
                Self::First => (last, first),
            };
            let letters = word.trim_matches(SEPARATORS);
            let is_word = !letters.is_empty() && letters.chars().all(char::is_alphabetic);
            (is_word && !kept.is_empty()).then(|| (format!("{folder}{kept}"), word.to_owned()))
        };
        let mut words = files.keys().map(|name| rest(name).map(|(_, word)| word));
        let first = words.next().flatten();
        if first.is_none() || words.any(|word| word != first) {
            return files.clone();
        }
        files.iter().filter_map(|(name, found)| Some((rest(name)?.0, found.clone()))).collect()
    }
}
