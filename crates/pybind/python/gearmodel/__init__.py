"""Transmission error and backlash of circular and non-circular gear pairs.

Angles are in rad, lengths in mm, torque in N m, unless a name says otherwise. Arrays in, arrays of the same shape out;
scalars in, floats out. TE = theta2 measured - f(theta1 measured), positive when the driven gear is ahead; backlash =
TE_cw - TE_ccw at equal theta1.

>>> import gearmodel as gm
>>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287)
>>> errors = gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
>>> print(f"{1e6 * pair.transmission_error(0.0, errors):.1f} urad")
1108.4 urad
"""

from . import cluster
from ._analysis import Floor, OrderSpectrum, Spectra, SynchronousAverage, Waves, WaveSplit
from ._diagnosis import CalibratedModel, Diagnosis, Section, diagnose
from ._native import (
    Analysis,
    Errors,
    Event,
    GearPair,
    GeometryError,
    LoadedPair,
    Log,
    LogError,
    MeasuredBacklash,
    PhaseValue,
    Phases,
    Profile,
    Recording,
    ToothDamage,
    ToothErrors,
    analyse,
    backlash_from,
    read_log,
    sweep,
)
from ._outline import Outline
from ._study import SweepTable, Tolerance, ToleranceFigure

__all__ = [
    "Analysis",
    "CalibratedModel",
    "Diagnosis",
    "Errors",
    "Event",
    "Floor",
    "GearPair",
    "GeometryError",
    "LoadedPair",
    "Log",
    "LogError",
    "MeasuredBacklash",
    "OrderSpectrum",
    "Outline",
    "PhaseValue",
    "Phases",
    "Profile",
    "Recording",
    "Section",
    "Spectra",
    "SweepTable",
    "SynchronousAverage",
    "Tolerance",
    "ToleranceFigure",
    "ToothDamage",
    "ToothErrors",
    "WaveSplit",
    "Waves",
    "analyse",
    "backlash_from",
    "cluster",
    "diagnose",
    "read_log",
    "sweep",
]

# Functions of the native half say where users find them, as its classes do by themselves.
for _function in (analyse, backlash_from, read_log, sweep):
    _function.__module__ = __name__
del _function
