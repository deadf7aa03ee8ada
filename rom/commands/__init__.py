"""Sub-commands of `rom`, one a file: each offers ``add(commands)``, which adds its parser."""
