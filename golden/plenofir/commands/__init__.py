"""The command ``plenofir``: one module for each group of commands."""
