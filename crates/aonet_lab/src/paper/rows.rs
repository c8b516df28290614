//! The rows of the paper's tables: their model files, their names here, and the paper's numbers.

use aonet::Size;
use aonet::net::{KernelWeights, Model, ModelConfig};
use aonet::search::Classic;
use aonet_scene::{Error, Result};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The paper's numbers of a row; missing ones are absent.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct PaperNumbers {
    /// SSIM on its own dataset.
    pub ssim: Option<f64>,
    /// PSNR on its own dataset (dB).
    pub psnr: Option<f64>,
    /// Run-time at 1280x720 on its GPU (ms).
    pub ms: Option<f64>,
}

/// One row of a table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PaperRow {
    /// Name of the model file, without seed and extension.
    pub key: &'static str,
    /// Its name in the table.
    pub label: &'static str,
    /// The paper's numbers.
    pub paper: PaperNumbers,
}

const fn row(key: &'static str, label: &'static str, paper: [f64; 3]) -> PaperRow {
    let paper = PaperNumbers { ssim: Some(paper[0]), psnr: Some(paper[1]), ms: Some(paper[2]) };
    PaperRow { key, label, paper }
}

const fn ours(key: &'static str, label: &'static str) -> PaperRow {
    PaperRow { key, label, paper: PaperNumbers { ssim: None, psnr: None, ms: None } }
}

/// The paper's network: a row of Tables 1 to 3, and the last one of Table 4.
pub const AO_NET: &str = "ao_net";

/// GTAO with the parameters of its source, and with ours.
pub const GTAO: &str = "gtao";
/// The same with parameters tuned on training frames.
pub const GTAO_TUNED: &str = "gtao:tuned";
/// The search that our network corrects.
pub const AGTAO: &str = "agtao:tuned";

// AO-Net Table 1, columns "our dataset" and run-time.
const DEEP_AO: PaperRow = row("deep_ao", "DeepAO", [0.9470, 24.40, 3.98]);
const DEEP_SHADING: PaperRow = row("deep_shading", "Deep Shading", [0.9597, 25.71, 6.09]);
const GTAO_ROW: PaperRow = PaperRow {
    key: GTAO,
    label: "GTAO, XeGTAO's High",
    paper: PaperNumbers { ssim: Some(0.9767), psnr: Some(26.10), ms: None },
};
const AO_NET_ROW: PaperRow = row(AO_NET, "AO-Net (paper's network)", [0.9802, 32.59, 3.92]);
const OURS: PaperRow = ours("ours", "ours");

/// AO-Net Table 1: against other methods.
pub const TABLE_1: [PaperRow; 12] = [
    ours("ssao:tuned", "SSAO, tuned"),
    ours("hbao:tuned", "HBAO, tuned"),
    ours("ssdo:tuned", "SSDO's occlusion, tuned"),
    ours("nnao", "NNAO"),
    ours("vbao:tuned", "visibility bitmask, tuned"),
    GTAO_ROW,
    ours(GTAO_TUNED, "GTAO, tuned"),
    ours(AGTAO, "GTAO, attenuated (ours), tuned"),
    DEEP_AO,
    DEEP_SHADING,
    AO_NET_ROW,
    OURS,
];

/// AO-Net Table 2: run-time at three sizes.
pub const TABLE_2: [PaperRow; 4] = [DEEP_AO, DEEP_SHADING, AO_NET_ROW, OURS];

/// AO-Net Table 2: the paper's run-times (ms) at [`SIZES`].
pub const TABLE_2_MS: [Option<[f64; 3]>; 4] =
    [Some([2.26, 3.96, 7.09]), Some([3.56, 6.09, 11.35]), Some([2.67, 3.92, 6.95]), None];

/// AO-Net Table 2: its three sizes.
pub const SIZES: [Size; 3] = [Size::px(540, 540), HD, Size::px(2048, 1024)];

/// The size that all other run-times are for.
pub const HD: Size = Size::px(1280, 720);

/// AO-Net Table 3: input features. The last one is ours.
pub const TABLE_3: [PaperRow; 4] = [
    row(AO_NET, "only normal", [0.9802, 32.59, 3.92]),
    row("normal_depth", "normal + depth", [0.9743, 30.51, 4.22]),
    row("normal_depth_normalized", "normal + normalised depth", [0.9786, 32.45, 4.22]),
    ours("normal_projected_radius", "normal + projected radius"),
];

/// AO-Net Table 4: patches and kernels.
pub const TABLE_4: [PaperRow; 4] = [
    row("base", "Base (U-Net)", [0.9880, 33.40, 20.55]),
    row("base_patch", "Base+Patch", [0.9732, 30.94, 3.60]),
    row("base_kernel", "Base+Kernel", [0.9887, 35.50, 22.78]),
    row(AO_NET, "Base+Patch+Kernel", [0.9802, 32.59, 3.92]),
];

/// Variants that the paper does not test.
pub const ABLATIONS: [PaperRow; 9] = [
    ours(AO_NET, "AO-Net, as in Table 1"),
    ours("normal_encoded", "normals as n/2 + 1/2"),
    ours("softmax", "kernels that sum to one"),
    ours("no_skips", "no skip connections"),
    ours("dssim_only", "loss: DSSIM only"),
    ours("l1_only", "loss: L1 only"),
    ours("vgg_off", "crops of 128, loss: DSSIM"),
    ours("vgg_relu1_2", "crops of 128, loss: DSSIM, VGG-19 relu1_2"),
    ours("vgg_relu2_2", "crops of 128, loss: DSSIM, VGG-19 relu2_2"),
];

