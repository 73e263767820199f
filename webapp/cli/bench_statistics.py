"""``padlab bench statistics``: padlab's statistics beside other packages on the same numbers, and a million ratings."""

import io
import os
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pandas as pd
import yaml
from numpy.typing import NDArray
from scipy import stats

from evaluation.statistics.agreement.icc import intraclass_correlations
from evaluation.statistics.agreement.krippendorff import krippendorff_alpha
from evaluation.statistics.agreement.pairwise import mean_pairwise_pearson
from evaluation.statistics.anova import one_way_of_matrix
from evaluation.statistics.mixed.models import crossed_mixed_model
from evaluation.statistics.mixed.result import CrossedMixedModel
from evaluation.statistics.rater_model import rater_model
from evaluation.study import StudySpec
from webapp.cli.bench_database import filled
from webapp.cli.context import echo_json
from webapp.errors import ConfigError

RATERS = ITEMS = 1_000
MISSING = 0.3
CONDITIONS = 3
REPEATS = 7
SLOW_REPEATS = 3
FILLED = 0.02
PEERS = ("krippendorff", "pingouin", "statsmodels", "sureal")

Floats = NDArray[np.float64]
Call = Callable[[], object]


@click.command()
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--report/--no-report", default=True, help="Measure the report on a million ratings as well.")
def statistics(as_json: bool, report: bool) -> None:
    """Measure the statistics beside scipy, numpy, pandas, krippendorff, pingouin, sureal and statsmodels.

    The peers come with the extra ``bench``. All are given the same 1,000 x 1,000 ratings in one run, and take turns;
    each is timed after a call of its own that is not, short ones as the mean of the calls that 20 ms hold. A ratio is
    the median over pairs of the peer's time over ours. The mixed models of 3 x 40 x 40 and 3 x 100 x 100 ratings take
    statsmodels minutes, so the larger is fitted once. Last, the full report is written for a study of a million
    ratings in an SQLite database, in a process of its own.
    """
    missing = [name for name in PEERS if find_spec(name) is None]
    if missing:
        raise ConfigError(f"There is no {', '.join(missing)} to compare with; install padlab with the extra 'bench'")
    figures = {**_matrices(), **_mixed(40, SLOW_REPEATS), **_mixed(100, 1), **(_report_million() if report else {})}
    if as_json:
        echo_json(figures)
        return
    for name, value in figures.items():
        click.echo(f"{name}\t{value}")


def ratings(raters: int, items: int) -> Floats:
    """Return simulated ratings from 1 to 5, shape (items, raters)."""
    rng = np.random.default_rng(1)
    quality, bias = rng.normal(3, 0.8, (items, 1)), rng.normal(0, 0.4, (1, raters))
    return np.clip(np.rint(quality + bias + rng.normal(0, 0.8, (items, raters))), 1, 5)


def _matrices() -> dict[str, float]:
    import krippendorff  # noqa: PLC0415
    import pingouin  # noqa: PLC0415

    table = ratings(RATERS, ITEMS)
    gaps = table.copy()
    gaps[np.random.default_rng(2).random(table.shape) < MISSING] = np.nan
    frame, columns, transposed = pd.DataFrame(gaps), list(table.T), np.ascontiguousarray(table.T)
    gaps_transposed = np.ascontiguousarray(gaps.T)
    long = pd.DataFrame(
        {
            "item": np.repeat(np.arange(ITEMS), RATERS),
            "rater": np.tile(np.arange(RATERS), ITEMS),
            "rating": table.ravel(),
        }
    )
    dataset = _sureal_dataset(table)

    def reliability(data: Floats) -> object:
        return krippendorff.alpha(reliability_data=data, level_of_measurement="interval")

    figures: dict[str, float] = {}
    for name, ours, peer, repeats in (
        ("anova.ratio_to_f_oneway", lambda: one_way_of_matrix(table), lambda: stats.f_oneway(*columns), REPEATS),
        (
            "pairwise_pearson.ratio_to_corrcoef",
            lambda: mean_pairwise_pearson(table),
            lambda: np.corrcoef(transposed),
            REPEATS,
        ),
        (
            "pairwise_pearson_missing.ratio_to_pandas",
            lambda: mean_pairwise_pearson(gaps),
            lambda: frame.corr(min_periods=3),
            SLOW_REPEATS,
        ),
        (
            "krippendorff.ratio_to_krippendorff",
            lambda: krippendorff_alpha(table),
            lambda: reliability(transposed),
            REPEATS,
        ),
        (
            "krippendorff_missing.ratio_to_krippendorff",
            lambda: krippendorff_alpha(gaps),
            lambda: reliability(gaps_transposed),
            REPEATS,
        ),
        (
            "icc.ratio_to_pingouin",
            lambda: intraclass_correlations(table),
            lambda: pingouin.intraclass_corr(long, targets="item", raters="rater", ratings="rating"),
            SLOW_REPEATS,
        ),
        ("p910.ratio_to_sureal", lambda: rater_model(table), lambda: _sureal(dataset), SLOW_REPEATS),
    ):
        figures |= _compared(name, ours, peer, repeats)
    return figures


