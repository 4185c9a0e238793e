# SPDX-License-Identifier: Apache-2.0
"""The whole design of a scene: core, and all that is built around it."""

from collections.abc import Iterator
from dataclasses import dataclass

from plenofir.fpga.boards import board_of
from plenofir.fpga.core.configuration import CoreConfiguration
from plenofir.fpga.families import Family
from plenofir.fpga.resources.estimate import VIDEO, Block
from plenofir.fpga.screen.board_screen import Screen
from plenofir.fpga.screen.chip_light_field import StoredLightField
from plenofir.plan.scene import LoadedScene
from plenofir.plan.sensor.board_camera import PlannedCamera, lanes_camera, sensor_camera
from plenofir.plan.sensor.resampler import SensorLogic
from plenofir.plan.timing import clock_of

_PLAIN = Screen()


@dataclass(frozen=True)
class SceneDesign:
    """A core, and all that is built around it."""

    core: CoreConfiguration
    screen: Screen = _PLAIN
    sensor: SensorLogic | None = None
    video: bool = False  # whether a board's video path is around them
    camera: PlannedCamera | None = None
    stored: StoredLightField | None = None

    def blocks(self, family: Family) -> Iterator[Block]:
        """Blocks of all parts, for the estimate."""
        yield from self.core.blocks(family)
        yield from self.screen.blocks_behind(self.core, family)
        if self.sensor is not None:
            yield from self.sensor.blocks(family)
        if self.video:
            yield from VIDEO.blocks(family)
        if self.camera is not None:
            yield from self.camera.blocks_around(self.core)
        if self.stored is not None:
            yield from self.stored.blocks(family)


def camera_of(loaded: LoadedScene, core: CoreConfiguration) -> PlannedCamera | None:
    """The camera of a scene whose board has its lanes."""
    scene = loaded.scene
    if scene.build.path != "camera":
        return None
    board, rate = board_of(scene.build.device), scene.frame.rate_hz
    needed, _ = clock_of(loaded, core, None)
    assert board is not None
    if scene.lanes is not None:
        assert needed is not None
        where = f"{loaded.path}: lanes"
        return lanes_camera(scene.lanes, loaded.registers, core, board, rate, needed, where=where)
    assert scene.sensor is not None
    return sensor_camera(scene.sensor, core, board, rate, needed, where=f"{loaded.path}: sensor")


def design_with(loaded: LoadedScene, core: CoreConfiguration) -> SceneDesign:
    """A scene's design with a core."""
    return SceneDesign(
        core=core,
        screen=loaded.shown,
        sensor=None if loaded.sensor is None else loaded.sensor.logic,
        video=loaded.scene.build.path == "video",
        camera=camera_of(loaded, core),
        stored=loaded.stored,
    )
