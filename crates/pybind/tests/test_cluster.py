"""Many studies at once: order, errors and progress, on threads, processes and a cluster of this machine."""

import concurrent.futures
import pickle
import threading

import numpy as np
import pytest

import gearmodel as gm

ECCENTRICITIES = (0.1, 0.3, 0.2, 0.4)


def sweeps():
    return [{"over": {"eccentricity": [k], "e1_mm": [0.0, 0.05]}} for k in ECCENTRICITIES]


@pytest.fixture(scope="module")
def cluster():
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as local, distributed.Client(local) as client:
        yield client


@pytest.fixture
def processes():
    import multiprocessing

    with concurrent.futures.ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        yield pool


@pytest.fixture(params=["threads", "processes", "cluster"])
def client(request):
    return None if request.param == "threads" else request.getfixturevalue(request.param)


def test_sweeps_come_back_in_their_order(pair, client):
    heard = []
    tables = gm.cluster.map("sweep", sweeps(), client, progress=lambda *at: heard.append(at), pair=pair)
    for k, table in zip(ECCENTRICITIES, tables, strict=True):
        alone = gm.sweep(pair, over={"eccentricity": [k], "e1_mm": [0.0, 0.05]})
        np.testing.assert_array_equal(table.values, alone.values)
        assert table.axes["eccentricity"].tolist() == [k]
    assert heard == [(1, 4), (2, 4), (3, 4), (4, 4)]


def test_tolerance_studies_keep_their_seeds(pair, client):
    items = [{"sigma": {"e1_mm": 0.02}, "n": 500, "seed": seed} for seed in range(3)]
    studies = gm.cluster.map("tolerance", items, client, pair=pair)
    for seed, study in enumerate(studies):
        alone = pair.tolerance(sigma={"e1_mm": 0.02}, n=500, seed=seed)
        np.testing.assert_array_equal(study["te_ccw_pp_rad"].values_rad, alone["te_ccw_pp_rad"].values_rad)


def test_an_item_that_fails_is_named_and_the_others_can_go_on(pair, client):
    items = sweeps()
    items[2] = {"over": {"colour": [1.0]}}
    with pytest.raises(gm.cluster.ItemError, match=r'^item 2: sweep failed: ValueError: parameter "colour"') as caught:
        gm.cluster.map("sweep", items, client, pair=pair)
    assert caught.value.index == 2 and isinstance(caught.value.__cause__, ValueError)
    tables = gm.cluster.map("sweep", items, client, on_error="return", pair=pair)
    assert [isinstance(table, gm.SweepTable) for table in tables] == [True, True, False, True]
    assert isinstance(tables[2], gm.cluster.ItemError) and tables[2].index == 2
    twin = pickle.loads(pickle.dumps(tables[2]))
    assert (twin.index, str(twin)) == (2, str(tables[2]))


def test_items_are_arguments(pair):
    angles = np.linspace(0, 1, 5)
    found = gm.cluster.map("theta2", [(pair, angles), {"pair": pair, "theta1": angles}])
    for values in (*found, *gm.cluster.map("theta2", [angles], pair=pair)):
        np.testing.assert_array_equal(values, pair.theta2(angles))
    assert gm.cluster.map("sweep", []) == []


def test_names_are_looked_up_when_they_are_called(monkeypatch):
    monkeypatch.setattr(gm, "diagnose", lambda recordings, pair: (recordings, pair), raising=False)
    assert gm.cluster.map("diagnose", ["a.mcap", "b.mcap"], pair="p") == [("a.mcap", "p"), ("b.mcap", "p")]


def test_a_failure_starts_no_further_item(monkeypatch):
    begun = []
    gate = threading.Event()

    def study(n):
        begun.append(n)
        if n == 0:
            raise OSError("no such log")
        gate.wait(10)

    monkeypatch.setattr(gm, "study", study, raising=False)
    threading.Timer(0.5, gate.set).start()
    with pytest.raises(gm.cluster.ItemError, match="item 0: study failed: OSError: no such log"):
        gm.cluster.map("study", range(50), workers=2)
    assert len(begun) < 10


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"fn_name": "conquer"}, 'fn_name is \'conquer\': write "sweep"'),
        ({"fn_name": "__init__"}, "fn_name is '__init__'"),
        ({"fn_name": "GearPair"}, "fn_name is 'GearPair'"),
        ({"on_error": "hide"}, "on_error is 'hide'"),
        ({"workers": 0}, "workers is 0: at least 1"),
    ],
)
def test_what_is_refused_is_named(change, text):
    with pytest.raises(ValueError, match=text):
        gm.cluster.map(**({"fn_name": "sweep", "items": []} | change))


def test_a_client_that_is_none_and_a_missing_dask(monkeypatch):
    pytest.importorskip("distributed")
    with pytest.raises(TypeError, match="client is a str"):
        gm.cluster.map("sweep", [], "tcp://nowhere:1")
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(ImportError, match=r"cluster.map\(\) with a client needs distributed: pip install distributed, or gear"):
        gm.cluster.map("sweep", [], object())
