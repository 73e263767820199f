import os
from pathlib import Path

import numpy as np
import pytest

from synth.face.assets import fetch, is_compiled
from synth.face.mesh import FaceModel, load_face
from synth.face.rig import Rig

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def face_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with compiled face data: PADLAB_FACE_DIR, else instance/face, else fetched once."""
    chosen = os.environ.get("PADLAB_FACE_DIR")
    if chosen:
        return Path(chosen)
    if is_compiled(ROOT / "instance" / "face"):
        return ROOT / "instance" / "face"
    folder = tmp_path_factory.mktemp("face")
    fetch(folder)
    return folder


@pytest.fixture(scope="session")
def face(face_dir: Path) -> FaceModel:
    return load_face(face_dir)


@pytest.fixture(scope="session")
def rig(face: FaceModel) -> Rig:
    return Rig(face)


@pytest.fixture
def weights(face: FaceModel):
    """A function from morph names (without side: both sides) and values to the (52,) array."""

    def make(**values: float) -> np.ndarray:
        result = np.zeros(len(face.morph_names))
        for name, value in values.items():
            found = [k for k, morph in enumerate(face.morph_names) if morph in {name, name + "Left", name + "Right"}]
            assert found, name
            result[found] = value
        return result

    return make
