# SPDX-License-Identifier: Apache-2.0
"""Builds one design of a hunt and runs its streams in a simulator."""

import importlib
import json
import random
import re
import shutil
import subprocess
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cocotb_tools.runner import get_runner

from hunt import VARIABLE
from hunt.start_values import with_start_values
from plenofir.fpga import hdl
from plenofir.fpga.hdl_text import used_components, used_units
from plenofir.fpga.tools.simulators import coverage_options, find_simulator
from plenofir.ground import project
from plenofir_tb.runner import simulator_name
from plenofir_tb.wrapper import TOP, wrapper

FOLDER = project.root() / "build" / "hunt"
STREAMS = 12
"""Streams of a design."""
ENDED = "bound check failure|out of bounds|outside of|assertion failed"
"""What a simulator says where start values contradict each other."""
Change = Callable[[list[Path], Path], list[Path]]


@dataclass
class Result:
    """Result of a design: number of cases, counts of each kind, and its fault."""

    name: str
    streams: int = 0
    counts: Counter[str] = field(default_factory=Counter)
    fault: str = ""
    waves: Path | None = None  # its waveform, if there is one


def entities() -> list[str]:
    """Names of the entities that have a hunt."""
    return sorted(p.stem.removesuffix("_hunt") for p in Path(__file__).parent.glob("*_hunt.py"))


def _closure(top: str) -> list[Path]:
    """Sources that an entity needs, in order; a bench in VHDL comes last."""
    sources = hdl.all_sources()
    benches = {path.stem: path for path in (project.root() / "tb").rglob("*.vhd")}
    by_name = {source.stem: source for source in sources} | {
        name: path for name, path in benches.items() if name == top
    }
    needed, todo = set(), [top]
    while todo:
        name = todo.pop()
        if name in by_name and name not in needed:
            needed.add(name)
            text = by_name[name].read_text()
            todo += used_units(text) | used_components(text)
    order = [source for source in sources if source.stem in needed]
    return order + [benches[name] for name in [top] if name in benches]


def _module(entity: str) -> Any:
    return importlib.import_module(f"hunt.{entity}_hunt")


def sources_of(entity: str) -> list[Path]:
    """Sources that a hunt builds."""
    return _closure(_module(entity).ENTITY)


def started_sources() -> set[Path]:
    """Sources whose registers start with drawn values, in each hunt that builds them."""
    kept = {name for entity in entities() for name in getattr(_module(entity), "KEEP", ())}
    return {s for entity in entities() for s in sources_of(entity) if s.name not in kept}


def run_design(
    entity: str,
    number: int,
    *,
    streams: int = STREAMS,
    change: Change | None = None,
    waves: bool = False,
) -> Result:
    """Run the design and the streams of a number, and write a waveform of all signals if asked to.

    `change` copies the sources into a folder, changed.
    """
    module = _module(entity)
    rng = random.Random(f"{entity} {number}")
    design = module.draw(rng)
    result = Result(f"{entity}-{number}")
    scratch = FOLDER / f"{result.name}{'-changed' if change else ''}"
    shutil.rmtree(scratch, ignore_errors=True)
    scratch.mkdir(parents=True)
    sources = _closure(module.ENTITY)
    if change:
        sources = change(sources, scratch / "changed")
    verdicts = scratch / "verdicts"
    order = {
        "entity": entity,
        "number": number,
        "streams": streams,
        "design": design,
        "verdicts": str(verdicts),
    }
    (scratch / "order.json").write_text(json.dumps(order, indent=1))
    # Contradicting start values may leave ranges or break asserted promises before the reset. That
    # ends a simulation but is no fault: then fewer values are drawn.
    shares = [1, 0.5, 0.25, 0.1, 0] if rng.random() < 0.5 else [0]
    for share in shares:
        used = sources
        if share:
            keep = getattr(module, "KEEP", ())
            used = with_start_values(sources, scratch / "started", rng, share=share, keep=keep)
        dump = scratch / f"waves.{'ghw' if simulator_name() == 'ghdl' else 'fst'}"
        result.waves = dump if waves else None
        log = _simulate(module.ENTITY, design["generics"], used, order, scratch, result.waves)
        if verdicts.exists() or not re.search(ENDED, log):
            break
    result.counts[f"designs: {share:.0%} of the start values drawn"] += 1
    for line in verdicts.read_text().splitlines() if verdicts.exists() else []:
        verdict = json.loads(line)
        result.streams += 1
        result.counts.update(verdict["counts"])
        if verdict["fault"]:
            result.fault = f"stream {verdict['stream']}: {verdict['fault']}"
    if not result.fault and result.streams < streams:
        told = [line for line in log.splitlines() if "rror" in line][:3] or log.splitlines()[-5:]
        result.fault = f"stream {result.streams}: the simulation ended: {' | '.join(told)}"
    if not result.fault and not waves:
        shutil.rmtree(scratch)
    return result


def _simulate(
    top: str,
    generics: dict[str, Any],
    sources: Sequence[Path],
    order: dict[str, Any],
    scratch: Path,
    waves: Path | None,
) -> str:
    """Analyse and run; result: output of the tools."""
    name = simulator_name()
    case = scratch / f"{TOP}.vhd"
    case.write_text(wrapper([(top, generics)], sources))
    simulator = find_simulator(name, brief=True)
    runner = get_runner(name)
    logs = [scratch / "build.log", scratch / "run.log"]
    run_options = ["--ieee-asserts=disable", "--max-stack-alloc=0"] if name == "ghdl" else []
    if waves:
        run_options.append(f"--wave={waves}")
    try:
        runner.build(
            sources=[*sources, case],
            hdl_toplevel=TOP,
            build_args=simulator.global_options(),
            build_dir=scratch / "work",
            log_file=logs[0],
        )
        runner.test(
            test_module="hunt.bench",
            hdl_toplevel=TOP,
            hdl_toplevel_lang="vhdl",
            build_dir=scratch / "work",
            test_dir=scratch / "work",
            elab_args=coverage_options(simulator.name),
            test_args=simulator.global_options() if name == "ghdl" else [],
            plusargs=run_options,
            seed=1,
            extra_env={
                VARIABLE: json.dumps(order),
                "COCOTB_LOG_LEVEL": "WARNING",
                "COCOTB_REWRITE_ASSERTION_FILES": "",
                "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",
            },
            results_xml=str(scratch / "results.xml"),
            log_file=logs[1],
        )
    except (RuntimeError, SystemExit, subprocess.CalledProcessError):
        pass
    return "\n".join(log.read_text(errors="replace") for log in logs if log.exists())
