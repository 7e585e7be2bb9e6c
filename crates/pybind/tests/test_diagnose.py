"""The diagnosis from Python: its fields, what it must not depend on, and what it says of thin data."""

import json
import math

import numpy as np
import pytest

import campaign as c
import gearmodel as gm

EPS, WINDUP, DJ = 6e-5, 1.2e-5, 0.012
EFFECTS = (c.output_encoder(EPS, 0.7), c.output_windup(WINDUP), c.backlash(DJ))


@pytest.fixture(scope="module")
def found() -> gm.Diagnosis:
    return gm.diagnose(c.made(c.recordings(EFFECTS)), c.pair())


@pytest.fixture(scope="module")
def null() -> gm.Diagnosis:
    return gm.diagnose(c.made(c.recordings()), c.pair())


def _is_number(x):
    return isinstance(x, (int, float)) and not isinstance(x, bool) and math.isfinite(x)


def _is_share(x):
    return x is None or _is_number(x)


def _check_signature(row):
    assert set(row) == {"carrier", "parity", "load_exponent", "speed_exponent", "accumulates", "sector_deg"}
    assert row["carrier"] in ("input", "output", "mesh", "encoder line", "time", "none")
    assert row["parity"] in ("even", "odd", "mixed", "one flank")
    assert row["accumulates"] in ("per revolution", "per time", "no")
    assert _is_share(row["load_exponent"]) and _is_share(row["speed_exponent"])
    assert row["sector_deg"] is None or len(row["sector_deg"]) == 2


@pytest.mark.parametrize("case", ["found", "null"])
def test_fields_are_those_of_the_contract(case, request):
    fields = request.getfixturevalue(case).to_dict()
    assert json.loads(json.dumps(fields, allow_nan=False)) == fields
    assert set(fields) == {
        "gap", "where", "effects", "groups", "unknown", "verdict", "next", "warnings", "confusability",
        "settings",
    }  # fmt: skip
    gap = fields["gap"]
    assert set(gap) == {"before_rad", "after_rad", "floor_rad", "closed", "closed_interval", "budget"}
    assert all(_is_number(gap[key]) and gap[key] >= 0 for key in ("before_rad", "after_rad", "floor_rad"))
    assert all({"effect", "share", "interval"} == set(row) and _is_number(row["share"]) for row in gap["budget"])
    where = fields["where"]
    assert set(where) == {
        "signature", "input_angle", "driven_angle", "tooth", "input_order", "output_order", "mesh_order", "line_phase",
        "direction", "load", "speed", "revolution", "time",
    }  # fmt: skip
    _check_signature(where.pop("signature"))
    for slices in where.values():
        assert all(_is_number(s["rad"]) and _is_number(s["floor_rad"]) and isinstance(s["at"], (str, int, float)) for s in slices)
    assert len(where["tooth"]) == c.TEETH and [s["at"] for s in where["direction"]] == ["ccw", "cw"]
    # Every effect that this pair can have, also the improbable ones: none is left out.
    names = [e["name"] for e in fields["effects"]]
    assert len(names) == len(set(names)) and {"slip", "pitch_errors", "thermal_drift", "encoder1_interpolation"} <= set(names)
    assert [e["probability"] for e in fields["effects"]] == sorted((e["probability"] for e in fields["effects"]), reverse=True)
    for e in fields["effects"]:
        assert {"name", "probability", "parameters", "shrink", "component", "confused_with"} <= set(e)
        assert 0 <= e["probability"] <= 1 and _is_share(e["shrink"]) and isinstance(e["component"], str)
        assert all(isinstance(n, str) for n in e["confused_with"])
        for parameter in e["parameters"].values():
            assert set(parameter) == {"value", "std", "unit"} and isinstance(parameter["unit"], str)
            if isinstance(parameter["value"], (list, str)):
                assert parameter["std"] is None
    for g in fields["groups"]:
        assert set(g) == {"members", "angle_deg", "probability"} and len(g["members"]) > 1
        assert 0 <= g["angle_deg"] < 2 and 0 <= g["probability"] <= 1
    assert set(fields["unknown"]) == {"probability", "rms_rad", "where"}
    assert 0 <= fields["unknown"]["probability"] <= 1 and _is_number(fields["unknown"]["rms_rad"])
    for item in fields["verdict"]:
        assert isinstance(item, str) or set(item) == {"members", "angle_deg"}
    assert len(fields["next"]) <= 3
    for experiment in fields["next"]:
        assert {"action", "separates", "expected_probability", "minutes", "plan", "toml"} <= set(experiment)
        assert experiment["toml"].count("[[runs]]") == len(experiment["plan"])
    assert all(isinstance(w, str) for w in fields["warnings"])


