"""Tests that are coroutines run in an event loop of their own."""

from __future__ import annotations

import asyncio
import inspect
from typing import cast

import pytest


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Run a coroutine; with the fixture `domain`, its nodes are in that ROS domain."""
    if not inspect.iscoroutinefunction(pyfuncitem.obj):
        return None
    names = inspect.signature(pyfuncitem.obj).parameters
    test = pyfuncitem.obj(**{name: pyfuncitem.funcargs[name] for name in names})
    if "domain" in pyfuncitem.funcargs:
        from tests.support.inprocess import run  # has ROS

        run(cast("int", pyfuncitem.funcargs["domain"]), test)
    else:
        asyncio.run(test)
    return True
