"""Who hears of progress: a function, a bar of tqdm, plain lines on the standard error, or nobody."""

from __future__ import annotations

import re
import sys
import time
from collections.abc import Callable
from typing import Any

from ._errors import InputError

Listener = Callable[..., object] | bool | None
# Plain lines come no oftener (s).
_PAUSE = 1.0


class Shown:
    """``with Shown(progress, total) as listener``: what the engine calls, or None."""

    def __init__(self, progress: Listener, total: int | None = None, unit: str = "samples") -> None:
        self._bar: _Bar | _Lines | None = None
        self._listener: Callable[..., object] | None = None
        self._total = total
        self._heard = False
        if progress is True:
            self._bar = _bar(total, unit)
            self._listener = self._hear
        elif callable(progress):
            self._listener = progress
        elif progress is not None and progress is not False:
            raise InputError(f"`progress`: is {progress!r}; give a function, True or None", "progress")

    def _hear(self, *told: Any) -> None:
        if self._bar is None:
            return
        self._heard = True
        if len(told) == 1:
            text = str(told[0])
            counted = re.match(r"(\d+) of (\d+) ", text)
            if counted:
                self._bar.count(int(counted[1]), int(counted[2]), 0)
            else:
                self._bar.stage(text)
        else:
            done, total, failed, _ = told
            self._bar.count(int(done), int(total), int(failed))

    def __enter__(self) -> Callable[..., object] | None:
        return self._listener

    def __exit__(self, kind: object, *_: object) -> None:
        if self._bar is not None:
            if kind is None and self._total is not None and not self._heard:
                # Work that tells nothing on its way, but has come to its end.
                self._bar.count(self._total, self._total, 0)
            self._bar.close()


def _bar(total: int | None, unit: str) -> _Bar | _Lines:
    try:
        from tqdm.auto import tqdm
    except ImportError:
        return _Lines(unit)
    return _Bar(tqdm(total=total, unit=f" {unit}"))


class _Bar:
    """A bar of tqdm."""

    def __init__(self, bar: Any) -> None:
        self._bar = bar

    def count(self, done: int, total: int, failed: int) -> None:
        self._bar.total = total
        self._bar.update(done - self._bar.n)
        if failed:
            self._bar.set_postfix(failed=failed)

    def stage(self, text: str) -> None:
        self._bar.set_description_str(text)

    def close(self) -> None:
        self._bar.close()


class _Lines:
    """Lines on the standard error."""

    def __init__(self, unit: str) -> None:
        self._unit = unit
        self._begin = time.monotonic()
        self._told = -_PAUSE
        self._waiting = ""
        self._counted = (-1, -1, -1)

    def count(self, done: int, total: int, failed: int) -> None:
        if (done, total, failed) == self._counted:
            return
        self._counted = (done, total, failed)
        seconds = time.monotonic() - self._begin
        rate = done / seconds if seconds > 0 else 0.0
        words = [f"{done:,} of {total:,} {self._unit}", f"{rate:,.3g} a second"]
        if 0 < done < total and rate > 0:
            words.append(f"{(total - done) / rate:,.0f} s left")
        if failed:
            words.append(f"{failed:,} failed")
        self._tell(", ".join(words))

    def stage(self, text: str) -> None:
        self._tell(text)

    def _tell(self, text: str) -> None:
        now = time.monotonic()
        if now - self._told < _PAUSE:
            self._waiting = text
            return
        self._told, self._waiting = now, ""
        print(f"rodsweep: {text}", file=sys.stderr, flush=True)

    def close(self) -> None:
        if self._waiting:
            print(f"rodsweep: {self._waiting}", file=sys.stderr, flush=True)
