"""Version of the package; setuptools reads it from this file."""

__version__ = "0.1.0"
