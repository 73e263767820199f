"""Which emotion a FAP file shows, by command."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import Result

from synth.expression.models import load_model
from synth.fap.file import write_fap
from synth.fap.table import FAP_COUNT
from webapp.services.modelling import ModelReport

HAPPY, SAD = (0.6, 0.4, 0.3), (-0.6, -0.3, -0.3)

Run = Callable[..., Result]


@pytest.fixture
def shown(folder: Path) -> Callable[[str, tuple[float, float, float]], Path]:
    """Write the face of an emotion, coming and going in five frames."""

    def write(name: str, pad: tuple[float, float, float]) -> Path:
        _, apex = load_model("ann").apex(np.array([pad]))
        values = np.array([0.0, 0.5, 1.0, 0.5, 0.0])[:, None] * apex
        write_fap(folder / name, values, fps=25, name="face")
        return folder / name

    return write


def test_faces_are_told_apart_by_the_way_back(run: Run, shown: Callable[..., Path]) -> None:
    told = {
        pad: json.loads(run("face", "--describe", str(shown("a.fap", pad)), "--json").stdout) for pad in (HAPPY, SAD)
    }
    for pad, own in told.items():
        assert own["apex"]["frame"] == 2
        assert np.sign(own["apex"]["pad"][0]) == np.sign(pad[0])
        assert own["apex"]["pad"] == own["frames"][2]
        assert np.shape(own["frames"]) == (5, 3)
        assert np.abs(own["frames"]).max() <= 1
        assert len(own["apex"]["pep"]) == 9
        assert list(own["rmse"]) == ["P", "A", "D"]
        assert all(0 < error < 1 for error in own["rmse"].values())
        distances = [word["distance"] for word in own["apex"]["words"]]
        assert distances == sorted(distances)
        assert own["models"] == "pseudo-mtap2013"
        assert "not agreement with people" in own["note"]
    assert told[HAPPY]["apex"]["words"][0]["word"] != told[SAD]["apex"]["words"][0]["word"]


def test_the_text_tells_the_same_with_its_error_and_source(run: Run, shown: Callable[..., Path]) -> None:
    path = str(shown("happy.fap", HAPPY))
    told = json.loads(run("face", "--describe", path, "--json").stdout)
    lines = run("face", "--describe", path).stdout.splitlines()
    assert lines[0] == "Strongest expression: frame 2 of 5"
    for name, value, line in zip("PAD", told["apex"]["pad"], lines[1:4], strict=True):
        assert line.startswith(f"{name}  {value:+.2f}  (RMSE 0.")
    assert told["apex"]["words"][0]["word"] in lines[4]
    assert "mouth corners up" in next(line for line in lines if line.startswith("PEP 8"))
    assert "pseudo database" in lines[-1]


def test_a_face_at_rest_points_nowhere(run: Run, folder: Path) -> None:
    write_fap(folder / "rest.fap", np.zeros((3, FAP_COUNT)), fps=25, name="rest")
    lines = run("face", "--describe", "rest.fap").stdout.splitlines()
    assert lines[0] == "Strongest expression: frame 0 of 3"
    peps = [line for line in lines if line.startswith("PEP ")]
    assert len(peps) == 9
    assert all(line.endswith("+0.00  -") for line in peps)


def test_a_trained_set_has_its_own_way_back(
    run: Run, shown: Callable[..., Path], pseudo_report: ModelReport, tmp_path: Path
) -> None:
    (tmp_path / "models" / "mine").mkdir(parents=True)
    text = pseudo_report.models.to_json().replace('"data": "pseudo-mtap2013"', '"data": "other"')
    (tmp_path / "models" / "mine" / "models.json").write_text(text, encoding="utf-8")
    path = str(shown("a.fap", HAPPY))
    assert json.loads(run("face", "--describe", path, "--json", "--model", "mine/ann").stdout)["models"] == "other"


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (("none.fap",), ("There is no FAP file none.fap",)),
        (("empty.fap",), ("empty.fap, line 1", "empty")),
        (("broken.fap",), ("broken.fap, line 2",)),
        (("frameless.fap",), ("frameless.fap, line 1", "number of frames")),
        (("picture.fap",), ("picture.fap",)),
        (("a.fap", "--model", "nosuch/ann"), ("no trained set 'nosuch'", "padlab train")),
    ],
)
def test_wrong_input_gives_one_sentence(
    run: Run, fails: object, shown: Callable[..., Path], arguments: tuple[str, ...], parts: tuple[str, ...]
) -> None:
    folder = shown("a.fap", HAPPY).parent
    (folder / "empty.fap").touch()
    (folder / "broken.fap").write_text("2.1 broken 25 1\n0\n0\n")
    (folder / "frameless.fap").write_text("2.1 none 25 0\n")
    (folder / "picture.fap").write_bytes(b"\x89PNG\r\n\x1a\n\xff\xfe\x00")
    fails(run("face", "--describe", *arguments), *parts)


@pytest.mark.parametrize(
    "arguments",
    [
        ("0.1", "0.2", "0.3", "--describe", "a.fap"),
        ("--describe", "a.fap", "--out", "a.png"),
        ("--describe", "a.fap", "--model", "cubic"),
        ("--describe", "."),
        ("--describe",),
        ("0.1", "0.2", "0.3", "--out", "a.png", "--json"),
        ("0.1", "0.2", "--out", "a.png"),
        ("--json",),
        (),
    ],
)
def test_wrong_usage_is_exit_code_2(run: Run, shown: Callable[..., Path], arguments: tuple[str, ...]) -> None:
    folder = shown("a.fap", HAPPY).parent
    result = run("face", *arguments)
    assert result.exit_code == 2
    assert not (folder / "a.png").exists()
