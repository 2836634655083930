"""The exceptions of chasles."""

from .contract.errors import *  # noqa: F403
