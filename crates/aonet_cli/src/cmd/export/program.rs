//! What a graphics processor does, as data.

use super::{Args, Written};
use crate::setup;
use anyhow::{Context, Result, bail};
use aonet::gpu::program::ProgramBytes;
use aonet::gpu::{
    DepthEncoding, Kernels, Layers, NormalEncoding, NormalSpace, Precision, ProgramOptions, Template,
    TextureEncoding,
};
use aonet::net::gpu::Network;
use aonet::search::Classic;
use aonet::search::gpu::Method;
use aonet_scene::atomic_file;
use clap::builder::PossibleValue;
use serde_json::{Value, json};
use sha2::{Digest, Sha256};
use std::path::{Path, PathBuf};

/// Names of the files in the folder.
const JSON: &str = "program.json";
const BLOB: &str = "program.bin";

/// How a program is written.
#[derive(Debug, clap::Args)]
pub(super) struct ProgramArgs {
    /// Folder to write: program.json and program.bin. It is made if it does not exist.
    #[arg(long, value_name = "DIR")]
    program: Option<PathBuf>,
    /// Encoding of the normals' texture; shaders of the others differ in one line, which the file lists.
    #[arg(long, value_name = "ENCODING", requires = "program", default_value = "plain")]
    normals: Choice<NormalEncoding>,
    /// Space of the normals.
    #[arg(long, value_name = "SPACE", requires = "program", default_value = "view")]
    normal_space: Choice<NormalSpace>,
    /// Encoding of the depth texture; shaders of the others differ in two lines, which the file lists.
    #[arg(long, value_name = "ENCODING", requires = "program", default_value = "reversed")]
    depth: Choice<DepthEncoding>,
    /// Layers of depth: 2 binds a second depth texture.
    #[arg(long, value_name = "COUNT", requires = "program", default_value = "1",
        value_parser = clap::value_parser!(u8).range(1..=2))]
    layers: u8,
    /// Numbers to compute with. Half floats need the device's feature shader-f16; such a file can be run with 32-bit floats, too.
    /// Classic methods always compute with f32.
    #[arg(long, requires = "program", default_value = "f16")]
    precision: Choice<Precision>,
}

/// An option of the crate as a value of a flag, by its name in files.
#[derive(Debug, Clone, Copy)]
struct Choice<T>(T);

/// The choices of a flag.
macro_rules! choices {
    ($($ty:ty: $($name:literal = $value:expr),+;)+) => {$(
        impl clap::ValueEnum for Choice<$ty> {
            fn value_variants<'a>() -> &'a [Self] {
                &[$(Self($value)),+]
            }

            fn to_possible_value(&self) -> Option<PossibleValue> {
                [$(($name, $value)),+].into_iter().find(|(_, v)| *v == self.0).map(|(name, _)| PossibleValue::new(name))
            }
        }
    )+};
}

choices! {
    NormalEncoding: "plain" = NormalEncoding::Plain, "unorm" = NormalEncoding::Unorm,
        "octahedral" = NormalEncoding::Octahedral, "octahedral_unorm" = NormalEncoding::OctahedralUnorm;
    NormalSpace: "view" = NormalSpace::View, "world" = NormalSpace::World;
    DepthEncoding: "reversed" = DepthEncoding::Reversed, "standard" = DepthEncoding::Standard,
        "linear" = DepthEncoding::Linear;
    Precision: "f16" = Precision::F16, "f32" = Precision::F32;
}

/// Writes the program, if it is wanted.
pub(super) fn write(args: &Args) -> Result<Option<Written>> {
    let ProgramArgs { program: Some(folder), normals, normal_space, depth, layers, precision } =
        &args.program
    else {
        return Ok(None);
    };
    let layers = if *layers == 2 { Layers::Two } else { Layers::One };
    let textures =
        TextureEncoding { normals: normals.0, normal_space: normal_space.0, depth: depth.0, layers };
    let options = ProgramOptions { precision: precision.0, kernels: Kernels::Plain, textures };
    let template = template(args, options)?;
    let ProgramBytes { json, blob } = match args.size {
        None => template.to_bytes()?,
        Some(size) => template.at(size)?.to_bytes()?,
    };
    let sha256: String = Sha256::digest(&blob).iter().map(|byte| format!("{byte:02x}")).collect();
    let mut document: Value = serde_json::from_slice(&json)?;
    if args.size.is_none() {
        document["blob"]["file"] = json!(BLOB);
        document["blob"]["sha256"] = json!(sha256);
    }
    std::fs::create_dir_all(folder).with_context(|| format!("--program {}", folder.display()))?;
    let paths = [folder.join(BLOB), folder.join(JSON)];
    let json = serde_json::to_vec(&document)?;
    // The JSON comes last: where it is, the block is.
    atomic_file::write(&paths[0], &blob)?;
    atomic_file::write(&paths[1], &json)?;
    let facts = json!({ "program": {
        "paths": paths, "bytes": { "json": json.len(), "blob": blob.len() }, "sha256": sha256,
        "precision": template.precision(), "textures": document["textures"], "passes": template.pass_count(),
    }});
    let notes = vec![format!(
        "{} passes, {} shaders, {} bytes of weights, {}",
        template.pass_count(),
        template.shaders().len(),
        blob.len(),
        template.precision()
    )];
    Ok(Some(Written { facts, notes, paths: paths.into() }))
}

/// The program of a network or of a classic method.
fn template(args: &Args, options: ProgramOptions) -> Result<Template> {
    if let Some(method) = args.model.as_deref().and_then(classic) {
        if args.onnx.path.is_some() {
            bail!("--onnx: expected a network, found the classic method {}", method.name());
        }
        return Ok(Method::new(&method, options.textures)?.template()?);
    }
    Ok(Network::new(&args.model()?, options)?.template()?)
}

/// A classic method, unless there is a file of that name.
fn classic(name: &Path) -> Option<Classic> {
    if name.exists() { None } else { Classic::named(name.to_str()?).ok() }
}

impl Args {
    /// The network.
    pub(super) fn model(&self) -> Result<aonet::net::Model> {
        match &self.config {
            Some(config) => setup::untrained(config),
            None => setup::model(self.model.as_deref()),
        }
    }
}
