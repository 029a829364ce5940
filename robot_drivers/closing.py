"""What runs until it is closed, as a context manager."""

from abc import ABC, abstractmethod
from typing import Self


class ClosedAtExit(ABC):
    """Closed at the end of its ``with`` block, however that ends."""

    __slots__ = ()

    @abstractmethod
    def close(self) -> None:
        """End what runs and release what it holds."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *how_it_ended: object) -> None:
        self.close()
