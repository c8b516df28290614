"""Sessions, threads of Python, threads of a session, and processes."""

import concurrent.futures
import subprocess
import sys
import textwrap
import threading
import time

import aonet
import numpy as np
import pytest
from conftest import cast


def test_results_repeat(frame):
    session = aonet.Session(96, 64)
    runs = [session.run(frame.normal, frame.depth, **frame.camera) for _ in range(3)]
    runs += [aonet.infer(frame.normal, frame.depth, threads=n, **frame.camera) for n in (1, 2, 3)]
    assert all(np.array_equal(run, runs[0]) for run in runs)


def test_a_classic_session_is_the_function(frame):
    expected = aonet.classic("gtao", frame.normal, frame.depth, parameters={"slices": 5}, **frame.camera)
    session = aonet.ClassicSession(96, 64, "gtao", parameters={"slices": 5}, threads=2)
    for _ in range(2):
        assert np.array_equal(session.run(frame.normal, frame.depth, **frame.camera), expected)


def test_a_session_remembers_nothing_of_a_frame(frame):
    session = aonet.Session(96, 64, model="high")
    expected = session.run(frame.normal, frame.depth, **frame.camera)
    other = session.run(frame.normal, 2 * frame.depth, second=3 * frame.depth, fov_y=30.0, radius=1.0)
    assert not np.array_equal(other, expected)
    assert np.array_equal(session.run(frame.normal, frame.depth, **frame.camera), expected)


@pytest.mark.parametrize("share", [False, True])
def test_two_python_threads(share):
    """Two sessions at the same time, or two threads that take turns with one."""
    frames = [cast(fov_y=fov_y) for fov_y in (40.0, 60.0)]
    sessions = [aonet.Session(96, 64, threads=2) for _ in frames]
    sessions = sessions[:1] * 2 if share else sessions
    expected = [aonet.infer(f.normal, f.depth, **f.camera) for f in frames]
    assert not np.array_equal(*expected)

    def many(i):
        return [sessions[i].run(frames[i].normal, frames[i].depth, **frames[i].camera) for _ in range(10)]

    with concurrent.futures.ThreadPoolExecutor(2) as pool:
        for i, runs in enumerate(pool.map(many, range(2))):
            assert all(np.array_equal(run, expected[i]) for run in runs)


def moments_during(work):
    """How often another Python thread could run while `work` did."""
    moments, stop = [], threading.Event()

    def count():
        while not stop.wait(0.001):
            moments.append(time.perf_counter())

    other = threading.Thread(target=count)
    other.start()
    begin = time.perf_counter()
    work()
    end = time.perf_counter()
    stop.set()
    other.join()
    return sum(begin < moment < end for moment in moments)


def test_other_python_threads_run_meanwhile():
    frame = cast(640, 360)
    session = aonet.Session(640, 360, model="high", threads=1)
    assert moments_during(lambda: session.run(frame.normal, frame.depth, **frame.camera)) >= 5
    # Work of C that keeps the lock: nothing else runs.
    assert moments_during(lambda: sum(range(20_000_000))) <= 2


def run_alone(program):
    script = textwrap.dedent(program)
    return subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)


def test_a_fork_is_told_to_make_its_own_session():
    """A fork has none of the session's threads: waiting for them would never end."""
    done = run_alone("""
        import os, warnings
        import numpy as np, aonet
        warnings.simplefilter("ignore")
        normal, depth = np.zeros((16, 16, 3), np.float32), np.ones((16, 16), np.float32)
        normal[..., 2] = 1
        session = aonet.Session(16, 16, threads=3)
        expected = session.run(normal, depth, radius=0.5, fov_y=60.0)
        child = os.fork()
        if child == 0:
            try:
                session.run(normal, depth, radius=0.5, fov_y=60.0)
                os._exit(3)
            except RuntimeError as error:
                assert "fork" in str(error)
            # Ends the session: nothing else refers to it.
            del session
            own = aonet.infer(normal, depth, radius=0.5, fov_y=60.0, threads=2)
            os._exit(0 if np.array_equal(own, expected) else 4)
        print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
    """)
    assert (done.stdout, done.stderr) == ("0\n", "")


def test_a_session_ends_with_the_interpreter():
    done = run_alone("""
        import aonet
        session = aonet.Session(64, 64, threads=4)
        print("done")
    """)
    assert (done.returncode, done.stdout, done.stderr) == (0, "done\n", "")
