"""Appearance: everything that is seen of the face, as painted surfaces."""

import numpy as np
from numpy.typing import NDArray

from synth.face.eyes import eyeballs, lashes
from synth.face.hair import loose_hair
from synth.face.mesh import FaceModel
from synth.face.mouth import teeth, tongue
from synth.face.painting import paint
from synth.face.skin import skin
from synth.face.surface import Surface


def dress(face: FaceModel) -> tuple[list[Surface], NDArray[np.uint8]]:
    """Return the surfaces of the figure, the left and the right eyeball last, and the painting they refer to."""
    identity = face.identity
    bust, nape = skin(face)
    surfaces = [bust, nape, *loose_hair(face, bust), *teeth(face), tongue(face), *lashes(face)]
    return [*surfaces, *eyeballs(face, identity.palette)], paint(identity.palette, identity.look)
