"""Blocks: parts of a large sweep, each of which Snakemake plans by itself."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import NamedTuple

from echotruth.config.loading import ConfigError


class Block(NamedTuple):
    """A part of the hearts of a sweep.

    Attributes
    ----------
    number : int
        From 1 to `blocks`; 0 is the repository and its report without any heart.
    blocks : int
        Number of blocks.
    """

    number: int = 1
    blocks: int = 1

    @classmethod
    def parse(cls, text: object, source: str) -> Block:
        """Block named by a text such as "3/40"; the whole sweep if there is none.

        Raises
        ------
        ConfigError
            If the text names no block.
        """
        if text is None:
            return cls()
        found = re.fullmatch(r"(\d+)/(\d+)", str(text))
        block = cls(*map(int, found.groups())) if found else cls(1, 0)
        if not block.number <= block.blocks:
            raise ConfigError(f"{source}: block = {text}: give a number and that of all blocks, such as 3/40")
        return block

    def of(self, motions: Mapping[str, str]) -> list[str]:
        """Cases of this block; those with the same motion, which is solved once, are in the same one.

        Parameters
        ----------
        motions : mapping
            Case -> hash of what its motion depends on, in the order of the configuration.
        """
        if self.number == 0:
            return []
        groups: dict[str, list[str]] = {}
        for case, motion in motions.items():
            groups.setdefault(motion, []).append(case)
        cases, before = [], 0
        for group in groups.values():
            if before * self.blocks // len(motions) + 1 == self.number:
                cases += group
            before += len(group)
        return cases
