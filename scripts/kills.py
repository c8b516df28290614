#!/usr/bin/env python3
"""Kills commands of aonet at random times and spoils their disk, starts them again, and compares what they leave with undisturbed runs.

    scripts/kills.py [--aonet PATH] [--kills 200] [--tries 20] [--seed 1] [--only NAME...] [--markdown FILE]

Every command first runs undisturbed. Then it is started and killed (SIGKILL) after a random share of that time, again and again; each
time the script checks that every file with a final name is whole. The command that is let alone in the end must leave the same files as the undisturbed
one, byte for byte. Then it runs on a disk that is too small; in a folder that is read-only; while its inputs are taken away after a random time; and twice at
the same time in one folder. `train` takes part if the program was built with the feature `train`. Needs nothing but Python and the program; full
disks and read-only folders need permission to mount a tmpfs.
"""
import argparse
import hashlib
import json
import pathlib
import random
import shutil
import subprocess
import sys
import tempfile
import time

VIEW = '{"eye":[0.5,3,5],"target":[0,0.5,0],"fov_y_deg":50,"width":160,"height":96,"radius":0.5}'
TINY_NETWORK = {
    "model": {"arch": "ao_net", "features": "normal", "patch": 4, "kernel": "off", "encoder": [8, 8], "decoder": [8]},
    "steps": 60, "batch": 2, "crop": 32, "learning_rate": 0.001, "loss": {"dssim": 1, "perceptual": 0, "vgg_layers": [], "l1": 1}, "augment": {"mirror": True, "roll": 0}, "seed": 1, "validate_every": 20, "validation_frames": 1, "checkpoint_every": 10,
}
# Fields that say when and for how long something ran.
TIMES = {"seconds", "ms", "elapsed", "time"}
FRAMES = ["--procedural", "street:0..2", "--width", "64", "--height", "48", "--spp", "16"]


def jobs(inputs):
    """Name, arguments of a command that runs in the folder that it writes to, and whether a second start continues the first one."""
    data = str(inputs / "data")
    frame = str(inputs / "frame.exr")
    return [
        ("dataset", ["dataset", "data", "--frames", "24", *FRAMES], True),
        ("train", ["train", str(inputs / "tiny.json"), "--dataset", data, "--dataset", str(inputs / "unseen"), "-o", "run"], True),
        ("tune", ["tune", "gtao", "--on", data, "--frames", "2", "--trials", "12", "-o", "gtao.json"], False),
        ("eval", ["eval", data, "--classic", "all", "--split", "train", "--json", "-o", "eval.json"], False),
        ("export", ["export", "balanced", "--onnx", "balanced.onnx"], False),
        ("infer", ["infer", frame, "-o", "ao.exr"], False),
        ("trace", ["trace", str(inputs / "scene.glb"), "--view", str(inputs / "view.json"), "--spp", "64", "-o", "frame.exr"], False),
    ]


def without_times(value):
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if k not in TIMES}
    return [without_times(v) for v in value] if isinstance(value, list) else value


def digest(path):
    """Of the contents; of JSON without the times, of safetensors with a sorted header."""
    data = path.read_bytes()
    if path.suffix == ".safetensors":
        length = int.from_bytes(data[:8], "little")
        data = json.dumps(json.loads(data[8:8 + length]), sort_keys=True).encode() + data[8 + length:]
    if path.suffix in (".json", ".jsonl"):
        lines = data.splitlines() if path.suffix == ".jsonl" else [data]
        data = json.dumps([without_times(json.loads(line)) for line in lines]).encode()
    return hashlib.sha256(data).hexdigest()


def contents(folder):
    return {str(p.relative_to(folder)): digest(p) for p in sorted(folder.rglob("*")) if p.is_file() and not temporary(p)}


def temporary(path):
    return path.name.startswith(".") or path.suffix == ".tmp"


def check_whole(folder, expected, grows, problems):
    """Every file with a final name equals the undisturbed one, or can at least be read if the command changes it as it goes on."""
    for path in folder.rglob("*"):
        if not path.is_file() or temporary(path):
            continue
        name = str(path.relative_to(folder))
        try:
            if digest(path) != expected.get(name) and not grows:
                problems.append(f"{name}: differs from the undisturbed run")
        except ValueError as error:
            problems.append(f"{name}: half written ({error})")


