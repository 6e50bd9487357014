"""Decides which generated rooms are accepted, and remakes the catalogue.

For maintainers, after a change of the generator: ``python -m hoz_dist.sim.validation [SCENE...]``. Training and
evaluation only read the catalogue.
"""

import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from random import Random
from typing import Final

import numpy as np
from numpy.typing import NDArray

from hoz_dist.nav.categories import ROOM_SCENES, SCENE_TARGETS, SCENES, TARGETS
from hoz_dist.nav.episode import SUCCESS_DISTANCE_M
from hoz_dist.nav.pose import GRID_M, VIEWS_PER_POSITION
from hoz_dist.nav.rooms import SPLITS, RoomId
from hoz_dist.sim.camera import Camera
from hoz_dist.sim.catalogue import CATALOGUE_PATH, Entry, targets_of
from hoz_dist.sim.detections import Detector
from hoz_dist.sim.generator import generate_room
from hoz_dist.sim.pose_graph import PoseGraph, build_pose_graph
from hoz_dist.sim.room import Room
from hoz_dist.sim.world import World

LEAST_SUCCESS_VIEWS: Final = 8
"""Every target must succeed from at least so many views."""
LEAST_CONNECTED: Final[dict[str, float]] = {**dict.fromkeys(ROOM_SCENES, 0.95), "apartment": 0.98}
"""Share of the free positions that must be connected: no pockets where the agent cannot go, no room cut off."""
POSITIONS: Final[dict[str, tuple[int, int]]] = {
    "kitchen": (39, 171),
    "living_room": (112, 330),
    "bedroom": (81, 227),
    "bathroom": (44, 140),
    "apartment": (250, 450),
}
"""Range of the number of reachable positions: over the field's 40 rooms; an apartment has about 2.4 times as many."""
ALWAYS_HELD: Final[dict[str, frozenset[str]]] = {
    "kitchen": frozenset({"LightSwitch", "GarbageCan", "Fridge", "Sink", "StoveBurner"}),
    "living_room": frozenset({"LightSwitch", "GarbageCan"}),
    "bedroom": frozenset({"LightSwitch", "GarbageCan"}),
    "bathroom": frozenset({"LightSwitch", "GarbageCan", "Sink"}),
    "apartment": frozenset({"Chair", "GarbageCan", "Fridge", "Sink", "StoveBurner", "Sofa", "Bed"}),
}
"""What every room must have, targets or not."""
LEAST_SHARE_HELD: Final = 0.7
"""Share of the scene's targets that a room must hold."""
_MOST_ATTEMPTS: Final = 200


def find_fault(room: Room) -> str | None:
    """Say why a room is not accepted; None if it is."""
    held = {TARGETS[index] for index in targets_of(room)}
    scene = room.room.scene
    missing = ALWAYS_HELD[scene] - {item.category for item in room.items}
    if missing:
        return f"no {', '.join(sorted(missing))}"
    if len(held) < LEAST_SHARE_HELD * len(SCENE_TARGETS[scene]):
        return f"only {len(held)} targets"
    with World(room) as world:
        graph = build_pose_graph(world)
        least, most = POSITIONS[scene]
        count = len(graph.positions)
        if not least <= count <= most:
            return f"{count} reachable positions"
        free = sum(
            world.is_free(x * GRID_M, z * GRID_M)
            for x in range(int(room.width / GRID_M) + 1)
            for z in range(int(room.depth / GRID_M) + 1)
        )
        if count < LEAST_CONNECTED[scene] * free:
            return f"only {count} of {free} free positions are connected"
        hidden = _hidden_targets(world, graph)
    return f"{', '.join(hidden)} cannot be reached and seen" if hidden else None


def _hidden_targets(world: World, graph: PoseGraph) -> list[str]:
    """Return the targets that succeed from too few views; looks around until all others have enough."""
    room, camera = world.room, Camera(world)
    detector, wanted = Detector(room), np.array(targets_of(room))
    counts = np.zeros(len(TARGETS), dtype=np.int64)
    order = list(range(len(graph.positions)))
    Random(0).shuffle(order)
    for position in order:
        if not _is_near(room, graph.positions[position] * GRID_M, set(wanted[counts[wanted] < LEAST_SUCCESS_VIEWS])):
            continue
        poses = [graph.pose(position * VIEWS_PER_POSITION + row) for row in range(VIEWS_PER_POSITION)]
        pictures = np.stack([camera.render(pose).segmentation for pose in poses])
        places = np.array([(pose.x, pose.z) for pose in poses])
        counts += detector.detect(pictures, places).success.sum(axis=0)
    return [TARGETS[index] for index in wanted if counts[index] < LEAST_SUCCESS_VIEWS]


def _is_near(room: Room, place: NDArray[np.float64], categories: set[int]) -> bool:
    """Say whether an instance of one of the categories is close enough to a place to succeed from there."""
    names = {TARGETS[index] for index in categories}
    for item in room.items:
        if item.category in names:
            gap = np.maximum(np.array(item.low[:2]) - place, place - np.array(item.high[:2])).clip(min=0.0)
            if np.hypot(*gap) <= SUCCESS_DISTANCE_M:
                return True
    return False


def accept(room: RoomId) -> Entry:
    """Find the first attempt that is accepted.

    Raises:
        RuntimeError: None of many attempts is; the generator is at fault.
    """
    for attempt in range(_MOST_ATTEMPTS):
        made = generate_room(room, attempt)
        fault = find_fault(made)
        if fault is None:
            return Entry(attempt, made.digest)
        sys.stdout.write(f"{room} attempt {attempt}: {fault}\n")
    message = f"No attempt to generate {room} was accepted."
    raise RuntimeError(message)


def main(scenes: Sequence[str] = SCENES) -> None:
    """Remake the catalogue's entries of some scenes."""
    rooms = [RoomId(scene, number) for scene in scenes for numbers in SPLITS[scene].values() for number in numbers]
    with ProcessPoolExecutor() as pool:
        entries = pool.map(accept, rooms)
        made = {str(room): entry._asdict() for room, entry in zip(rooms, entries, strict=True)}
    content = json.loads(CATALOGUE_PATH.read_text(encoding="utf-8")) | made
    CATALOGUE_PATH.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:] or SCENES)