def test_what_was_put_in_is_found_with_its_size(found):
    assert c.holds(found.verdict, "encoder2_eccentricity")
    assert c.holds(found.verdict, "shaft_compliance_output")
    assert c.holds(found.verdict, "backlash_error")
    assert len(found.verdict) == 3
    by_name = {e.name: e.parameters for e in found.effects}
    for value, truth in (
        (by_name["encoder2_eccentricity"].eps, EPS),
        (by_name["shaft_compliance_output"].c_rad_per_nm, WINDUP),
        (by_name["backlash_error"].dj_mm, DJ),
    ):
        assert value.std > 0 and abs(value.value - truth) < max(4 * value.std, 0.03 * truth)
    # Same trace for every pair: never one of them alone, and dj = 2 c / cos(alpha).
    (group,) = [g for g in found.groups if "backlash_error" in g.members]
    assert "bearing_clearance" in group.members
    clearance = by_name["bearing_clearance"].c_mm.value
    assert by_name["backlash_error"].dj_mm.value == pytest.approx(2 * clearance / math.cos(math.radians(20)), rel=0.02)
    # One set-up of an elliptic pair cannot tell the encoders apart.
    (encoders,) = [g for g in found.groups if "encoder2_eccentricity" in g.members]
    assert "encoder1_eccentricity" in encoders.members
    assert found.gap.closed > 0.97
    assert found.gap.before_rad > 3 * found.gap.after_rad


def test_nothing_is_named_where_nothing_is(null):
    assert null.verdict == []
    assert null.gap.closed is None and null.gap.closed_interval is None
    assert null.gap.before_rad == pytest.approx(null.gap.floor_rad, rel=0.25)
    assert "the nominal model suffices" in repr(null)


def test_false_alarms_are_rare():
    verdicts = [gm.diagnose(c.made(c.recordings(seed=seed)), c.pair()).verdict for seed in range(1, 9)]
    # Chance alone makes one in eight once in five times at 3 % each; two would be a fault.
    assert sum(bool(v) for v in verdicts) <= 1


def test_summary_reads_as_the_contract_says(found):
    lines = repr(found).splitlines()
    assert lines[0].startswith("gap   ") and "% of the reducible gap closed [" in lines[0] and "on held-out runs" in lines[0]
    assert lines[1].startswith("where ")
    assert sum(line.startswith("why   ") for line in lines) == 3
    assert any(line.startswith("        if encoder2_eccentricity   eps = (") and line.endswith(" deg") for line in lines)
    assert any(line.startswith("also  ") for line in lines)
    assert "encoder eccentricity, input or output" in repr(found)
    assert "same trace for an elliptic pair" in repr(found)
    # Data that was drawn at random knows no parameter to eight digits.
    assert not any(len(word.strip("(),.e-+").replace(".", "")) > 8 for word in repr(found).split() if word[:1].isdigit())


def _settling(s):
    """A mount that gives a little anew in each run."""
    return 60e-6 * s.sign * np.exp(-(s.time_s - s.time_s[0]) / 6.0)


def _random_walk(s):
    """A level that wanders over the whole campaign, the same in all of its runs."""
    clock = np.linspace(0, 400, 4000)
    walk = np.cumsum(np.random.default_rng(5).standard_normal(4000))
    return 50e-6 * np.interp(s.time_s, clock, walk - walk.mean()) / walk.std()


def _slow_swing(s):
    """An air conditioner's period: slower than a turn, tied to no angle."""
    return 50e-6 * np.sin(2 * np.pi * s.time_s / 17.3)


def _ghost_order(s):
    """What a grinding wheel leaves: orders 60 and 120 of the driven gear's turn."""
    return 20e-6 * np.sin(60 * s.theta2 + 0.4) + 8e-6 * np.sin(120 * s.theta2)


