"""Many sweeps, tolerance studies or diagnoses: on this machine's cores, or on a Dask cluster.

>>> import gearmodel as gm
>>> pair = gm.GearPair.elliptical(module_mm=3, teeth=47, eccentricity=0.3)
>>> items = [{"over": {"e1_mm": [0.0, 0.1]}, "of": of} for of in ("te_pp", "backlash_pp")]
>>> [table.of for table in gm.cluster.map("sweep", items, pair=pair)]
['te_pp', 'backlash_pp']
"""

from __future__ import annotations

import concurrent.futures
import os
from collections.abc import Callable, Iterable, Iterator
from typing import Any, Literal

from ._extras import require

__all__ = ["ItemError", "map"]


class ItemError(ValueError):
    """An item that failed: ``index`` is its place in the items, ``__cause__`` the error itself."""

    index: int

    def __init__(self, index: int, text: str) -> None:
        super().__init__(f"item {index}: {text}")
        self.index = index
        self._text = text

    def __reduce__(self) -> tuple[Any, ...]:
        return (ItemError, (self.index, self._text))


def map(
    fn_name: str,
    items: Iterable[Any],
    client: Any = None,
    *,
    progress: Callable[[int, int], object] | None = None,
    on_error: Literal["raise", "return"] = "raise",
    workers: int | None = None,
    **shared: Any,
) -> list[Any]:
    """Calls a function of this package for each item; results in the order of the items.

    Args:
        fn_name: "sweep", "tolerance", "diagnose" or another function of the package; also a method of a pair, whose first
            argument is then the pair.
        items: what each call gets: a dict its keyword arguments, a tuple its positional ones, anything else the first one.
        client: a ``distributed.Client`` (``pip install gearmodel[cluster]``; its workers need gearmodel, and paths in items
            must mean the same file there), or a ``concurrent.futures.Executor``. None: threads on this machine's cores, which
            heavy calls share without holding each other up.
        progress: called with (items done, items) in the calling thread.
        on_error: "raise" ends with the first failure and starts no further item; "return" puts the :class:`ItemError` in the
            place of the result and goes on.
        workers: threads without a client; None: one a core.
        shared: keyword arguments of every call.

    Raises:
        ItemError: a ValueError that names the item's index and says what it failed of; ``__cause__`` is the error itself.
        ValueError: an unknown function, ``on_error`` or number of workers.
        ImportError: Dask is missing where a client is given; says how to install it.
        TypeError: a client that is none.
    """
    _function(fn_name)
    if on_error not in ("raise", "return"):
        raise ValueError(f'on_error is {on_error!r}: write "raise" or "return"')
    if workers is not None and workers < 1:
        raise ValueError(f"workers is {workers}: at least 1 is needed, or None for one a core")
    calls = list(items)
    if client is None:
        with concurrent.futures.ThreadPoolExecutor(workers or _cores(), thread_name_prefix="gearmodel") as pool:
            return _gather(pool.submit, concurrent.futures.as_completed, fn_name, calls, shared, progress, on_error)
    if isinstance(client, concurrent.futures.Executor):
        return _gather(client.submit, concurrent.futures.as_completed, fn_name, calls, shared, progress, on_error)
    distributed = require("distributed", extra="cluster", purpose="cluster.map() with a client")
    if not isinstance(client, distributed.Client):
        raise TypeError(f"client is a {type(client).__name__}: a distributed.Client, an Executor or None is needed")

    def submit(*call: Any) -> Any:
        # Studies without a seed of their own are not to be taken from a cache.
        return client.submit(*call, pure=False)

    return _gather(submit, distributed.as_completed, fn_name, calls, shared, progress, on_error)


def _cores() -> int:
    try:
        return len(os.sched_getaffinity(0))
    except AttributeError:  # not on every system
        return os.cpu_count() or 1


def _function(name: str) -> Callable[..., Any]:
    """The function of a name; looked up where it runs, so that a cluster runs its own version."""
    import gearmodel

    for place in (gearmodel, gearmodel.GearPair):
        found = getattr(place, name, None) if not name.startswith("_") else None
        if callable(found) and not isinstance(found, type):
            return found  # type: ignore[no-any-return]
    raise ValueError(f'fn_name is {name!r}: write "sweep", "tolerance", "diagnose" or another function of gearmodel')


def _call(name: str, item: Any, shared: dict[str, Any]) -> Any:
    function = _function(name)
    if isinstance(item, dict):
        arguments: tuple[Any, ...] = ()
        keywords = {**shared, **item}
    else:
        arguments, keywords = (item if isinstance(item, tuple) else (item,)), dict(shared)
    # A method takes its pair first.
    if hasattr(function, "__objclass__") and "pair" in keywords:
        arguments = (keywords.pop("pair"), *arguments)
    return function(*arguments, **keywords)


def _gather(
    submit: Callable[..., Any],
    as_completed: Callable[[list[Any]], Iterator[Any]],
    fn_name: str,
    items: list[Any],
    shared: dict[str, Any],
    progress: Callable[[int, int], object] | None,
    on_error: str,
) -> list[Any]:
    futures = [submit(_call, fn_name, item, shared) for item in items]
    # By identity: futures of a cluster compare equal by their keys.
    index_of = {id(future): index for index, future in enumerate(futures)}
    results: list[Any] = [None] * len(futures)
    try:
        for done, future in enumerate(as_completed(list(futures)), start=1):
            index = index_of[id(future)]
            try:
                results[index] = future.result()
            except Exception as error:
                failure = ItemError(index, f"{fn_name} failed: {type(error).__name__}: {error}")
                failure.__cause__ = error
                if on_error == "raise":
                    raise failure from error
                results[index] = failure
            if progress is not None:
                progress(done, len(futures))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return results
