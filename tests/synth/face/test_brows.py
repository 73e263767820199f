import numpy as np
import pytest

from synth.face.feature_points import VERTICES
from synth.face.motion import Motion
from synth.face.rig import Rig


@pytest.mark.parametrize("morph", ["browInnerUp", "browOuterUpLeft", "browDownLeft"])
def test_a_brow_slides_as_a_whole(rig: Rig, weights, morph: str) -> None:
    """Across its thickness a brow moves alike, so that it is not squeezed to a thread."""
    face = rig.face
    way = (rig.pose(Motion.of(weights(**{morph: 1.0})))[0] - rig.pose(Motion.of())[0])[: len(face.vertices), 1]
    for point in ("4.1", "4.3"):
        x = face.template[face.base_index == VERTICES[point], 0][0]
        place = face.template
        across = (np.abs(place[:, 0] - x) < 0.06) & (np.abs(place[:, 1] - 7.53) < 0.06) & (place[:, 2] > 0.5)
        assert across.sum() >= 2
        assert np.ptp(way[across]) < 0.5 * np.abs(way[across]).max() + 0.003, point
