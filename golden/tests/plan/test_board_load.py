# SPDX-License-Identifier: Apache-2.0
"""Calibrations for a board's serial port: sent words, and refusals."""

from pathlib import Path

import pytest
from in_process import plenofir

from plenofir.camera.calibration import Calibration, calibration_of_grid
from plenofir.ground.errors import InputError
from plenofir.plan import load_scene, make_plan
from plenofir.plan.sensor.board_load import described, description, load_board, load_lines
from plenofir.plan.sensor.chip import loads, resampling
from plenofir.plan.sensor.resampler import ResamplerConfiguration
from plenofir_studies.synthetic import regular_grid

SHAPE = (61, 83)
SCENE = """
name = "small"
camera = { micro_image_size = 5 }
sensor = { columns = 83, rows = 61, pitch_px = 5.4, rotation_degrees = 1.0 }
depth = { slices = ["1/5"] }
"""


def camera(
    pitch: float = 5.4,
    layout: str = "rectangular",
    shape: tuple[int, int] = SHAPE,
    turn: float = 0.7,
) -> Calibration:
    grid = regular_grid(shape, pitch, rotation_degrees=turn, layout=layout)  # type: ignore[arg-type]
    return calibration_of_grid(grid, shape).model_copy(update={"shading": (-0.1, 0.05, 0.0)})


class Board:
    """A board that answers as load_port does."""

    def __init__(
        self, core: ResamplerConfiguration | None, *, breaks: int = -1, left: bool = False
    ) -> None:
        self.core, self.breaks = core, breaks
        # Part of a line is left from another load; during its answer, the board ignores input.
        self.left, self.deaf = left, False
        self.lines: list[str] = []
        self.answers: list[bytes] = []

    def write(self, data: bytes, /) -> object:
        line = data.decode().removesuffix("\r")
        if self.deaf:
            self.deaf = False
            return None
        if self.left:
            answer, self.left, self.deaf = "error", False, True
        elif line == "l ?":
            answer = "error" if self.core is None else description(self.core)
        elif line:
            self.lines.append(line)
            answer = "error" if len(self.lines) == self.breaks else "ok"
        else:
            return None
        self.answers.append(f"{answer}\r\n".encode())
        return None

    def readline(self) -> bytes:
        """Answer to it."""
        return self.answers.pop(0)


def test_words_go_out_as_the_load_port_wants_them() -> None:
    chip = resampling(camera(), 5)
    board = Board(chip.core)
    assert load_board(board, camera(), name="/dev/ttyUSB1") == chip.core
    words = [(int(line[2:3], 16), int(line[3:8], 16), int(line[8:], 16)) for line in board.lines]
    assert words == chip.loads()
    assert board.lines == load_lines(chip.loads())


def test_load_behind_one_that_was_broken_off() -> None:
    chip = resampling(camera(), 5)
    board = Board(chip.core, left=True)
    load_board(board, camera(), name="port")
    assert board.lines == load_lines(chip.loads())


@pytest.mark.parametrize(
    ("other", "message"),
    [
        (camera(6.4, "hexagonal-rows"), "has hexagonal True, the resampler False"),
        (camera(shape=(61, 84)), "needs 84 max_columns; the resampler has 83"),
        (camera(turn=8), r"needs \d+ lines; the resampler has"),
        (camera(3.2), "M = 5 is more than the micro images' pitch"),
        (camera(5.0), r"needs \d+ lenses; the resampler has"),
    ],
)
def test_calibration_of_another_camera_is_refused(other: Calibration, message: str) -> None:
    board = Board(resampling(camera(), 5).core)
    with pytest.raises(InputError, match=message):
        load_board(board, other, name="port", where="other.json")
    assert not board.lines


def test_board_that_does_not_play_along() -> None:
    core = resampling(camera(), 5).core
    with pytest.raises(InputError, match="port: answers 'error'; is it a board with a resampler"):
        load_board(Board(None), camera(), name="port")
    with pytest.raises(InputError, match="answers 'error' to word 3 of"):
        load_board(Board(core, breaks=3), camera(), name="port")
    for line in ("", "resampler lines=8", description(core).replace("lines=", "lines=9999")):
        with pytest.raises(InputError, match="is it a board with a resampler"):
            described(line, where="port")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "small.toml").write_text(SCENE)
    camera().model_copy(update={"shading": (0.0,)}).save(tmp_path / "calib.json")
    camera(6.4, "hexagonal-rows").save(tmp_path / "hex.json")
    wide = SHAPE[0], SHAPE[1] + 1
    camera(shape=wide).save(tmp_path / "wide.json")
    return tmp_path


def test_configure_writes_the_lines_for_the_serial_port(folder: Path) -> None:
    scene, out = folder / "small.toml", folder / "out"
    calib = folder / "calib.json"
    done = plenofir("configure", str(scene), "--calib", str(calib), "--out", str(out))
    assert done.returncode == 0, done.stderr
    lines = (out / "calibration.txt").read_text().splitlines()
    sensor = make_plan(load_scene(scene)).sensor
    assert sensor is not None
    chip = resampling(camera(), 5, devignette=False)
    assert lines == load_lines(loads(sensor.core, chip.registers, chip.tables))


@pytest.mark.parametrize(
    ("scene", "calib", "message"),
    [
        ("{}/small.toml", "{}/hex.json", "hex.json: has hexagonal True, the resampler False"),
        (
            "{}/small.toml",
            "{}/wide.json",
            "wide.json: is a calibration for 84 x 61 pixels; the sensor has 83 x 61",
        ),
        ("grey-microscope", "{}/calib.json", "--calib: the scene grey-microscope has no sensor"),
    ],
)
def test_configure_refuses_other_calibrations(folder: Path, scene, calib, message) -> None:
    out = folder / "out"
    done = plenofir(
        "configure", scene.format(folder), "--calib", calib.format(folder), "--out", str(out)
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert message in done.stderr
    assert not out.exists()


def test_port_that_is_not_there_is_one_line(folder: Path) -> None:
    pytest.importorskip("serial")
    done = plenofir("board", "load", str(folder / "calib.json"), "--port", str(folder / "tty"))
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "the board's serial port" in done.stderr
