"""What the add-on says when it cannot go on."""


class SolidError(Exception):
    """What is wrong, in which file, and what to do: shown as it is, in Blender's status bar and by render.py."""
