"""Transforms of a robot: each link that moves as a stream, and each chain of links from the root to an end.

A state publisher tells links one by one; where the tool is in the base follows from all of them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from daq.bags.fields import continuous_quaternions
from daq.bags.series import NO_STAMP, Series, Stamped
from robot_drivers.protocols import FloatArray, IntArray

_TYPE = "tf2_msgs/msg/TFMessage"
_MOST_LINKS = 50


@dataclass(frozen=True, slots=True, eq=False)
class Link:
    """``T_parent_child`` as it was told: places (n, 3), m, quaternions (n, 4), x y z w, and both stamps (n,), ns."""

    parent: str
    child: str
    position: FloatArray
    quaternion_xyzw: FloatArray
    log_time_ns: IntArray
    header_time_ns: IntArray

    @property
    def moves(self) -> bool:
        """Whether it was told more than once."""
        return len(self.log_time_ns) > 1

    @property
    def time_ns(self) -> IntArray:
        """Its own stamps, or those of the receipt where some are missing."""
        return self.log_time_ns if np.any(self.header_time_ns == NO_STAMP) else self.header_time_ns


def links_of(messages: Stamped) -> list[Link]:
    """Return the links that messages of transforms tell, each with its own stamps."""
    found: dict[tuple[str, str], list[tuple[int, Any]]] = {}
    for log_time_ns, message in messages:
        for one in getattr(message, "transforms", None) or [message]:
            # ROS 1 lets a frame begin with a slash
            key = str(one.header.frame_id).lstrip("/"), str(one.child_frame_id).lstrip("/")
            found.setdefault(key, []).append((log_time_ns, one))
    return [_link(*key, rows) for key, rows in found.items()]


def series_of_links(links: Sequence[Link]) -> list[Series]:
    """Return the chains from the root to every end of the tree that moves, then each link that moves."""
    by_child = {link.child: link for link in links}
    chains = [chain for link in links if (chain := _chain_to(link, by_child)) and _is_end(link, links)]
    composed = [
        _series(_composed(chain)) for chain in chains if len(chain) > 1 and any(x.moves for x in chain)
    ]
    return [*composed, *(_series(link) for link in links if link.moves)]


def _link(parent: str, child: str, rows: Sequence[tuple[int, Any]]) -> Link:
    places = [one.transform.translation for _, one in rows]
    turns = [one.transform.rotation for _, one in rows]
    return Link(
        parent,
        child,
        np.array([(one.x, one.y, one.z) for one in places], np.float64),
        continuous_quaternions(np.array([(one.x, one.y, one.z, one.w) for one in turns], np.float64)),
        np.array([time_ns for time_ns, _ in rows], np.int64),
        np.array([one.header.stamp.sec * 10**9 + one.header.stamp.nanosec for _, one in rows], np.int64),
    )


def _chain_to(link: Link, by_child: Mapping[str, Link]) -> list[Link]:
    """Return the links from the root to a link; nothing where they go in a circle."""
    chain = [link]
    while chain[0].parent in by_child:
        chain.insert(0, by_child[chain[0].parent])
        if len(chain) > _MOST_LINKS:
            return []
    return chain


def _is_end(link: Link, links: Sequence[Link]) -> bool:
    return all(other.parent != link.child for other in links)


def _composed(chain: Sequence[Link]) -> Link:
    """Return the transform of a chain at the stamps of its last link that moves, where the others are known too."""
    last = [link for link in chain if link.moves][-1]
    time_ns = last.time_ns
    position = np.zeros((len(time_ns), 3))
    turn = Rotation.identity(len(time_ns))
    for link in chain:
        place, rotation = _at(link, time_ns)
        position = position + turn.apply(place)
        turn = turn * rotation
    known = np.isfinite(position).all(axis=1)
    return Link(
        chain[0].parent,
        chain[-1].child,
        position[known],
        continuous_quaternions(turn.as_quat()[known]),
        last.log_time_ns[known],
        last.header_time_ns[known],
    )


def _at(link: Link, time_ns: IntArray) -> tuple[FloatArray, Rotation]:
    """Return a link at other times: between its own by a straight line and the shortest turn, not beyond them."""
    unit = np.linalg.norm(link.quaternion_xyzw, axis=1) > 0.5
    turns = Rotation.from_quat(np.where(unit[:, None], link.quaternion_xyzw, [0.0, 0.0, 0.0, 1.0]))
    if not link.moves:
        return np.repeat(link.position, len(time_ns), axis=0), Rotation.concatenate([turns] * len(time_ns))
    own, first = np.unique(link.time_ns, return_index=True)
    if len(own) == 1:
        return _at(_first(link), time_ns)
    seconds, wanted = (own - own[0]) / 1e9, (time_ns - own[0]) / 1e9
    inside = (wanted >= seconds[0]) & (wanted <= seconds[-1])
    place = np.stack([np.interp(wanted, seconds, link.position[first, axis]) for axis in range(3)], axis=1)
    place[~inside] = np.nan
    return place, Slerp(seconds, turns[first])(np.clip(wanted, seconds[0], seconds[-1]))


def _first(link: Link) -> Link:
    arrays = link.position[:1], link.quaternion_xyzw[:1], link.log_time_ns[:1], link.header_time_ns[:1]
    return Link(link.parent, link.child, *arrays)


def _series(link: Link) -> Series:
    columns = [
        *(("position." + axis, "m", link.position[:, place]) for place, axis in enumerate("xyz")),
        *(("q." + axis, None, link.quaternion_xyzw[:, place]) for place, axis in enumerate("xyzw")),
    ]
    name = f"tf {link.parent} to {link.child}"
    return Series(name, _TYPE, link.log_time_ns, link.header_time_ns, tuple(columns), link.parent)
