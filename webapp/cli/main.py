"""The command ``padlab`` and how its failures are told."""

import importlib
import sys
from typing import Any

import click

from evaluation.errors import EvaluationError
from synth.errors import SynthError
from webapp import __version__
from webapp.errors import WebappError

# Command to "module:attribute"; a module is imported when its command is used, so that --help is quick.
COMMANDS = {
    "assets": "webapp.cli.assets:assets",
    "bench": "webapp.cli.bench:bench",
    "bots": "webapp.cli.bots:bots",
    "clips": "webapp.cli.clips:clips",
    "db": "webapp.cli.db:db",
    "demo": "webapp.cli.demo:demo",
    "experiment": "webapp.cli.experiment:experiment",
    "export": "webapp.cli.results:export",
    "face": "webapp.cli.face:face",
    "faces": "webapp.cli.faces:faces",
    "fap": "webapp.cli.fap:fap",
    "head": "webapp.cli.head:head",
    "identities": "webapp.cli.faces:identities",
    "models": "webapp.cli.models:models",
    "power": "webapp.cli.power:power",
    "report": "webapp.cli.results:report",
    "rounds": "webapp.cli.rounds:rounds",
    "say": "webapp.cli.say:say",
    "serve": "webapp.cli.serve:serve",
    "study": "webapp.cli.study:study",
    "text": "webapp.cli.say:text",
    "train": "webapp.cli.models:train",
    "user": "webapp.cli.user:user",
    "words": "webapp.cli.words:words",
}
EXIT_FAILURE = 1


class PadlabGroup(click.Group):
    """A group that imports its commands late and turns expected errors into one sentence."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return all names."""
        return sorted(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the command."""
        if cmd_name not in COMMANDS:
            return None
        module, attribute = COMMANDS[cmd_name].split(":")
        command: click.Command = getattr(importlib.import_module(module), attribute)
        return command

    def invoke(self, ctx: click.Context) -> Any:
        """Run the command; an expected failure becomes one sentence and exit code 1."""
        debug = ctx.params.get("debug", False)
        try:
            return super().invoke(ctx)
        except (WebappError, EvaluationError, SynthError) as error:
            if debug:
                raise
            fail(str(error))
        except BrokenPipeError:
            # The reader of a pipe (head, less) has gone: nothing is wrong, and nobody is there to be told.
            sys.stderr.close()
            sys.exit(EXIT_FAILURE)
        except OSError as error:
            if debug:
                raise
            place = f" {error.filename}" if error.filename else ""
            fail(f"The file system or network refused{place}: {error.strerror or error}")
        except (click.exceptions.Exit, click.ClickException, click.Abort):
            raise
        except Exception as error:
            if debug:
                raise
            fail(
                f"padlab met a fault of its own ({type(error).__name__}: {error}); run it again as "
                f"`padlab --debug …` and report what it prints"
            )


def fail(sentence: str) -> None:
    """Print one sentence (for a study file with several faults one for each) on standard error; exit with code 1."""
    click.echo(f"Error: {sentence.strip()}", err=True)
    sys.exit(EXIT_FAILURE)


@click.group(cls=PadlabGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--debug", is_flag=True, help="Show the traceback of a failure.")
@click.version_option(__version__, prog_name="padlab")
def main(debug: bool) -> None:
    """From a sentence to an expressive talking face, to people's ratings, to the statistics of a paper."""
