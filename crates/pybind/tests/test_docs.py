"""The examples in the docstrings hold."""

import doctest
import inspect

import gearmodel as gm


def _found():
    finder = doctest.DocTestFinder(exclude_empty=True)
    tests = finder.find(gm, "gearmodel") + finder.find(gm.cluster, "gearmodel.cluster")
    return [test for test in tests if test.examples]


def test_doctests():
    runner = doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE)
    tests = _found()
    for test in tests:
        runner.run(test)
    assert runner.failures == 0
    assert {"gearmodel", "gearmodel.GearPair.theta2", "gearmodel.Recording.split", "gearmodel.analyse", "gearmodel.cluster"} <= {
        test.name for test in tests
    }


def test_every_public_name_is_documented():
    for name in gm.__all__:
        thing = getattr(gm, name)
        assert inspect.getdoc(thing), name
        if inspect.isclass(thing):
            for attribute, value in vars(thing).items():
                assert attribute.startswith("_") or inspect.getdoc(value), f"{name}.{attribute}"
