"""What the README and the example say runs as written."""

import pathlib
import re
import subprocess
import sys

import aonet
import numpy as np

HERE = pathlib.Path(__file__).resolve().parent
README = (HERE.parent / "README.md").read_text()


def run(folder, *arguments):
    done = subprocess.run([sys.executable, *arguments], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_readme(tmp_path, exr, deep_exr):
    """All of its Python, from top to bottom, beside the files that it names."""
    (tmp_path / "frame.exr").write_bytes(deep_exr.read_bytes())
    blocks = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    assert len(blocks) >= 3
    run(tmp_path, "-W", "error", "-c", "\n".join(blocks))
    first = aonet.load_ao(tmp_path / "ao.png")
    assert first.min() < 0.7 and first.max() > 0.9


def test_all_names_are_in_the_readme():
    missing = [name for name in aonet.__all__ if not name.startswith("_") and name not in README]
    assert not missing


def test_the_example(tmp_path, exr):
    script = str(HERE.parent / "examples" / "first_picture.py")
    assert "aonet" in run(tmp_path, script)
    picture = aonet.load_ao(tmp_path / "first_picture.png")
    assert picture.shape == (720, 1440)
    none, agtao, network = np.hsplit(picture[360:], 3)
    assert np.all(none == 1) and network.mean() < 0.95
    # Two methods for the same thing.
    assert aonet.compare(agtao, network).full.ssim > 0.9
    scores = run(tmp_path, script, str(exr)).splitlines()
    found = [float(re.search(r"psnr=([\d.]+)", line)[1]) for line in scores[:3]]
    assert found[2] > found[0] + 3, scores