def _sureal_dataset(table: Floats) -> SimpleNamespace:
    """Return the ratings as sureal reads them."""
    videos = [{"asset_id": k, "content_id": k, "os": row.tolist(), "path": str(k)} for k, row in enumerate(table)]
    contents = [{"content_id": k, "content_name": str(k), "path": str(k)} for k in range(len(table))]
    return SimpleNamespace(
        dataset_name="bench", ref_videos=contents, dis_videos=videos, ref_score=None, yuv_fmt="notyuv"
    )


def _sureal(dataset: SimpleNamespace) -> object:
    from sureal.dataset_reader import RawDatasetReader  # noqa: PLC0415
    from sureal.subjective_model import SubjectMLEModelProjectionSolver2  # noqa: PLC0415

    # It prints each of its steps.
    with redirect_stdout(io.StringIO()):
        return SubjectMLEModelProjectionSolver2(RawDatasetReader(dataset)).run_modeling()


def _compared(name: str, ours: Call, peer: Call, repeats: int) -> dict[str, float]:
    """Return the median ratio of the peer's time to ours, and our median time in milliseconds."""
    own, ratios = [], []
    for _ in range(repeats):
        mine, theirs = _seconds(ours), _seconds(peer)
        own.append(mine)
        ratios.append(theirs / mine)
    return {name: round(median(ratios), 2), f"{name.partition('.')[0]}.ms": round(1000 * median(own), 3)}


def _seconds(work: Call, *, warm: bool = True) -> float:
    """Return how long a call takes: of short ones the mean of as many as fill `FILLED` seconds, after one untimed."""
    calls = 1
    if warm:
        begun = time.perf_counter()
        work()
        calls = max(1, round(FILLED / (time.perf_counter() - begun)))
    begun = time.perf_counter()
    for _ in range(calls):
        work()
    return (time.perf_counter() - begun) / calls


def _mixed(size: int, repeats: int) -> dict[str, float]:
    """Return the ratio for a crossed mixed model, and how far the two packages' estimates are apart."""
    table = _crossed(size)
    labels = (table["condition"].to_numpy(), table["rater"].to_numpy(), table["stimulus"].to_numpy())

    def ours() -> CrossedMixedModel:
        return crossed_mixed_model(table["value"].to_numpy(), *labels)

    fits: dict[str, Any] = {}

    def peer() -> None:
        fits["peer"] = _statsmodels(table)

    ratios = []
    for _ in range(repeats):
        mine = _seconds(ours)
        ratios.append(_seconds(peer, warm=False) / mine)
    own, other = ours(), fits["peer"]
    estimates = np.array([one.estimate for one in own.fixed])
    errors = np.array([one.se for one in own.fixed])
    spread = np.array([one.sd for one in own.random])
    theirs = np.sqrt(
        [dict(zip(other.model.exog_vc.names, other.vcomp, strict=True))[name] for name in ("rater", "stimulus")]
    )
    count = len(estimates)
    return {
        f"crossed_mixed_{size}.ratio_to_statsmodels": round(median(ratios), 1),
        f"crossed_mixed_{size}.fixed_difference": float(np.abs(estimates - other.fe_params[:count]).max()),
        f"crossed_mixed_{size}.se_difference": float(np.abs(errors - other.bse_fe[:count]).max()),
        f"crossed_mixed_{size}.sd_difference": float(np.abs(spread - theirs).max()),
        f"crossed_mixed_{size}.loglik_ours_higher": float(own.loglik - other.llf),
    }