def _jolt(s):
    """Something gives way, and springs back later."""
    return 60e-6 * ((s.time_s > 79.0) & (s.time_s < 158.0))


def _between_laws(s):
    """Order 5 by the root of the load: as a brake's ripple and a part at any load it would take two causes at one order."""
    return 30e-6 * s.sign * np.sqrt(s.load_nm / 10) * np.sin(5 * s.theta2 + 0.3)


OUTSIDE = [
    (_jolt, "and back at"),
    (_between_laws, "order 5 of the driven shaft"),
    (_settling, "settles anew"),
    (_random_walk, "wanders with time"),
    (_slow_swing, "a tone of 0.0578 Hz"),
    (_ghost_order, "orders 60, 120 of the driven shaft"),
]


@pytest.mark.parametrize(("outside", "said"), OUTSIDE, ids=[outside.__name__ for outside, _ in OUTSIDE])
def test_what_no_effect_makes_is_called_unknown_and_described(outside, said):
    alone = c.made(c.recordings([outside]))
    d = gm.diagnose(alone, c.pair())
    assert d.verdict == ["unknown"], str(d)
    assert said in d.unknown["where"]["description"], str(d)

    beside = c.made(c.recordings([outside, c.output_encoder(40e-6, 0.6)]))
    d = gm.diagnose(beside, c.pair())
    named = [v if isinstance(v, str) else v["members"] for v in d.verdict]
    assert "unknown" in named and len(named) == 2, str(d)
    assert any("encoder2_eccentricity" in v for v in named), str(d)


def test_lost_counts_are_counted_where_runs_end_too():
    """Seven steps of one size, some of them in the last degrees of a run: the levels of the runs must not take them up."""
    lost_at_rev = np.array([1.3, 3.97, 8.02, 11.6, 15.98, 20.4, 22.1])
    recordings = c.made(c.recordings([lambda s: -35e-6 * np.searchsorted(lost_at_rev, s.revolutions)]))
    d = gm.diagnose(recordings, c.pair())
    assert d.verdict == ["count_loss"], str(d)
    lost = next(e for e in d.effects if e.name == "count_loss")
    assert lost.parameters["steps"].value == 7, str(d)
    assert lost.parameters["step_rad"].value == pytest.approx(-35e-6, abs=2e-6), str(d)


def test_the_order_of_recordings_does_not_matter(found):
    again = gm.diagnose(c.made(c.recordings(EFFECTS)[::-1]), c.pair())
    assert c.names(again.verdict) == c.names(found.verdict)
    assert again.gap.before_rad == pytest.approx(found.gap.before_rad, rel=1e-6)
    assert again.gap.after_rad == pytest.approx(found.gap.after_rad, rel=1e-3)


def test_splitting_a_recording_does_not_matter(found):
    runs = c.recordings(EFFECTS)
    half = len(runs[2]["time_s"]) // 2
    arrays = ("time_s", "theta1_rad", "theta2_rad")
    first = {**runs[2], **{key: runs[2][key][:half] for key in arrays}}
    second = {**runs[2], **{key: runs[2][key][half:] for key in arrays}}
    again = gm.diagnose(c.made([*runs[:2], first, second, *runs[3:]]), c.pair())
    assert c.names(again.verdict) == c.names(found.verdict)
    assert again.gap.before_rad == pytest.approx(found.gap.before_rad, rel=0.02)


def test_the_zero_does_not_matter(found):
    again = gm.diagnose(c.made(c.recordings(EFFECTS, zero_rad=0.0123)), c.pair())
    assert c.names(again.verdict) == c.names(found.verdict)
    assert again.gap.before_rad == pytest.approx(found.gap.before_rad, rel=1e-4)


def test_the_sampling_rate_does_not_matter(found):
    runs = c.recordings(EFFECTS)
    for run in runs:
        for key in ("time_s", "theta1_rad", "theta2_rad"):
            run[key] = run[key][::2]
    again = gm.diagnose(c.made(runs), c.pair())
    assert c.names(again.verdict) == c.names(found.verdict)


