"""The version of this program, by itself so that every floor can read it."""

from __future__ import annotations

VERSION = "0.1.0"
