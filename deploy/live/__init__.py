"""A flight as it happens: the report's playback in a browser, the log's topics in Foxglove; on this computer only."""

from deploy.live.server import live

__all__ = ["live"]
