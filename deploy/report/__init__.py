"""The post-flight report, one HTML file."""
