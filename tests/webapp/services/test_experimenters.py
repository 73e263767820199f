import pytest

from webapp.db import Database
from webapp.errors import ConflictError
from webapp.services import experimenters


def test_only_the_right_password_opens(database: Database) -> None:
    with database.write() as session:
        experimenters.add(session, "wu", "correct horse", role="admin")
    with database.read() as session:
        found = experimenters.authenticate(session, "wu", "correct horse")
        assert found is not None
        assert found.role == "admin"
        assert "correct" not in found.password_hash
        assert experimenters.authenticate(session, "wu", "wrong horse") is None
        assert experimenters.authenticate(session, "nobody", "correct horse") is None


@pytest.mark.parametrize(("name", "password"), [("wu", "long enough"), ("li", "short"), ("", "long enough")])
def test_accounts_that_cannot_be_made(database: Database, name: str, password: str) -> None:
    with database.write() as session:
        experimenters.add(session, "wu", "correct horse")
    with pytest.raises(ConflictError), database.write() as session:
        experimenters.add(session, name, password)


def test_generated_passwords_differ_and_are_long(database: Database) -> None:
    made = {experimenters.new_password() for _ in range(50)}
    assert len(made) == 50
    assert min(map(len, made)) >= 16
