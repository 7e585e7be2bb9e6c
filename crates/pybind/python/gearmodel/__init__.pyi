from ._native import (
    Analysis as Analysis,
    Errors as Errors,
    Event as Event,
    GearPair as GearPair,
    GeometryError as GeometryError,
    Log as Log,
    LogError as LogError,
    MeasuredBacklash as MeasuredBacklash,
    Recording as Recording,
    analyse as analyse,
    backlash_from as backlash_from,
    read_log as read_log,
)

__all__ = [
    "Analysis",
    "Errors",
    "Event",
    "GearPair",
    "GeometryError",
    "Log",
    "LogError",
    "MeasuredBacklash",
    "Recording",
    "analyse",
    "backlash_from",
    "read_log",
]
