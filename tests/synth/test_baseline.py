from collections.abc import Callable

import numpy as np

from synth.baseline import NaiveRenderer
from synth.canvas import BACKGROUND
from synth.face.motion import Motion
from synth.face.rig import Rig
from synth.render import Renderer


def figure(frame: np.ndarray) -> np.ndarray:
    return (np.abs(frame - np.round(np.array(BACKGROUND) * 255)) > 6).any(axis=2)


def test_plain_loop_films_the_same_figure(rig: Rig, weights: Callable[..., np.ndarray]) -> None:
    """Otherwise the comparison of the two would mean nothing."""
    motion = Motion.of(weights(jawOpen=0.5), head=(0.1, 0.3, 0.0))
    with NaiveRenderer(rig, width=320, height=256) as plain, Renderer(rig, width=320, height=256) as renderer:
        (naive,) = plain.frames(motion)
        own = renderer.frame(motion)
    assert naive.shape == own.shape
    assert naive.dtype == np.uint8
    assert figure(own).mean() > 0.2
    assert (figure(naive) != figure(own)).mean() < 0.01


def test_own_renderer_goes_on_after_the_plain_loop(rig: Rig) -> None:
    with Renderer(rig, width=160, height=128) as renderer:
        before = renderer.frame(Motion.of())
        with NaiveRenderer(rig, width=160, height=128) as plain:
            list(plain.frames(Motion.of()))
        renderer.frame(Motion.of(head=(0.0, 0.3, 0.0)))
        assert (renderer.frame(Motion.of()) == before).all()