def torture(job, program, kills, chance, work):
    name, arguments, grows = job
    # In the folder, so that files which name their command are alike.
    run = lambda folder, do, **how: do([str(program), *arguments], cwd=folder, **how)
    calm = work / f"{name}_calm"
    calm.mkdir()
    began = time.monotonic()
    run(calm, subprocess.run, check=True, capture_output=True)
    whole = time.monotonic() - began
    expected, problems, done, finished, leftovers = contents(calm), [], 0, 0, 0
    folder = work / f"{name}_killed"
    while done < kills:
        folder.mkdir(exist_ok=True)
        process = run(folder, subprocess.Popen, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        try:
            process.wait(chance.uniform(0.0, whole))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            done += 1
            check_whole(folder, expected, grows, problems)
            if done < kills:
                continue
        # It came to its end, or it is let alone now.
        last = run(folder, subprocess.run, capture_output=True, text=True)
        if last.returncode != 0:
            problems.append(f"the last run fails: {last.stderr.strip()}")
        found = contents(folder)
        problems += [f"{f}: not as in the undisturbed run" for f in expected if found.get(f) != expected[f]]
        problems += [f"{f}: not in the undisturbed run" for f in found if f not in expected]
        leftovers += sum(temporary(p) for p in folder.rglob("*") if p.is_file())
        finished += 1
        shutil.rmtree(folder)
    return {"command": f"aonet {arguments[0]}", "seconds": round(whole, 2), "kills": done, "ends": finished,
            "files": len(expected), "temporary files left": leftovers, "problems": problems}


def full_disk(job, program, work):
    """Runs a command on a disk with half of the space that it needs, then with enough. Returns what is wrong, or None without permission to mount."""
    name, arguments, grows = job
    calm, folder, problems = work / f"{name}_calm", work / f"{name}_full", []
    expected, needed = contents(calm), sum(p.stat().st_size for p in calm.rglob("*") if p.is_file())
    mount = lambda *how: subprocess.run(["mount", "-t", "tmpfs", *how, "tmpfs", str(folder)], capture_output=True).returncode == 0
    run = lambda: subprocess.run([str(program), *arguments], cwd=folder, capture_output=True, text=True)
    folder.mkdir()
    page = 4096
    if not mount("-o", f"size={page + needed // 2 // page * page}"):
        return None
    try:
        (folder / ".filler").write_bytes(bytes(page))
        first = run()
        if first.returncode == 0 or "No space left" not in first.stderr:
            problems.append(f"full disk: status {first.returncode}, {first.stderr.strip()}")
        check_whole(folder, expected, grows, problems)
        mount("-o", f"remount,size={10 * needed + (1 << 20)}")
        second = run()
        if second.returncode != 0 or contents(folder) != expected:
            problems.append(f"after the full disk: status {second.returncode}, {second.stderr.strip()}")
    finally:
        subprocess.run(["umount", str(folder)], check=True)
    return problems


def read_only(job, program, work):
    """Runs a command in a read-only folder. Returns what is wrong, or None without permission to mount."""
    name, arguments, _ = job
    folder = work / f"{name}_read_only"
    folder.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "ro", "tmpfs", str(folder)], capture_output=True).returncode != 0:
        return None
    try:
        run = subprocess.run([str(program), *arguments], cwd=folder, capture_output=True, text=True)
    finally:
        subprocess.run(["umount", str(folder)], check=True)
    named = run.returncode == 2 and "Read-only file system" in run.stderr
    return [] if named else [f"read-only folder: status {run.returncode}, {run.stderr.strip()}"]


