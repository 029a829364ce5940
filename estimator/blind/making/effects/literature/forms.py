"""All forms of the literature, by the labels of the diagnosis."""

from estimator.blind.making.effects.literature import (
    anchors,
    beads,
    cameras,
    energies,
    force,
    grasps,
    levers_and_clocks,
    memory,
    places,
    robot,
    surroundings,
)
from estimator.blind.making.scenes.scene import Form

FORMS: dict[str, tuple[Form, ...]] = {
    **energies.FORMS,
    **memory.FORMS,
    **places.FORMS,
    **anchors.FORMS,
    **grasps.FORMS,
    **surroundings.FORMS,
    **robot.FORMS,
    **force.FORMS,
    **levers_and_clocks.FORMS,
    **cameras.FORMS,
    **beads.FORMS,
}
