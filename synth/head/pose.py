"""Head rotation from facial points in a picture, relative to a neutral reference frame (MTAP 2013, section 3.1).

Two methods. `five_points` takes the corners of both eyes and the tip of the nose, after Horprasert, Yacoob and Davis
(1996): a cross ratio gives the proportion of eyes and gap, and the way the corners are spaced gives yaw. That signal is
weak, so yaw needs points that are right to a tenth of a pixel (`pose_noise`). `many_points` fits a whole head with
OpenCV's perspective-n-point solver and is the one to use with ordinary video.

The camera is a pinhole without distortion. Pictures have x to the right and y downward, in pixels. The head has x to
the subject's left, y up, z forward. It turns by yaw, then pitch, then roll (intrinsic), as padlab's face does; angles
are in degrees, positive down, to the subject's left, to the subject's right.
"""

import importlib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from synth.errors import SpecError
from synth.head.published import printed

Floats = NDArray[np.float64]

FIVE = ("right_eye_outer", "right_eye_inner", "left_eye_inner", "left_eye_outer", "nose_tip")
"""The five points of `five_points`, in its order; right and left are the subject's."""

MIN_POINTS = 6
"""Fewest landmarks for `many_points`."""

_TO_CAMERA = np.diag([1.0, -1.0, -1.0])  # from x left, y up, z forward to x right, y down, z away from the camera
_FLATNESS = 0.02
_ANGLE_ORDER = "YXZ"


@dataclass(frozen=True, eq=False)
class PoseNoise:
    """What noise of the points does to the angles.

    Attributes
    ----------
    bias, sd : (3,) float64
        Mean error and standard deviation of pitch, yaw and roll in degrees.
    """

    bias: Floats
    sd: Floats


@cache
def landmarks() -> Mapping[str, tuple[float, float, float]]:
    """Return the known landmarks and their places on padlab's neutral face in mm."""
    rows = printed()["landmarks_mm"]
    return MappingProxyType({name: tuple(place) for name, place in rows.items() if name != "about"})


def nose_tilt() -> float:
    """Return how far the way from the eyes to the tip of the nose leans forward on padlab's face, in degrees."""
    places = np.array([landmarks()[name] for name in FIVE])
    _, y, z = places[4] - places[:4].mean(axis=0)
    return math.degrees(math.atan2(z, -y))


def corner_depth() -> float:
    """Return how far the outer corners of padlab's eyes lie behind the inner ones, over the inner ones' distance."""
    outer, inner = (np.array(landmarks()[name]) for name in ("left_eye_outer", "left_eye_inner"))
    return float((inner[2] - outer[2]) / (2.0 * inner[0]))


def project(angles: npt.ArrayLike, model: npt.ArrayLike, *, focal: float, position: npt.ArrayLike) -> Floats:
    """Return where points of a turned head appear in the picture.

    Parameters
    ----------
    angles : array_like, shape (N, 3)
        Pitch, yaw and roll in degrees.
    model : array_like, shape (K, 3)
        Places on the head in mm.
    focal : float
        Focal length in pixels.
    position : array_like, shape (3,)
        The head's origin before the camera in mm: to the right, down, away from it.

    Returns
    -------
    (N, K, 2) float64
        Pixels from the principal point.
    """
    pitch, yaw, roll = np.asarray(angles, dtype=np.float64).T
    turns = Rotation.from_euler(_ANGLE_ORDER, np.stack([yaw, pitch, roll], axis=1), degrees=True).as_matrix()
    places = np.asarray(model, dtype=np.float64) @ np.swapaxes(turns, 1, 2) @ _TO_CAMERA + np.asarray(position)
    return np.asarray(focal * places[..., :2] / places[..., 2:], dtype=np.float64)


