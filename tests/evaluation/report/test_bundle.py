"""The full report as files: the same bytes for the same data, and every link leads somewhere."""

import hashlib
import io
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from evaluation.report import bundle, table_files
from evaluation.report.analysis import analyse
from evaluation.report.full import FullReport
from evaluation.simulate import simulate_responses
from evaluation.study import StudySpec, load_bundled

ROOT = Path(__file__).parents[3]

FRESH = """
import hashlib
from evaluation.report import bundle
from evaluation.report.analysis import analyse
from evaluation.report.full import FullReport
from evaluation.simulate import simulate_responses
from evaluation.study import load_bundled

spec = load_bundled("mtap-2013-exp3")
answers = simulate_responses(spec, 4, seed=3).sample(frac=1, random_state=5)
for name, content in bundle.files(FullReport(analyse(spec, answers))):
    print(name, hashlib.sha256(content).hexdigest())
"""


@pytest.fixture(scope="module")
def full():
    spec = load_bundled("mtap-2013-exp3")
    return FullReport(analyse(spec, simulate_responses(spec, 4, seed=3)))


@pytest.fixture(scope="module")
def files(full):
    return dict(bundle.files(full))


def test_another_process_and_another_order_of_rows_give_the_same_bytes(files):
    environment = {**os.environ, "PYTHONHASHSEED": "7", "PYTHONPATH": str(ROOT)}
    printed = subprocess.run(
        [sys.executable, "-c", FRESH], env=environment, cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert printed.splitlines() == [f"{name} {hashlib.sha256(content).hexdigest()}" for name, content in files.items()]


def test_there_is_a_page_and_a_file_for_each_table_and_figure(files, full):
    names = set(files)
    assert {"report.html", "methods.txt"} <= names
    assert {name.split("/")[0] for name in names} == {"report.html", "methods.txt", "tables", "figures"}
    assert {f"tables/{name}.csv" for name in full.frames} <= names
    assert {f"tables/{section.name}.tex" for section in full.sections if section.rows} <= names
    assert {name.partition(".")[2] for name in names if name.startswith("figures/")} == {"svg", "png"}
    assert files["methods.txt"].decode() == f"{full.methods}\n"
    assert all(files[name].startswith(b"\x89PNG") for name in names if name.endswith(".png"))
    assert all(files[name].startswith(b'<?xml version="1.0"') for name in names if name.endswith(".svg"))


def check_links(page, made):
    links = re.findall(r'href="([^"]+)"', page)
    assert any(not link.startswith("#") for link in links)
    for link in links:
        assert f'id="{link[1:]}"' in page if link.startswith("#") else link in made
    assert not re.search(r'(?:src|href)="(?:https?:|//)', page)


def test_every_link_of_the_page_leads_to_a_file(files):
    check_links(files["report.html"].decode(), files)


def test_a_part_has_its_files_in_a_folder_of_its_own(build):
    content = build(3, 2).model_dump(mode="json", exclude_defaults=True)
    del content["instruments"], content["presentation"]
    part = {"name": "exp1", "instruments": ["emotion14"], "presentation": {"assignment": "full"}}
    study = StudySpec.model_validate(content | {"parts": [part]})
    report = analyse(study.only("exp1"), simulate_responses(study, 3, seed=1))
    # Even where it is the only part.
    made = dict(bundle.study_files({"exp1": FullReport(replace(report, study=study))}))
    check_links(made["report-exp1.html"].decode(), made)
    assert [name for name in made if not name.startswith("exp1/")] == ["report-exp1.html", "papers.html"]


def test_tables_have_all_their_digits(files, full):
    for name in ("mos_by_cell", "icc", "mos_intervals", "raters_mos", "votes_needed", "mixed_model_mos"):
        # In CSV an empty text is no text.
        frame = full.frames[name].replace("", np.nan)
        back = pd.read_csv(io.BytesIO(files[f"tables/{name}.csv"]))
        pd.testing.assert_frame_equal(back, frame, check_exact=True, check_dtype=False)


def test_text_is_utf_8():
    assert table_files.to_csv(pd.DataFrame({"a": ["高兴", 'x,"y"'], "b": [0.1, None]})) == (
        'a,b\n高兴,0.1\n"x,""y""",\n'
    )


def test_the_page_of_the_papers_is_the_same_each_time():
    name, content = bundle.papers_page()
    assert name == "papers.html"
    assert bundle.papers_page() == (name, content)
