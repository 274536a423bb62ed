"""The types of fields that messages share: texts by one rule (`reviewer.texts`), run-lengths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from reviewer.errors import InvalidInput
from reviewer.texts import clean_text


@dataclass(frozen=True, slots=True)
class Readable:
    """Makes a string field one of `clean_text`, with its bounds in the schema."""

    longest: int
    least: int = 0
    lines: bool = False
    fold: bool = True

    def clean(self, text: str) -> str:
        """Return the text as it is kept, or say as Pydantic wants it why not."""
        try:
            return clean_text(
                text,
                "text",
                longest=self.longest,
                least=self.least,
                lines=self.lines,
                fold=self.fold,
            )
        except InvalidInput as error:
            raise PydanticCustomError("text", "{told}", {"told": str(error)}) from error

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        """Clean after Pydantic has seen that it is a string."""
        return core_schema.no_info_after_validator_function(self.clean, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Tell the bounds; of what is unreadable the schema names the control characters."""
        kept = "\\u0009\\u000a\\u000d" if self.lines else ""
        controls = f"[{kept}\\u0020-\\u007e\\u00a0-\\uffff]"
        shown = {"minLength": self.least, "maxLength": self.longest, "pattern": f"^{controls}*$"}
        return {**handler(schema), **shown}


Key = Annotated[str, Readable(400, fold=False)]
"""The name of a run or a split, to be looked up as it was given."""

Word = Annotated[str, Readable(80)]
"""A few words on one line."""

Cause = Annotated[str, Readable(80, least=1)]
"""Why a pair is skipped, in a few words."""

Client = Annotated[str, Readable(64, least=1)]
"""Which window of a person something comes from."""

Comment = Annotated[str, Readable(2000, lines=True)]
"""What a person has to say, on several lines if need be."""

Phrase = Annotated[str, Readable(4000, lines=True)]
"""What a person calls something, before it is brought into the form of a label."""

ListedReason = Annotated[str, Readable(400, lines=True)]
"""A line of the list of reasons, as it was typed."""

Counts = Annotated[str, Field(max_length=2**26, pattern=r"^[0-o]*$")]
"""COCO compressed run-lengths."""
