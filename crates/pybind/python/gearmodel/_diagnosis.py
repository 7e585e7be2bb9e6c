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
    """The nominal model with the found effects: predicts TE where nothing was measured; of a group, with its likeliest member."""

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

        Raises:
            ValueError: direction is neither "ccw" nor "cw", or an angle is not a number.
        """
        te, std = self._native.predict(
            theta1, direction=direction, load_nm=load_nm, speed_rpm=speed_rpm, time_s=time_s, revolutions=revolutions
        )
        if not interval:
            return te
        return te, te - 1.645 * std, te + 1.645 * std


class Diagnosis:
    """What :func:`diagnose` found; its ``repr`` is the summary for people.

    Every field is plain data: numbers, text, lists, and dicts whose keys are attributes too (``d.gap.before_rad``).
    """

    def __init__(self, native: _native.NativeDiagnosis, pair: _native.GearPair) -> None:
        self._native = native
        self._pair = pair
        self._fields: dict[str, Any] = json.loads(native.to_json())

    @property
    def gap(self) -> Section:
        """How large the gap is and how far it shrinks, on runs that were not used for the fit.

        before_rad, after_rad, floor_rad: RMS of a sample's residual, rad; closed: (before² - after²)/(before² - floor²), None
        where nothing is reducible; closed_interval: its 90 % interval; budget: list of (effect, share, interval).
        """
        return _section(self._fields["gap"])  # type: ignore[no-any-return]

    @property
    def where(self) -> Section:
        """Where it lies: lists of (at, rad, floor_rad), and the signature.

        input_angle, driven_angle (at in deg), tooth, input_order, output_order, mesh_order (amplitudes), line_phase, direction,
        load (N m), speed (rpm), revolution, time (s); signature: carrier, parity, load_exponent, speed_exponent, accumulates,
        sector_deg.
        """
        return _section(self._fields["where"])  # type: ignore[no-any-return]

    @property
    def effects(self) -> list[Section]:
        """Every applicable effect, most probable first.

        name, probability, parameters {name: (value, std, unit)}, shrink (share of the reducible gap that it closes alone, or
        None), component, confused_with (names), rms_rad (its trace).
        """
        return _section(self._fields["effects"])  # type: ignore[no-any-return]

    @property
    def groups(self) -> list[Section]:
        """Sets of effects that this data cannot tell apart: members (names), angle_deg, probability of one of them."""
        return _section(self._fields["groups"])  # type: ignore[no-any-return]

    @property
    def unknown(self) -> Section:
        """What lies outside the library: probability, rms_rad, where (description and signature, or None)."""
        return _section(self._fields["unknown"])  # type: ignore[no-any-return]

    @property
    def verdict(self) -> list[Any]:
        """What the diagnosis would stake its name on: names, groups as (members, angle_deg), and "unknown"."""
        return _section(self._fields["verdict"])  # type: ignore[no-any-return]

    @property
    def next(self) -> list[Section]:
        """Up to three experiments: action, separates (names), expected_probability, minutes, plan (rows), toml."""
        return _section(self._fields["next"])  # type: ignore[no-any-return]

    @property
    def warnings(self) -> list[str]:
        """What the data does not allow one to conclude, in plain words."""
        return list(self._fields["warnings"])

    @property
    def confusability(self) -> Section:
        """Angles between effects under this plan: names, angle_deg (a square table)."""
        return _section(self._fields["confusability"])  # type: ignore[no-any-return]

    @property
    def settings(self) -> Section:
        """Every number that was chosen for it, by step: ``docs/theory/settings.md`` says what each means."""
        return _section(self._fields["settings"])  # type: ignore[no-any-return]

    @property
    def curves(self) -> list[dict[str, Any]]:
        """Mean residual of every run over the driver's turn, before and after.

        A dict a run: label, theta1_rad, before_rad, after_rad; 1-D arrays of equal length, rad.
        """
        names = ("label", "theta1_rad", "before_rad", "after_rad")
        return [dict(zip(names, curve, strict=True)) for curve in self._native.curves()]

    @property
    def model(self) -> CalibratedModel:
        """The nominal model with the found effects."""
        return CalibratedModel(self._native, self._pair)

    def to_dict(self) -> dict[str, Any]:
        """All fields in plain JSON types; what is not finite is None."""
        fields: dict[str, Any] = json.loads(self._native.to_json())
        return fields

    def to_json(self, **options: Any) -> str:
        """All fields as JSON text; options as of :func:`json.dumps`."""
        return json.dumps(self._fields, **options)

    def to_html(self, path: str | os.PathLike[str]) -> None:
        """Writes the report as a page that needs nothing else.

        Raises:
            OSError: the file cannot be written.
        """
        with open(path, "w", encoding="utf-8") as file:
            file.write(self._native.to_html())

    def plot(self) -> Any:
        """The gap, the probabilities, where it lies, and each run before and after: a matplotlib figure.

        Raises:
            ImportError: matplotlib is not installed.
        """
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