/// The name of a row in figures: the shortest unambiguous one.
pub fn short_label(key: &str) -> String {
    let all = [&TABLE_1[..], &TABLE_3, &TABLE_4, &ABLATIONS].concat();
    let label = all.iter().find(|r| r.key == key).map_or(key, |r| r.label);
    label.split(" (").next().unwrap_or(label).to_owned()
}

/// The classic method of a row, if it is one: named as on the command line.
pub fn classic(key: &str) -> Option<Classic> {
    Classic::named(key).ok()
}

/// The configuration of a row of Table 4, for measuring its run-time before anything is trained.
pub fn untrained_config(key: &str) -> Option<ModelConfig> {
    let with = |kernel, config| Some(ModelConfig { kernel, ..config });
    match key {
        "base" => with(KernelWeights::Off, ModelConfig::full_resolution()),
        "base_patch" => with(KernelWeights::Off, ModelConfig::paper()),
        "base_kernel" => with(KernelWeights::Linear, ModelConfig::full_resolution()),
        AO_NET => with(KernelWeights::Linear, ModelConfig::paper()),
        _ => None,
    }
}

/// A network of a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Trained {
    /// Its file.
    pub path: PathBuf,
    /// The network.
    pub model: Model,
}

/// Trained networks by row; the seeds of a row are in the order of their numbers, the file without one first.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Models {
    rows: BTreeMap<String, Vec<Trained>>,
}

impl Models {
    /// Every `ROW.safetensors` and `ROW-SEED.safetensors` of a folder, and the best models of training runs in
    /// `ROW` and `ROW-SEED`.
    ///
    /// # Errors
    /// Names the folder that cannot be read, or the file that is no model.
    pub fn load(dir: &Path) -> Result<Self> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir(dir).map_err(Error::io(dir))? {
            let path = entry.map_err(Error::io(dir))?.path();
            let best = path.join("best.safetensors");
            if let Some((row, seed)) = row_and_seed(&path, best.is_file()) {
                found.push((row, seed, if best.is_file() { best } else { path }));
            }
        }
        found.sort();
        let mut rows: BTreeMap<String, Vec<Trained>> = BTreeMap::new();
        for (row, _, path) in found {
            let bytes = std::fs::read(&path).map_err(Error::io(&path))?;
            let model = Model::from_bytes(&bytes).map_err(Error::in_file(&path))?;
            rows.entry(row).or_default().push(Trained { path, model });
        }
        Ok(Self { rows })
    }

    /// The networks of a row, one per seed; none if it is not trained.
    pub fn seeds(&self, key: &str) -> &[Trained] {
        self.rows.get(key).map_or(&[], Vec::as_slice)
    }

    /// The network of a row that pictures show: its first seed.
    pub fn first(&self, key: &str) -> Option<&Model> {
        self.seeds(key).first().map(|t| &t.model)
    }

    /// The rows that have a network, in alphabetical order.
    pub fn keys(&self) -> impl Iterator<Item = &str> {
        self.rows.keys().map(String::as_str)
    }

    /// The rows that are in no table, in alphabetical order.
    pub fn others(&self) -> Vec<String> {
        let known = [&TABLE_1[..], &TABLE_3, &TABLE_4, &ABLATIONS].concat();
        self.keys().filter(|k| known.iter().all(|r| r.key != *k)).map(str::to_owned).collect()
    }
}

/// `row` and no seed of `row.safetensors`, `row` and 3 of `row-3.safetensors`, the same for runs; none for other files.
fn row_and_seed(path: &Path, is_run: bool) -> Option<(String, Option<u64>)> {
    let name = path.file_name()?.to_str()?;
    let stem = if is_run { name } else { name.strip_suffix(".safetensors")? };
    let numbered =
        stem.rsplit_once('-').and_then(|(row, seed)| Some((row.to_owned(), Some(seed.parse().ok()?))));
    Some(numbered.unwrap_or_else(|| (stem.to_owned(), None))).filter(|(row, _)| !row.is_empty())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paper::fixtures;

    #[test]
    fn seeds_belong_to_their_row_in_order() {
        let dir = tempfile::tempdir().unwrap();
        for name in ["base-10", "base-9", "base", "base_patch", "my-own"] {
            fixtures::save_model(dir.path(), name, ModelConfig::paper());
        }
        std::fs::write(dir.path().join("notes.txt"), "not a model").unwrap();
        std::fs::create_dir(dir.path().join("softmax-2")).unwrap();
        fixtures::save_model(&dir.path().join("softmax-2"), "best", ModelConfig::paper());
        std::fs::create_dir(dir.path().join("no_run")).unwrap();
        let models = Models::load(dir.path()).unwrap();
        let names = models.seeds("base").iter().map(|t| t.path.file_stem().unwrap().to_str().unwrap());
        assert_eq!(names.collect::<Vec<_>>(), ["base", "base-9", "base-10"]);
        assert_eq!(models.others(), ["my-own"]);
        assert_eq!(models.seeds("base_kernel"), []);
        assert_eq!(models.seeds("softmax").len(), 1);
        assert!(models.first("base_patch").is_some() && models.first("ao_net").is_none());
    }

    #[test]
    fn a_broken_model_and_a_missing_folder_are_named() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("base.safetensors"), "no").unwrap();
        assert!(Models::load(dir.path()).unwrap_err().to_string().contains("base.safetensors"));
        let absent = dir.path().join("absent");
        assert!(Models::load(&absent).unwrap_err().to_string().contains("absent"));
    }

    #[test]
    fn labels_in_figures_are_short() {
        assert_eq!(short_label(AO_NET), "AO-Net");
        assert_eq!((short_label("base"), short_label("my-own")), ("Base".into(), "my-own".into()));
        assert_eq!(untrained_config("base").unwrap().patch, 1);
        assert_eq!(untrained_config(AO_NET).unwrap(), ModelConfig::paper());
        assert!(untrained_config("deep_ao").is_none());
    }
}
