"""Types of the native half; the documentation is in the docstrings of the module itself."""

import os
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeAlias, final, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._analysis import Floor, Spectra, SynchronousAverage, WaveSplit
from ._outline import Outline
from ._study import SweepTable, Tolerance

_Array: TypeAlias = NDArray[np.float64]
_Scalar: TypeAlias = float | np.floating[Any] | np.integer[Any]
_Path: TypeAlias = str | os.PathLike[str]
_Direction: TypeAlias = Literal["ccw", "cw"]
_Method: TypeAlias = Literal["common_normal", "exact", "published"]
_Teeth: TypeAlias = int | Sequence[int]

__all__ = [
    "Analysis",
    "analyse",
    "MeasuredBacklash",
    "backlash_from",
    "GeometryError",
    "LogError",
    "Errors",
    "Event",
    "Log",
    "read_log",
    "GearPair",
    "PhaseValue",
    "Phases",
    "Recording",
    "LoadedPair",
    "Profile",
    "ToothDamage",
    "ToothErrors",
    "sweep",
    "outline_dxf",
    "outline_svg",
    "NativeDiagnosis",
    "diagnose",
    "diagnose_logs",
]

class GeometryError(ValueError): ...
class LogError(ValueError): ...

@final
class Errors:
    def __new__(
        cls,
        *,
        e1_mm: float = 0.0,
        phi1_rad: float = 0.0,
        e2_mm: float = 0.0,
        phi2_rad: float = 0.0,
        shaft_compliance_output_rad_per_nm: float = 0.0,
        shaft_compliance_input_rad_per_nm: float = 0.0,
        mesh_compliance_mm2_rad_per_nm: float = 0.0,
    ) -> Errors: ...
    @property
    def e1_mm(self) -> float: ...
    @property
    def phi1_rad(self) -> float: ...
    @property
    def e2_mm(self) -> float: ...
    @property
    def phi2_rad(self) -> float: ...
    @property
    def shaft_compliance_output_rad_per_nm(self) -> float: ...
    @property
    def shaft_compliance_input_rad_per_nm(self) -> float: ...
    @property
    def mesh_compliance_mm2_rad_per_nm(self) -> float: ...
    def replace(self, **changes: float) -> Errors: ...
    def to_dict(self) -> dict[str, float]: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, float]]: ...

