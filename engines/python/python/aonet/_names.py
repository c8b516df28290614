"""What can be chosen by name."""

from __future__ import annotations

from typing import NamedTuple

from . import _aonet, _checks


class Parameter(NamedTuple):
    """A parameter of a classic method."""

    name: str
    #: Its value in this method or preset.
    value: float
    #: Least value.
    low: float
    #: Largest value.
    high: float
    #: Whether it counts something.
    whole: bool
    #: What it does, and its unit.
    doc: str


def models() -> list[str]:
    """The networks that come with the package: values of ``model``."""
    return _aonet.models()


def methods() -> list[str]:
    """The classic methods, each followed by its presets: values of ``method``."""
    return _aonet.methods()


def parameters(method: str) -> list[Parameter]:
    """The parameters of a classic method or preset.

    Raises:
        ValueError: there is no such method.
    """
    name = _checks.text("method", method, "the name of a method")
    return [Parameter(*parameter) for parameter in _aonet.parameters(name)]


def precisions() -> list[str]:
    """The values of ``precision`` that this machine has instructions for."""
    return _aonet.precisions()
