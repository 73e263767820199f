import pytest

from synth.corpus.pseudo import generate
from synth.expression.pep import ACII, MTAP
from synth.face.mesh import load_face
from synth.face.rig import Rig


@pytest.fixture(scope="session")
def rigs(face_dir):
    return {name: Rig(load_face(face_dir, name)) for name in ("mei", "wei", "anna", "erik")}


@pytest.fixture(scope="session")
def like_mtap(rigs):
    """The set of 486 and its true PAD."""
    return generate(MTAP, rigs, seed=1)


@pytest.fixture(scope="session")
def like_acii(rigs):
    """The set of 213 and its true PAD."""
    return generate(ACII, rigs, seed=1)