@final
class GearPair:
    @staticmethod
    def elliptical(
        *,
        module_mm: float,
        teeth: _Teeth,
        eccentricity: float,
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def circular(
        *,
        module_mm: float,
        teeth: _Teeth,
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def lobed(
        *,
        module_mm: float,
        teeth: _Teeth,
        eccentricity: float,
        lobes: tuple[int, int],
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def fourier(
        *,
        module_mm: float,
        teeth: _Teeth,
        cosines: ArrayLike | None = None,
        sines: ArrayLike | None = None,
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def sampled(
        *,
        module_mm: float,
        teeth: _Teeth,
        theta1_rad: ArrayLike,
        radius: ArrayLike,
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def transmission(
        *,
        module_mm: float,
        teeth: _Teeth,
        cosines: ArrayLike | None = None,
        sines: ArrayLike | None = None,
        pressure_angle_deg: float = 20.0,
        centre_distance_mm: float | None = None,
        backlash_mm: float = 0.0,
        face_width_mm: float = 30.0,
        addendum: float = 1.0,
        dedendum_clearance: float = 0.25,
    ) -> GearPair: ...
    @staticmethod
    def constant(ratio: float) -> GearPair: ...
    @staticmethod
    def from_toml(source: _Path) -> GearPair: ...
    def to_toml(self, path: _Path | None = None) -> str: ...
    @property
    def kind(self) -> str: ...
    @property
    def module_mm(self) -> float: ...
    @property
    def teeth(self) -> tuple[int, int]: ...
    @property
    def pressure_angle_rad(self) -> float: ...
    @property
    def backlash_mm(self) -> float: ...
    @property
    def face_width_mm(self) -> float: ...
    @property
    def addendum(self) -> float: ...
    @property
    def dedendum_clearance(self) -> float: ...
    @property
    def centre_distance_mm(self) -> float: ...
    @property
    def semi_major_mm(self) -> float: ...
    @property
    def perimeter_mm(self) -> float: ...
    @property
    def closure(self) -> float: ...
    @property
    def errors(self) -> Errors: ...
    @property
    def effects(self) -> list[str]: ...
    def with_errors(self, errors: Errors) -> GearPair: ...
    @overload
    def theta2(self, theta1: _Scalar) -> float: ...
    @overload
    def theta2(self, theta1: ArrayLike) -> _Array: ...
    @overload
    def theta1(self, theta2: _Scalar) -> float: ...
    @overload
    def theta1(self, theta2: ArrayLike) -> _Array: ...
    @overload
    def ratio(self, theta1: _Scalar | None = None) -> float: ...
    @overload
    def ratio(self, theta1: ArrayLike) -> _Array: ...
    @overload
    def radius(self, theta1: _Scalar, gear: Literal[1, 2] = 1) -> float: ...
    @overload
    def radius(self, theta1: ArrayLike, gear: Literal[1, 2] = 1) -> _Array: ...
    @overload
    def inclination(self, theta1: _Scalar) -> float: ...
    @overload
    def inclination(self, theta1: ArrayLike) -> _Array: ...
    @overload
    def arc_length_mm(self, theta1: _Scalar) -> float: ...
    @overload
    def arc_length_mm(self, theta1: ArrayLike) -> _Array: ...
    @overload
    def transmission_error(
        self,
        theta1: _Scalar,
        errors: Errors | None = None,
        direction: _Direction = "ccw",
        method: _Method = "common_normal",
        load_nm: float = 0.0,
        relative_to_start: bool = False,
        *,
        tooth_errors: ToothErrors | None = None,
        displacement_mm: tuple[float, float] | None = None,
        speed_rpm: float = 0.0,
        time_s: float = 0.0,
        revolutions: float = 0.0,
    ) -> float: ...
    @overload
    def transmission_error(
        self,
        theta1: ArrayLike,
        errors: Errors | None = None,
        direction: _Direction = "ccw",
        method: _Method = "common_normal",
        load_nm: float = 0.0,
        relative_to_start: bool = False,
        *,
        tooth_errors: ToothErrors | None = None,
        displacement_mm: tuple[float, float] | None = None,
        speed_rpm: float = 0.0,
        time_s: float = 0.0,
        revolutions: float = 0.0,
    ) -> _Array: ...
    @overload
    def backlash(
        self,
        theta1: _Scalar,
        errors: Errors | None = None,
        method: _Method = "common_normal",
        load_nm: float = 0.0,
        *,
        tooth_errors: ToothErrors | None = None,
        displacement_mm: tuple[float, float] | None = None,
    ) -> float: ...
    @overload
    def backlash(
        self,
        theta1: ArrayLike,
        errors: Errors | None = None,
        method: _Method = "common_normal",
        load_nm: float = 0.0,
        *,
        tooth_errors: ToothErrors | None = None,
        displacement_mm: tuple[float, float] | None = None,
    ) -> _Array: ...
    @overload
    def te_derivative(
        self,
        theta1: _Scalar,
        parameter: str,
        errors: Errors | None = None,
        direction: _Direction = "ccw",
        load_nm: float = 0.0,
    ) -> float: ...
    @overload
    def te_derivative(
        self,
        theta1: ArrayLike,
        parameter: str,
        errors: Errors | None = None,
        direction: _Direction = "ccw",
        load_nm: float = 0.0,
    ) -> _Array: ...
    def tolerance(
        self,
        errors: Errors | None = None,
        sigma: Mapping[str, float] | None = None,
        n: int = 100_000,
        seed: int = 0,
        *,
        uniform: Mapping[str, float] | None = None,
        load_nm: float = 0.0,
        angles: int = 720,
        progress: Callable[[int, int], object] | None = None,
    ) -> Tolerance: ...
    def loaded(
        self,
        errors: Errors | None = None,
        *,
        tooth_errors: ToothErrors | None = None,
        displacement_mm: tuple[float, float] | None = None,
        bearing_compliance_mm_per_n: float = 0.0,
        bearing_clearance_mm: float = 0.0,
        youngs_modulus_n_per_mm2: float = 206_000.0,
        poisson: float = 0.3,
        stiffness_correction: float = 0.8,
    ) -> LoadedPair: ...
    def flank(self, gear: Literal[1, 2] = 1, tooth: int = 0, side: _Direction = "ccw", n: int = 64) -> _Array: ...
    def outline(self, gear: Literal[1, 2] = 1, points_per_tooth: int = 40) -> Outline: ...
    def to_dxf(self, path: _Path, gear: Literal[1, 2] = 1, points_per_tooth: int = 40) -> None: ...
    def to_svg(self, path: _Path, gear: Literal[1, 2] = 1, points_per_tooth: int = 40) -> None: ...
    def check_teeth(self) -> None: ...
    def tooth_faults(self) -> list[str]: ...
    def contact_ratio(self, direction: _Direction = "ccw") -> _Array: ...
    def optimal_phases(
        self,
        errors: Errors | None = None,
        objective: Literal["backlash", "te_ccw", "te_cw", "te_both"] = "backlash",
        driver: Literal["hub", "fixed"] | int | None = None,
        driven: Literal["hub", "fixed"] | int | None = None,
    ) -> Phases: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]
    def __reduce__(self) -> tuple[Any, tuple[str]]: ...

@final
class PhaseValue:
    @property
    def phi1_rad(self) -> float: ...
    @property
    def phi2_rad(self) -> float: ...
    @property
    def value_rad(self) -> float: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]

@final
class Phases:
    @property
    def phi1_rad(self) -> float: ...
    @property
    def phi2_rad(self) -> float: ...
    @property
    def value_rad(self) -> float: ...
    @property
    def published(self) -> tuple[PhaseValue, PhaseValue]: ...

@final
class LoadedPair:
    @overload
    def transmission_error(self, theta1: _Scalar, load_nm: float, direction: _Direction = "ccw") -> float: ...
    @overload
    def transmission_error(self, theta1: ArrayLike, load_nm: float, direction: _Direction = "ccw") -> _Array: ...
    @overload
    def backlash(self, theta1: _Scalar, load_nm: float) -> float: ...
    @overload
    def backlash(self, theta1: ArrayLike, load_nm: float) -> _Array: ...
    def mesh(self, theta1: ArrayLike, load_nm: float, direction: _Direction = "ccw") -> np.recarray[Any, Any]: ...
    @overload
    def mesh_stiffness_n_per_mm_um(self, theta1: _Scalar, load_nm: float, direction: _Direction = "ccw") -> float: ...
    @overload
    def mesh_stiffness_n_per_mm_um(self, theta1: ArrayLike, load_nm: float, direction: _Direction = "ccw") -> _Array: ...

@final
class Profile:
    def __new__(
        cls, *, slope_mm: float = 0.0, crown_mm: float = 0.0, waves: Sequence[tuple[float, float]] | None = None
    ) -> Profile: ...
    @property
    def slope_mm(self) -> float: ...
    @property
    def crown_mm(self) -> float: ...
    @property
    def waves(self) -> list[tuple[float, float]]: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

@final
class ToothDamage:
    def __new__(cls, tooth: int, depth_mm: float, width: float, flank: _Direction = "ccw") -> ToothDamage: ...
    @property
    def tooth(self) -> int: ...
    @property
    def depth_mm(self) -> float: ...
    @property
    def width(self) -> float: ...
    @property
    def flank(self) -> _Direction: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]
    def __getnewargs__(self) -> tuple[int, float, float, str]: ...

@final
class ToothErrors:
    def __new__(
        cls,
        *,
        driver_ccw_mm: ArrayLike | None = None,
        driver_cw_mm: ArrayLike | None = None,
        driven_ccw_mm: ArrayLike | None = None,
        driven_cw_mm: ArrayLike | None = None,
        profile_ccw: Profile | None = None,
        profile_cw: Profile | None = None,
        damage: Sequence[ToothDamage] | None = None,
    ) -> ToothErrors: ...
    def __eq__(self, value: object, /) -> bool: ...
    def __ne__(self, value: object, /) -> bool: ...
    __hash__ = None  # type: ignore[assignment]
    def __getnewargs_ex__(self) -> tuple[tuple[()], dict[str, Any]]: ...

def sweep(
    pair: GearPair,
    over: Mapping[str, ArrayLike],
    of: Literal["te_pp", "te_rms", "te_mean", "backlash_pp", "backlash_mean"] = "te_pp",
    *,
    errors: Errors | None = None,
    direction: _Direction = "ccw",
    method: Literal["common_normal", "exact"] = "common_normal",
    load_nm: float = 0.0,
    angles: int = 720,
    progress: Callable[[int, int], object] | None = None,
) -> SweepTable: ...
def outline_dxf(points: NDArray[np.float64], layer: str) -> str: ...
def outline_svg(points: NDArray[np.float64]) -> str: ...
@final
class Recording:
    def __new__(
        cls,
        time_s: ArrayLike,
        theta1_rad: ArrayLike,
        theta2_rad: ArrayLike,
        load_nm: ArrayLike,
        speed_rpm: ArrayLike,
        direction: Literal["ccw", "cw", "auto"],
        *,
        input_lines: int | None = None,
        output_lines: int | None = None,
    ) -> Recording: ...
    @property
    def time_s(self) -> _Array: ...
    @property
    def theta1_rad(self) -> _Array: ...
    @property
    def theta2_rad(self) -> _Array: ...
    @property
    def load_nm(self) -> float | _Array: ...
    @property
    def speed_rpm(self) -> float | _Array: ...
    @property
    def direction(self) -> Literal["ccw", "cw", "auto"]: ...
    @property
    def input_lines(self) -> int | None: ...
    @property
    def output_lines(self) -> int | None: ...
    @property
    def revolutions(self) -> float: ...
    @property
    def duration_s(self) -> float: ...
    @staticmethod
    def from_csv(
        path: _Path,
        *,
        load_nm: ArrayLike | None = None,
        speed_rpm: ArrayLike | None = None,
        direction: Literal["ccw", "cw", "auto"] | None = None,
        input_lines: int | None = None,
        output_lines: int | None = None,
    ) -> Recording: ...
    @staticmethod
    def from_parquet(
        path: _Path,
        *,
        load_nm: ArrayLike | None = None,
        speed_rpm: ArrayLike | None = None,
        direction: Literal["ccw", "cw", "auto"] | None = None,
        input_lines: int | None = None,
        output_lines: int | None = None,
    ) -> Recording: ...
    def split(self) -> list[Recording]: ...
    def __len__(self) -> int: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, int | None]]: ...

