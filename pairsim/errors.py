"""Typed errors, under the name by which users import them."""

from pairsim.runtime.errors import *  # noqa: F403
