# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the extension and the program."""

import os
import sys
from pathlib import Path

import pytest

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent)]


@pytest.fixture(scope="session")
def program():
    """The program `aonet`: the variable AONET names it."""
    return os.environ["AONET"]