def test_irrelevant_effects_do_not_change_the_verdict(found):
    absent = ["thermal_drift", "brake_torque_ripple", "tooth_damage", "count_loss", "wear_drift"]
    again = gm.diagnose(c.made(c.recordings(EFFECTS)), c.pair(), exclude=absent)
    assert c.names(again.verdict) == c.names(found.verdict)
    assert not {e.name for e in again.effects if e.probability > 0} & set(absent)


def test_gaps_are_skipped(found):
    runs = c.recordings(EFFECTS)
    for n, run in enumerate(runs):
        run["theta2_rad"][100 + 10 * n : 160 + 10 * n] = np.nan
        run["theta1_rad"][700] = np.nan
    again = gm.diagnose(c.made(runs), c.pair())
    assert c.names(again.verdict) == c.names(found.verdict)
    assert math.isfinite(again.gap.after_rad)


def test_one_run_in_one_direction_warns():
    runs = c.recordings(EFFECTS, plan=[("ccw", 5.0, 5.0)])
    d = gm.diagnose(c.made(runs), c.pair())
    text = " ".join(d.warnings)
    assert "only ccw" in text and "only one load" in text and "only one speed" in text
    # A wind-up under one load in one sense is a zero: it cannot be claimed alone.
    assert ["shaft_compliance_output"] not in [sorted(v) for v in c.names(d.verdict)]
    assert d.where.signature.load_exponent is None and d.where.signature.speed_exponent is None
    assert any("sense" in e.action for e in d.next)


def test_less_than_a_revolution_is_accepted():
    runs = c.recordings(EFFECTS, plan=[("ccw", 5.0, 5.0)], revolutions=0.7)
    assert gm.diagnose(c.made(runs), c.pair()).warnings


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"time_s": lambda t: np.where(np.arange(t.size) == 5, np.nan, t)}, r"time_s.*5"),
        ({"time_s": lambda t: np.where(np.arange(t.size) == 5, t[4], t)}, r"time_s.*5"),
        ({"theta2_rad": lambda y: y[:-1]}, "theta2_rad"),
        ({"time_s": lambda t: t[:0], "theta1_rad": lambda t: t[:0], "theta2_rad": lambda t: t[:0]}, "empty|no sample"),
        ({"direction": lambda _: "left"}, "left"),
    ],
)
def test_bad_recordings_are_named(change, message):
    run = c.recordings(plan=[("ccw", 5.0, 5.0)])[0]
    for key, alter in change.items():
        run[key] = alter(run[key])
    with pytest.raises(ValueError, match=message):
        c.made([run])


def test_bad_calls_are_named():
    runs = c.made(c.recordings(plan=[("ccw", 5.0, 5.0)]))
    with pytest.raises(ValueError, match="gear3_eccentricity"):
        gm.diagnose(runs, c.pair(), known=["gear3_eccentricity"])
    with pytest.raises(ValueError, match="nonsense"):
        gm.diagnose(runs, c.pair(), exclude=["nonsense"])
    with pytest.raises(ValueError, match="recording"):
        gm.diagnose([], c.pair())
    with pytest.raises(TypeError, match="int"):
        gm.diagnose(3, c.pair())
    still = gm.Recording(np.arange(100) / 10, np.zeros(100), np.zeros(100), 1.0, 5.0, "ccw")
    with pytest.raises(ValueError):
        gm.diagnose([still], c.pair())


def test_fields_read_as_attributes_and_fail_with_their_names(found):
    assert found.gap.before_rad == found.to_dict()["gap"]["before_rad"]
    with pytest.raises(AttributeError, match="before_rad"):
        _ = found.gap.befor_rad
    with pytest.raises(AttributeError):
        _ = found.nonsense
    assert json.loads(found.to_json()) == found.to_dict()


def test_model_predicts_what_was_put_in(found):
    theta1 = np.linspace(0, 2 * np.pi, 181)
    # A load that was not measured.
    te, low, high = found.model.transmission_error(theta1, load_nm=20.0, direction="cw", interval=True)
    assert te.shape == low.shape == high.shape == theta1.shape
    s = c.Samples(theta1, theta1, c.driven(theta1), np.ones(181), np.ones(181), -1.0, 20.0, 0.5, theta1)
    mu = c.inclination(theta1)
    r1 = c.SEMI_MAJOR_MM * (1 - c.K**2) / (1 - c.K * np.cos(theta1))
    s.arm_mm = (2 * c.SEMI_MAJOR_MM - r1) * np.cos(np.radians(20) + mu)
    truth = sum(effect(s) for effect in EFFECTS)
    miss = te - truth
    assert np.std(miss) < 0.1 * np.std(truth)
    assert np.all(low <= te) and np.all(te <= high) and np.all(high > low)
    assert isinstance(found.model.transmission_error(0.3), float)


