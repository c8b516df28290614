//! Runs the program in a folder, and checks its output.
#![allow(dead_code, reason = "not every test needs everything")]

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Output};

/// `aonet` with the words of a line, in `folder`.
pub(crate) fn aonet(folder: &Path, line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_aonet"));
    command.args(line.split_whitespace()).current_dir(folder);
    command
}

/// stdout of a command that must succeed.
pub(crate) fn ok(folder: &Path, line: &str) -> String {
    let output = aonet(folder, line).output().unwrap();
    assert_eq!(output.status.code(), Some(0), "aonet {line}\n{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The same, of a command that prints JSON.
pub(crate) fn json(folder: &Path, line: &str) -> Value {
    serde_json::from_str(&ok(folder, line)).unwrap()
}

/// The message of a command that cannot run.
pub(crate) fn refusal(output: &Output) -> String {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    stderr
}