def five_points(
    points: npt.ArrayLike,
    *,
    focal: float,
    reference: int = 0,
    tilt: float | None = None,
    depth: float | None = None,
) -> Floats:
    """Return a head's rotation from four eye corners and the tip of the nose.

    Roll is the slope of the line through the corners. After turning the picture back by it, the cross ratio of the
    corners gives the eyes' width over the gap between them, one for the whole recording (the median over frames); a
    projection of the corners, fitted by least squares, gives yaw and distance; the projected length of the nose gives
    pitch. Both eyes are taken as equally wide.

    Parameters
    ----------
    points : array_like, shape (N, 5, 2)
        Pixels from the principal point, in the order of `FIVE`, not mirrored.
    focal : float
        Focal length in pixels; about the width of the picture for webcams.
    reference : int
        Row of the neutral frame: all angles are 0 there.
    tilt : float, optional
        How far the nose leans forward in the neutral frame, in degrees between 0 and 90; by default as on padlab's
        face. Two pitches give the same picture, one to each side of where the nose is seen at its full length; the
        one with the chin further up is returned, which is right as long as the head nods by less than the tilt.
    depth : float, optional
        How far the outer eye corners lie behind the inner ones, over the gap between the inner ones, 0 to 1; by
        default as on padlab's face (4 of 30 mm). 0 is the original method, which takes the four corners as one
        straight line; but a few mm do more to the picture than perspective does, and on a face with them it returns
        about three times the yaw. An error of half the depth still makes yaw wrong by a third.

    Returns
    -------
    (N, 3) float64
        Pitch, yaw and roll in degrees.

    Raises
    ------
    SpecError
        If an argument is malformed, or the points of a frame cannot be a face seen from the front.

    References
    ----------
    Horprasert, Yacoob and Davis (1996), Computing 3-D head orientation from a monocular image sequence, FG '96:242.
    The formulas are derived here, with the tilt of the nose and the depth of the corners added.
    """
    seen = _checked(points, count=len(FIVE), focal=focal, reference=reference) / focal
    lean = math.radians(nose_tilt() if tilt is None else tilt)
    if not 0.0 < lean < 0.5 * math.pi:
        raise SpecError(f"Pose: the tilt of the nose is {tilt!r}, but must be an angle between 0 and 90 degrees.")
    behind = corner_depth() if depth is None else depth
    if not 0.0 <= behind <= 1.0:
        raise SpecError(f"Pose: the depth of the eye corners is {depth!r}, but must be a number from 0 to 1 gaps.")
    slope = _line_angle(seen[:, :4])
    upright = _turned_back(seen, slope)
    along, height = upright[:, :4, 0], upright[:, :4, 1].mean(axis=1)
    proportion = _eye_proportion(along)
    yaw, gap = _projection(along, proportion, behind)
    nose = upright[:, 4, 1]
    # With n the nose's length over the gap's and a its tilt backward: n gap (cos a - k sin a) = nose - height.
    k = nose * np.cos(yaw)
    length = (nose - height) / gap
    full = length[reference] / (math.cos(lean) + k[reference] * math.sin(lean))
    if not full > 0.0:
        raise SpecError(f"Pose: in the reference frame {reference} the nose is above the eyes; y must go downward.")
    cosine = np.clip(length / (full * np.sqrt(1.0 + k**2)), -1.0, 1.0)
    pitch = lean - np.arccos(cosine) - np.arctan(k)
    # What turning the picture back leaves keeps the line of the eyes level: a pitch, then a yaw.
    return _relative(Rotation.from_euler("ZYX", np.stack([-slope, yaw, pitch], axis=1)), reference)


