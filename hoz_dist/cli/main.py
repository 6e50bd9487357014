"""The `hoz-dist` command: a table of sub-commands, and what becomes of errors.

A sub-command's module is imported only when that command runs, so that `hoz-dist --help` needs click alone.
"""

import os
import signal
import sys
from importlib import import_module
from typing import Final, NamedTuple

import click

from hoz_dist import __version__
from hoz_dist.errors import HozError, OwnMistakeError, UnknownNameError

EXIT_FAILED: Final = 1
"""The exit status of a command that did its work and found something wrong, that could not print its result, or that
failed by a mistake of ours."""
EXIT_USER_ERROR: Final = 2
"""The exit status of an error that is the user's to mend; click's own for wrong usage."""
EXIT_INTERRUPTED: Final = 130
"""128 + SIGINT, as shells say it."""


class Entry(NamedTuple):
    """Where a sub-command is, and what the list of commands says of it."""

    target: str
    """``module:attribute`` of the click command."""
    short_help: str


COMMANDS: Final[dict[str, Entry]] = {
    "train": Entry("hoz_dist.cli.train:train_command", "Train on this machine: a learner and its actors."),
    "learner": Entry("hoz_dist.cli.learner:learner_command", "Run a learner that actors and queries connect to."),
    "actor": Entry("hoz_dist.cli.actor:actor_command", "Run an actor that trains in its rooms for a learner."),
    "router": Entry("hoz_dist.cli.router:router_command", "Run a router that learners, actors and queries meet at."),
    "keys": Entry("hoz_dist.cli.keys:keys_group", "Make keys that let processes in and say what they may do."),
    "query": Entry("hoz_dist.cli.query:query_command", "Ask a learner for a scene graph or a plan."),
    "status": Entry("hoz_dist.cli.status:status_command", "Ask a learner how the run goes."),
    "evaluate": Entry("hoz_dist.cli.evaluate:evaluate_command", "Measure a checkpoint on rooms it was not trained in."),
    "analyse": Entry("hoz_dist.cli.analyse:analyse_command", "Say why episodes fail, and where SPL is lost."),
    "reproduce": Entry("hoz_dist.cli.reproduce:reproduce_command", "Make the paper's tables again on unseen rooms."),
    "scenes": Entry("hoz_dist.cli.scenes:scenes_group", "List, show and render the rooms."),
    "graph": Entry("hoz_dist.cli.graph:graph_group", "Build, show, convert and plot graphs, and plan on them."),
    "bench": Entry("hoz_dist.cli.bench:bench_group", "Measure how fast each part is, beside the machine's limits."),
    "simulate": Entry("hoz_dist.cli.simulate:simulate_command", "Predict the speed of a run on more machines."),
    "doctor": Entry("hoz_dist.cli.doctor:doctor_command", "Check this machine, the view cache and the router."),
}
"""The sub-commands, in the order of `hoz-dist --help`."""


class LazyGroup(click.Group):
    """A group that imports a sub-command when it is asked for, and lists all without importing any."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names in the order of `COMMANDS`."""
        del ctx
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import the module of a sub-command; None when there is no such command."""
        del ctx
        if cmd_name not in COMMANDS:
            return None
        module, _, attribute = COMMANDS[cmd_name].target.partition(":")
        command: click.Command = getattr(import_module(module), attribute)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Find the sub-command that the arguments name.

        Raises:
            UnknownNameError: There is no such command.
        """
        if not args[0].startswith("-") and args[0] not in COMMANDS:
            raise UnknownNameError.of("command", args[0], COMMANDS)
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of sub-commands from the table alone."""
        del ctx
        with formatter.section("Commands"):
            formatter.write_dl([(name, entry.short_help) for name, entry in COMMANDS.items()])


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="hoz-dist")
def cli() -> None:
    """Train object-goal navigation over Zenoh, guided by hierarchical object-to-zone graphs.

    Try first: hoz-dist train
    """


def main() -> None:
    """Run the command line and exit.

    Exit status: 0 on success, 1 when a check found something wrong or for a mistake of ours, 2 for an error of the
    user's, said in one sentence on standard error, 130 when interrupted, by SIGTERM too: it ends a command as Ctrl-C
    does, by way of the `with` statements that stop its children.
    """
    # SIGINT too: a shell script starts background commands with it ignored, and Python leaves it so.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.default_int_handler)
    sys.exit(run(sys.argv[1:]))


def run(arguments: list[str]) -> int:
    """Run one command.

    Args:
        arguments: The words after `hoz-dist`.

    Returns:
        The exit status.
    """
    try:
        result = cli.main(args=arguments, prog_name="hoz-dist", standalone_mode=False)
        sys.stdout.flush()
    except (KeyboardInterrupt, click.Abort):
        return EXIT_INTERRUPTED
    except BrokenPipeError:
        # The reader, `head` for instance, has what it wanted. Python would complain once more as it flushes at exit.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILED
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return EXIT_USER_ERROR
    except (click.ClickException, HozError, OSError) as error:
        click.echo(f"hoz-dist: {sentence_of(error)}", err=True)
        return EXIT_USER_ERROR
    except OwnMistakeError as error:
        click.echo(f"hoz-dist: {error}", err=True)
        return EXIT_FAILED
    return result if isinstance(result, int) else 0


def sentence_of(error: click.ClickException | HozError | OSError) -> str:
    """Say on one line what is wrong."""
    match error:
        case click.UsageError():
            command = error.ctx.command_path if error.ctx else "hoz-dist"
            sentence = f"{error.format_message()} See '{command} --help'."
        case click.ClickException():
            sentence = error.format_message()
        case OSError(filename=None):
            sentence = f"The system refuses: {error.strerror or error}."
        case OSError():
            sentence = f"'{error.filename}': {error.strerror}."
        case _:
            sentence = str(error)
    return " ".join(sentence.split())


if __name__ == "__main__":
    main()
