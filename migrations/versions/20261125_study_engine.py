"""study engine: parts, kinds of trials, places in the design, rounds, panels, displays, audit

Revision ID: 7c1f0a62d9be
Revises: 05b9b014921c
Create Date: 2026-11-25 21:45:10.224519
"""

from datetime import UTC, datetime, timedelta

import sqlalchemy as sa
from alembic import op

revision = "7c1f0a62d9be"
down_revision = "05b9b014921c"
branch_labels = None
depends_on = None

_MOMENT = sa.DateTime(timezone=True)


def upgrade() -> None:
    op.create_table(
        "annotation_round",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("study_id", sa.Integer(), nullable=False),
        sa.Column("part", sa.String(length=80), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("opened_at", _MOMENT, nullable=False),
        sa.Column("completed_at", _MOMENT, nullable=True),
        sa.Column("final", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name=op.f("fk_annotation_round_study_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_annotation_round")),
        sa.UniqueConstraint("study_id", "part", "number", name=op.f("uq_annotation_round_study_id_part_number")),
    )
    op.create_table(
        "round_sample",
        sa.Column("round_id", sa.Integer(), nullable=False),
        sa.Column("stimulus_id", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("again", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(["round_id"], ["annotation_round.id"], name=op.f("fk_round_sample_round_id")),
        sa.ForeignKeyConstraint(["stimulus_id"], ["stimulus.id"], name=op.f("fk_round_sample_stimulus_id")),
        sa.PrimaryKeyConstraint("round_id", "stimulus_id", name=op.f("pk_round_sample")),
    )
    op.create_index(op.f("ix_round_sample_stimulus_id"), "round_sample", ["stimulus_id"])
    op.create_table(
        "free_slot",
        sa.Column("study_id", sa.Integer(), nullable=False),
        sa.Column("slot", sa.Integer(), autoincrement=False, nullable=False),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name=op.f("fk_free_slot_study_id")),
        sa.PrimaryKeyConstraint("study_id", "slot", name=op.f("pk_free_slot")),
    )
    op.create_table(
        "audit_entry",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("at", _MOMENT, nullable=False),
        sa.Column("study_id", sa.Integer(), nullable=False),
        sa.Column("actor", sa.String(length=80), nullable=False),
        sa.Column("action", sa.String(length=40), nullable=False),
        sa.Column("participant", sa.Integer(), nullable=True),
        sa.Column("details", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(["study_id"], ["study.id"], name=op.f("fk_audit_entry_study_id")),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_audit_entry")),
    )
    op.create_index(op.f("ix_audit_entry_study_id"), "audit_entry", ["study_id"])
    op.create_table(
        "decision",
        sa.Column("participant_id", sa.Integer(), nullable=False),
        sa.Column("gate", sa.String(length=10), nullable=False),
        sa.Column("reason", sa.String(length=400), nullable=False),
        sa.Column("made_at", _MOMENT, nullable=False),
        sa.ForeignKeyConstraint(["participant_id"], ["participant.id"], name=op.f("fk_decision_participant_id")),
        sa.PrimaryKeyConstraint("participant_id", name=op.f("pk_decision")),
    )
    op.create_table(
        "trial_stimulus",
        sa.Column("trial_id", sa.Integer(), nullable=False),
        sa.Column("place", sa.Integer(), autoincrement=False, nullable=False),
        sa.Column("stimulus_id", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(["trial_id"], ["trial.id"], name=op.f("fk_trial_stimulus_trial_id")),
        sa.ForeignKeyConstraint(["stimulus_id"], ["stimulus.id"], name=op.f("fk_trial_stimulus_stimulus_id")),
        sa.PrimaryKeyConstraint("trial_id", "place", name=op.f("pk_trial_stimulus")),
    )
    op.create_index(op.f("ix_trial_stimulus_stimulus_id"), "trial_stimulus", ["stimulus_id"])
    _studies_and_clips()
    _participants()
    _trials()
    with op.batch_alter_table("response") as table:
        table.add_column(sa.Column("raw", sa.JSON(), nullable=True))
        table.add_column(sa.Column("display", sa.JSON(), nullable=True))
    with op.batch_alter_table("playback_event") as table:
        table.add_column(sa.Column("place", sa.Integer(), nullable=False, server_default="1"))
        table.add_column(sa.Column("value", sa.Double(), nullable=True))
    _without_default("playback_event", "place", sa.Integer())


def _studies_and_clips() -> None:
    with op.batch_alter_table("study") as table:
        table.add_column(sa.Column("enrolled", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("next_slot", sa.Integer(), nullable=False, server_default="0"))
    counted = "(SELECT count(*) FROM participant WHERE participant.study_id = study.id)"
    op.execute(f"UPDATE study SET enrolled = {counted}, next_slot = {counted}")  # noqa: S608 - no value from outside
    _without_default("study", "enrolled", sa.Integer())
    _without_default("study", "next_slot", sa.Integer())
    with op.batch_alter_table("clip") as table:
        table.add_column(sa.Column("suffix", sa.String(length=5), nullable=False, server_default="mp4"))
        table.add_column(sa.Column("duration_s", sa.Double(), nullable=True))
    _without_default("clip", "suffix", sa.String(length=5))
    with op.batch_alter_table("stimulus") as table:
        table.add_column(sa.Column("words", sa.JSON(), nullable=True))


def _participants() -> None:
    with op.batch_alter_table("participant") as table:
        table.add_column(sa.Column("slot", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("state", sa.String(length=10), nullable=False, server_default="active"))
        table.add_column(sa.Column("panel", sa.String(length=20), nullable=True))
        table.add_column(sa.Column("panel_id", sa.String(length=100), nullable=True))
        table.add_column(sa.Column("panel_session", sa.String(length=200), nullable=True))
        table.add_column(sa.Column("code", sa.String(length=40), nullable=True))
        table.add_column(sa.Column("part", sa.Integer(), nullable=False, server_default="0"))
        table.add_column(sa.Column("opens_at", _MOMENT, nullable=True))
        table.add_column(sa.Column("due_at", _MOMENT, nullable=True))
        table.add_column(sa.Column("withdrawn_at", _MOMENT, nullable=True))
        table.create_unique_constraint(
            op.f("uq_participant_study_id_panel_panel_id"), ["study_id", "panel", "panel_id"]
        )
    op.create_index("ix_participant_due", "participant", ["study_id", "state", "due_at"])
    op.create_index("ix_participant_slot", "participant", ["study_id", "slot"])
    # Until now everybody had the place of their number, and a study had one part.
    op.execute("UPDATE participant SET slot = number")
    op.execute("UPDATE participant SET state = 'completed', part = 1 WHERE completed_at IS NOT NULL")
    # Who is in the middle keeps the place for a day from now on, as everybody does.
    people = sa.table("participant", sa.column("state", sa.String), sa.column("due_at", _MOMENT))
    tomorrow = datetime.now(UTC) + timedelta(days=1)
    op.execute(people.update().where(people.c.state == "active").values(due_at=tomorrow))
    _without_default("participant", "slot", sa.Integer())
    _without_default("participant", "state", sa.String(length=10))
    _without_default("participant", "part", sa.Integer())


def _trials() -> None:
    with op.batch_alter_table("trial") as table:
        table.add_column(sa.Column("part", sa.String(length=80), nullable=False, server_default="main"))
        table.add_column(sa.Column("kind", sa.String(length=10), nullable=False, server_default="rating"))
        table.add_column(sa.Column("instrument", sa.String(length=80), nullable=True))
        table.add_column(sa.Column("check_place", sa.Integer(), nullable=True))
        table.add_column(sa.Column("repeats", sa.Integer(), nullable=True))
        table.add_column(sa.Column("round_id", sa.Integer(), nullable=True))
        table.add_column(sa.Column("watched", sa.Double(), nullable=True))
        table.alter_column("stimulus_id", existing_type=sa.Integer(), nullable=True)
        table.create_foreign_key(op.f("fk_trial_round_id"), "annotation_round", ["round_id"], ["id"])
    op.create_index(op.f("ix_trial_round_id"), "trial", ["round_id"])
    _without_default("trial", "part", sa.String(length=80))
    _without_default("trial", "kind", sa.String(length=10))


def _without_default(table: str, column: str, kind: sa.types.TypeEngine) -> None:
    """Take away the default that only the rows that were there needed."""
    with op.batch_alter_table(table) as batch:
        batch.alter_column(column, existing_type=kind, existing_nullable=False, server_default=None)


def downgrade() -> None:
    """Go back; what the earlier schema has no room for is lost: of the trials only the ratings remain."""
    for table in ("playback_event", "response", "trial_stimulus"):
        op.execute(f"DELETE FROM {table} WHERE trial_id IN (SELECT id FROM trial WHERE kind <> 'rating')")  # noqa: S608
    op.execute("DELETE FROM trial WHERE kind <> 'rating'")
    with op.batch_alter_table("playback_event") as table:
        table.drop_column("value")
        table.drop_column("place")
    with op.batch_alter_table("response") as table:
        table.drop_column("display")
        table.drop_column("raw")
    op.drop_index(op.f("ix_trial_round_id"), table_name="trial")
    with op.batch_alter_table("trial") as table:
        table.drop_constraint(op.f("fk_trial_round_id"), type_="foreignkey")
        table.alter_column("stimulus_id", existing_type=sa.Integer(), nullable=False)
        for column in ("watched", "round_id", "repeats", "check_place", "instrument", "kind", "part"):
            table.drop_column(column)
    op.drop_index("ix_participant_slot", table_name="participant")
    op.drop_index("ix_participant_due", table_name="participant")
    with op.batch_alter_table("participant") as table:
        table.drop_constraint(op.f("uq_participant_study_id_panel_panel_id"), type_="unique")
        for column in ("withdrawn_at", "due_at", "opens_at", "part", "code", "panel_session"):
            table.drop_column(column)
        for column in ("panel_id", "panel", "state", "slot"):
            table.drop_column(column)
    with op.batch_alter_table("stimulus") as table:
        table.drop_column("words")
    with op.batch_alter_table("clip") as table:
        table.drop_column("duration_s")
        table.drop_column("suffix")
    with op.batch_alter_table("study") as table:
        table.drop_column("next_slot")
        table.drop_column("enrolled")
    op.drop_index(op.f("ix_trial_stimulus_stimulus_id"), table_name="trial_stimulus")
    op.drop_table("trial_stimulus")
    op.drop_table("decision")
    op.drop_index(op.f("ix_audit_entry_study_id"), table_name="audit_entry")
    op.drop_table("audit_entry")
    op.drop_table("free_slot")
    op.drop_index(op.f("ix_round_sample_stimulus_id"), table_name="round_sample")
    op.drop_table("round_sample")
    op.drop_table("annotation_round")
