"""Progress callbacks and progress bars."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar

Result = TypeVar("Result")


def callback_of(progress: Any) -> Callable[[float, str], object] | None:
    """Returns a callback unchanged. For a bar with update() and n, such as tqdm's, returns a callback that moves it."""
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


def report_completion(report: Callable[[float, str], object] | None, made: Result) -> Result:
    """Reports completion to the callback, since some library calls do not, and returns the result."""
    if report is not None:
        report(1.0, "done")
    return made
