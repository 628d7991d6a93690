"""Callbacks and bars of progress."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Made = TypeVar("Made")


def callback_of(progress: Any) -> Callable[[float, str], object] | None:
    """A callback as it is; of a bar with update() and n, such as tqdm's, one that moves it to the share of its total."""
    if progress is None or callable(progress) and not hasattr(progress, "update"):
        return progress  # type: ignore[no-any-return]
    if not hasattr(progress, "update") or not hasattr(progress, "n"):
        raise TypeError("progress: expected a function of (share done, stage), or a bar such as tqdm's")

    bar: Any = progress

    def move(done: float, stage: str) -> None:
        if hasattr(bar, "set_description"):
            bar.set_description(stage, refresh=False)
        bar.update(done * (bar.total or 1) - bar.n)

    return move


def done(report: Callable[[float, str], object] | None, made: Made) -> Made:
    """The result, once the callback has heard that all is done, which some calls of the library do not say."""
    if report is not None:
        report(1.0, "done")
    return made