def vanishing(job, program, tries, chance, work, seconds):
    """Takes all inputs away while a command runs. It may be done with them; otherwise it must name one that is missing, and be complete when they
    are back. Returns the number of runs to the end and of errors, and what is wrong; or None of a command without inputs."""
    name, arguments, grows = job
    inputs, gone = work / "inputs", work / "gone"
    if not any(str(inputs) in argument for argument in arguments):
        return None
    expected, ends, errors, problems = contents(work / f"{name}_calm"), 0, 0, []
    for _ in range(tries):
        folder = work / f"{name}_vanishing"
        folder.mkdir()
        process = subprocess.Popen([str(program), *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        time.sleep(chance.uniform(0.0, seconds))
        inputs.rename(gone)
        said = process.communicate()[1]
        gone.rename(inputs)
        check_whole(folder, expected, grows, problems)
        if process.returncode == 0:
            ends += 1
        elif process.returncode == 2 and "No such file" in said and str(inputs) in said:
            errors += 1
            subprocess.run([str(program), *arguments], cwd=folder, capture_output=True)
        else:
            problems.append(f"inputs taken away: status {process.returncode}, {said.strip()}")
        if contents(folder) != expected:
            problems.append("inputs taken away: not as in the undisturbed run")
        shutil.rmtree(folder)
    return ends, errors, problems


def together(job, program, tries, chance, work, seconds):
    """Starts a command twice in one folder, the second a random time after the first. Returns what is wrong."""
    name, arguments, _ = job
    expected, problems = contents(work / f"{name}_calm"), []
    for _ in range(tries):
        folder = work / f"{name}_together"
        folder.mkdir()
        start = lambda: subprocess.Popen([str(program), *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        first = start()
        time.sleep(chance.uniform(0.0, seconds))
        second = start()
        for process in (first, second):
            said = process.communicate()[1]
            if process.returncode != 0:
                problems.append(f"two at once: status {process.returncode}, {said.strip()}")
        found = contents(folder)
        problems += [f"two at once: {f} differs" for f in sorted({*found, *expected}) if found.get(f) != expected.get(f)]
        shutil.rmtree(folder)
    return problems


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--aonet", type=pathlib.Path, default=pathlib.Path("target/release/aonet"))
    options.add_argument("--kills", type=int, default=200, help="of each command")
    options.add_argument("--tries", type=int, default=20, help="of each command without its inputs, and twice at once")
    options.add_argument("--seed", type=int, default=1)
    options.add_argument("--only", nargs="*", help="names of commands")
    options.add_argument("--markdown", type=pathlib.Path, help="file to write the table to")
    options = options.parse_args()
    program = options.aonet.resolve()
    no_training = subprocess.run([program, "train", "x", "--dataset", "y", "-o", "z"], capture_output=True, text=True)
    can_train = "without training" not in no_training.stderr
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        work = pathlib.Path(folder)
        inputs = work / "inputs"
        inputs.mkdir()
        (inputs / "view.json").write_text(VIEW)
        (inputs / "tiny.json").write_text(json.dumps(TINY_NETWORK))
        scene = pathlib.Path(__file__).resolve().parent.parent / "fuzz/seeds/gltf/everything.glb"
        shutil.copy(scene, inputs / "scene.glb")
        make = [["dataset", str(inputs / "data"), "--frames", "24", *FRAMES],
                ["dataset", str(inputs / "unseen"), "--frames", "2", "--split", "val", *FRAMES],
                ["trace", str(inputs / "scene.glb"), "--view", str(inputs / "view.json"), "--spp", "4", "-o", str(inputs / "frame.exr")]]
        for arguments in make:
            subprocess.run([program, *arguments], check=True, capture_output=True)
        chance = random.Random(options.seed)
        for job in jobs(inputs):
            if (options.only and job[0] not in options.only) or (job[0] == "train" and not can_train):
                continue
            row = torture(job, program, options.kills, chance, work)
            outcome = lambda found, good: "not tried" if found is None else "wrong" if found else good
            full, locked = full_disk(job, program, work), read_only(job, program, work)
            without = vanishing(job, program, options.tries, chance, work, row["seconds"])
            twice = together(job, program, options.tries, chance, work, row["seconds"])
            row["full disk"] = outcome(full, "error, then complete")
            row["read-only folder"] = outcome(locked, "error")
            row["inputs taken away"] = "has none" if without is None else "{} done, {} refused".format(*without)
            row["two at once"] = outcome(twice, "alike")
            for found in (full, locked, without and without[2], twice):
                row["problems"] += found or []
            rows.append(row)
            print(json.dumps(row), flush=True)
    if options.markdown:
        head = "| command | undisturbed s | kills | runs to the end | files | wrong or half-written | temporary files left | full disk | read-only folder | inputs taken away | two at once |\n|---|---:|---:|---:|---:|---:|---:|---|---|---|---|\n"
        line = lambda r: "| `{command}` | {seconds} | {kills} | {ends} | {files} | {n} | {temporary files left} | {full disk} | {read-only folder} | {inputs taken away} | {two at once} |\n".format(n=len(r["problems"]), **r)
        options.markdown.write_text(head + "".join(map(line, rows)))
    sys.exit(any(row["problems"] for row in rows))


if __name__ == "__main__":
    main()
