"""A scene: everything that is true of one case, from the tissue to the instruments. Effects change scenes."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from estimator.blind.making.mechanics.brick_mesh import Break
from estimator.blind.making.mechanics.grip import Grip
from estimator.blind.making.mechanics.laws import Addition, Fibres, Law, Term
from estimator.blind.making.mechanics.response import Instant, PermanentSet, Relaxation, Softening
from estimator.blind.making.mechanics.surfaces import Traction
from estimator.blind.making.scenes.outline import Outline
from estimator.blind.making.scenes.parts import Part
from estimator.blind.making.scenes.retraction import Rows

FloatArray = NDArray[np.float64]
Vector = tuple[float, float, float]

SIZE: Vector = (0.10, 0.10, 0.01)
GRASP_X = (0.03, 0.05)
GRASP_Y = (-0.01, 0.01)
BEADS = 16
DENSITY = 1070.0
GRAVITY = 9.81


@dataclass(frozen=True)
class Mechanics:
    """What decides how the body deforms; the defaults are the baseline.

    Attributes
    ----------
    law : at the centre of the body
    two_sides : anchored at y = +0.05 too, not at x = −0.05 alone
    thickness : true one, m
    outline : of a body that is no block, nor flat; None: it is
    parts : cavities and regions of such a body, which are stated; ``stiffness`` has the regions' moduli
    beads : how many the tissue carries
    grasp_x, grasp_y : where the jaws end along x and y on the block, m
    grasp_shift, grasp_yaw : of the grasped region against the stated one, m and rad
    centre_shift : of the gripper frame's true origin, m
    stiffness : factors of the modulus at points (n, 3)
    relaxation, softening, permanent_set, tear, seasons, swelling : as ``response.Material`` has them; ``tear``
        still takes the points
    mended : share of softening and set that is gone when the next experiment begins
    body_force : N/m³
    heavy : share of the body force that acts at points (n, 3); None: all of it
    bonded : which points (n, 3) of the anchored faces are attached; None: all
    anchor : law of the layer between tissue and anchor, by the axis of the face; None holds rigidly
    table : law of the traction on the lower face
    grip : what lies between gripper and tissue
    motion : from the reported poses to the true ones, one after the other
    breaks : further mesh planes across x and y
    has_region : whether part of the body differs from the rest, and wants a finer mesh
    """

    law: Law
    two_sides: bool = False
    thickness: float = SIZE[2]
    outline: Outline | None = None
    parts: tuple[Part, ...] = ()
    beads: int = BEADS
    grasp_x: tuple[float, float] = GRASP_X
    grasp_y: tuple[float, float] = GRASP_Y
    grasp_shift: tuple[float, float] = (0.0, 0.0)
    grasp_yaw: float = 0.0
    centre_shift: tuple[float, float] = (0.0, 0.0)
    stiffness: tuple[Callable[[FloatArray], FloatArray], ...] = ()
    relaxation: Relaxation | None = None
    softening: Softening | None = None
    permanent_set: PermanentSet | None = None
    tear: Callable[[FloatArray, Instant], FloatArray] | None = None
    seasons: Callable[[Instant], float] | None = None
    swelling: Callable[[Instant], float] | None = None
    mended: float = 0.0
    body_force: Vector = (0.0, 0.0, 0.0)
    heavy: Callable[[FloatArray], FloatArray] | None = None
    bonded: Callable[[FloatArray], NDArray[np.bool_]] | None = None
    anchor: Callable[[int], Traction] | None = None
    table: Traction | None = None
    grip: Grip | None = None
    motion: tuple[Callable[[Rows], Rows], ...] = ()
    breaks: tuple[tuple[Break, ...], tuple[Break, ...]] = ((), ())
    has_region: bool = False

    def with_terms(self, *terms: Term) -> "Mechanics":
        """Add terms to the law's energy."""
        return replace(self, law=replace(self.law, terms=(*self.law.terms, *terms)))

    def with_fibres(self, *fibres: Fibres) -> "Mechanics":
        """Add fibres to the law's energy."""
        return replace(self, law=replace(self.law, fibres=(*self.law.fibres, *fibres)))

    def with_additions(self, *additions: Addition) -> "Mechanics":
        """Add energy to the law."""
        return replace(self, law=replace(self.law, additions=(*self.law.additions, *additions)))

    def with_motion(self, change: Callable[[Rows], Rows]) -> "Mechanics":
        """Let the gripper move otherwise than reported."""
        return replace(self, motion=(*self.motion, change))

    def with_stiffness(self, factor: Callable[[FloatArray], FloatArray]) -> "Mechanics":
        """Multiply the modulus by a function of the place."""
        return replace(self, stiffness=(*self.stiffness, factor))

    def with_breaks(self, x: tuple[Break, ...] = (), y: tuple[Break, ...] = ()) -> "Mechanics":
        """Refine the mesh."""
        return replace(self, breaks=((*self.breaks[0], *x), (*self.breaks[1], *y)))

    def meshed_like(self, other: "Mechanics") -> "Mechanics":
        """Mesh this body where another one is refined, so that the two differ by no error of their meshes.

        The grasp's own edges stay where they are: the solution is singular there, and only equal distances to the next
        planes make equal errors.
        """
        return replace(self, breaks=other.breaks, has_region=other.has_region)