def test_page_is_whole_and_safe(found, null, tmp_path):
    for d in (found, null):
        path = tmp_path / "report.html"
        d.to_html(path)
        page = path.read_text(encoding="utf-8")
        assert page.startswith("<!doctype html>") and page.rstrip().endswith("</html>")
        assert len(page) < 1_500_000
        # Nothing comes from elsewhere, and nothing runs.
        for outside in ("http:", "https:", "src=", "url(", "@import", "<script", "<link"):
            assert outside not in page
        assert "NaN" not in page and "inf" not in page.replace("information", "").split("<style>")[0]
        for tag in ("svg", "table", "section", "article", "figure", "ul", "ol", "p"):
            assert page.count(f"<{tag}>") + page.count(f"<{tag} ") == page.count(f"</{tag}>"), tag
    with pytest.raises(OSError):
        found.to_html(tmp_path / "missing" / "report.html")


def test_figure(found, null):
    pytest.importorskip("matplotlib")
    for d in (found, null):
        figure = d.plot()
        figure.canvas.draw()
        titles = [a.get_title() for a in figure.get_axes()]
        assert sum("rpm" in title for title in titles) == len(c.PLAN)


def test_curves(found):
    assert len(found.curves) == len(c.PLAN)
    for curve in found.curves:
        assert curve["theta1_rad"].shape == curve["before_rad"].shape == curve["after_rad"].shape
        assert np.sqrt(np.mean(curve["after_rad"] ** 2)) < np.sqrt(np.mean(curve["before_rad"] ** 2))


# ---- any drive with two encoders: a joint that goes to and fro


def _joint(ratio=81.0, *, true_ratio=None, skew_s=0.0, lost=0.0, hysteresis=0.0, seed=3):
    """A joint of constant ratio that turns to and fro over 4 turns of the motor, at two speeds: one recording each."""
    rng = np.random.default_rng(seed)
    records = []
    start = 0.0
    for sweep_s in (24.0, 12.0):
        time = np.arange(0, 3 * sweep_s, 0.01)
        swing = np.abs((time / sweep_s) % 2 - 1)  # 1 .. 0 .. 1
        theta1 = 8 * np.pi * (1 - swing)
        speed = np.gradient(theta1, time)
        theta2 = theta1 / (true_ratio or ratio)
        # Order 2 of the motor, small: what such a reducer has of its own.
        theta2 = theta2 + skew_s * speed / ratio - hysteresis / 2 * np.sign(speed)
        theta2 = theta2 + lost * np.floor((time + start) / 13.0)
        theta2 = theta2 + 2e-6 * rng.standard_normal(time.size)
        records.append(gm.Recording(time + start, theta1, theta2, 2.0, 0.0, "auto"))
        start += float(time[-1]) + 5.0
    return records


def test_a_sound_joint_needs_nothing():
    assert gm.diagnose(_joint(), gm.GearPair.constant(ratio=81.0)).verdict == []


@pytest.mark.parametrize(
    ("fault", "accepted"),
    [
        ({"true_ratio": 81.01}, {"pitch_curve_error", "unknown"}),
        ({"skew_s": 0.004}, {"time_skew"}),
        ({"lost": -2e-4}, {"count_loss"}),
        ({"hysteresis": 2e-4}, {"backlash_error"}),
    ],
)
def test_a_joint_that_reverses(fault, accepted):
    d = gm.diagnose(_joint(**fault), gm.GearPair.constant(ratio=81.0))
    assert any(item & accepted for item in c.names(d.verdict)), d
    # What is added must not make it worse on runs that were not used.
    assert d.gap.after_rad < d.gap.before_rad
    # Reversals are found: both senses were recorded.
    assert not any("only ccw" in w or "only cw" in w for w in d.warnings)
    assert not any("tooth" in e.name or "pitch_errors" in e.name for e in d.effects)
