# SPDX-License-Identifier: Apache-2.0
"""Fixtures of the tests of commands."""

from pathlib import Path

import pytest
from any_call import make_stock


@pytest.fixture(scope="session")
def stock(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a good file of each kind, and some of no kind."""
    folder = tmp_path_factory.mktemp("stock")
    make_stock(folder)
    return folder
