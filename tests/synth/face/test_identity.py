import dataclasses
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from synth.errors import AssetError
from synth.face.assets import load_compiled
from synth.face.identity import DEFAULT_IDENTITY, IDENTITIES, find_identity
from synth.face.mesh import FaceModel, load_face

MIRRORED = 2e-3
"""How far the targets' left and right differ, dm."""


@pytest.fixture(scope="module", params=sorted(IDENTITIES))
def person(request: pytest.FixtureRequest, face_dir: Path) -> FaceModel:
    return load_face(face_dir, request.param)


def test_there_are_women_and_men_of_several_ethnicities() -> None:
    who = [(identity.sex, identity.ethnicity) for identity in IDENTITIES.values()]
    assert len(who) >= 4
    assert len(set(who)) == len(who)
    assert {sex for sex, _ in who} == {"female", "male"}
    assert DEFAULT_IDENTITY in IDENTITIES


def test_an_identity_is_found_by_its_name() -> None:
    for name, identity in IDENTITIES.items():
        assert find_identity(name) is identity
        assert identity.name == name
        assert identity.sex in {"female", "male"}
        assert identity.description


def test_an_unknown_name_is_refused_with_the_known_ones() -> None:
    with pytest.raises(AssetError) as error:
        find_identity("nobody")
    message = str(error.value)
    assert message.endswith(".")
    assert "'nobody'" in message
    assert all(name in message for name in IDENTITIES)


def test_targets_are_in_the_data_and_alike_on_both_sides(person: FaceModel, face_dir: Path) -> None:
    known = set(load_compiled(face_dir)["target_names"])
    targets = person.identity.targets
    assert set(targets) <= known
    for name, weight in targets.items():
        assert 0 < weight <= 1
        for one, other in (("/l-", "/r-"), ("/r-", "/l-")):
            if one in name:
                assert targets[name.replace(one, other)] == weight


def test_the_neutral_face_is_its_own_mirror_image(person: FaceModel) -> None:
    """The template is symmetric, so the mirror image of each vertex is known by its place there."""
    order = np.lexsort(np.round(person.template * (1, 1, 1), 3).T)
    mirrored = person.template * (-1, 1, 1)
    partner = np.lexsort(np.round(mirrored, 3).T)
    assert np.abs(person.template[order] - mirrored[partner]).max() < MIRRORED
    pairs = np.empty(len(order), dtype=int)
    pairs[order] = partner
    difference = person.vertices - person.vertices[pairs] * (-1, 1, 1)
    assert np.quantile(np.abs(difference), 0.99) < MIRRORED


def test_eyes_lie_level_between_crown_and_jaw(person: FaceModel) -> None:
    left, right = person.eye_centres
    assert left == pytest.approx(right * (-1, 1, 1), abs=MIRRORED)
    assert person.pivots["jaw"][1] < left[1] < person.pivots["head-2"][1]


def test_no_two_look_alike(face_dir: Path) -> None:
    people = [load_face(face_dir, name) for name in IDENTITIES]
    for one, other in combinations(people, 2):
        # Size and place apart: the shape itself must differ.
        shapes = [
            (p.vertices - p.eye_centres.mean(axis=0)) / np.linalg.norm(np.subtract(*p.eye_centres))
            for p in (one, other)
        ]
        faces = [shape[one.template[:, 2] > 1.0] for shape in shapes]
        assert np.linalg.norm(faces[0] - faces[1], axis=1).mean() > 0.01, (one.identity.name, other.identity.name)
        assert one.identity.palette != other.identity.palette
        assert one.identity.look != other.identity.look


def test_colours_are_colours() -> None:
    for identity in IDENTITIES.values():
        for colour in dataclasses.astuple(identity.palette):
            assert len(colour) == 3
            assert all(0 < value < 1 for value in colour)


def test_brows_stand_out_from_the_skin() -> None:
    """Brows carry much of an expression: in luminance they are at most half as bright as the skin."""
    for identity in IDENTITIES.values():
        skin, brows = (
            np.square(colour) @ (0.21, 0.72, 0.07) for colour in (identity.palette.skin, identity.palette.brows)
        )
        assert brows < 0.5 * skin, identity.name
