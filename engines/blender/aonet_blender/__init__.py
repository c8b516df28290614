# SPDX-License-Identifier: GPL-3.0-or-later
"""Ambient occlusion by aonet: a panel in the render properties, an image, a compositor group."""

from . import interface


def register() -> None:
    """Called by Blender when the extension is enabled."""
    interface.register()


def unregister() -> None:
    """Called by Blender when the extension is disabled."""
    interface.unregister()
