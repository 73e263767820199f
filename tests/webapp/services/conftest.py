from pathlib import Path

import pytest

from lab import Lab
from webapp.config import Settings
from webapp.db import Database


@pytest.fixture
def lab(database: Database, settings: Settings, tmp_path: Path) -> Lab:
    return Lab(database, settings, tmp_path)
