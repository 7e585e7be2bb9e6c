"""The gap between model and rig: where it lies, which effect causes it, how far it shrinks once that is added."""

from __future__ import annotations

import json
import os
import warnings
from collections.abc import Iterable, Sequence
from typing import Any

from . import _native


class Section(dict[str, Any]):
    """A part of a diagnosis: a dict whose keys are attributes too."""

    def __getattr__(self, name: str) -> Any:
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no field {name!r}: there are {', '.join(self)}") from None


def _section(value: Any) -> Any:
    if isinstance(value, dict):
        return Section({key: _section(entry) for key, entry in value.items()})
    if isinstance(value, list):
        return [_section(entry) for entry in value]
    return value


class CalibratedModel:
    """The nominal model with the found effects: predicts TE where nothing was measured."""

    def __init__(self, native: _native.NativeDiagnosis, pair: _native.GearPair) -> None:
        self._native = native
        self._pair = pair

    @property
    def pair(self) -> _native.GearPair:
        """The pair with the found effects documented: a nominal model like any other.

        Raises:
            GeometryError: the sum is no model, as a compliance below zero.
        """
        calibrated: _native.GearPair = self._native.calibrated(self._pair)[0]
        return calibrated

    def to_toml(self, path: str | os.PathLike[str] | None = None) -> str:
        """The text of a ``pair.toml`` with the found effects under ``[documented]``; written to ``path`` too, where given."""
        return self.pair.to_toml(path)

    def transmission_error(
        self,
        theta1: Any,
        *,
        direction: str = "ccw",
        load_nm: float = 0.0,
        speed_rpm: float = 5.0,
        time_s: float = 0.0,
        revolutions: float = 0.0,
        interval: bool = False,
    ) -> Any:
        """TE of the nominal model with the found effects, rad, in the shape of ``theta1``.

        Args:
            theta1: driver angle, rad; a number or any array-like.
            direction: "ccw" or "cw".
            load_nm: torque on the driven shaft, N m.
            speed_rpm: driver speed, rpm.
            time_s: time since the campaign's start, s, for effects that grow with it.
            revolutions: driver revolutions since then.
            interval: True returns (te, low, high), the 90 % interval of the found effects' amplitudes.
        """
        te, std = self._native.predict(
            theta1, direction=direction, load_nm=load_nm, speed_rpm=speed_rpm, time_s=time_s, revolutions=revolutions
        )
        if not interval:
            return te
        return te, te - 1.645 * std, te + 1.645 * std


class Diagnosis:
    """What :func:`diagnose` found. Fields: gap, where, effects, groups, unknown, verdict, next, warnings, confusability."""

    def __init__(self, native: _native.NativeDiagnosis, pair: _native.GearPair) -> None:
        self._native = native
        self._pair = pair
        self._fields: dict[str, Any] = json.loads(native.to_json())

    def __getattr__(self, name: str) -> Any:
        fields = self.__dict__.get("_fields", {})
        if name in fields:
            return _section(fields[name])
        raise AttributeError(f"a diagnosis has no field {name!r}: there are {', '.join(fields)}")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._fields]

    @property
    def model(self) -> CalibratedModel:
        """The nominal model with the found effects."""
        return CalibratedModel(self._native, self._pair)

    def to_dict(self) -> dict[str, Any]:
        """All fields in plain JSON types."""
        fields: dict[str, Any] = json.loads(self._native.to_json())
        return fields

    def to_json(self, **options: Any) -> str:
        """All fields as JSON text; options as of :func:`json.dumps`."""
        return json.dumps(self._fields, **options)

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Writes the report as a page that needs nothing else."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._native.to_html())

    def plot(self) -> Any:
        """The residual of each run before and after, and the probabilities: a matplotlib figure."""
        from ._plot import diagnosis

        return diagnosis(self)

    def __repr__(self) -> str:
        return self._native.summary().rstrip()


def diagnose(
    recordings: Any,
    pair: Any,
    *,
    known: Sequence[str] = (),
    exclude: Sequence[str] = (),
) -> Diagnosis:
    """Says where model and measurement disagree, which effect causes it, and how far the gap shrinks once it is added.

    Args:
        recordings: a :class:`Recording` or a path of a log, or a list of them; all share one clock, in any order.
        pair: the nominal model: the pair with its documented errors.
        known: names of effects that are there: always in the model.
        exclude: names of effects that are not.

    Raises:
        ValueError: names what is missing or wrong: no recording, too little motion, an unknown effect.
        LogError: a path is no rig log.

    >>> import gearmodel as gm, numpy as np
    >>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
    >>> rng = np.random.default_rng(1)
    >>> def run(sign, t0):
    ...     t = t0 + np.arange(0, 48, 0.02)
    ...     theta1 = sign * 2 * np.pi * 5 / 60 * (t - t0)
    ...     reading = pair.theta2(theta1) + 1e-4 * np.sin(2 * pair.theta2(theta1)) + 1e-5 * rng.standard_normal(t.size)
    ...     return gm.Recording(t, theta1, reading, 1.0, 5.0, "ccw" if sign > 0 else "cw")
    >>> d = gm.diagnose([run(1, 0.0), run(-1, 60.0)], pair)
    >>> sorted(d.verdict[0].members)
    ['coupling_misalignment_output', 'encoder2_ellipticity']
    """
    if isinstance(recordings, (str, os.PathLike, _native.Recording)):
        recordings = [recordings]
    elif not isinstance(recordings, Iterable):
        raise TypeError(f"recordings is a {type(recordings).__name__}: a Recording, a path of a log, or a list of them is needed")
    entries = list(recordings)
    paths = [os.fspath(entry) for entry in entries if isinstance(entry, (str, os.PathLike))]
    if paths and len(paths) == len(entries):
        # Logs are read block by block and share their clock.
        native, incomplete = _native.diagnose_logs(paths, pair, list(known), list(exclude))
        for line in incomplete:
            warnings.warn(line, UserWarning, stacklevel=2)
        return Diagnosis(native, pair)
    runs: list[_native.Recording] = []
    for entry in entries:
        if isinstance(entry, (str, os.PathLike)):
            # A log's recordings count their time from its own first sample.
            if len(paths) > 1:
                raise ValueError("several logs and recordings together have no clock in common: give logs alone, or recordings alone")
            runs.extend(_native.read_log(os.fspath(entry)).runs)
        else:
            runs.append(entry)
    return Diagnosis(_native.diagnose(runs, pair, list(known), list(exclude)), pair)
