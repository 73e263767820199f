import pandas as pd

from evaluation.report import tables
from evaluation.report.analysis import RESPONSE_COLUMNS, analyse

EMPTY = pd.DataFrame(columns=list(RESPONSE_COLUMNS))


def section(report, name):
    return next(found for found in tables.sections(report) if found.name == name)


def test_the_numbers_in_the_tables_are_those_of_the_report(report):
    rows = section(report, "reverse_evaluation").rows
    assert [row[:2] for row in rows[:4]] == [("all", "P"), ("all", "A"), ("all", "D"), ("Subtle", "P")]
    r = report.reverse_evaluation[1].result.r
    assert rows[1][3] == f"{r:.3f}".removeprefix("0")
    assert [row[-1] for row in rows[:3]] == [".873", ".569", ".624"]
    mos = section(report, "mos_by_condition").rows
    assert [row[2] for row in mos] == [f"{found.result.mean:.2f}" for found in report.mos_by_condition]
    assert report.mos_anova.summary() in section(report, "mos_anova").notes
    assert any("The unit is the stimulus" in note for note in section(report, "mos_anova").notes)


def test_every_row_is_as_long_as_the_header(demo, report):
    for found in (*tables.sections(report), *tables.sections(analyse(demo, EMPTY))):
        assert {len(row) for row in found.rows} <= {len(found.header)}


def test_columns_of_text_are_aligned(report):
    lines = tables.to_text(report).splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("Condition") and "Ratings" in line)
    header, *rows = lines[start : start + 4]
    end = header.index("MOS") + len("MOS")
    assert [row[:end][-4:] for row in rows] == [f"{found.result.mean:.2f}" for found in report.mos_by_condition]


def test_a_chinese_character_takes_two_columns(demo, answers):
    stimuli = tuple(s.model_copy(update={"label": {"zh": s.label["zh"]}}) for s in demo.stimuli)
    lines = tables.to_text(analyse(demo.model_copy(update={"stimuli": stimuli}), answers)).splitlines()
    assert "高兴      30     0.55" in "\n".join(lines)
    assert "Stimulus   n  input P" in "\n".join(lines)


def test_without_answers_the_text_says_so(demo):
    text = tables.to_text(analyse(demo, EMPTY))
    assert "There are no answers yet." in text
    assert "No face has been rated with pad12 yet." in text
    assert "nan" not in text.lower()


def test_frames_have_full_digits(demo, report):
    frames = tables.frames(report)
    reverse = frames["reverse_evaluation"].set_index(["condition", "dimension"])
    assert reverse.loc[("all", "P"), "r"] == report.reverse_evaluation[0].result.r
    assert len(reverse) == 12
    assert frames["mos_by_condition"]["mean"].tolist() == [found.result.mean for found in report.mos_by_condition]
    assert len(frames["mos_anova"]) == 3
    assert all(isinstance(frame, pd.DataFrame) for frame in tables.frames(analyse(demo, EMPTY)).values())


def test_a_label_is_english_or_else_the_first():
    assert tables.label({"zh": "高兴", "en": "Happy"}) == "Happy"
    assert tables.label({"zh": "高兴", "de": "froh"}) == "高兴"
