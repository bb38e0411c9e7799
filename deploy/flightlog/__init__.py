"""Flight logs: topics, writer, reader."""
