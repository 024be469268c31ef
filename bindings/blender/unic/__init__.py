# SPDX-License-Identifier: GPL-3.0-or-later OR MIT OR Apache-2.0
"""Neural garments in Blender: capture, train, play live and bake, by the program `unic`."""

from __future__ import annotations

import bpy

from . import bake, export, live, panel, settings, train

CLASSES = (*settings.CLASSES, *export.CLASSES, *train.CLASSES, *live.CLASSES, *bake.CLASSES, *panel.CLASSES)


def register() -> None:
    """Adds the settings, the operators and the panels."""
    for made in CLASSES:
        bpy.utils.register_class(made)
    settings.register()
    live.register()


def unregister() -> None:
    """Ends what is at work, and removes everything that `register` has added."""
    train.unregister()
    live.unregister()
    settings.unregister()
    for made in reversed(CLASSES):
        bpy.utils.unregister_class(made)
