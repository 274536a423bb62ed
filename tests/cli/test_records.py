"""A record's fields are the options of a command."""

from dataclasses import dataclass
from typing import Annotated

import typer
from typer.testing import CliRunner

from reviewer.cli.records import options_of


@dataclass(frozen=True)
class Given:
    """Options."""

    name: Annotated[str, typer.Argument(help="Whose.")]
    times: Annotated[int, typer.Option(help="How often.", min=1)] = 2


def invoke(*arguments):
    app = typer.Typer()
    heard = []

    @app.command()
    @options_of(Given)
    def greet(given: Given) -> None:
        """Greet somebody."""
        heard.append(given)

    return CliRunner().invoke(app, list(arguments)), heard


def test_a_command_gets_its_options_as_a_record_with_the_defaults_of_its_fields():
    assert invoke("Ada")[1] == [Given("Ada", 2)]
    assert invoke("Ada", "--times", "5")[1] == [Given("Ada", 5)]


def test_help_and_checks_are_those_of_the_fields():
    result, _ = invoke("--help")
    assert "Greet somebody." in result.output and "How often." in result.output
    result, heard = invoke("Ada", "--times", "0")
    assert result.exit_code == 2 and heard == []