def many_points(
    points: npt.ArrayLike, model: npt.ArrayLike, *, focal: float, reference: int = 0, adapt: bool = True
) -> Floats:
    """Return a head's rotation by fitting a rigid head to all points (OpenCV, the extra ``padlab[pose]``).

    Parameters
    ----------
    points : array_like, shape (N, K, 2)
        Pixels from the principal point, K at least 6.
    model : array_like, shape (K, 3)
        Places of the points on the head in mm, not all in one plane; see `landmarks`.
    focal : float
        Focal length in pixels.
    reference : int
        Row of the neutral frame: all angles are 0 there.
    adapt : bool
        Whether widths and heights of the model are taken from the reference frame, in which the speaker then has to
        face the camera; only depths are the model's. Without that, a face 10 % lower than the model looks like one
        that is tilted by 25 degrees, and nods come out half as large again.

    Returns
    -------
    (N, 3) float64
        Pitch, yaw and roll in degrees.

    Raises
    ------
    SpecError
        If OpenCV is missing, an argument is malformed, or a frame has no solution.
    """
    places = np.asarray(model, dtype=np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or len(places) < MIN_POINTS or not np.isfinite(places).all():
        raise SpecError(
            f"Pose: the model has shape {places.shape}, but must be (K, 3), finite, K at least {MIN_POINTS}."
        )
    spread = np.linalg.svd(places - places.mean(axis=0), compute_uv=False)
    if spread[2] < _FLATNESS * spread[0]:
        raise SpecError("Pose: the landmarks lie in one plane; add one out of it, for instance nose_tip or chin.")
    seen = _checked(points, count=len(places), focal=focal, reference=reference)
    if adapt:
        places = _adapted(places, seen[reference], focal)
    cv2 = _opencv()
    camera = np.diag([focal, focal, 1.0])
    turns = np.empty((len(seen), 3, 3))
    for frame, pixels in enumerate(seen):
        turns[frame] = _TO_CAMERA @ _solve(cv2, places, pixels, camera, frame)
    return _relative(Rotation.from_matrix(turns), reference)


def pose_noise(
    noise: float,
    *,
    rng: np.random.Generator,
    method: str = "five",
    angles: tuple[float, float, float] = (0.0, 0.0, 0.0),
    focal: float = 800.0,
    distance: float = 800.0,
    samples: int = 1000,
) -> PoseNoise:
    """Return how noise of the points comes out in the angles, by simulation on padlab's face.

    The reference frame is neutral and free of noise; each sample is a frame in which the noise is new.

    Parameters
    ----------
    noise : float
        Standard deviation of each coordinate in pixels.
    rng : numpy.random.Generator
        What is drawn comes from here.
    method : {"five", "many"}
        `five_points`, or `many_points` with all `landmarks`.
    angles : tuple of float
        The head's true pitch, yaw and roll.
    focal : float
        Focal length in pixels.
    distance : float
        Distance of the head in mm.
    samples : int
        Number of frames.

    Raises
    ------
    SpecError
        If an argument is malformed.
    """
    if not 0.0 <= noise < math.inf or samples < 2:
        raise SpecError(f"Pose: noise is {noise!r} and samples {samples!r}, but must be at least 0 and at least 2.")
    names = FIVE if method == "five" else tuple(landmarks())
    model = np.array([landmarks()[name] for name in names])
    truth = np.array(angles, dtype=np.float64)
    poses = np.vstack([np.zeros(3), np.tile(truth, (samples, 1))])
    seen = project(poses, model, focal=focal, position=(0.0, 0.0, distance))
    seen[1:] += rng.normal(0.0, noise, seen[1:].shape)
    found = _method(method)(seen, model, focal)[1:] - truth
    return PoseNoise(bias=found.mean(axis=0), sd=found.std(axis=0, ddof=1))


def _method(name: str) -> Callable[[Floats, Floats, float], Floats]:
    if name == "five":
        return lambda points, _, focal: five_points(points, focal=focal)
    if name == "many":
        return lambda points, model, focal: many_points(points, model, focal=focal)
    raise SpecError(f"Pose: there is no method {name!r}; there are five and many.")


def _checked(points: npt.ArrayLike, *, count: int, focal: float, reference: int) -> Floats:
    seen = np.asarray(points, dtype=np.float64)
    if seen.ndim != 3 or seen.shape[1:] != (count, 2) or not len(seen):
        raise SpecError(f"Pose: the points have shape {seen.shape}, but must be (frames, {count}, 2).")
    if not np.isfinite(seen).all():
        frame, point, _ = np.argwhere(~np.isfinite(seen))[0]
        raise SpecError(f"Pose: point {point} of frame {frame} is not finite.")
    if not 0.0 < focal < math.inf:
        raise SpecError(f"Pose: the focal length is {focal!r}, but must be a number of pixels above 0.")
    if isinstance(reference, bool) or not 0 <= reference < len(seen):
        raise SpecError(f"Pose: there is no frame {reference!r} for the reference; frames are 0 to {len(seen) - 1}.")
    return seen


def _relative(turns: Rotation, reference: int) -> Floats:
    """Return pitch, yaw and roll (N, 3) in degrees from the reference frame on."""
    yaw, pitch, roll = (turns[reference].inv() * turns).as_euler(_ANGLE_ORDER, degrees=True).T
    angles = np.stack([pitch, yaw, roll], axis=1)
    angles[reference] = 0.0
    return np.asarray(angles, dtype=np.float64)


def _line_angle(corners: Floats) -> Floats:
    """Return the angle of the least-squares line (by distances from it) through the corners of each frame, rad."""
    x, y = np.moveaxis(corners - corners.mean(axis=1, keepdims=True), -1, 0)
    return np.asarray(0.5 * np.arctan2(2.0 * np.sum(x * y, axis=1), np.sum(x**2 - y**2, axis=1)), dtype=np.float64)


def _turned_back(points: Floats, angle: Floats) -> Floats:
    cos, sin = np.cos(angle)[:, None], np.sin(angle)[:, None]
    x, y = points[..., 0], points[..., 1]
    return np.stack([cos * x + sin * y, cos * y - sin * x], axis=-1)


def _eye_proportion(along: Floats) -> float:
    """Return an eye's width over the gap between the eyes, from the cross ratio of the corners (N, 4)."""
    if not (np.diff(along, axis=1) > 0.0).all():
        frame = int(np.argwhere(np.diff(along, axis=1) <= 0.0)[0][0])
        raise SpecError(
            f"Pose: the eye corners of frame {frame} are not in order from left to right; give the subject's right "
            f"eye first (outer, inner), then the left (inner, outer), in a picture that is not mirrored."
        )
    t1, t2, t3, t4 = along.T
    ratio = (t3 - t2) * (t4 - t1) / ((t4 - t2) * (t3 - t1))
    # The positive root of I q^2 + (2 I - 2) q + I - 1 = 0; the ratio of ordered corners lies between 0 and 1.
    return float(np.median((1.0 - ratio + np.sqrt(1.0 - ratio)) / ratio))


def _projection(along: Floats, proportion: float, depth: float) -> tuple[Floats, Floats]:
    """Return yaw (N,) in rad and gap over distance (N,), from the corners' places (N, 4) over the focal length.

    A point x to the left and z forward, in gaps, appears at (b + a x + c z) / (1 + c x - a z), with a = cos(yaw) gap
    and c = sin(yaw) gap, which is linear in a, b and c.
    """
    x = np.array([-0.5 - proportion, -0.5, 0.5, 0.5 + proportion])
    z = np.array([-depth, 0.0, 0.0, -depth])
    terms = np.stack([x + z * along, np.ones(along.shape), z - x * along], axis=2)
    q, r = np.linalg.qr(terms)
    a, _, c = np.moveaxis(np.linalg.solve(r, np.swapaxes(q, 1, 2) @ along[..., None])[..., 0], 1, 0)
    return np.arctan2(c, a), np.hypot(a, c)


def _adapted(model: Floats, pixels: Floats, focal: float) -> Floats:
    """Return a model (K, 3) that appears at the pixels (K, 2) when it faces the camera, as wide and deep as it was."""
    x = model[:, 0] - model[:, 0].mean()
    scale = float(x @ pixels[:, 0] / (x @ x)) if x.any() else 0.0
    if scale <= 0.0:
        raise SpecError("Pose: left and right are exchanged in the reference frame; is the picture mirrored?")
    distances = focal / scale - model[:, 2]
    return np.column_stack([pixels[:, 0] * distances / focal, -pixels[:, 1] * distances / focal, model[:, 2]])


def _solve(cv2: Any, places: Floats, pixels: Floats, camera: Floats, frame: int) -> Floats:
    try:
        found, turn, shift = cv2.solvePnP(places, pixels, camera, None, flags=cv2.SOLVEPNP_SQPNP)
        if found:
            turn, shift = cv2.solvePnPRefineLM(places, pixels, camera, None, turn, shift)
    except cv2.error:
        found = False
    if not found or not np.isfinite(turn).all() or float(shift[2, 0]) <= 0.0:
        raise SpecError(f"Pose: no head fits the points of frame {frame}; look for exchanged or misplaced landmarks.")
    return np.asarray(cv2.Rodrigues(turn)[0], dtype=np.float64)


def _opencv() -> Any:
    # Imported late: OpenCV is an extra, and only this method needs it.
    try:
        return importlib.import_module("cv2")
    except ImportError as error:
        raise SpecError(
            "Pose: the method of many points needs OpenCV, which is not installed; run pip install 'padlab[pose]'."
        ) from error
