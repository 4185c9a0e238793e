# SPDX-License-Identifier: Apache-2.0
"""One Verilog module with parameters of sizes, over the cores of several scenes.

The frame's size stays a parameter, because the cores take it at run time. Every other size shapes a
core, so that each scene is synthesised, and the module's parameters choose among them.
"""

import re
from collections.abc import Sequence
from pathlib import Path

from plenofir.fpga import hdl
from plenofir.fpga.core.configuration import MAX_ROWS
from plenofir.ground.errors import InputError
from plenofir.ground.files import publish
from plenofir.plan.configure import needed_sources
from plenofir.plan.plan import Plan
from plenofir.plan.verilog import lint_head, synthesised

MODULE = "plenofir_refocuser"
"""The module; its file is named after it."""
_MISSING = f"{MODULE}_has_no_core_of_these_sizes"
# Ports of every core, with the highest bit of each vector.
_WORD = "PIXELS_PER_CLOCK*CHANNELS*PIXEL_BITS-1"
_INPUTS = {
    "clk": "", "reset": "", "slice": "7", "sweep": "", "sweep_frames": "7", "s_axis_tvalid": "",
    "s_axis_tdata": _WORD, "s_axis_tuser": "", "s_axis_tlast": "", "m_axis_tready": "",
    "error_clear": "",
}  # fmt: skip
_OUTPUTS = {
    "s_axis_tready": "", "m_axis_tvalid": "", "m_axis_tdata": _WORD, "m_axis_tuser": "",
    "m_axis_tid": "7", "m_axis_tlast": "", "error_flags": "4",
}  # fmt: skip


def _sizes(plan: Plan) -> dict[str, int]:
    """Parameters that choose a core, beside the line that it must be long enough for."""
    core = plan.core
    return {
        "MICRO_IMAGE_SIZE": core.micro_image_size,
        "SLICES": len(core.shifts),
        "PIXELS_PER_CLOCK": core.pixels_per_clock,
        "CHANNELS": core.channels,
        "PIXEL_BITS": core.pixel_bits,
    }


def _words(plan: Plan) -> str:
    """Sizes of a core, as a line of the module's head and of errors."""
    sizes = ", ".join(f"{name} {value}" for name, value in _sizes(plan).items())
    return f"{sizes}, COLUMNS up to {plan.core.max_columns}"


def _refuse(plans: Sequence[Plan]) -> None:
    """InputError for scenes that the module cannot hold, and for two that it cannot tell apart."""
    scenes: dict[str, str] = {}
    for plan in plans:
        if plan.sensor is not None or plan.screen.needs_stack:
            feature = "a sensor" if plan.sensor is not None else "all slices at once"
            raise InputError(
                f"has {feature}, which the ports of {MODULE} leave out; "
                "plenofir configure --verilog writes it",
                where=plan.scene,
            )
        first = scenes.setdefault(_words(plan), plan.scene)
        if first is not plan.scene:
            raise InputError(
                f"has the sizes of {first} ({_words(plan)}), so that no parameter chooses it; "
                "leave one of both out",
                where=plan.scene,
            )


def _core(plan: Plan, module: str) -> str:
    """The modules of a scene's core, all of whose names begin with `module`."""
    entity = plan.core.engine.ENTITY
    used = f"entity work.{entity}"
    sources = needed_sources(used, "", hdl.all_sources(), plan.core.unbuilt)
    text = synthesised(sources, entity, plan.core.generics(), written={})
    names = {name: f"{module}_{name}" for name in re.findall(r"^module (\w+)", text, re.M)}
    names[entity] = module
    # A name stands behind `module`, or before the label of an instance.
    return re.sub(
        r"^(module |  )(\w+)(?=$| \w+ \()",
        lambda word: word[1] + names.get(word[2], word[2]),
        text,
        flags=re.M,
    )


def _ports() -> list[str]:
    """Declarations of the module's ports."""
    kinds = [("input  wire", _INPUTS), ("output wire", _OUTPUTS)]
    return [
        f"    {kind} {f'[{bits}:0] ' if bits else ''}{name}"
        for kind, ports in kinds
        for name, bits in ports.items()
    ]


def module_text(plans: Sequence[Plan]) -> str:
    """Verilog-2001 of the module whose parameters choose the core `MODULE`_1, _2, ... of a scene.

    Without parameters it is the first scene. Of cores that differ in their longest line alone the
    shortest that is long enough is taken. Sizes of no core end every tool with the name of a module
    that does not exist, the one error that elaboration has in Verilog-2001.
    """
    first = plans[0]
    defaults = {"COLUMNS": first.columns, "ROWS": first.rows, **_sizes(first)}
    numbered = sorted(enumerate(plans, 1), key=lambda one: one[1].core.max_columns)
    branches = []
    for number, plan in numbered:
        sizes = [f"{name} == {value}" for name, value in _sizes(plan).items()]
        condition = " &&\n        ".join(["FRAME", *sizes, f"COLUMNS <= {plan.core.max_columns}"])
        connected = ["columns(COLUMNS[15:0])", "rows(ROWS[15:0])"]
        connected += [f"{name}({name})" for name in (*_INPUTS, *_OUTPUTS)]
        branches += [
            f"if ({condition}) begin : core_{number}",
            f"      {MODULE}_{number} core (",
            ",\n".join(f"          .{port}" for port in connected),
            "      );",
            "    end else ",
        ]
    cores = [
        f"//   {plan.scene}, a = {' '.join(part.a for part in plan.slices)}:\n//     {_words(plan)}"
        for plan in plans
    ]
    chain = "\n".join(branches).replace("else \n", "else ")
    return "\n".join(
        [
            "// A refocuser whose parameters choose one of these cores and the size of its frames:",
            *cores,
            f"// COLUMNS is 1 at least, ROWS 1 to {MAX_ROWS}. Other sizes end elaboration with the "
            "name of a missing module,",
            f"// {_MISSING}.",
            f"module {MODULE} #(",
            ",\n".join(
                f"    parameter integer {name} = {value}" for name, value in defaults.items()
            ),
            ") (",
            ",\n".join(_ports()),
            ");",
            "",
            f"  localparam FRAME = COLUMNS > 0 && ROWS > 0 && ROWS <= {MAX_ROWS};",
            "",
            "  generate",
            f"    {chain}begin : none",
            f"      {_MISSING} see_the_cores_above (clk);",
            "    end",
            "  endgenerate",
            "",
            "endmodule",
        ]
    )


def write_module(plans: Sequence[Plan], out: Path) -> Path:
    """Write `MODULE` with the cores of scenes, alone in one file, and return its path.

    InputError for a scene with a sensor or a stack, for two scenes with the same sizes, and if GHDL
    is not installed.
    """
    _refuse(plans)
    names = ", ".join(plan.scene for plan in plans)
    head = lint_head(f"Cores of {names}, written by plenofir verilog")
    cores = [_core(plan, f"{MODULE}_{number}") for number, plan in enumerate(plans, 1)]
    publish({f"{MODULE}.v": "\n\n".join([head, module_text(plans), *cores, ""])}, out)
    return out / f"{MODULE}.v"
