//! The project's documents: links lead somewhere, and the README stays short.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Most words of the README.
const README_WORDS: usize = 900;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_owned()
}

/// Every Markdown file of the project, without what is built.
fn documents() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root(), root().join("docs"), root().join("results"), root().join("results/paper")];
    folders.push(root().join("docs/decisions"));
    for engine in std::fs::read_dir(root().join("engines")).into_iter().flatten() {
        folders.push(engine.unwrap().path());
    }
    for folder in folders.iter().filter(|folder| folder.is_dir()) {
        let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        found.extend(files.filter(|path| path.extension().is_some_and(|e| e == "md")));
    }
    found.sort();
    found
}

/// The text outside of fenced code, line by line.
fn prose(text: &str) -> impl Iterator<Item = &str> {
    let mut code = false;
    text.lines().filter(move |line| {
        let fence = line.trim_start().starts_with("```");
        code ^= fence;
        !code && !fence
    })
}

/// Where the links of a line lead.
fn targets(line: &str) -> impl Iterator<Item = &str> {
    line.split("](").skip(1).filter_map(|rest| rest.split_once(')')).map(|(target, _)| target)
}

/// The anchors of a document's headings, as code hosts make them.
fn anchors(text: &str) -> Vec<String> {
    let slug = |heading: &str| -> String {
        let kept = heading.trim().chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
    };
    let heading = |line: &str| line.starts_with('#').then(|| slug(line.trim_start_matches('#')));
    prose(text).filter_map(heading).collect()
}

#[test]
fn links_lead_somewhere() {
    let documents = documents();
    assert!(documents.len() > 10, "{documents:?}");
    let (mut broken, mut links) = (Vec::new(), 0);
    for document in &documents {
        let text = std::fs::read_to_string(document).unwrap();
        for target in prose(&text).flat_map(targets).filter(|target| !target.contains("://")) {
            links += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let path = if file.is_empty() { document.clone() } else { document.parent().unwrap().join(file) };
            let known = |text: String| anchor.is_empty() || anchors(&text).contains(&anchor.to_owned());
            let leads = path.is_dir()
                || path.exists() && (anchor.is_empty() || std::fs::read_to_string(&path).is_ok_and(known));
            if !leads {
                broken.push(format!("{}: {target}", document.strip_prefix(root()).unwrap().display()));
            }
        }
    }
    assert!(links > 50, "{links} links");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn the_readme_is_short() {
    let text = std::fs::read_to_string(root().join("README.md")).unwrap();
    let words = text.split_whitespace().count();
    assert!(words <= README_WORDS, "{words} words");
}

/// The first program of the README in a crate that depends on `aonet` alone, as a stranger would try it.
#[test]
fn the_readmes_program_compiles_as_a_crate_of_its_own() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let program = readme.split("```rust,no_run\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    assert!(program.lines().all(|line| !line.starts_with('#')), "lines that only rustdoc hides");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("stranger");
    std::fs::create_dir_all(folder.join("src")).unwrap();
    let aonet = root().join("crates/aonet");
    let manifest = format!(
        "[package]\nname = \"stranger\"\nedition = \"2024\"\n\n[dependencies]\naonet = {{ path = {aonet:?} }}\n\n[workspace]\n"
    );
    let check = |program: &str| {
        std::fs::write(folder.join("Cargo.toml"), &manifest).unwrap();
        std::fs::write(folder.join("src/main.rs"), program).unwrap();
        std::fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
        let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or("cargo".into()));
        let target = folder.join("target");
        cargo.args(["check", "--offline", "--quiet"]).env("CARGO_TARGET_DIR", target).current_dir(&folder);
        cargo.output().unwrap()
    };
    let output = check(program);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    // The test can fail: what is not public does not compile.
    let output = check(&program.replace("aonet::net::{", "aonet::threads::{"));
    assert!(String::from_utf8_lossy(&output.stderr).contains("threads"), "{output:?}");
}

#[test]
fn anchors_are_those_of_code_hosts() {
    let text = "# On your G-buffers\n```\n# not a heading\n```\n## What `fast` is, what not\n";
    assert_eq!(anchors(text), ["on-your-g-buffers", "what-fast-is-what-not"]);
    assert_eq!(targets("[a](b.md#c) and ![d](e.png)").collect::<Vec<_>>(), ["b.md#c", "e.png"]);
}

#[test]
fn committed_weights_name_no_folder_of_a_machine() {
    let folders = ["assets/models/rows", "assets/models/small_radius", "crates/aonet/models"];
    let files = folders.iter().flat_map(|folder| std::fs::read_dir(root().join(folder)).unwrap());
    let files = files.map(|file| file.unwrap().path());
    let mut commands = 0;
    for path in files.filter(|path| path.extension().is_some_and(|e| e == "safetensors")) {
        // NNAO's weights are no model.
        let Ok(model) = aonet::net::Model::from_bytes(&std::fs::read(&path).unwrap()) else { continue };
        let command = &model.facts().command;
        let absolute = command.split_whitespace().find(|word| Path::new(word).is_absolute());
        assert_eq!(absolute, None, "{}: {command}", path.display());
        commands += usize::from(!command.is_empty());
    }
    assert!(commands > 10, "{commands} commands");
}
