//! Output files of a run: `log.jsonl`, `curves.svg`, models.

use super::step::Losses;
use super::validate::ValidationScores;
use aonet::net::{Model, WeightFormat};
use aonet_scene::atomic_file;
use aonet_scene::error::{Error, Result};
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// One JSON object per line: a training step (`loss`) or a validation (`val_loss`).
pub(crate) struct Log {
    dir: PathBuf,
    lines: Vec<Value>,
    file: BufWriter<File>,
}

impl Log {
    /// Opens the log of a run that has taken `step` steps; later lines are dropped, they will be written again.
    ///
    /// # Errors
    /// When the file cannot be read or written.
    pub(crate) fn open(dir: &Path, step: u64) -> Result<Self> {
        let path = dir.join("log.jsonl");
        let text = if path.exists() {
            std::fs::read_to_string(&path).map_err(Error::io(&path))?
        } else {
            String::new()
        };
        let known = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
        let lines: Vec<Value> = known.filter(|l| l["step"].as_u64().is_some_and(|s| s <= step)).collect();
        let kept: String = lines.iter().map(|l| format!("{l}\n")).collect();
        atomic_file::write(&path, kept.as_bytes())?;
        let file = File::options().append(true).open(&path).map_err(Error::io(&path))?;
        Ok(Self { dir: dir.to_owned(), lines, file: BufWriter::new(file) })
    }

    fn write(&mut self, line: Value) -> Result<()> {
        let path = self.dir.join("log.jsonl");
        writeln!(self.file, "{line}").map_err(Error::io(&path))?;
        self.lines.push(line);
        Ok(())
    }

    pub(crate) fn step(&mut self, step: u64, losses: &Losses, rate: f64, elapsed: Duration) -> Result<()> {
        self.write(json!({
            "step": step, "loss": losses.total, "dssim": losses.dssim, "perceptual": losses.perceptual,
            "l1": losses.l1, "psnr": losses.psnr, "learning_rate": rate, "seconds": elapsed.as_secs_f64(),
        }))
    }

    pub(crate) fn validation(&mut self, step: u64, scores: &ValidationScores) -> Result<()> {
        let mut line = json!({ "step": step });
        scores.named().into_iter().for_each(|(name, value)| line[format!("val_{name}")] = json!(value));
        self.write(line)?;
        self.flush()
    }

    pub(crate) fn flush(&mut self) -> Result<()> {
        self.file.flush().map_err(Error::io(&self.dir.join("log.jsonl")))
    }

    /// Loss and validation PSNR over steps, as `curves.svg`.
    pub(crate) fn draw_curves(&self) -> Result<()> {
        let points = |key: &str| -> Vec<(f64, f64)> {
            self.lines.iter().filter_map(|l| Some((l["step"].as_f64()?, l[key].as_f64()?))).collect()
        };
        crate::plot::training_curves(
            &self.dir.join("curves.svg"),
            &smooth(&points("loss")),
            &points("val_loss"),
            &points("val_psnr"),
        )
    }
}

/// Step and scores of the validation with the lowest loss in the log of `dir`; none without a validation.
///
/// # Errors
/// When the log cannot be read.
pub(crate) fn best_validation(dir: &Path) -> Result<Option<(u64, ValidationScores)>> {
    let path = dir.join("log.jsonl");
    if !path.exists() {
        return Ok(None);
    }
    let text = std::fs::read_to_string(&path).map_err(Error::io(&path))?;
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let scores = lines.filter_map(|line| {
        // JSON has no infinity: the PSNR of equal images is written as null.
        let psnr = line["val_psnr"].as_f64().unwrap_or(f64::INFINITY);
        let (loss, ssim) = (line["val_loss"].as_f64()?, line["val_ssim"].as_f64()?);
        Some((line["step"].as_u64()?, ValidationScores { loss, ssim, psnr }))
    });
    Ok(scores.min_by(|a, b| a.1.loss.total_cmp(&b.1.loss)))
}

/// Mean over blocks so that at most 400 points are drawn.
fn smooth(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let mean = |block: &[(f64, f64)]| {
        let n = block.len() as f64;
        (block.iter().map(|p| p.0).sum::<f64>() / n, block.iter().map(|p| p.1).sum::<f64>() / n)
    };
    points.chunks(points.len().div_ceil(400).max(1)).map(mean).collect()
}

/// Writes a model with half-precision weights.
pub(crate) fn save_model(path: &Path, model: &Model) -> Result<()> {
    atomic_file::write(path, &model.to_bytes(WeightFormat::F16).map_err(Error::in_file(path))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_log_keeps_its_digits_and_drops_later_steps() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("log.jsonl");
        // Neighbours of doubles that a fast parser mistakes for each other.
        let kept = "{\"learning_rate\":0.0009829629131445341,\"loss\":0.22840115427970886,\"step\":6}\n";
        std::fs::write(&path, format!("{kept}{{\"loss\":0.5,\"step\":7}}\n{{\"loss\":0.5,\"st")).unwrap();
        drop(Log::open(dir.path(), 6).unwrap());
        assert_eq!(std::fs::read_to_string(&path).unwrap(), kept);
    }
}