def _crossed(size: int) -> pd.DataFrame:
    rng = np.random.default_rng(3)
    condition, rater, stimulus = (axis.ravel() for axis in np.indices((CONDITIONS, size, size)))
    value = 3 + 0.3 * condition + rng.normal(0, 0.5, size)[rater] + rng.normal(0, 0.7, size)[stimulus]
    names = np.array([f"c{k}" for k in range(CONDITIONS)])
    return pd.DataFrame(
        {
            "value": value + rng.normal(0, 0.8, len(value)),
            "condition": names[condition],
            "rater": rater,
            "stimulus": stimulus,
        }
    )


def _statsmodels(table: pd.DataFrame) -> Any:
    from statsmodels.regression.mixed_linear_model import MixedLM  # noqa: PLC0415

    parts = {"rater": "0 + C(rater)", "stimulus": "0 + C(stimulus)"}
    groups = np.ones(len(table))
    model = MixedLM.from_formula("value ~ condition", groups=groups, vc_formula=parts, re_formula="0", data=table)
    return model.fit(reml=True)


def _report_million() -> dict[str, float]:
    """Return seconds and memory of ``padlab report`` on a million ratings, as one process from start to end."""
    with TemporaryDirectory(prefix="padlab-bench-") as folder:
        home = Path(folder)
        spec, text = _million()
        values = ratings(RATERS, ITEMS).astype(int).tolist()
        filled(
            home / "padlab.sqlite",
            spec,
            text,
            people=RATERS,
            each=ITEMS,
            answered=ITEMS,
            instrument="mos5",
            answer=lambda rater, cell: {"mos": values[cell][rater]},
        ).dispose()
        program = (
            "import sys; from pathlib import Path; from webapp.cli import main\n"
            "main(['report', 'million', '--out', sys.argv[1]], standalone_mode=False)\n"
            "lines = dict(x.split(':', 1) for x in Path('/proc/self/status').read_text().splitlines())\n"
            "print(int(lines['VmHWM'].split()[0]) / 1024)\n"
        )
        begun = time.perf_counter()
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-c", program, str(home / "report")],
            env={**os.environ, "PADLAB_HOME": folder, "PADLAB_DATABASE_URL": ""},
            capture_output=True,
            text=True,
            check=False,
        )
        seconds = time.perf_counter() - begun
        if done.returncode:
            raise ConfigError(f"The report failed: {done.stderr.strip().splitlines()[-1]}")
        memory = float(done.stdout.splitlines()[-1])
    return {"report_million.seconds": round(seconds, 2), "report_million.peak_memory_mb": round(memory, 1)}


def _million() -> tuple[StudySpec, str]:
    """Return a study of 250 stimuli in four conditions, all rated by everybody, and its text."""
    words: Mapping[str, Any] = {
        "slug": "million",
        "title": {"en": "A million ratings"},
        "languages": ["en"],
        "seed": 1,
        **{name: {"en": ["Text."]} for name in ("welcome", "consent", "instructions", "debrief")},
        "conditions": [
            {"name": f"c{k}", "label": {"en": f"C{k}"}, "clip": {"intensity": (k + 1) / 4}} for k in range(4)
        ],
        "stimuli": [
            {"id": f"s{k}", "label": {"en": f"S{k}"}, "clip": {"pad": [0.1, 0.1, 0.1]}} for k in range(ITEMS // 4)
        ],
        "instruments": ["mos5"],
        "presentation": {"assignment": "full"},
    }
    text = yaml.safe_dump(dict(words), sort_keys=False)
    return StudySpec.from_yaml(text), text
