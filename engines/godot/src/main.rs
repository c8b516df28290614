//! `aonet_godot FOLDER OUT.tres`: the program that `aonet export --program FOLDER` wrote, as a resource of Godot.

use aonet_godot::Error;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let [folder, out] = &arguments[..] else {
        eprintln!("usage: aonet_godot FOLDER OUT.tres");
        return ExitCode::from(2);
    };
    match convert(folder.as_ref(), out.as_ref()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("aonet_godot: {}: {error}", folder.display());
            ExitCode::from(2)
        }
    }
}

fn convert(folder: &Path, out: &Path) -> Result<(), Error> {
    let read = |name| std::fs::read(folder.join(name)).map_err(|e| format!("{name}: {e}"));
    let text = aonet_godot::resource(&read("program.json")?, &read("program.bin")?)?;
    // A file under its final name is complete.
    let partial = out.with_extension("tres.partial");
    std::fs::write(&partial, text)
        .and_then(|()| std::fs::rename(&partial, out))
        .map_err(|e| format!("{}: {e}", out.display()))?;
    Ok(())
}