@dataclass(frozen=True)
class Readings:
    """What the instruments say of one experiment.

    Attributes
    ----------
    rows : the reported poses and their times
    wrench : (n, 6) that the tissue exerts on the gripper, in the tissue frame about the gripper's origin,
        zeroed in the sensor at the first row
    beads : (n, m, 3) m
    """

    rows: Rows
    wrench: FloatArray
    beads: FloatArray

    def sensed(self) -> FloatArray:
        """Return the wrench in the sensor's frame, (n, 6)."""
        return _rotated(self.rows.rotation.inv(), self.wrench)

    def with_sensed(self, wrench: FloatArray) -> "Readings":
        """Return readings whose wrench in the sensor's frame is this."""
        return replace(self, wrench=_rotated(self.rows.rotation, wrench))


Reading = Callable[[Readings], Readings]


@dataclass(frozen=True)
class Scene:
    """The mechanics, and the instruments in the order in which they distort.

    Attributes
    ----------
    rest_after_mounting : the list of rest positions was read at the first row, not before mounting
    rest_as_seen : where whoever measured the rest positions saw beads that are at (m, 3) m
    """

    mechanics: Mechanics
    readings: tuple[Reading, ...] = ()
    rest_after_mounting: bool = False
    rest_as_seen: tuple[Callable[[FloatArray], FloatArray], ...] = ()

    def read_by(self, *readings: Reading) -> "Scene":
        """Add distortions of the instruments."""
        return replace(self, readings=(*self.readings, *readings))

    def acted_on(self, **changes: Any) -> "Scene":
        """Change fields of the mechanics."""
        return replace(self, mechanics=replace(self.mechanics, **changes))


@dataclass(frozen=True)
class Drawn:
    """One effect as drawn.

    Attributes
    ----------
    parameters : SI, for the key
    change : makes a scene of the baseline into one with the effect
    where : centre and radius (m), where the effect has a place
    """

    parameters: dict[str, Any]
    change: Callable[[Scene], Scene]
    where: dict[str, Any] = field(default_factory=dict)


# How far the catalogue of the diagnosis knows a form: its own formula; the same mechanism by another function, most of
# which its formulas follow; or neither.
Family = Literal["exact", "near", "far"]


@dataclass(frozen=True)
class Form:
    """One way in which an effect may show.

    Attributes
    ----------
    name : for the key
    draw : an effect from a random generator, its size (1 is typical) and the scene without it
    range : smallest and largest plausible size
    two_sides : False where the form needs a phantom anchored on one side only
    least_modulus : softest phantom for which it makes sense, Pa
    family : how far the catalogue of the diagnosis knows it
    block : whether it needs a phantom that is a block
    beads : fewest beads with which it makes sense
    acts_on : block of the rig of an effect that no label means; empty for others
    """

    name: str
    draw: Callable[[np.random.Generator, float, Mechanics], Drawn]
    range: tuple[float, float] = (0.02, 4.0)
    two_sides: bool = True
    least_modulus: float = 0.0
    family: Family = "exact"
    block: bool = False
    beads: int = 0
    acts_on: str = ""


def _rotated(rotation: Rotation, wrench: FloatArray) -> FloatArray:
    return np.hstack([rotation.apply(wrench[:, :3]), rotation.apply(wrench[:, 3:])])