@final
class Event:
    @property
    def time_ns(self) -> int: ...
    @property
    def level(self) -> Literal["debug", "info", "warning", "error", "fatal", "unknown"]: ...
    @property
    def name(self) -> str: ...
    @property
    def message(self) -> str: ...

@final
class Log:
    @property
    def path(self) -> os.PathLike[str]: ...
    @property
    def runs(self) -> list[Recording]: ...
    @property
    def metadata(self) -> dict[str, dict[str, str]]: ...
    @property
    def events(self) -> list[Event]: ...
    @property
    def te(self) -> np.recarray[Any, Any]: ...
    @property
    def backlash(self) -> np.recarray[Any, Any]: ...
    @property
    def losses(self) -> int: ...
    @property
    def complete(self) -> bool: ...
    @property
    def completeness(self) -> str: ...
    @property
    def pair(self) -> GearPair | None: ...

def read_log(path: _Path) -> Log: ...

@final
class Analysis:
    @property
    def direction(self) -> _Direction: ...
    @property
    def load_nm(self) -> float: ...
    @property
    def speed_rpm(self) -> float: ...
    @property
    def samples(self) -> int: ...
    @property
    def gaps(self) -> int: ...
    @property
    def revolutions(self) -> int: ...
    @property
    def theta1(self) -> _Array: ...
    @property
    def te(self) -> _Array: ...
    @property
    def mean_curve(self) -> _Array: ...
    @property
    def predicted(self) -> _Array: ...
    @property
    def spectrum(self) -> Spectra: ...
    @property
    def f_i_total(self) -> float: ...
    @property
    def f_i_tooth(self) -> float: ...
    @property
    def cumulative_offset(self) -> float: ...
    @property
    def floor(self) -> Floor: ...
    def waves(self, cut_off_order: float, axis: Literal["input", "output", "mesh"] = "mesh") -> WaveSplit: ...
    def synchronous_average(
        self, shaft: Literal["input", "output"] = "input", *, bins: int | None = None
    ) -> SynchronousAverage: ...
    @property
    def mean_rad(self) -> float: ...
    @property
    def rms_rad(self) -> float: ...
    @property
    def zero_rad(self) -> float: ...
    @property
    def residual_rms_rad(self) -> float: ...
    @property
    def coverage(self) -> float: ...
    def plot(self) -> Any: ...

