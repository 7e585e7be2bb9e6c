"""What the tests share: the repository's root and the pair of the reference tables."""

from pathlib import Path

import pytest

import gearmodel as gm

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def pair() -> gm.GearPair:
    return gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3287, pressure_angle_deg=20)


@pytest.fixture
def errors() -> gm.Errors:
    return gm.Errors(e1_mm=0.05, phi1_rad=0.3, e2_mm=0.03, phi2_rad=1.1)
