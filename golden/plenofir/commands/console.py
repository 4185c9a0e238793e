# SPDX-License-Identifier: Apache-2.0
"""What commands print: lines, tables, JSON and progress bars."""

import json
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import typer

# Commands that end earlier say nothing of their steps where no terminal shows them.
QUIET_SECONDS = 5.0
# A step that lasts is told again.
_AGAIN_SECONDS = 20.0


def print_line(name: str, text: object) -> None:
    """Print a line of a summary."""
    typer.echo(f"{name:<11} {text}")


def print_lines(*lines: str) -> None:
    """Print lines, those that are empty left out."""
    for line in filter(None, lines):
        typer.echo(line)


_notes: list[str] = []


def note(text: str) -> None:
    """Keep a note on the result, for `print_notes`: a command that fails prints its error alone."""
    _notes.append(text)


def print_notes(*, drop: bool = False) -> None:
    """Print the notes on standard error, or drop them."""
    for text in () if drop else dict.fromkeys(_notes):
        typer.echo(f"note: {text}", err=True)
    _notes.clear()


def print_json(content: Any) -> None:
    """Print JSON."""
    typer.echo(json.dumps(content, indent=2, allow_nan=False))


def print_table(
    columns: Sequence[str],
    rows: Iterable[Sequence[str]],
    *,
    title: str = "",
    left: Sequence[str] = (),
    width: int = 0,
) -> None:
    """Print a table: columns in `left` are aligned left, and it is never narrower than `width`."""
    from rich.console import Console
    from rich.table import Table

    if title:
        typer.echo(title)
    table = Table()
    for column in columns:
        table.add_column(column, justify="left" if column in left else "right")
    for row in rows:
        table.add_row(*row)
    Console(width=max(Console().width, width)).print(table)


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[[int, int], None]]:
    """Progress bar on standard error, to be called with what is done and what there is to do."""
    with steps_bar(description) as show:
        yield lambda done, total: show(description, done, total)


@contextmanager
def steps_bar(
    description: str, quiet_seconds: float | None = None
) -> Iterator[Callable[[str, int, int], None]]:
    """Progress on standard error, of one named step after the other.

    A bar on a terminal, otherwise a line for each step once `quiet_seconds` have passed, and how
    far a step is that lasts.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.file.isatty():
        lines = _StepLines(description, QUIET_SECONDS if quiet_seconds is None else quiet_seconds)
        try:
            yield lines.show
        finally:
            lines.timer.cancel()
        return
    columns = (TextColumn("{task.description:<20}"), BarColumn(), TimeRemainingColumn())
    with Progress(*columns, transient=True, console=console) as bars:
        task = bars.add_task(description, total=None)
        yield lambda step, done, total: bars.update(
            task, description=step, completed=done, total=total
        )


class _StepLines:
    """A line for each step of something that takes long."""

    def __init__(self, description: str, quiet_seconds: float) -> None:
        self.begin, self.quiet_seconds = time.monotonic(), quiet_seconds
        self.now, self.told, self.told_at = (description, 0, 0), ("", ""), self.begin
        # The timer tells from a thread of its own.
        self.lock = threading.Lock()
        self.timer = threading.Timer(quiet_seconds, self.tell)
        # A command that ends sooner does not wait for it.
        self.timer.daemon = True
        if quiet_seconds > 0:
            self.timer.start()

    def show(self, step: str, done: int, total: int) -> None:
        """Take note of a step, and tell it unless it is too early."""
        self.now = step, done, total
        if time.monotonic() - self.begin >= self.quiet_seconds:
            self.tell()

    def tell(self) -> None:
        """The line of the present step: once, and later how far it is."""
        with self.lock:
            step, done, total = self.now
            share = f" ({min(done + 1, total)} of {total})" if total else ""
            line, now = (step, share), time.monotonic()
            lasts = now - self.told_at >= _AGAIN_SECONDS and line != self.told
            if step == self.told[0] and not lasts:
                return
            self.told, self.told_at = line, now
            typer.echo(f"{now - self.begin:5.0f} s  {step}{share}", err=True)


@contextmanager
def kept_bars() -> Iterator[Callable[[str, int, int], None]]:
    """Progress bars on standard output, one for each step, which stay when it is done."""
    from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

    bars = Progress(
        TextColumn("{task.description:<20}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f} %"),
        TimeRemainingColumn(elapsed_when_finished=True),
    )
    tasks: dict[str, TaskID] = {}

    def show(step: str, done: int, total: int) -> None:
        bars.start()
        if step not in tasks:
            tasks[step] = bars.add_task(step, total=total)
        bars.update(tasks[step], completed=done)

    try:
        yield show
    finally:
        if tasks:
            bars.stop()