def analyse(rec: Recording, pair: GearPair, *, bins: int = 720, highest_order: int | None = None) -> Analysis: ...
@final
class MeasuredBacklash:
    @property
    def theta1(self) -> _Array: ...
    @property
    def backlash(self) -> _Array: ...
    @property
    def predicted(self) -> _Array: ...
    @property
    def low(self) -> _Array: ...
    @property
    def high(self) -> _Array: ...
    @property
    def min_rad(self) -> float: ...
    @property
    def mean_rad(self) -> float: ...
    @property
    def max_rad(self) -> float: ...
    def plot(self) -> Any: ...

def backlash_from(ccw: Recording, cw: Recording, pair: GearPair, *, bins: int = 720) -> MeasuredBacklash: ...

@final
class NativeDiagnosis:
    def to_json(self) -> str: ...
    def to_html(self) -> str: ...
    def summary(self) -> str: ...
    def curves(self) -> list[tuple[str, _Array, _Array, _Array]]: ...
    def predict(
        self, theta1: ArrayLike, *, direction: str, load_nm: float, speed_rpm: float, time_s: float, revolutions: float
    ) -> tuple[Any, Any]: ...
    def calibrated(self, pair: GearPair) -> tuple[GearPair, list[str]]: ...

def diagnose(
    recordings: Sequence[Recording], pair: GearPair, known: Sequence[str], exclude: Sequence[str]
) -> NativeDiagnosis: ...
def diagnose_logs(
    paths: Sequence[str], pair: GearPair, known: Sequence[str], exclude: Sequence[str]
) -> tuple[NativeDiagnosis, list[str]]: ...
