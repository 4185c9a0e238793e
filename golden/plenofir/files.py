"""Writing results: all files at once or none."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from plenofir.errors import InputError


def _cannot_write(out: Path, error: OSError) -> InputError:
    return InputError(
        f"cannot write: {error.strerror}",
        where=f"OUT ({out})",
        expected="a folder that can be written, with enough room",
    )


def publish(texts: Mapping[str, str], out: Path) -> None:
    """Write text files into a folder, each replacing its predecessor in one step.

    Parameters
    ----------
    texts
        File name to content.
    out
        Folder; made where it is missing.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        with tempfile.TemporaryDirectory(prefix="plenofir-") as staging:
            for name, text in texts.items():
                (Path(staging) / name).write_text(text)
            publish_files(Path(staging), out)
    except OSError as error:
        raise _cannot_write(out, error) from None


def publish_files(results: Path, out: Path) -> None:
    """Copy the files of a folder into another, each replacing its predecessor in one step.

    Parameters
    ----------
    results
        Folder with the files.
    out
        Folder; made where it is missing.

    Raises
    ------
    InputError
        If it cannot be written.
    """
    try:
        out.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=out, prefix=".plenofir-") as staging:
            for file in results.iterdir():
                if file.is_file():
                    shutil.copy(file, staging)
            for file in sorted(Path(staging).iterdir()):
                file.replace(out / file.name)
    except OSError as error:
        raise _cannot_write(out, error) from None
